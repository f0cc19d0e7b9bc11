"""ctr-pvs design: a report, a robot file and a picture that hold, one clear line for bad input, Ctrl-C."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from ctr_pvs import EquilibriumSolver
from ctr_pvs import load_robot
from ctr_pvs.cli import main as cli

#: Tips of the shipped robot, and one to begin with that is off from it in curvature.
COMMANDS = [([0.2, 1.0], [0.07, 0.18]), ([2.0, 2.5], [0.08, 0.2]), ([-1.0, -1.5], [0.05, 0.15])]


@pytest.fixture(scope="module")
def words(tmp_path_factory) -> list[str]:
    folder = tmp_path_factory.mktemp("design")
    solver = EquilibriumSolver(load_robot("renda2021"), 1e-8)
    tips = [solver.solve(*command, start="cold").tip.position for command in COMMANDS]
    (folder / "targets.csv").write_text("x,y,z\n" + "\n".join(",".join(map(repr, tip.tolist())) for tip in tips) + "\n")
    text = (Path(__file__).parents[2] / "config" / "renda2021.yaml").read_text()
    (folder / "start.yaml").write_text(text.replace("[9.9]", "[5.0]").replace("[13.8]", "[7.0]"))
    return ["design", str(folder / "start.yaml"), str(folder / "targets.csv"), "--starts", "2"]


def refused(capsys, *words: str) -> str:
    assert cli.main(list(words)) == 2
    captured = capsys.readouterr()
    complaint = [line for line in captured.err.splitlines() if line.startswith("ctr-pvs")]
    assert captured.out == "" and len(complaint) == 1
    return complaint[0]


def test_the_report_the_file_and_the_picture(words, tmp_path, capsys):
    pytest.importorskip("matplotlib")
    file, picture = tmp_path / "new.yaml", tmp_path / "new.png"
    assert cli.main([*words, "--write", str(file), "--output", str(picture)]) == 0
    told, progress = capsys.readouterr()
    assert "3 of 3 targets reached" in told and "curvature of inner" in told and "strain [%]" in told
    assert progress.startswith("before: ") and "stage 1, design 1 of 2" in progress
    assert picture.stat().st_size > 10_000
    assert file.read_text().startswith("# Designed for targets.csv by ctr-pvs design, seed 0: 3 of 3 targets reached")
    solver = EquilibriumSolver(load_robot(file), 1e-7)
    rows = np.loadtxt(words[2], delimiter=",", skiprows=1)
    assert all(solver.inverse(place).success for place in rows)


def test_json_is_the_same_again(words, capsys):
    told = []
    for _ in range(2):
        assert cli.main([*words, "--vary", "curvature", "length:inner:2=0.06,0.1", "--json"]) == 0
        told.append(json.loads(capsys.readouterr().out))
    first, second = ({key: value for key, value in one.items() if key != "seconds"} for one in told)
    assert first == second
    assert [p["name"] for p in first["parameters"]] == ["length:inner:2", "curvature:outer", "curvature:inner"]
    assert all(p["low"] <= p["value"] <= p["high"] for p in first["parameters"])
    assert first["success"] and all(target["stability_margin"] >= 0.1 for target in first["after"]["targets"])
    assert first["before"]["tubes"][1]["largest_strain"] == pytest.approx(0.0056)
    assert max(target["distance"] for target in first["after"]["targets"]) == first["after"]["worst"] <= 1e-6


def test_what_is_not_reached_is_told(words, capsys):
    assert cli.main([*words, "--strain", "0.007", "--vary", "curvature", "--json"]) == 5
    found = json.loads(capsys.readouterr().out)
    assert not found["success"] and found["after"]["worst"] > 1e-4
    assert all(tube["largest_strain"] <= 0.007 * (1 + 1e-9) for tube in found["after"]["tubes"])


@pytest.mark.parametrize(
    ("others", "part"),
    [
        (["--vary", "stiffness"], "vary: expected one of"),
        (["--vary", "curvature:middle"], "vary: expected one of"),
        (["--vary", "curvature:inner=20,5"], "a lower and a higher bound"),
        (["--vary", "curvature:inner=7,7"], "a lower and a higher bound"),
        (["--strain", "0.001"], "the least strain of tube"),
        (["--strain", "-1"], "strain: expected"),
        (["--margin-floor", "2"], "margin_floor: expected"),
        (["--clearance", "0.01"], "_diameter:"),
        (["--within", "0"], "within: expected"),
        (["--starts", "0"], "--starts: expected a whole number"),
        (["--write", "/no/such/folder/robot.yaml"], "its folder is not there"),
        (["--output", "picture.nonsense"], "expected a file that ends in"),
    ],
)
def test_bad_input_is_one_line(words, capsys, others, part):
    assert part in refused(capsys, *words, *others)


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("x,y,z\n", "0 rows"),
        ("x,y\n0.1,0\n", "column z"),
        ("x,y,z\n0.1,nan,0\n", "row 1: expected a finite number"),
        ("x,y,z\n-0.1,0,0\n", "expected x of 0 or more"),
        ("x,y,z\n100,0,0\n", "--mm"),
        ("x,y,z,tx,ty,tz\n0.1,0,0,1,1,1\n", "a vector of length 1"),
    ],
)
def test_targets_that_cannot_be_meant_are_one_line(words, capsys, tmp_path, text, part):
    file = tmp_path / "targets.csv"
    file.write_text(text)
    assert part in refused(capsys, words[0], words[1], str(file))


def test_ctrl_c_keeps_the_best_so_far(words, tmp_path):
    file = tmp_path / "new.yaml"
    run = subprocess.Popen(
        [sys.executable, "-m", "ctr_pvs", *words[:-1], "200", "--write", str(file)], text=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, cwd=Path(__file__).parents[2], env=os.environ.copy(),
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )  # fmt: skip
    assert run.stderr is not None
    for line in run.stderr:
        if line.startswith("stage 1, design"):
            break
    run.send_signal(signal.SIGINT)
    told, complaint = run.communicate(timeout=300)
    assert run.returncode == 130, complaint
    assert "stopped before the end" in told and "ctr-pvs: stopped" in complaint
    assert load_robot(file).n_tubes == 2 and "stopped before the end" in file.read_text()
