"""Which commands a robot takes: checked, refused, or moved into bounds where that is asked for."""

from __future__ import annotations

import copy
import math
import pickle

import numpy as np
import pytest

from ctr_pvs.errors import CommandError
from ctr_pvs.robot.robot import Limits
from ctr_pvs.robot.robot import Robot
from ctr_pvs.robot.robot import Segment
from ctr_pvs.robot.robot import Tube


def make_robot(limits: Limits | None = None) -> Robot:
    """Two tubes, 0.15 m and 0.275 m long."""
    tubes = (Tube("outer", (Segment(0.15, 0.05, 0.04),)), Tube("inner", (Segment(0.275, 0.05, 0.04),)))
    return Robot("pair", tubes, limits or Limits())


@pytest.mark.parametrize("kind", [list, tuple, np.array])
def test_a_good_command_comes_back_as_it_is(kind):
    alpha, D = make_robot().check_command(kind([-280, 1]), kind([0.0, 0.275]))
    assert alpha.dtype == D.dtype == np.float64
    np.testing.assert_array_equal(alpha, [-280.0, 1.0])
    np.testing.assert_array_equal(D, [0.0, 0.275])


def test_a_checked_command_is_a_copy():
    asked = np.array([0.1, 0.2])
    alpha, D = make_robot().check_command(asked, asked)
    alpha[:], D[:] = 7.0, 8.0
    np.testing.assert_array_equal(asked, [0.1, 0.2])


@pytest.mark.parametrize(
    ("asked", "given"),
    [
        ([-5e-13, 0.1], [0.0, 0.1]),
        ([0.15 + 5e-13, 0.2], [0.15, 0.2]),
        ([0.1 + 5e-13, 0.1], [0.1 + 5e-13, 0.1 + 5e-13]),
        ([0.05, 0.275 + 5e-13], [0.05, 0.275]),
        ([0.15 + 9e-13, 0.15], [0.15, 0.15]),
    ],
)
def test_rounding_errors_in_D_are_absorbed(asked, given):
    robot = make_robot()
    _, D = robot.check_command([0.0, 0.0], asked)
    np.testing.assert_array_equal(D, given)
    assert 0.0 <= D[0] <= D[1] <= robot.tubes[1].length
    assert D[0] <= robot.tubes[0].length


LIMITED = Limits(alpha=((-3.0, 3.0), None), D=(None, (0.02, 0.2)))


@pytest.mark.parametrize(
    ("alpha", "D", "field", "words"),
    [
        ([0.0], [0.0, 0.1], "alpha", ["2 real numbers", "[0.0]"]),
        ([0.0, 0.0, 0.0], [0.0, 0.1], "alpha", ["2 real numbers"]),
        ([], [0.0, 0.1], "alpha", ["2 real numbers"]),
        (0.0, [0.0, 0.1], "alpha", ["2 real numbers"]),
        ([[0.0, 0.0]], [0.0, 0.1], "alpha", ["2 real numbers"]),
        ([[0.0], [0.0, 1.0]], [0.0, 0.1], "alpha", ["2 real numbers"]),
        ([0.0, None], [0.0, 0.1], "alpha", ["2 real numbers", "None"]),
        (["0", "1"], [0.0, 0.1], "alpha", ["2 real numbers", "'0'"]),
        ([True, False], [0.0, 0.1], "alpha", ["2 real numbers", "True"]),
        ([0.0, 1j], [0.0, 0.1], "alpha", ["2 real numbers", "1j"]),
        ([0.0, 10**400], [0.0, 0.1], "alpha", ["2 real numbers"]),
        ([0.0, math.nan], [0.0, 0.1], "alpha[1]", ["finite", "'inner'", "nan"]),
        ([-math.inf, 0.0], [0.0, 0.1], "alpha[0]", ["finite", "'outer'", "-inf"]),
        ([0.0, 1e308], [0.0, 0.1], "alpha[1]", ["<= 1000000 rad", "'inner'", "1e+308"]),
        ([3.1, 0.0], [0.0, 0.1], "alpha[0]", ["-3 <= alpha <= 3 rad", "limits", "3.1"]),
        ([0.0, 0.0], [0.0], "D", ["2 real numbers"]),
        ([0.0, 0.0], [math.nan, 0.1], "D[0]", ["finite", "'outer'", "nan"]),
        ([0.0, 0.0], [-0.01, 0.1], "D[0]", ["0 <= D <= 0.15 m", "'outer'", "-0.01"]),
        ([0.0, 0.0], [0.151, 0.16], "D[0]", ["0 <= D <= 0.15 m", "'outer'", "0.151"]),
        ([0.0, 0.0], [0.1, 208.5], "D[1]", ["0 <= D <= 0.275 m", "metres", "208.5"]),
        ([0.0, 0.0], [0.1, 1e308], "D[1]", ["0 <= D <= 0.275 m", "1e+308"]),
        ([0.0, 0.0], [0.1, 0.21], "D[1]", ["0.02 <= D <= 0.2 m", "limits", "0.21"]),
        ([0.0, 0.0], [0.0, 0.01], "D[1]", ["0.02 <= D <= 0.2 m", "limits", "0.01"]),
        ([0.0, 0.0], [0.1, 0.09], "D[1]", ["D >= 0.1 m", "'outer'", "0.09"]),
        ([0.0, 0.0], [0.1, 0.1 - 1e-11], "D[1]", ["D >= 0.1 m"]),
    ],
)
def test_a_bad_command_is_refused(alpha, D, field, words):
    with pytest.raises(CommandError) as caught:
        make_robot(LIMITED).check_command(alpha, D)
    error = caught.value
    message = str(error)
    assert error.field == field
    assert message.startswith(f"{field}: expected {error.limit}, got ")
    assert all(word in message for word in words), message
    assert len(message.splitlines()) == 1


