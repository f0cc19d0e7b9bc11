"""ctr-pvs calibrate: a report, a picture, a new robot file, and one clear line for bad input."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from ctr_pvs import EquilibriumSolver
from ctr_pvs import load_robot
from ctr_pvs.cli import main as cli

ROBOT = str(Path(__file__).parents[2] / "config" / "renda2021.yaml")
FIT = ("--fit", "curvature:inner", "alpha:inner", "registration")


@pytest.fixture(scope="module")
def tips(tmp_path_factory) -> str:
    """40 tips in mm and degrees, of a robot whose inner tube is turned by 5 deg, in a frame that lies elsewhere."""
    robot, rng = load_robot(ROBOT), np.random.default_rng(3)
    turn = np.linspace(0.0, 60.0, 40)
    slid = 0.12 + 0.02 * np.sin(0.3 * np.arange(40))
    solver = EquilibriumSolver(robot)
    file = tmp_path_factory.mktemp("tips") / "tips.csv"
    lines = ["theta,alpha_2,D_1,D_2,x,y,z"]
    for angle, D in zip(turn, slid, strict=True):
        tip = solver.solve([0.0, np.radians(angle + 5.0)], [0.0535, D]).tip.position
        x, y, z = 1e3 * (tip[[1, 2, 0]] + [0.1, 0.2, 0.3] + 1e-4 * rng.standard_normal(3))
        lines.append(f"0,{angle},53.5,{1e3 * D},{x},{y},{z}")
    file.write_text("\n".join(lines) + "\n")
    return str(file)


def words(tips: str, *others: str) -> list[str]:
    return [
        "calibrate", ROBOT, tips, "--columns", "alpha_1=theta", "--degrees", "--mm", "--hold-out", "10", *FIT, *others
    ]  # fmt: skip


def test_the_report_the_file_and_the_picture(tips, tmp_path, capsys):
    pytest.importorskip("matplotlib")
    file, picture = tmp_path / "new.yaml", tmp_path / "left.png"
    assert cli.main(words(tips, "--write", str(file), "--output", str(picture))) == 0
    told, progress = capsys.readouterr()
    assert "after, held out" in told and "rotation offset of inner" in told and "standard error" in told
    assert "solve 1" in progress
    assert picture.stat().st_size > 10_000
    again = load_robot(file)
    assert again.tubes[0] == load_robot(ROBOT).tubes[0]
    assert file.read_text().startswith("# Fitted to tips.csv by ctr-pvs calibrate: tips of 20 rows held out")
    assert "alpha:inner" in file.read_text()


def test_json(tips, capsys):
    assert cli.main(words(tips, "--json", "--prior", "curvature=1,0.05", "--bounds", "alpha:inner=-1,1")) == 0
    found = json.loads(capsys.readouterr().out)
    by_name = {parameter["name"]: parameter for parameter in found["parameters"]}
    assert by_name["alpha:inner"]["value"] == pytest.approx(np.radians(5.0), abs=4.0 * by_name["alpha:inner"]["error"])
    assert by_name["curvature:inner"]["std"] == 0.05 and by_name["registration:x"]["std"] is None
    assert found["after"]["held_out"]["rows"] == 20 and found["after"]["held_out"]["median"] < 4e-4
    assert len(found["registration"]["rotation"]) == 4


@pytest.mark.parametrize(
    ("others", "match"),
    [
        (["--columns", "alpha_1"], "--columns: expected NAME=..."),
        (["--prior", "poisson=0.3"], "--prior: expected two numbers"),
        (["--fit", "stiffness"], "fit: expected one of"),
        (["--position-std", "0"], "position_std: expected a number above 0"),
        (["--columns", "alpha_1=angle"], "column angle: expected a column of this name"),
        (["--hold-out", "-1"], "--hold-out"),
        (["--output", "picture.nonsense"], "--output"),
        (["--write", "/no/such/folder/robot.yaml"], "--write: cannot write"),
    ],
)
def test_bad_input_is_one_line(tips, capsys, others, match):
    assert cli.main(words(tips, *others)) == 2
    complaint = [line for line in capsys.readouterr().err.splitlines() if line.startswith("ctr-pvs")]
    assert len(complaint) == 1 and match in complaint[0]
