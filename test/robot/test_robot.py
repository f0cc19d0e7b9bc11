"""Robots built in Python: what the constructors take, derive and refuse."""

from __future__ import annotations

import math
import pickle
from dataclasses import FrozenInstanceError

import numpy as np
import pytest

from ctr_pvs.errors import RobotError
from ctr_pvs.robot.cross_section import annulus_stiffness
from ctr_pvs.robot.cross_section import shear_modulus_from_poisson
from ctr_pvs.robot.robot import Limits
from ctr_pvs.robot.robot import Robot
from ctr_pvs.robot.robot import Segment
from ctr_pvs.robot.robot import Tube

STRAIGHT = Segment(0.125, 0.05, 0.04)
ARC = Segment(0.025, 0.05, 0.04, (9.9,))


def make_robot(limits: Limits | None = None) -> Robot:
    """Two tubes, 0.15 m and 0.275 m long."""
    outer = Tube("outer", (STRAIGHT, ARC), 2.01e-3, 2.39e-3)
    inner = Tube("inner", (STRAIGHT, STRAIGHT, ARC), 0.0, 1.6e-3)
    return Robot("pair", (outer, inner), limits or Limits())


# --- segments ---------------------------------------------------------------------------------------------------------


def test_polynomial_pre_curvature_is_the_sum_of_its_terms():
    segment = Segment(0.2, 1.0, 1.0, (9.9, 3.0 - 20.0j, 500.0j))
    X = np.linspace(0.0, 0.2, 7)
    np.testing.assert_allclose(segment.pre_curvature(X), 9.9 + (3.0 - 20.0j) * X + 500.0j * X**2, rtol=1e-15)


def test_helical_pre_curvature_turns_at_constant_size():
    segment = Segment(0.2, 1.0, 1.0, (8.0,), turn=30.0)
    X = np.linspace(0.0, 0.2, 7)
    value = segment.pre_curvature(X)
    np.testing.assert_allclose(value.real, 8.0 * np.cos(30.0 * X), atol=1e-13)
    np.testing.assert_allclose(value.imag, 8.0 * np.sin(30.0 * X), atol=1e-13)


@pytest.mark.parametrize(
    ("curvature", "turn"),
    [((), 0.0), ((9.9,), 0.0), ((9.9,), -12.0), ((1.0 + 2.0j, -30.0j, 400.0, 5e3j), 0.0), ((1.0j, 60.0, 7e2), 25.0)],
)
def test_pre_curvature_rate_is_the_derivative(curvature, turn):
    segment = Segment(0.1, 1.0, 1.0, curvature, turn)
    X = np.linspace(0.01, 0.09, 9)
    h = 1e-4
    value = segment.pre_curvature
    five_point = (value(X - 2 * h) - 8 * value(X - h) + 8 * value(X + h) - value(X + 2 * h)) / (12 * h)
    np.testing.assert_allclose(segment.pre_curvature_rate(X), five_point, rtol=1e-9, atol=1e-8)


@pytest.mark.parametrize("segment", [STRAIGHT, ARC, Segment(0.1, 1.0, 1.0, (1.0, 2.0j), 3.0)])
@pytest.mark.parametrize("shape", [(), (0,), (4,), (2, 3)])
def test_pre_curvature_keeps_the_shape(segment, shape):
    X = np.full(shape, 0.02)
    for value in (segment.pre_curvature(X), segment.pre_curvature_rate(X)):
        assert np.shape(value) == shape
        assert value.dtype == np.complex128


@pytest.mark.parametrize(
    ("given", "kept"),
    [
        ((), ()),
        ([9.9], (9.9 + 0j,)),
        (np.array([1.0, 2.0j, 0.0, 0.0]), (1.0 + 0j, 2.0j)),
        ((0.0, 0.0), ()),
        ((0, 3), (0j, 3 + 0j)),
    ],
)
def test_coefficients_become_complex_and_lose_trailing_zeros(given, kept):
    segment = Segment(0.1, 1.0, 1.0, given)
    assert segment.curvature == kept
    assert all(type(coefficient) is complex for coefficient in segment.curvature)
    assert segment.is_straight == (kept == ())


