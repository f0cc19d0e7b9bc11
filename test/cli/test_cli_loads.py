"""External loads on the command line: what the words mean, what is refused, and what the answers tell."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest

from ctr_pvs import EquilibriumSolver
from ctr_pvs import Loads
from ctr_pvs import PointForce
from ctr_pvs import Robot
from ctr_pvs import load_robot
from ctr_pvs.cli import main as cli
from ctr_pvs.cli.loads import loads_as_json
from ctr_pvs.cli.loads import loads_as_line
from ctr_pvs.cli.loads import loads_in
from ctr_pvs.cli.words import shielded

ROOT = Path(__file__).parents[2]
ROBOT = str(ROOT / "config" / "renda2021.yaml")
COMMAND = [ROBOT, "--alpha", "0", "1", "--D", "0.09", "0.2"]
FIG4 = [ROBOT, "--alpha", "0", "0", "--D", "0.0935", "0.2085"]  # a boundary of the outer tube sits on the orifice


def meant(*words: str) -> Loads | None:
    """The loads that words of `ctr-pvs solve` mean."""
    arguments = cli._parser().parse_args(shielded(["solve", *COMMAND, *words]))
    return loads_in(arguments, load_robot(ROBOT))


# --- words ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("words", "loads"),
    [
        ("", None),
        ("--tip-force 0 0.5 -1e-1", Loads((0, 0.5, -0.1))),
        ("--tip-force=-1 -2 -3", Loads((-1, -2, -3))),
        ("--tip-moment -.01 0 1e-3", Loads(tip_moment=(-0.01, 0, 0.001))),
        ("--tip-force 0 0 0", Loads()),
        ("--gravity 0 0 -9.81", Loads(gravity=(0, 0, -9.81))),
        ("--point-force inner 0.25 1 -2 3", Loads(point_forces=[PointForce(1, 0.25, (1, -2, 3))])),
        ("--point-force 2 250e-3 1 -2 3", Loads(point_forces=[PointForce(1, 0.25, (1, -2, 3))])),
        ("--point-moment 1 0.1 0 -1 0", Loads(point_forces=[PointForce(0, 0.1, moment=(0, -1, 0))])),
        ("--line-force outer 0 0 -2 --line-force 2 1 0 0", Loads(line_forces={0: (0, 0, -2), 1: (1, 0, 0)})),
        # force and moment on one point, however the tube is called, are one
        (
            "--point-force inner 0.25 1 0 0 --point-moment 2 0.25 0 0 -1 --point-moment inner 0.26 0 1 0",
            Loads(point_forces=[PointForce(1, 0.25, (1, 0, 0), (0, 0, -1)), PointForce(1, 0.26, moment=(0, 1, 0))]),
        ),
        # what is given more than once adds up
        (
            "--point-force inner 0.25 1 0 0 --point-force inner 0.25 0 0 2 --line-force 1 0 1 0 --line-force 1 0 1 0",
            Loads(point_forces=[PointForce(1, 0.25, (1, 0, 2))], line_forces={0: (0, 2, 0)}),
        ),
    ],
)
def test_what_the_words_mean(words, loads):
    assert meant(*words.split()) == loads


def test_a_tube_called_like_a_number_is_meant_by_its_name(tmp_path):
    """YAML's and Python's words for numbers are names too; digits alone are not."""
    path = tmp_path / "robot.yaml"
    path.write_text(Path(ROBOT).read_text().replace("name: inner", "name: nan"))
    words = ["solve", str(path), *COMMAND[1:], "--line-force", "nan", "0", "0", "1"]
    assert loads_in(cli._parser().parse_args(words), load_robot(path)).line_forces == {1: (0.0, 0.0, 1.0)}


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("--tip-force 1 2", ["--tip-force", "3 arguments"]),
        ("--tip-force 1 2 x", ["--tip-force", "'x'", "finite number"]),
        ("--tip-force 1 2 nan", ["--tip-force", "'nan'", "finite number"]),
        ("--tip-force 1 2 -inf", ["--tip-force", "'-inf'", "finite number"]),
        ("--tip-force 1 2 -2e9", ["tip_force", "1e+09 N"]),
        ("--tip-moment 1 2 1e300", ["tip_moment", "1e+09 N m"]),
        ("--gravity 9.81", ["--gravity", "3 arguments"]),
        ("--gravity 0 0 -9.81", ["density", "'outer'", "kg/m^3"]),
        ("--point-force inner 0.25 1 2", ["--point-force", "5 arguments"]),
        ("--point-force inner 0.25 1 2 x", ["--point-force", "'x'", "finite number"]),
        ("--point-force inner tip 1 2 3", ["--point-force", "'tip'", "finite number"]),
        ("--point-moment inner 0.25 1 2 -nan", ["--point-moment", "'-nan'", "finite number"]),
        ("--point-force middle 0.25 1 2 3", ["--point-force", "outer, inner", "from 1 to 2", "'middle'"]),
        ("--point-force 0 0.25 1 2 3", ["--point-force", "from 1 to 2", "'0'"]),
        ("--point-force 3 0.25 1 2 3", ["--point-force", "from 1 to 2", "'3'"]),
        ("--point-force 1.0 0.25 1 2 3", ["--point-force", "from 1 to 2", "'1.0'"]),
        ("--line-force -1 1 2 3", ["--line-force", "from 1 to 2", "'-1'"]),
        ("--line-force outer 1 2", ["--line-force", "4 arguments"]),
        ("--point-force inner -0.1 1 2 3", ["X", "at least 0 m", "-0.1"]),
        ("--point-force inner 0.31 1 2 3", ["point_forces[0].X", "'inner'", "0.3035 m", "0.31"]),
        ("--point-force inner 0.19 1 2 3", ["point_forces[0].X", "'inner'", "D = 0.2 m", "0.19", "orifice"]),
    ],
)
@pytest.mark.parametrize("output", [[], ["--json"]])
def test_words_that_are_no_load_are_one_line_and_exit_code_2(capsys, words, said, output):
    assert cli.main(["solve", *COMMAND, *words.split(), *output]) == cli.BAD_INPUT
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith("ctr-pvs: ")
    assert len(captured.err.splitlines()) == 1
    missing = [word for word in said if word not in captured.err]
    assert not missing, captured.err


# --- what acts, told --------------------------------------------------------------------------------------------------

EVERYTHING = Loads(
    (0, 0.5, -0.0),
    (0.01, 0, 0),
    [PointForce(1, 0.25, (1, 0, 0), (0, 0, -1)), PointForce(0, 0.1)],
    {0: (0, 0, -2)},
    (0, 0, -9.81),
)


def test_a_line_tells_what_acts():
    assert loads_as_line(load_robot(ROBOT), EVERYTHING) == (
        "tip force (0, 0.5, 0) N and tip moment (0.01, 0, 0) N m; "
        "force (1, 0, 0) N and moment (0, 0, -1) N m on inner at X 250 mm; "
        "(0, 0, -2) N/m along outer; gravity (0, 0, -9.81) m/s^2"
    )


def test_json_tells_what_acts_with_tubes_from_1():
    robot = load_robot(ROBOT)
    assert loads_as_json(robot, None) is loads_as_json(robot, Loads(line_forces={1: (0, 0, 0)})) is None
    told = loads_as_json(robot, EVERYTHING)
    assert json.loads(json.dumps(told)) == {
        "tip_force": [0.0, 0.5, 0.0],
        "tip_moment": [0.01, 0.0, 0.0],
        "point_forces": [
            {"tube": 2, "name": "inner", "X": 0.25, "force": [1.0, 0.0, 0.0], "moment": [0.0, 0.0, -1.0]},
            {"tube": 1, "name": "outer", "X": 0.1, "force": [0.0, 0.0, 0.0], "moment": [0.0, 0.0, 0.0]},
        ],
        "line_forces": [{"tube": 1, "name": "outer", "force": [0.0, 0.0, -2.0]}],
        "gravity": [0.0, 0.0, -9.81],
    }


# --- answers ----------------------------------------------------------------------------------------------------------


def solve(capsys, *words: str) -> str:
    assert cli.main(["solve", *words]) == 0
    captured = capsys.readouterr()
    assert captured.err == ""
    return captured.out


def test_the_json_answer_is_the_solvers_under_the_same_loads(capsys):
    words = ["--tip-force", "0", "0.5", "-0.3", "--point-force", "outer", "0.15", "0", "-0.4", "0.2"]
    words += ["--point-moment", "outer", "0.15", "0.01", "0", "0"]
    loads = Loads((0, 0.5, -0.3), point_forces=[PointForce(0, 0.15, (0, -0.4, 0.2), (0.01, 0, 0))])
    answer = json.loads(solve(capsys, *COMMAND, *words, "--json"))
    equilibrium = EquilibriumSolver(load_robot(ROBOT)).solve([0.0, 1.0], [0.09, 0.2], loads=loads, start="cold")
    assert answer["tip"]["position"] == equilibrium.tip.position.tolist()
    for key in ("torque", "force", "jacobian", "compliance", "force_interval_reversed"):
        assert answer[key] == getattr(equilibrium, key).tolist(), key
    assert np.shape(answer["jacobian"]) == (6, 4) and np.shape(answer["compliance"]) == (6, 6)
    assert answer["potential"] is None  # of a dead moment
    assert answer["loads"]["point_forces"] == [
        {"tube": 1, "name": "outer", "X": 0.15, "force": [0.0, -0.4, 0.2], "moment": [0.01, 0.0, 0.0]}
    ]
    assert answer["warnings"] == []


def test_a_load_moves_the_tip_its_way_and_is_held_at_the_base(capsys):
    """Statics of the whole: the base wrench is the load's, moved from the tip to the orifice."""
    force = np.array([0.0, 0.4, -0.2])
    free = json.loads(solve(capsys, *COMMAND, "--json", "--tolerance", "1e-7"))
    words = ["--tip-force", *map(str, force)]
    held = json.loads(solve(capsys, *COMMAND, *words, "--json", "--tolerance", "1e-7"))
    tip = np.array(held["tip"]["position"])
    assert force @ (tip - free["tip"]["position"]) > 1e-4
    np.testing.assert_allclose(held["base_wrench"]["force"], force, atol=1e-12)
    np.testing.assert_allclose(held["base_wrench"]["moment"], np.cross(tip, force), atol=1e-6)
    assert held["potential"] == pytest.approx(held["energy"] - force @ tip, abs=1e-7)
    compliance = np.array(held["compliance"])
    np.testing.assert_allclose(compliance, compliance.T, atol=1e-6 * np.abs(compliance).max())


