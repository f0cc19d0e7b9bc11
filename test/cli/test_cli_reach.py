"""ctr-pvs reach and ctr-pvs follow: answers that hold, files of joint values, exit codes, one line for bad input."""

from __future__ import annotations

import csv
import json

import numpy as np
import pytest

from ctr_pvs import EquilibriumSolver
from ctr_pvs import load_robot
from ctr_pvs.cli import main as cli

START = ["--start-alpha", "0", "0.5", "--start-D", "0.09", "0.2"]
TARGET = EquilibriumSolver(load_robot("renda2021"), 1e-7).solve([0.4, 1.2], [0.08, 0.19]).tip.position


def run(capsys, *words: str, code: int = 0) -> str:
    assert cli.main(list(words)) == code
    captured = capsys.readouterr()
    assert captured.err == ""
    return captured.out


def refused(capsys, *words: str) -> str:
    assert cli.main(list(words)) == 2
    captured = capsys.readouterr()
    assert captured.out == "" and len(captured.err.splitlines()) == 1
    return captured.err


def numbers(values) -> list[str]:
    return [repr(float(value)) for value in values]


def test_what_json_tells_reaches_the_target(capsys, tmp_path):
    file = tmp_path / "joints.csv"
    words = ("reach", "renda2021", "--position", *numbers(TARGET), *START, "--json", "--csv", str(file))
    found = json.loads(run(capsys, *words))
    assert found["success"] and found["status"] == "reached" and found["distance"] < 1e-6
    solver = EquilibriumSolver(load_robot("renda2021"), 1e-7)
    rows = list(csv.DictReader(file.read_text().splitlines()))
    assert len(rows) == len(found["way"])
    for step, row in zip(found["way"], rows, strict=True):
        answer = solver.solve(step["alpha"], step["D"])
        assert [float(row["outer_rotation"]), float(row["inner_rotation"])] == step["alpha"]
        assert [float(row["outer_translation"]), float(row["inner_translation"])] == step["D"]
        assert float(row["margin"]) == step["stability_margin"]
    assert answer.alpha.tolist() == found["alpha"]
    assert np.linalg.norm(answer.tip.position - TARGET) < 2e-6
    assert found["way"][0]["alpha"] == [0.0, 0.5]


def test_text_in_degrees(capsys):
    words = ("reach", "renda2021", "--position", *numbers(TARGET), "--degrees")
    text = run(capsys, *words, "--start-alpha", "0", "30", "--start-D", "0.09", "0.2")
    assert text.startswith("renda2021: reached: ") and "alpha [deg]" in text and "least margin" in text


def test_all_solutions_are_told(capsys):
    found = json.loads(run(capsys, "reach", "renda2021", "--position", *numbers(TARGET), "--all", "--json"))
    margins = [found["stability_margin"], *(other["stability_margin"] for other in found["others"])]
    assert len(margins) >= 2 and margins == sorted(margins, reverse=True)


def test_exit_codes(capsys):
    far = run(capsys, "reach", "renda2021", "--position", "0.5", "0", "0", code=5)
    assert "closest" in far
    late = run(capsys, "reach", "renda2021", "--position", "0.1", "0.2", "0", "--budget", "1e-9", code=4)
    assert "timeout" in late
    stopped = run(capsys, "follow", "renda2021", "--through", *numbers(TARGET), "--through", "0.1", "0.5", "0", code=5)
    assert "stopped at" in stopped


def test_a_path_from_a_file_under_a_load(capsys, tmp_path):
    points, file = tmp_path / "points.csv", tmp_path / "joints.csv"
    ends = TARGET, TARGET + np.array([0.0, 0.0, 0.004])
    points.write_text("x,y,z\n" + "\n".join(",".join(numbers(end)) for end in ends) + "\n")
    words = ("follow", "renda2021", "--points", str(points), "--tip-force", "0", "0", "0.05", "--csv", str(file))
    found = json.loads(run(capsys, *words, "--json"))
    assert found["success"] and found["length"] == pytest.approx(0.004)
    assert np.linalg.norm(np.array(found["tip"][-1]) - TARGET - [0.0, 0.0, 0.004]) < 1e-5
    rows = list(csv.DictReader(file.read_text().splitlines()))
    assert [float(row["time"]) for row in rows] == found["time"] and rows[0].keys() >= {"margin", "deviation"}
    assert "farthest from the path" in run(capsys, *words)


@pytest.mark.parametrize(
    ("words", "part"),
    [
        (("reach", "renda2021", "--position", "0.1", "0", "0", "--start-D", "0.1", "0.2"), "--start-alpha"),
        (("reach", "renda2021", "--position", "0.1", "0", "0", "--margin-floor", "2"), "margin_floor"),
        (("reach", "renda2021", "--position", "0.1", "0", "0", "--tangent", "0", "0", "0"), "tangent"),
        (("reach", "renda2021", "--position", "0.1", "0", "0", "--csv", "/nowhere/x.csv"), "--csv"),
        (("follow", "renda2021", "--points", "/nowhere/x.csv"), "--points"),
        (("follow", "renda2021", "--through", "0.1", "0", "0", "--slide-rate", "0"), "slide"),
    ],
)
def test_bad_input_is_one_line(capsys, words, part):
    assert part in refused(capsys, *words)


def test_a_file_that_holds_no_points_is_refused(capsys, tmp_path):
    file = tmp_path / "points.csv"
    file.write_text("x,y,z\n1,2\n")
    assert "row 1" in refused(capsys, "follow", "renda2021", "--points", str(file))
    file.write_text("x,y,z\n")
    assert "at least one point" in refused(capsys, "follow", "renda2021", "--points", str(file))
