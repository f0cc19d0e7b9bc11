"""Poses: what of them counts, what is refused, and the one step that each is worth."""

import math
import time

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ctr_pvs import EquilibriumSolver
from ctr_pvs import NoEquilibriumError
from ctr_pvs_ros.inputs.commands import Command
from ctr_pvs_ros.inputs.poses import GOALS
from ctr_pvs_ros.inputs.poses import PoseReason
from ctr_pvs_ros.inputs.poses import RejectedPose
from ctr_pvs_ros.inputs.poses import read_pose
from ctr_pvs_ros.stream import Stream
from ctr_pvs_ros.tip_servo import LONGEST_PERIOD
from ctr_pvs_ros.tip_servo import TipServo

PLACE = (0.1, 0.02, -0.03)
TURNED = (0.0, 0.0, math.sin(0.3), math.cos(0.3))  # about z, by 0.6 rad


@pytest.fixture
def try_out(seed_robot):
    stream = Stream(EquilibriumSolver(seed_robot))
    return lambda alpha, D: stream.try_out(Command(alpha, D), 1.0)


def joints(tried):
    return tried.command.alpha, tried.command.D


@pytest.fixture
def answer(seed_robot):
    answer = EquilibriumSolver(seed_robot).solve([0.0, 1.0], [0.09, 0.17])  # on no kink
    assert answer.success
    return answer


def test_what_counts_of_a_pose():
    goal = read_pose("", PLACE, (math.nan,) * 4, "base", "position")
    assert goal.position.tolist() == list(PLACE) and goal.orientation is None
    goal = read_pose("base", PLACE, TURNED, "base", "tangent")
    assert goal.orientation == pytest.approx(TURNED) and not goal.whole
    goal = read_pose("base", PLACE, TURNED, "base", "orientation")
    assert goal.orientation == pytest.approx(TURNED) and goal.whole


@pytest.mark.parametrize(
    ("frame", "position", "orientation", "goal", "reason"),
    [
        ("world", PLACE, TURNED, "position", PoseReason.UNKNOWN_FRAME),
        ("", (0.1, math.nan, 0.0), TURNED, "position", PoseReason.NON_FINITE),
        ("", (0.1, math.inf, 0.0), TURNED, "orientation", PoseReason.NON_FINITE),
        ("", (100.0, 0.0, 0.0), TURNED, "position", PoseReason.OUT_OF_LIMITS),
        ("", PLACE, (0.0, 0.0, 0.0, 0.0), "tangent", PoseReason.OUT_OF_LIMITS),
        ("", PLACE, (0.0, 0.0, 0.0, math.nan), "tangent", PoseReason.NON_FINITE),
        ("", PLACE, (1.0, 0.0, 0.0, 1.0), "orientation", PoseReason.OUT_OF_LIMITS),
    ],
)
def test_a_bad_pose_is_refused_with_the_reason(frame, position, orientation, goal, reason):
    with pytest.raises(RejectedPose) as caught:
        read_pose(frame, position, orientation, "base", goal)
    assert caught.value.reason is reason and "expected" in str(caught.value)


def test_a_step_leads_there(seed_robot, answer, try_out):
    """From 0.1 mm away to within the square of that over the size of the robot."""
    servo = TipServo(seed_robot, 0.0, 0.0)
    for way in np.eye(3):
        goal = read_pose("", tuple(answer.tip.position + 1e-4 * way), TURNED, "base", "position")
        assert goal.distance(servo.step(answer, goal, try_out).equilibrium) < 1e-6