def test_without_loads_the_json_says_so(capsys):
    answer = json.loads(solve(capsys, *COMMAND, "--json"))
    none = json.loads(solve(capsys, *COMMAND, "--tip-force", "0", "0", "0", "--json"))
    assert answer == none
    assert answer["loads"] is None
    assert answer["potential"] == answer["energy"]
    assert answer["base_wrench"]["force"] == pytest.approx([0, 0, 0], abs=1e-12)
    assert answer["base_wrench"]["moment"] == pytest.approx([0, 0, 0], abs=1e-6)
    assert answer["force_interval_reversed"] == [False, False]


def test_weight_acts_as_line_forces_of_the_same_size(capsys, tmp_path):
    path = tmp_path / "robot.yaml"
    path.write_text(Path(ROBOT).read_text().replace("youngs_modulus", "density: 8000\n    youngs_modulus"))
    command = [str(path), *COMMAND[1:], "--json"]
    areas = math.pi / 4 * np.array([2.39e-3**2 - 2.01e-3**2, 1.6e-3**2])
    outer, inner = (str(-981.0 * 8000.0 * area) for area in areas)  # a hundredfold, so that it can be seen
    weight = json.loads(solve(capsys, *command, "--gravity", "0", "0", "-981"))
    lines = ["--line-force", "outer", "0", "0", outer, "--line-force", "inner", "0", "0", inner]
    drawn = json.loads(solve(capsys, *command, *lines))
    free = json.loads(solve(capsys, *command))
    assert weight["loads"]["gravity"] == [0.0, 0.0, -981.0]
    np.testing.assert_allclose(weight["tip"]["position"], drawn["tip"]["position"], atol=1e-12)
    assert free["tip"]["position"][2] - weight["tip"]["position"][2] > 1e-3
    reach = np.array([0.1858 - 0.09, 0.3035 - 0.2])
    np.testing.assert_allclose(weight["base_wrench"]["force"], [0, 0, -981 * 8000 * areas @ reach], rtol=1e-9)