@pytest.mark.parametrize(
    ("changes", "field", "shown"),
    [
        ({"length": 0.0}, "length", "0.0"),
        ({"length": -0.1}, "length", "-0.1"),
        ({"length": 93500.0}, "length", "93500"),
        ({"length": math.nan}, "length", "nan"),
        ({"length": math.inf}, "length", "inf"),
        ({"length": True}, "length", "True"),
        ({"length": "0.1"}, "length", "'0.1'"),
        ({"length": None}, "length", "None"),
        ({"length": 10**400}, "length", "1000"),
        ({"bending_stiffness": 0.0}, "bending_stiffness", "0.0"),
        ({"bending_stiffness": -1.0}, "bending_stiffness", "-1.0"),
        ({"bending_stiffness": 1e308}, "bending_stiffness", "1e+308"),
        ({"torsional_stiffness": 0.0}, "torsional_stiffness", "0.0"),
        ({"torsional_stiffness": math.nan}, "torsional_stiffness", "nan"),
        ({"turn": math.inf}, "turn", "inf"),
        ({"turn": 1j}, "turn", "1j"),
        ({"curvature": 9.9}, "curvature", "9.9"),
        ({"curvature": "9"}, "curvature[0]", "'9'"),
        ({"curvature": (9.9, None)}, "curvature[1]", "None"),
        ({"curvature": (True,)}, "curvature[0]", "True"),
        ({"curvature": (9.9, complex(0, math.nan))}, "curvature[1]", "nanj"),
        ({"curvature": (complex(1e308, 1e308),)}, "curvature[0]", "1e+308"),
        ({"curvature": (0.0, 0.0, 1e308)}, "curvature[2]", "1e+308"),
    ],
)
def test_a_segment_refuses(changes, field, shown):
    arguments = {"length": 0.1, "bending_stiffness": 0.05, "torsional_stiffness": 0.04} | changes
    with pytest.raises(RobotError) as caught:
        Segment(**arguments)
    assert caught.value.field == field
    assert str(caught.value).startswith(f"{field}: expected ")
    assert shown in str(caught.value)


# --- tubes ------------------------------------------------------------------------------------------------------------


def test_breaks_run_from_base_to_tip():
    tube = Tube("t", (Segment(93.5e-3, 1.0, 1.0), Segment(92.3e-3, 1.0, 1.0), Segment(0.1, 1.0, 1.0)))
    np.testing.assert_array_equal(tube.breaks, [0.0, 93.5e-3, 93.5e-3 + 92.3e-3, 93.5e-3 + 92.3e-3 + 0.1])
    assert tube.length == tube.breaks[-1]
    assert type(tube.length) is float


def test_breaks_cannot_be_changed():
    tube = Tube("t", (STRAIGHT,))
    with pytest.raises(ValueError, match="read-only"):
        tube.breaks[0] = 1.0


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"name": ""}, "name"),
        ({"name": "1st"}, "name"),
        ({"name": "my tube"}, "name"),
        ({"name": "tube\n"}, "name"),
        ({"name": "Röhre"}, "name"),
        ({"name": 3}, "name"),
        ({"segments": ()}, "segments"),
        ({"segments": STRAIGHT}, "segments"),
        ({"segments": (STRAIGHT, 0.1)}, "segments[1]"),
        ({"inner_diameter": None}, "inner_diameter"),
        ({"outer_diameter": None}, "outer_diameter"),
        ({"inner_diameter": -1e-3}, "inner_diameter"),
        ({"outer_diameter": 1e-3}, "outer_diameter"),  # the bore is 1 mm too
        ({"outer_diameter": 23.9}, "outer_diameter"),
        ({"outer_diameter": math.nan}, "outer_diameter"),
    ],
)
def test_a_tube_refuses(changes, field):
    arguments = {"name": "t", "segments": (STRAIGHT,), "inner_diameter": 1e-3, "outer_diameter": 2e-3} | changes
    with pytest.raises(RobotError) as caught:
        Tube(**arguments)
    assert caught.value.field == field


# --- stiffness --------------------------------------------------------------------------------------------------------


def test_annulus_stiffness_is_that_of_a_wire_less_its_bore():
    wire = np.array(annulus_stiffness(58e9, 21.5e9, 0.0, 2.39e-3))
    bore = np.array(annulus_stiffness(58e9, 21.5e9, 0.0, 2.01e-3))
    np.testing.assert_allclose(annulus_stiffness(58e9, 21.5e9, 2.01e-3, 2.39e-3), wire - bore, rtol=1e-14)
    # a wire of radius r: I = pi r^4 / 4, J = pi r^4 / 2
    radius = 1.195e-3
    np.testing.assert_allclose(wire, [58e9 * math.pi * radius**4 / 4, 21.5e9 * math.pi * radius**4 / 2], rtol=1e-14)


