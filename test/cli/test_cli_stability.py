"""ctr-pvs stability: the sweep, folds against known numbers, the map, pictures, and one clear line for bad input."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from ctr_pvs import load_robot
from ctr_pvs.cli import main as cli
from ctr_pvs.oracles.two_tubes import two_tube_parameters
from ctr_pvs.solve.equilibria import equilibria

ROOT = Path(__file__).parents[2]
ROBOT = str(ROOT / "config" / "renda2021.yaml")
FIG2 = str(ROOT / "config" / "renda2021_fig2.yaml")
THREE_TUBES = str(ROOT / "config" / "three_tubes.yaml")
FULL = ["--D", "0.0935", "0.2085"]


def run(capsys, *words: str, code: int = 0) -> str:
    """Standard output of `ctr-pvs stability`, which must end with exit code `code` and complain of nothing."""
    assert cli.main(["stability", *words]) == code
    captured = capsys.readouterr()
    assert captured.err == ""
    return captured.out


def refused(capsys, *words: str) -> str:
    """The line on standard error for bad input."""
    assert cli.main(["stability", *words]) == 2
    captured = capsys.readouterr()
    assert captured.out == "" and len(captured.err.splitlines()) == 1
    return captured.err


def answer(capsys, *words: str) -> dict:
    def no_such_word(word):
        raise AssertionError(f"{word} is not JSON")

    return json.loads(run(capsys, *words, "--json"), parse_constant=no_such_word)


def test_the_sweep_of_fig_4(capsys):
    found = answer(capsys, ROBOT, *FULL, "--steps", "19", "--degrees")
    assert (found["robot"], found["tube"], found["alpha"], found["D"]) == (
        "renda2021",
        "inner",
        [0.0, None],
        [0.0935, 0.2085],
    )
    sweep = found["sweep"]
    assert sweep["alpha"] == pytest.approx(np.radians(np.linspace(0.0, 360.0, 19)))
    assert sweep["status"] == ["ok"] * 15 + ["snap"] + ["ok"] * 3
    assert sweep["stability_margin"][10] == pytest.approx(1.0, abs=1e-3)  # 200 deg
    assert sweep["stability_margin"][13] == pytest.approx(0.989, abs=1e-3)  # 260 deg
    assert sweep["stability_margin"][14] == pytest.approx(0.452, abs=1e-3)  # 280 deg
    assert sweep["snap_reserve"][14] == pytest.approx(0.086, abs=1e-3)
    (snap,) = found["snaps"]
    assert np.degrees(snap["alpha"]) == pytest.approx(281.88998, abs=1e-3)
    assert snap["energy_released"] == pytest.approx(0.3754, abs=1e-3)
    assert found["snaps_before"] == 0 and found["map"] is None
    two = two_tube_parameters(load_robot(ROBOT), [0.0935, 0.2085])
    assert found["two_tubes"]["lambda"] == two.lam and found["two_tubes"]["b"] == two.b
    assert found["two_tubes"]["snap_free"] is False


def test_folds_and_branches(capsys):
    curve = answer(capsys, ROBOT, *FULL, "--steps", "2", "--degrees")["curve"]
    assert (curve["tubes"], curve["resolved"]) == (["outer", "inner"], True)
    assert curve["s"] == pytest.approx(0.0923)
    first, second = curve["folds"]
    assert np.degrees([first["alpha"], second["alpha"]]) == pytest.approx([78.11002, 281.88998], abs=1e-4)
    assert [first["ends_as_alpha"], second["ends_as_alpha"]] == ["falls", "grows"]
    assert first["ends_stable"] and second["ends_stable"]
    assert sum(branch["stable"] for branch in curve["branches"]) == 2
    # Every branch is made of equilibria: count those at 180 deg.
    crossed = sum(min(branch["alpha"]) <= np.pi <= max(branch["alpha"]) for branch in curve["branches"])
    assert crossed == len(equilibria(load_robot(ROBOT), [0.0, np.pi], [0.0935, 0.2085]).found) == 3


@pytest.mark.parametrize("alpha", [0.0, 0.7])
def test_rotating_the_other_tube_mirrors_the_folds(capsys, alpha):
    inner = answer(capsys, FIG2, "--D", "0", "0", "--alpha", str(alpha), "9", "--steps", "2", "--range", "-4", "6")
    outer = answer(
        capsys, FIG2, "--D", "0", "0", "--alpha", "9", str(alpha), "--steps", "2", "--range", "4", "-6", "--tube", "1"
    )
    assert inner["tube"] == "inner" and outer["tube"] == "outer" and outer["alpha"] == [None, alpha]
    known = np.radians([192.28833, 167.71167])
    grows = [fold["alpha"] for fold in inner["curve"]["folds"] if fold["ends_as_alpha"] == "grows"]
    assert grows == pytest.approx([known[0] + alpha - 2 * np.pi, known[0] + alpha], abs=1e-6)
    falls = [fold["alpha"] for fold in outer["curve"]["folds"] if fold["ends_as_alpha"] == "falls"]
    assert falls == pytest.approx([alpha - known[0], alpha + known[1]], abs=1e-6)


def test_text_for_people(capsys):
    text = run(capsys, ROBOT, *FULL, "--range", "-300", "-2e1", "--steps", "57", "--degrees", "--alpha", "0", "0")
    assert "inner rotated from -300 to -20 deg, 57 steps" in text
    # It sets out past the fold at -281.9, on the branch that ends where the angle grows to -78.1.
    assert "The cold start snapped once on its way to the first angle." in text
    assert (
        "Snap at inner -78.11 deg, releasing 0.3754 J." in text and "Smallest margin 0.4516, at inner -80 deg" in text
    )
    assert "inner -281.88998" in text and "a stable branch ends as the angle falls" in text
    assert "lambda 1.24817, b 2.25432; critical lambda 0.385129: this pair can snap" in text
    assert "one step in 3" in text
    quiet = run(capsys, ROBOT, *FULL, "--range", "0", "1", "--steps", "3")
    assert "No snap on the way." in quiet and "No folds in this range" in quiet and "[rad]" in quiet


def test_three_tubes_have_a_sweep_but_no_curve(capsys):
    words = [THREE_TUBES, "--D", "0.06", "0.14", "0.24", "--tube", "middle", "--alpha", "0.3", "0", "1", "--steps", "4"]
    found = answer(capsys, *words)
    assert found["tube"] == "middle" and found["alpha"] == [0.3, None, 1.0]
    assert found["curve"] is None and found["two_tubes"] is None
    assert all(0.0 < margin <= 1.0 for margin in found["sweep"]["stability_margin"])
    assert "folds are told by the sweep only" in run(capsys, *words)


def test_the_map(capsys):
    words = [
        ROBOT,
        *FULL,
        "--degrees",
        "--steps",
        "7",
        "--range",
        "0",
        "300",
        "--map",
        "0.12",
        "0.1705",
        "--map-steps",
        "3",
    ]
    found = answer(capsys, *words)["map"]
    assert found["D"] == pytest.approx([0.12, 0.14525, 0.1705])
    assert found["snap"][:2] == [None, None]
    assert np.degrees(found["snap"][2]) == pytest.approx(205.92164, abs=1e-3)
    margin = found["stability_margin"]
    assert all(value is not None for row in margin[:2] for value in row)
    assert [value is None for value in margin[2]] == [False] * 5 + [True] * 2
    assert "in 1 of 3 rows. It ends soonest, at 205.92" in run(capsys, *words)


def test_pictures(capsys, tmp_path):
    pytest.importorskip("matplotlib")
    folder = tmp_path / "new" / "folder"
    words = [ROBOT, *FULL, "--steps", "7", "--map", "0.15", "0.2", "--map-steps", "3", "--output", str(folder)]
    text = run(capsys, *words)
    assert text.splitlines()[-1] == f"Pictures: {folder / 'stability.png'} {folder / 'map.png'}"
    for name in ("stability.png", "map.png"):
        assert (folder / name).read_bytes().startswith(b"\x89PNG")
    run(capsys, THREE_TUBES, "--D", "0.06", "0.14", "0.24", "--steps", "3", "--output", str(tmp_path), "--json")
    assert (tmp_path / "stability.png").exists() and not (tmp_path / "map.png").exists()


def test_matplotlib_is_loaded_only_to_draw():
    program = f"""