def test_the_text_answer_tells_what_acts_and_the_base_wrench(capsys):
    text = solve(capsys, *COMMAND, "--tip-force", "0", "0.4", "-0.2")
    lines = text.splitlines()
    assert "external loads   tip force (0, 0.4, -0.2) N" in lines
    (force,) = [line for line in lines if line.startswith("base force")]
    assert re.findall(r"-?\d+\.\d+", force) == ["0.0000", "0.4000", "-0.2000"] and force.endswith(" N")
    assert any(line.startswith("base moment") and line.endswith(" N m") for line in lines)
    (energies,) = [line for line in lines if line.startswith("elastic energy")]
    assert re.fullmatch(r"elastic energy \S+ J, potential with the loads \S+ J", energies)
    bare = solve(capsys, *COMMAND)
    assert not [word for word in ("external", "base force", "potential", "reversed") if word in bare]


def expected_jump(robot: Robot, answer: dict) -> float:
    """By how much the outer tube's force towards +D is above that towards -D [N], with its curved part beginning on the
    orifice: the jump of (sum K) |k|^2 / 2, where (sum K) k = m + sum K kappa* exp(i psi) on either side."""
    outer, inner = robot.tubes
    curved, straight = outer.segments[1], inner.segments[0]
    psi_outer, psi_inner = answer["twist"]["psi"][0]
    before = complex(*answer["base_wrench"]["moment"][1:])
    before += straight.bending_stiffness * sum(straight.curvature[:1]) * np.exp(1j * psi_inner)
    after = before + curved.bending_stiffness * curved.curvature[0] * np.exp(1j * psi_outer)
    return (abs(after) ** 2 - abs(before) ** 2) / (2.0 * (curved.bending_stiffness + straight.bending_stiffness))


