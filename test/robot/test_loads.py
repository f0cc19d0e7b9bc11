"""External loads: what their constructors take and refuse, and which robots and commands they can act on."""

from __future__ import annotations

import copy
import math
import pickle
from dataclasses import FrozenInstanceError
from dataclasses import replace

import numpy as np
import pytest
from robot_texts import load_text
from robot_texts import one_tube

from ctr_pvs import LoadError
from ctr_pvs import Loads
from ctr_pvs import PointForce
from ctr_pvs import RobotFileError
from ctr_pvs.robot.loads import check_loads
from ctr_pvs.robot.robot import Robot
from ctr_pvs.robot.robot import Segment
from ctr_pvs.robot.robot import Tube

STRAIGHT = Segment(0.1, 0.05, 0.04)
EVERYTHING = {
    "tip_force": (1.0, -2.0, 3.0),
    "tip_moment": (0.1, 0.2, -0.3),
    "point_forces": (PointForce(1, 0.15, (4.0, 5.0, 6.0)), PointForce(0, 0.1, moment=(0.0, 0.5, 0.0))),
    "line_forces": {1: (7.0, 8.0, 9.0), 0: (0.0, 0.0, 1.0)},
    "gravity": (0.0, 0.0, -9.81),
}


def make_robot(density: float | None = 6450.0) -> Robot:
    """Two tubes, 0.1 m and 0.2 m long."""
    outer = Tube("outer", (STRAIGHT,), 2.01e-3, 2.39e-3, density)
    return Robot("pair", (outer, Tube("inner", (STRAIGHT, STRAIGHT), 0.0, 1.6e-3, density)))


# --- values -----------------------------------------------------------------------------------------------------------


def test_nothing_acts_by_default():
    loads = Loads()
    assert loads.is_none and not loads.has_moments
    assert loads == Loads((0, 0, 0), [0.0] * 3, [], {}, np.zeros(3))


@pytest.mark.parametrize("name", list(EVERYTHING))
def test_anything_alone_is_a_load(name):
    loads = Loads(**{name: EVERYTHING[name]})
    assert not loads.is_none
    assert loads.has_moments == (name in ("tip_moment", "point_forces"))
    assert loads.scaled(0.0).is_none


def test_zeros_in_every_place_are_no_load():
    assert Loads(point_forces=[PointForce(0, 0.1)], line_forces={0: (0, 0, 0)}, tip_moment=(-0.0, 0, 0)).is_none
    assert not Loads(point_forces=[PointForce(0, 0.1, (0, 0, 1e-300))]).has_moments


def test_arrays_and_lists_become_tuples_of_floats():
    arrays = Loads(
        np.array([1, -2, 3]),
        [np.float32(0.5), 0, 1],
        [PointForce(np.int64(1), np.float64(0.25), np.array([4.0, 5.0, 6.0]), [0, 0, 1])],
        {np.int64(1): np.array([7.0, 8.0, 9.0])},
        np.array([0.0, 0.0, -9.81]),
    )
    plain = Loads(
        (1.0, -2.0, 3.0),
        (0.5, 0.0, 1.0),
        (PointForce(1, 0.25, (4.0, 5.0, 6.0), (0.0, 0.0, 1.0)),),
        {1: (7.0, 8.0, 9.0)},
        (0.0, 0.0, -9.81),
    )
    assert arrays == plain and hash(arrays) == hash(plain)
    (point,) = arrays.point_forces
    numbers = [*arrays.tip_force, *arrays.tip_moment, *arrays.gravity, *point.force, *point.moment, point.X]
    assert {type(number) for number in numbers} == {float}
    assert type(point.tube) is int


def test_loads_are_values():
    loads = Loads(**EVERYTHING)
    same = Loads(**{**EVERYTHING, "line_forces": dict(reversed(EVERYTHING["line_forces"].items()))})
    assert loads == same and hash(loads) == hash(same)
    for other in (pickle.loads(pickle.dumps(loads)), copy.deepcopy(loads), replace(loads)):
        assert other == loads and hash(other) == hash(loads)
    for name in EVERYTHING:
        assert replace(loads, **{name: getattr(Loads(), name)}) != loads
    with pytest.raises(FrozenInstanceError):
        loads.gravity = (0.0, 0.0, 0.0)
    with pytest.raises(TypeError):
        loads.line_forces[0] = (0.0, 0.0, 0.0)


def test_loads_do_not_change_with_what_they_were_made_of():
    force, lines = np.array([1.0, 2.0, 3.0]), {0: (0.0, 0.0, 1.0)}
    loads = Loads(force, line_forces=lines)
    force[:], lines[1] = 0.0, (1.0, 1.0, 1.0)
    assert loads == Loads((1, 2, 3), line_forces={0: (0, 0, 1)})


