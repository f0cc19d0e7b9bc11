"""What the command line says beside its answer: warnings of the robot, and hints at equilibria a turn away."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from ctr_pvs import EquilibriumSolver
from ctr_pvs import load_robot
from ctr_pvs.cli import main as cli

ROOT = Path(__file__).parents[2]
ROBOT = str(ROOT / "config" / "renda2021.yaml")
THREE_TUBES = str(ROOT / "config" / "three_tubes.yaml")
FULL = ["--D", "0.0935", "0.2085"]


@pytest.fixture
def odd_robot(tmp_path):
    """Its inner tube's radius of curvature stands where the curvature belongs."""
    path = tmp_path / "odd.yaml"
    path.write_text(Path(ROBOT).read_text(encoding="utf-8").replace("[13.8]", "[588]"), encoding="utf-8")
    return str(path)


def run(capsys, *words, code=0):
    assert cli.main(list(words)) == code
    captured = capsys.readouterr()
    return captured.out, captured.err


def test_a_robot_that_looks_wrong_is_warned_of_in_one_line_and_in_the_json(capsys, odd_robot):
    out, err = run(capsys, "solve", odd_robot, "--alpha", "0", "0", "--D", "0.18", "0.29", "--json")
    (line,) = err.splitlines()
    assert line.startswith(f"ctr-pvs: warning: {odd_robot}: tube 'inner': segment 2: its pre-curvature 588 1/m")
    (warning,) = json.loads(out)["warnings"]
    assert line.endswith(warning)


def test_a_robot_that_looks_wrong_is_warned_of_by_stability_too(capsys, odd_robot):
    out, err = run(
        capsys, "stability", odd_robot, "--D", "0.18", "0.29", "--range", "0", "0.1", "--steps", "2", "--json"
    )
    assert len(err.splitlines()) == len(json.loads(out)["warnings"]) == 1


def test_right_robots_give_neither_warnings_nor_hints(capsys):
    out, err = run(capsys, "solve", ROBOT, "--alpha", "0", "170", *FULL, "--degrees", "--json")
    assert err == ""
    assert json.loads(out)["warnings"] == json.loads(out)["hints"] == []


def test_an_equilibrium_a_turn_away_is_hinted_at(capsys):
    """280 deg and -80 deg are one place of the bases; the robot snaps at 281.9 deg only."""
    out, err = run(capsys, "solve", ROBOT, "--alpha", "0", "270", *FULL, "--degrees", "--json")
    (hint,) = json.loads(out)["hints"]
    assert err == f"ctr-pvs: hint: {hint}\n"
    assert "--alpha 0 -90," in hint
    solver = EquilibriumSolver(load_robot(ROBOT))
    tips = [solver.solve([0.0, np.radians(a)], [0.0935, 0.2085], start="cold").tip.position for a in (270.0, -90.0)]
    assert f"{1e3 * math.dist(*tips):.3g} mm" in hint


def test_three_tubes_with_a_turn_between_two_of_them(capsys):
    out, _ = run(capsys, "solve", THREE_TUBES, "--alpha", "-90", "90", "620", "--D", "0.04", "0.06", "0.1",
                 "--degrees", "--json")  # fmt: skip
    answer = json.loads(out)
    assert answer["hints"] == []  # so mild a robot has one equilibrium for a place of its bases
    other, _ = run(capsys, "solve", THREE_TUBES, "--alpha", "-90", "90", "-100", "--D", "0.04", "0.06", "0.1",
                   "--degrees", "--json")  # fmt: skip
    assert math.dist(answer["tip"]["position"], json.loads(other)["tip"]["position"]) < 1e-4


def test_a_hint_is_not_given_for_angles_that_limits_forbid(capsys, tmp_path):
    path = tmp_path / "limited.yaml"
    text = Path(ROBOT).read_text(encoding="utf-8")
    path.write_text(f"{text}limits: {{alpha_deg: {{inner: [0, 360]}}}}\n", encoding="utf-8")
    out, err = run(capsys, "solve", str(path), "--alpha", "0", "270", *FULL, "--degrees", "--json")
    assert (json.loads(out)["hints"], err) == ([], "")
