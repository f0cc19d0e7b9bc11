"""Which wrenches are taken, in which frame, and what becomes of them in base axes."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ctr_pvs_ros.inputs.wrenches import LARGEST_FORCE
from ctr_pvs_ros.inputs.wrenches import LARGEST_MOMENT
from ctr_pvs_ros.inputs.wrenches import RejectedWrench
from ctr_pvs_ros.inputs.wrenches import WrenchReader
from ctr_pvs_ros.inputs.wrenches import WrenchReason

READER = WrenchReader("ctr_base", "ctr_tip")
FORCE, MOMENT = (0.1, -0.2, 0.3), (1e-3, 2e-3, -3e-3)
ZERO = (0.0, 0.0, 0.0)


def some_orientation(seed):
    return Rotation.random(random_state=seed).as_quat()


@pytest.mark.parametrize("frame", ["ctr_base", ""])
def test_base_axes_are_taken_as_they_are_also_without_a_frame(frame):
    wrench = READER.read(frame, FORCE, MOMENT)
    for orientation in (None, some_orientation(0)):
        loads = wrench.loads(orientation)
        assert (loads.tip_force, loads.tip_moment) == (FORCE, MOMENT)


@pytest.mark.parametrize("seed", range(5))
def test_the_tips_axes_are_turned_as_its_pose_says(seed):
    orientation = some_orientation(seed)
    loads = READER.read("ctr_tip", FORCE, MOMENT).loads(orientation)
    turn = Rotation.from_quat(orientation)
    assert loads.tip_force == pytest.approx(turn.apply(FORCE), abs=1e-15)
    assert loads.tip_moment == pytest.approx(turn.apply(MOMENT), abs=1e-15)


def test_in_the_tips_axes_x_is_the_tangent():
    quarter = Rotation.from_euler("z", 90.0, degrees=True)
    loads = READER.read("ctr_tip", (2.0, 0.0, 0.0), ZERO).loads(quarter.as_quat())
    assert loads.tip_force == pytest.approx((0.0, 2.0, 0.0), abs=1e-15)


def test_the_tips_axes_mean_nothing_without_a_tip():
    assert READER.read("ctr_tip", FORCE, MOMENT).loads(None) is None


@pytest.mark.parametrize("frame", ["world", "/ctr_base", "CTR_TIP", "ctr_base ", "x" * 100_000])
def test_another_frame_is_refused_with_the_two_that_are_known(frame):
    with pytest.raises(RejectedWrench) as caught:
        READER.read(frame, FORCE, MOMENT)
    assert caught.value.reason is WrenchReason.UNKNOWN_FRAME
    assert "'ctr_base'" in str(caught.value) and "'ctr_tip'" in str(caught.value)
    assert repr(frame[:40]) in str(caught.value) and len(str(caught.value)) < 200


@pytest.mark.parametrize("frame", ["ctr_base", "ctr_tip"])
@pytest.mark.parametrize("place", range(6))
@pytest.mark.parametrize(
    ("value", "reason"),
    [
        (math.nan, WrenchReason.NON_FINITE),
        (math.inf, WrenchReason.NON_FINITE),
        (-math.inf, WrenchReason.NON_FINITE),
        (1.1 * LARGEST_FORCE, WrenchReason.OUT_OF_LIMITS),
        (-1e308, WrenchReason.OUT_OF_LIMITS),
    ],
)
def test_what_no_solver_could_take_is_refused(frame, place, value, reason):
    numbers = [*FORCE, *MOMENT]
    numbers[place] = value
    with pytest.raises(RejectedWrench) as caught:
        READER.read(frame, tuple(numbers[:3]), tuple(numbers[3:]))
    assert caught.value.reason is reason
    assert ("force" if place < 3 else "torque") in str(caught.value)
    assert str(value) in str(caught.value)


@pytest.mark.parametrize("turn", [[0.6, 0.0, 0.8], [0.0, -1.0, 0.0], [-0.48, 0.64, 0.6]])
def test_limits_are_those_of_the_length_whatever_the_axes(turn):
    force, moment = (
        tuple((most * (1.0 - 1e-12) * np.array(turn)).tolist()) for most in (LARGEST_FORCE, LARGEST_MOMENT)
    )
    loads = READER.read("ctr_tip", force, moment).loads(some_orientation(1))
    assert math.hypot(*loads.tip_force) == pytest.approx(LARGEST_FORCE, rel=1e-9)
    for more in ((tuple(1.01 * f for f in force), moment), (force, tuple(1.01 * m for m in moment))):
        with pytest.raises(RejectedWrench):
            READER.read("ctr_tip", *more)