def test_incompressible_material_has_a_third_of_its_youngs_modulus_in_shear():
    assert shear_modulus_from_poisson(60e9, 0.5) == pytest.approx(20e9, rel=1e-15)


# --- robots -----------------------------------------------------------------------------------------------------------


def test_a_robot_is_a_value():
    robot = make_robot()
    assert robot == make_robot()
    assert hash(robot) == hash(make_robot())
    assert pickle.loads(pickle.dumps(robot)) == robot
    with pytest.raises(FrozenInstanceError):
        robot.name = "other"


def test_lists_are_taken_and_kept_as_tuples():
    robot = Robot("r", [Tube("t", [STRAIGHT])])
    assert robot == Robot("r", (Tube("t", (STRAIGHT,)),))
    assert robot.n_tubes == 1


def test_limits_are_completed_to_one_entry_per_tube():
    assert make_robot().limits == Limits((None, None), (None, None))
    assert make_robot(Limits(D=[[0, 0.1], None])).limits == Limits((None, None), ((0.0, 0.1), None))


WIDE = Tube("wide", (STRAIGHT,), 3e-3, 4e-3)
NARROW = Tube("narrow", (STRAIGHT,), 0.0, 1e-3)
UNKNOWN = Tube("unknown", (STRAIGHT,))


@pytest.mark.parametrize("tubes", [(WIDE, NARROW), (WIDE, UNKNOWN, NARROW), (UNKNOWN, WIDE)])
def test_tubes_that_fit(tubes):
    assert Robot("r", tubes).n_tubes == len(tubes)


@pytest.mark.parametrize(
    ("arguments", "field"),
    [
        ({"name": ""}, "name"),
        ({"name": "two\nlines"}, "name"),
        ({"name": 7}, "name"),
        ({"tubes": ()}, "tubes"),
        ({"tubes": WIDE}, "tubes"),
        ({"tubes": (WIDE, STRAIGHT)}, "tubes[1]"),
        ({"tubes": (WIDE, NARROW, Tube("wide", (STRAIGHT,)))}, "tubes[2].name"),
        ({"tubes": (NARROW, WIDE)}, "tubes[1].outer_diameter"),
        ({"tubes": (NARROW, UNKNOWN, WIDE)}, "tubes[2].outer_diameter"),  # no bore in between to hide behind
        ({"limits": None}, "limits"),
        ({"limits": Limits(alpha=((0.0, 1.0),))}, "limits.alpha"),
        ({"limits": Limits(alpha=((1.0, 0.0), None))}, "limits.alpha.wide"),
        ({"limits": Limits(alpha=(None, (0.0, math.inf)))}, "limits.alpha.narrow[1]"),
        ({"limits": Limits(alpha=(None, (-1e7, 0.0)))}, "limits.alpha.narrow[0]"),
        ({"limits": Limits(D=(None, 0.1))}, "limits.D.narrow"),
        ({"limits": Limits(D=(None, (0.0, 0.1, 0.2)))}, "limits.D.narrow"),
        ({"limits": Limits(D=(None, (0.13, 0.2)))}, "limits.D.narrow"),  # the tube is 0.125 m long
        ({"limits": Limits(D=(None, (-0.2, -0.1)))}, "limits.D.narrow"),
        ({"limits": Limits(D=((0.06, 0.1), (0.0, 0.05)))}, "limits.D.narrow"),  # order leaves nothing
    ],
)
def test_a_robot_refuses(arguments, field):
    with pytest.raises(RobotError) as caught:
        Robot(**({"name": "r", "tubes": (WIDE, NARROW)} | arguments))
    assert caught.value.field == field


def test_order_can_leave_no_command_because_a_tube_is_short():
    short = Tube("short", (Segment(0.05, 1.0, 1.0),))
    with pytest.raises(RobotError, match=r"limits\.D\.short: .* at least 0\.06 m") as caught:
        Robot("r", (WIDE, short), Limits(D=((0.06, 0.1), None)))
    assert caught.value.limit.endswith("where the limits of tube 'wide' start")