def test_a_reversed_force_interval_is_told(capsys):
    """Lifted by 5 N, the robot bends upwards at the orifice, against the outer tube's pre-curvature.

    There the end of that tube's straight part sits, and the more of its curved part comes out the less is bent, so the
    force towards +D is less than that towards -D.
    """
    words = [*FIG4, "--tip-force", "0", "0", "5", "--tolerance", "1e-7"]
    answer = json.loads(solve(capsys, *words, "--json"))
    assert answer["force_interval_reversed"] == [True, False]
    moment = complex(*answer["base_wrench"]["moment"][1:])
    assert moment == pytest.approx(-0.4472777, abs=1e-5)  # the plane rod's equations solved by shooting, to 1e-9
    assert expected_jump(load_robot(ROBOT), answer) < -1.0
    towards_less, towards_more = answer["force_interval"][0]
    assert towards_more - towards_less == pytest.approx(expected_jump(load_robot(ROBOT), answer), rel=1e-4)
    (warning,) = answer["warnings"]
    assert "outer" in warning and "no constant force" in warning
    text = solve(capsys, *words)
    assert warning in text.splitlines()
    assert "any force within the interval holds" not in text


def test_other_tubes_can_reverse_a_force_interval_too(capsys, tmp_path):
    """Without loads: the inner tube, curved at the orifice, bends the robot against what comes out of the outer one."""
    path = tmp_path / "robot.yaml"
    text = Path(ROBOT).read_text().replace("{length: 218.5e-3}", "{length: 218.5e-3, curvature_y: [60.0]}")
    path.write_text(text.replace("{length: 92.3e-3, curvature_y: [9.9]}", "{length: 10e-3, curvature_y: [5.0]}"))
    words = [str(path), "--alpha", "0", "180", "--degrees", "--D", "0.0935", "0.2", "--tolerance", "1e-7"]
    answer = json.loads(solve(capsys, *words, "--json"))
    towards_less, towards_more = answer["force_interval"][0]
    assert expected_jump(load_robot(path), answer) < -1.0
    assert towards_more - towards_less == pytest.approx(expected_jump(load_robot(path), answer), rel=1e-4)
    assert answer["force_interval_reversed"] == [True, False]
    assert "no constant force" in answer["warnings"][0]