def test_scaling_scales_every_force_and_moves_no_point():
    loads = Loads(**EVERYTHING)
    half = loads.scaled(0.5)
    assert half.tip_force == (0.5, -1.0, 1.5) and half.tip_moment == (0.05, 0.1, -0.15)
    assert half.gravity == (0.0, 0.0, -4.905)
    assert [(point.tube, point.X) for point in half.point_forces] == [(1, 0.15), (0, 0.1)]
    assert half.point_forces[0].force == (2.0, 2.5, 3.0) and half.point_forces[1].moment == (0.0, 0.25, 0.0)
    assert half.line_forces == {0: (0.0, 0.0, 0.5), 1: (3.5, 4.0, 4.5)}
    assert half.scaled(2.0) == loads
    with pytest.raises(LoadError, match="factor: expected a finite number, got nan"):
        loads.scaled(math.nan)


# --- what is refused --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "field", "shown"),
    [
        ({"tip_force": (1.0, 2.0)}, "tip_force", "(1.0, 2.0)"),
        ({"tip_force": 1.0}, "tip_force", "1.0"),
        ({"tip_force": None}, "tip_force", "None"),
        ({"tip_force": "xyz"}, "tip_force", "'xyz'"),
        ({"tip_force": ("1", "2", "3")}, "tip_force", "'1'"),
        ({"tip_force": (True, False, True)}, "tip_force", "True"),
        ({"tip_force": (0.0, [1.0], 2.0)}, "tip_force", "[1.0]"),
        ({"tip_force": (0.0, 0.0, 10**400)}, "tip_force", "1000"),
        ({"tip_force": np.eye(3)}, "tip_force", "1."),
        ({"tip_force": (0.0, math.nan, 0.0)}, "tip_force", "nan"),
        ({"tip_force": (0.0, 0.0, 2e9)}, "tip_force", "2000000000.0"),
        ({"tip_moment": (math.inf, 0.0, 0.0)}, "tip_moment", "inf"),
        ({"gravity": (0.0, 0.0, -math.inf)}, "gravity", "-inf"),
        ({"gravity": 9.81}, "gravity", "9.81"),
        ({"point_forces": PointForce(0, 0.1)}, "point_forces", "PointForce"),
        ({"point_forces": [PointForce(0, 0.1), (0, 0.1)]}, "point_forces[1]", "(0, 0.1)"),
        ({"line_forces": [(0.0, 0.0, 1.0)]}, "line_forces", "[(0.0, 0.0, 1.0)]"),
        ({"line_forces": {"outer": (0.0, 0.0, 1.0)}}, "line_forces", "'outer'"),
        ({"line_forces": {-1: (0.0, 0.0, 1.0)}}, "line_forces", "-1"),
        ({"line_forces": {1: (0.0, 0.0, math.nan)}}, "line_forces[1]", "nan"),
    ],
)
def test_loads_refuse(changes, field, shown):
    with pytest.raises(LoadError) as caught:
        Loads(**changes)
    assert caught.value.field == field
    assert str(caught.value).startswith(f"{field}: expected ")
    assert shown in str(caught.value)
    assert len(str(caught.value).splitlines()) == 1


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"tube": -1}, "tube"),
        ({"tube": 1.0}, "tube"),
        ({"tube": True}, "tube"),
        ({"tube": "inner"}, "tube"),
        ({"X": -1e-3}, "X"),
        ({"X": math.nan}, "X"),
        ({"X": math.inf}, "X"),
        ({"X": "0.1"}, "X"),
        ({"X": True}, "X"),
        ({"force": (0.0, 0.0)}, "force"),
        ({"force": (0.0, 0.0, math.inf)}, "force"),
        ({"moment": (0.0, 0.0, 0.0, 0.0)}, "moment"),
        ({"moment": (0.0, 0.0, math.nan)}, "moment"),
    ],
)
def test_a_point_force_refuses(changes, field):
    with pytest.raises(LoadError) as caught:
        PointForce(**({"tube": 0, "X": 0.1} | changes))
    assert caught.value.field == field
    assert str(caught.value).startswith(f"{field}: expected ")


# --- on a robot -------------------------------------------------------------------------------------------------------

D = np.array([0.06, 0.12])


@pytest.mark.parametrize(
    "loads",
    [
        Loads(**EVERYTHING),
        Loads(point_forces=[PointForce(0, 0.06, (1, 0, 0)), PointForce(1, 0.2, (1, 0, 0))]),  # orifice and end
        Loads(point_forces=[PointForce(0, 0.06 - 9e-13), PointForce(1, 0.2 + 9e-13)]),
    ],
)
def test_loads_that_can_act(loads):
    check_loads(make_robot(), D, loads)