def test_a_tangent_is_the_x_axis_and_draws_near(seed_robot, answer, try_out):
    """Another roll is no other goal; another tangent is."""
    x, y, z, w = answer.tip.orientation

    rolled = Rotation.from_quat([x, y, z, w]) * Rotation.from_rotvec([0.3, 0.0, 0.0])  # about its own x axis
    servo = TipServo(seed_robot, 0.0, 0.0)
    at = read_pose("", tuple(answer.tip.position), tuple(rolled.as_quat()), "base", "tangent")
    assert joints(servo.step(answer, at, try_out))[0] == pytest.approx(answer.alpha, abs=1e-8)
    bent = Rotation.from_rotvec([0.0, 0.02, 0.0]) * Rotation.from_quat([x, y, z, w])
    goal = read_pose("", tuple(answer.tip.position), tuple(bent.as_quat()), "base", "tangent")
    there = servo.step(answer, goal, try_out).equilibrium

    def off(tip):
        return np.linalg.norm(Rotation.from_quat(tip.orientation).apply([1.0, 0.0, 0.0]) - bent.apply([1.0, 0.0, 0.0]))

    assert off(there.tip) < off(answer.tip)


@pytest.mark.parametrize("goal", GOALS)
def test_where_the_tip_is_it_stays(seed_robot, answer, goal, try_out):
    tip = answer.tip
    at = read_pose("", tuple(tip.position), tuple(tip.orientation), "base", goal)
    alpha, D = joints(TipServo(seed_robot, 0.0, 0.0).step(answer, at, try_out))
    assert alpha == pytest.approx(answer.alpha, abs=1e-9) and pytest.approx(answer.D, abs=1e-10) == D


def test_rates_bound_a_step_and_keep_its_direction(seed_robot, answer, try_out):
    far = read_pose("", tuple(answer.tip.position + np.array([0.0, 0.01, 0.01])), TURNED, "base", "position")
    free = joints(TipServo(seed_robot, 0.0, 0.0).step(answer, far, try_out))
    servo = TipServo(seed_robot, 0.5, 0.01)
    bound = joints(servo.step(answer, far, try_out))
    turns, slides = bound[0] - answer.alpha, bound[1] - answer.D
    assert np.abs(turns).max() <= 0.5 * LONGEST_PERIOD * (1.0 + 1e-9)
    assert np.abs(slides).max() <= 0.01 * LONGEST_PERIOD * (1.0 + 1e-9)
    share = turns / (free[0] - answer.alpha)
    assert share == pytest.approx(share[0]) and 0.0 < share[0] < 1.0
    time.sleep(0.01)  # since the last pose
    soon = joints(servo.step(answer, far, try_out))
    assert np.abs(soon[0] - answer.alpha).max() < np.abs(turns).max()


def test_one_solve_is_enough_for_a_step_that_leads_nearer(seed_robot, answer, try_out):
    tried = []

    def counted(alpha, D):
        tried.append(try_out(alpha, D))
        return tried[-1]

    goal = read_pose("", tuple(answer.tip.position + np.array([0.0, 1e-4, 0.0])), TURNED, "base", "position")
    step = TipServo(seed_robot, 0.0, 0.0).step(answer, goal, counted)
    assert tried == [step]


def test_a_state_without_rates_is_refused(seed_robot, answer, try_out):
    class WithoutRates:
        tip, alpha, D = answer.tip, answer.alpha, answer.D

        @property
        def jacobian(self):
            raise NoEquilibriumError("an unstable equilibrium has no rates")

    goal = read_pose("", PLACE, TURNED, "base", "position")
    with pytest.raises(RejectedPose, match=r"no rates.*servo_jp") as caught:
        TipServo(seed_robot, 0.0, 0.0).step(WithoutRates(), goal, try_out)
    assert caught.value.reason is PoseReason.NO_RATES


def test_a_step_keeps_to_limits_and_order(seed_robot, answer, try_out):
    """A tip that should be ahead of all tubes presses them in as far as they go."""
    servo = TipServo(seed_robot, 0.0, 0.0)
    goal = read_pose("", (5.0, 0.0, 0.0), TURNED, "base", "position")
    alpha, D = joints(servo.step(answer, goal, try_out))
    seed_robot.check_command(alpha, D)
    assert D[1] < answer.D[1]