import sys
from ctr_pvs.cli.main import main
main(["stability", {ROBOT!r}, "--D", "0.0935", "0.2085", "--steps", "2", "--json"])
assert "matplotlib" not in sys.modules
"""
    subprocess.run([sys.executable, "-c", program], check=True, cwd=ROOT, capture_output=True)


def test_bad_input(capsys, tmp_path):
    assert "expected one of outer, inner, or a number from 1 to 2, got '3'" in refused(
        capsys, ROBOT, *FULL, "--tube", "3"
    )
    assert "two different angles" in refused(capsys, ROBOT, *FULL, "--range", "1", "1")
    assert "whole number from 2" in refused(capsys, ROBOT, *FULL, "--steps", "1")
    assert "D[1]" in refused(capsys, ROBOT, "--D", "0.18", "0.1")
    assert "D[1]" in refused(capsys, ROBOT, *FULL, "--map", "0.05", "0.2")
    assert "2 real numbers" in refused(capsys, ROBOT, *FULL, "--alpha", "1", "2", "3")
    assert "tolerance" in refused(capsys, ROBOT, *FULL, "--tolerance", "0")
    assert "limits" in refused(capsys, THREE_TUBES, "--D", "0.06", "0.14", "0.24", "--range", "0", "20")
    taken = tmp_path / "file"
    taken.write_text("")
    assert cli.main(["stability", ROBOT, *FULL, "--steps", "2", "--output", str(taken)]) == 2
    assert "cannot write the pictures" in capsys.readouterr().err