@pytest.mark.parametrize(
    ("loads", "field", "words"),
    [
        (Loads(point_forces=[PointForce(0, 0.1), PointForce(2, 0.1)]), "point_forces[1].tube",
         ["from 0 to 1", "outer, inner", "got 2"]),
        (Loads(line_forces={0: (0, 0, 1), 5: (0, 0, 1)}), "line_forces", ["from 0 to 1", "got 5"]),
        (Loads(point_forces=[PointForce(0, 0.1001)]), "point_forces[0].X", ["'outer'", "X <= 0.1 m", "got 0.1001"]),
        (Loads(point_forces=[PointForce(1, 0.2 + 3e-12)]), "point_forces[0].X", ["'inner'", "X <= 0.2 m"]),
        (Loads(point_forces=[PointForce(1, 0.1)]), "point_forces[0].X",
         ["'inner'", "D = 0.12 m", "got 0.1", "behind the orifice"]),
        (Loads(point_forces=[PointForce(0, 0.06 - 3e-12)]), "point_forces[0].X", ["'outer'", "D = 0.06 m"]),
    ],
)  # fmt: skip
def test_loads_that_cannot_act(loads, field, words):
    with pytest.raises(LoadError) as caught:
        check_loads(make_robot(), D, loads)
    assert caught.value.field == field
    message = str(caught.value)
    assert not [word for word in words if word not in message], message


GRAVITY = Loads(gravity=(0.0, 0.0, -9.81))


def test_gravity_needs_the_density_of_what_is_out():
    robot = make_robot()
    robot = replace(robot, tubes=(robot.tubes[0], replace(robot.tubes[1], density=None)))
    with pytest.raises(LoadError, match="'inner', which gravity acts on") as caught:
        check_loads(robot, D, GRAVITY)
    assert caught.value.field == "tubes[1].density"
    check_loads(robot, np.array([0.06, 0.2]), GRAVITY)  # the inner tube ends at the orifice
    check_loads(robot, D, Loads(tip_force=(1, 0, 0)))


def test_gravity_needs_the_diameters_of_what_is_out():
    bare = Tube("bare", (STRAIGHT, STRAIGHT), density=6450.0)
    with pytest.raises(LoadError, match="diameters of segment 0 of tube 'bare'"):
        check_loads(Robot("r", (bare,)), np.array([0.05]), GRAVITY)
    with pytest.raises(LoadError, match="diameters of segment 1 of tube 'bare'"):
        check_loads(Robot("r", (bare,)), np.array([0.1]), GRAVITY)
    known = replace(bare, segments=(STRAIGHT, replace(STRAIGHT, area=1e-6)))
    check_loads(Robot("r", (known,)), np.array([0.1]), GRAVITY)
    with pytest.raises(LoadError, match="diameters of segment 0 "):
        check_loads(Robot("r", (known,)), np.array([0.09]), GRAVITY)


# --- density and areas in a robot file --------------------------------------------------------------------------------

NITINOL = "youngs_modulus: 6e10\n    poissons_ratio: 0.3\n    inner_diameter: 1e-3\n    outer_diameter: 2e-3"
STIFF = "bending_stiffness: 1\n    torsional_stiffness: 1"


def test_density_is_read_from_the_file(tmp_path):
    (tube,) = load_text(tmp_path, one_tube(NITINOL + "\n    density: 6.45e3")).tubes
    assert tube.density == 6450.0
    assert tube.areas == pytest.approx([np.pi / 4 * 3e-6], rel=1e-14)
    assert load_text(tmp_path, one_tube(NITINOL)).tubes[0].density is None


@pytest.mark.parametrize("density", ["6.45", "0", "-6450", "6450000", ".nan", "heavy"])
def test_a_density_that_none_has_is_refused(tmp_path, density):
    with pytest.raises(RobotFileError) as caught:
        load_text(tmp_path, one_tube(f"{NITINOL}\n    density: {density}"))
    assert caught.value.field == "tubes[0].density"
    assert "kg/m^3" in str(caught.value)


def test_where_diameters_vary_each_segment_has_its_own_area(tmp_path):
    text = one_tube(NITINOL, "length: 0.1") + "      - {length: 0.1, outer_diameter: 3e-3}\n"
    (tube,) = load_text(tmp_path, text).tubes
    assert tube.areas == pytest.approx([np.pi / 4 * 3e-6, np.pi / 4 * 8e-6], rel=1e-14)


def test_a_segment_without_diameters_has_no_area_though_another_has(tmp_path):
    text = one_tube(STIFF, "length: 0.1") + "      - {length: 0.1, inner_diameter: 0, outer_diameter: 2e-3}\n"
    (tube,) = load_text(tmp_path, text).tubes
    assert tube.areas == (None, pytest.approx(np.pi * 1e-6, rel=1e-14))
    assert load_text(tmp_path, one_tube(STIFF)).tubes[0].areas == (None,)
