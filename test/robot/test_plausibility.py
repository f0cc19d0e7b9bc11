"""Warnings of robots that look as if they were in another unit, and none of those that are right."""

from __future__ import annotations

import warnings

import pytest
from robot_texts import GOOD

from ctr_pvs import RobotWarning
from ctr_pvs import load_robot
from ctr_pvs.robot.plausibility import implausible
from ctr_pvs.robot.robot import Limits
from ctr_pvs.robot.robot import Robot
from ctr_pvs.robot.robot import Segment
from ctr_pvs.robot.robot import Tube
from ctr_pvs.robot.shipped import shipped_robots

SIZES = {"inner_diameter": 2.01e-3, "outer_diameter": 2.39e-3}
STIFF = (0.0464, 0.0344)  # N m^2, of a nitinol tube of these sizes


def robot(length=0.1, stiffness=STIFF, curvature=(), sizes=SIZES, limits=Limits()) -> Robot:  # noqa: B008
    tube = Tube("outer", (Segment(0.05, *stiffness), Segment(length, *stiffness, curvature)), **sizes)
    return Robot("r", (tube,), limits)


@pytest.mark.parametrize("path", shipped_robots().values(), ids=lambda path: path.stem)
def test_shipped_robots_give_none(path):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert implausible(load_robot(path)) == []


@pytest.mark.parametrize(
    ("one", "words"),
    [
        (robot(length=97.0), ["97.05 m long", "over 3 m", "in mm?", "length_mm"]),
        (robot(curvature=(588.0,)), ["segment 2", "588 1/m", "70.3 %", "over 10 %", "radius in mm", "1.701 1/m"]),
        (robot(curvature=(0.0, 5880.0)), ["588 1/m", "70.3 %"]),
        (robot(curvature=(588.0,), sizes={}), ["588 1/m", "1.7 mm", "under 5 mm", "radius_mm"]),
        (robot(sizes={"inner_diameter": 2.01, "outer_diameter": 2.39}, stiffness=(4e10, 3e10)),
         ["outer diameter is 2.39 m", "over 0.03 m", "in mm?"]),
        (robot(stiffness=(46400.0, 34400.0)), ["46400 N m^2", "over 1.3e+12 Pa", "N mm^2"]),
        (robot(stiffness=(4.6e-8, 3.4e-8)), ["under 1e+07 Pa", "MPa or GPa"]),
        (robot(stiffness=(46400.0, 34400.0), sizes={}), ["46400 N m^2", "over 1000 N m^2", "N mm^2"]),
        (robot(stiffness=(0.0464, 3.44e-5)), ["0.000741", "one unit"]),
        (robot(limits=Limits(alpha=((-180.0, 180.0),))), ["-180 to 180 rad", "beyond 50 rad", "alpha_deg"]),
        (robot(limits=Limits(D=((0.0, 150.0),))), ["0 to 150 m", "in mm?", "D_mm"]),
    ],
)  # fmt: skip
def test_a_number_in_another_unit_is_told_with_threshold_and_likely_mistake(one, words):
    (line,) = implausible(one)
    assert line.startswith("tube 'outer': ")
    assert not [word for word in words if word not in line], line


def test_everything_a_thousand_times_too_small_is_seen():
    small = Tube("t", (Segment(97e-6, 5e-14, 4e-14),), 2.01e-6, 2.39e-6)
    lines = implausible(Robot("r", (small,)))
    assert len(lines) == 2
    assert all("divided by 1000 twice" in line for line in lines)


@pytest.mark.parametrize(
    "one",
    [
        robot(curvature=(83.0,)),  # 9.9 %
        robot(length=2.9),
        robot(sizes={"inner_diameter": 0.0, "outer_diameter": 29e-3}, stiffness=(2000.0, 1500.0)),
        robot(curvature=(190.0,), sizes={}),
        robot(stiffness=(9e-4, 7e-4)),  # a polymer
        robot(limits=Limits(alpha=((-12.6, 12.6),), D=((0.0, 1.0),))),
    ],
)
def test_what_is_large_but_possible_gives_none(one):
    assert implausible(one) == []


def test_reading_a_file_warns_with_its_name_and_gives_the_robot_all_the_same(tmp_path):
    path = tmp_path / "robot.yaml"
    path.write_text(GOOD.replace("length: 0.2", "length: 200"), encoding="utf-8")
    with pytest.warns(RobotWarning) as caught:
        assert load_robot(path).tubes[1].length == 200.0
    assert [str(warning.message).partition(": tube 'inner': it is 200 m long")[0] for warning in caught] == [str(path)]
    assert caught[0].filename == __file__