def test_an_error_survives_copying_and_pickling():
    with pytest.raises(CommandError) as caught:
        make_robot().check_command([0.0, 0.0], [0.1, 0.09])
    for twin in (copy.copy(caught.value), pickle.loads(pickle.dumps(caught.value))):
        assert (twin.field, twin.value, str(twin)) == ("D[1]", 0.09, str(caught.value))


@pytest.mark.parametrize(
    ("alpha", "D", "given_alpha", "given_D", "moved"),
    [
        ([1.0, 9.0], [0.0, 0.1], [1.0, 9.0], [0.0, 0.1], []),
        ([9.0, 0.0], [0.0, 0.1], [3.0, 0.0], [0.0, 0.1], ["alpha[0]"]),
        ([0.0, -1e300], [0.0, 0.1], [0.0, -1e6], [0.0, 0.1], ["alpha[1]"]),
        ([0.0, 0.0], [-1.0, 1e300], [0.0, 0.0], [0.0, 0.2], ["D[0]", "D[1]"]),
        ([0.0, 0.0], [0.12, 0.05], [0.0, 0.0], [0.12, 0.12], ["D[1]"]),
        ([0.0, 0.0], [1.0, 0.0], [0.0, 0.0], [0.15, 0.15], ["D[0]", "D[1]"]),
        ([0.0, 0.0], [-5e-13, 0.1], [0.0, 0.0], [0.0, 0.1], []),  # rounding is not worth a note
    ],
)
def test_clamping_moves_a_command_into_bounds_and_says_so(alpha, D, given_alpha, given_D, moved):
    robot = make_robot(LIMITED)
    clamped_alpha, clamped_D, notes = robot.clamp_command(alpha, D)
    np.testing.assert_array_equal(clamped_alpha, given_alpha)
    np.testing.assert_array_equal(clamped_D, given_D)
    assert [note.split(" ")[0] for note in notes] == moved
    robot.check_command(clamped_alpha, clamped_D)


def test_clamping_keeps_to_limits_that_order_tightens():
    """Each limit alone would let a tube where its neighbour cannot follow."""
    tubes = tuple(Tube(name, (Segment(0.3, 1.0, 1.0),)) for name in "abc")
    robot = Robot("r", tubes, Limits(D=((0.0, 0.3), (0.1, 0.2), (0.0, 0.3))))
    rng = np.random.default_rng(1)
    for asked in rng.uniform(-0.1, 0.4, (200, 3)):
        alpha, D, _ = robot.clamp_command(np.zeros(3), asked)
        np.testing.assert_array_equal(robot.check_command(alpha, D)[1], D)


@pytest.mark.parametrize(("alpha", "D"), [([0.0], [0.0, 0.1]), ([0.0, math.nan], [0.0, 0.1]), ([0.0, 0.0], [0.0, "a"])])
def test_clamping_does_not_mend_what_is_no_command(alpha, D):
    with pytest.raises(CommandError):
        make_robot().clamp_command(alpha, D)
