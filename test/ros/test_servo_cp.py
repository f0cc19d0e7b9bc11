"""servo_cp: the tip goes where poses ask it to, and both kinds of command go on from one another."""

import math
from itertools import pairwise

import numpy as np
import pytest
from geometry_msgs.msg import PoseStamped
from sensor_msgs.msg import JointState

from ctr_pvs import EquilibriumSolver
from ctr_pvs import load_robot
from ctr_pvs_interfaces.msg import EquilibriumStatus
from ctr_pvs_ros.process import share_file
from ros.load import EVERY_ANSWER
from ros.load import JOINTS
from ros.load import joint_state
from ros.load import stamp_of

START = [0.0, 0.09, 1.0, 0.17]
OTHER = [0.4, 0.1, 1.1, 0.18]
ON_A_KINK = [0.0, 0.0935, 1.0, 0.1705]  # a segment of the outer tube ends on the orifice
COUNT, RADIUS = 100, 0.002  # poses on a circle of so many metres
TIMEOUT = 10.0


class Tip:
    """Sends poses, and has the status of each."""

    def __init__(self, peer):
        self.peer = peer
        self.statuses = {}
        name = f"{peer.namespace}/ctr_equilibrium/status"
        peer.ros.create_subscription(EquilibriumStatus, name, self._keep, EVERY_ANSWER)
        self._poses = peer.ros.create_publisher(PoseStamped, f"{peer.namespace}/servo_cp", 1)
        peer.wait(lambda: self._poses.get_subscription_count() > 0, "node")
        self._stamp = 0

    def _keep(self, status):
        self.statuses[stamp_of(status)] = status

    def to(self, position, frame="", orientation=(0.0, 0.0, 0.0, 1.0)):
        """The status of a pose."""
        self._stamp += 1
        message = PoseStamped()
        message.header.stamp.nanosec, message.header.frame_id = self._stamp, frame
        place, turn = message.pose.position, message.pose.orientation
        place.x, place.y, place.z = map(float, position)
        turn.x, turn.y, turn.z, turn.w = map(float, orientation)
        self._poses.publish(message)
        return self._status()

    def joints_to(self, positions):
        """The status of a command."""
        self._stamp += 1
        self.peer.send(joint_state(JOINTS, positions, self._stamp))
        return self._status()

    def _status(self):
        self.peer.wait(lambda: self._stamp in self.statuses, "status", TIMEOUT)
        return self.statuses[self._stamp]


@pytest.fixture(scope="module")
def tip(start_node):
    return Tip(start_node("/tip"))


def ways_in():
    """Rotations against each other and bases of two tubes: alpha, D (M, 2)."""
    turns, outer, inner = np.meshgrid(np.linspace(0.0, np.pi, 9), np.linspace(0, 0.18, 7), np.linspace(0, 0.3, 9))
    turn, first, second = turns.ravel(), outer.ravel(), inner.ravel()
    good = first <= second
    return np.stack([0.0 * turn, turn], axis=1)[good], np.stack([first, second], axis=1)[good]


def where(tip):
    """The tip of the last answer [m], asked for as a late joiner does."""
    tips = tip.peer.subscribe(PoseStamped, "setpoint_cp")
    tip.peer.wait(lambda: bool(tips), "tip")
    place = tips[-1].pose.position
    return np.array([place.x, place.y, place.z])


def joints(tip):
    """Of the last answer."""
    told = tip.peer.subscribe(JointState, "setpoint_js")
    tip.peer.wait(lambda: bool(told), "joints")
    return np.array(told[-1].position)


def tip_orientation(tip):
    """Of the last answer."""
    tips = tip.peer.subscribe(PoseStamped, "setpoint_cp")
    tip.peer.wait(lambda: bool(tips), "tip")
    turn = tips[-1].pose.orientation
    return turn.x, turn.y, turn.z, turn.w


def test_before_the_first_answer_a_pose_is_refused(tip):
    status = tip.to([0.1, 0.0, 0.0])
    assert (status.trigger, status.outcome, status.reason) == (
        EquilibriumStatus.POSE,
        EquilibriumStatus.REFUSED,
        "no_start",
    )


def test_a_circle_is_followed(tip):
    tip.joints_to(START)
    centre = where(tip)
    errors = []
    for count in range(COUNT):
        angle = 2.0 * math.pi * count / COUNT
        status = tip.to(centre + RADIUS * np.array([0.0, math.cos(angle) - 1.0, math.sin(angle)]))
        assert (status.trigger, status.outcome) == (EquilibriumStatus.POSE, EquilibriumStatus.ACCEPTED)
        errors.append(status.tip_distance)
    assert max(errors) < 1e-5
    assert np.linalg.norm(where(tip) - centre) < 3.0 * RADIUS


def test_from_a_kink_the_second_pose_is_met(tip):
    """There rates hold for one direction of a translation only, so that the first step may miss."""
    tip.joints_to(ON_A_KINK)
    for way in np.eye(3):
        goal = where(tip) + 1e-4 * way
        assert tip.to(goal).tip_distance < 1e-3
        assert tip.to(goal).tip_distance < 1e-5


def test_switching_does_not_jump(tip):
    """A pose at the tip after a command leaves the joints where they are, and so does the other order."""
    tip.joints_to(START)
    there = where(tip)
    assert tip.to(there).tip_distance < 1e-9
    assert np.linalg.norm(where(tip) - there) < 1e-9
    moved = there + np.array([0.0, 1e-3, 0.0])
    for _ in range(3):
        status = tip.to(moved)
    assert status.tip_distance < 1e-6
    status = tip.joints_to(START)
    assert status.outcome == EquilibriumStatus.ACCEPTED and math.isnan(status.tip_distance)
    assert np.linalg.norm(where(tip) - there) < 1e-6


@pytest.mark.parametrize("moved", [0.0, 1e-4])
def test_each_input_goes_on_from_where_the_other_has_led(tip, moved):
    """Of the many commands for a place, poses choose the one near the last answer, not near their own last one."""
    tip.joints_to(START)
    there = where(tip)
    for share in np.linspace(0.0, 1.0, 40):  # poses lead far away, by other joints than the command that comes then
        tip.to(there + share * np.array([-0.02, 0.01, 0.01]))
    astray = joints(tip)
    tip.joints_to(OTHER)
    status = tip.to(where(tip) + moved * np.array([0.0, 1.0, 0.0]))
    assert status.outcome == EquilibriumStatus.ACCEPTED
    step = np.abs(joints(tip) - OTHER)
    assert step[0::2].max() < 0.1 and step[1::2].max() < 2e-3
    assert np.abs(astray - OTHER)[0::2].max() > 0.2 or np.abs(astray - OTHER)[1::2].max() > 4e-3
    on = joints(tip)
    tip.joints_to(on)  # and a command for where poses have led moves nothing
    assert np.array_equal(joints(tip), on)


def check_refused(tip, bad):
    tip.joints_to(START)
    there, stand = where(tip), joints(tip)
    for position, frame, orientation, reason in bad:
        status = tip.to(position, frame, orientation)
        assert (status.outcome, status.reason) == (EquilibriumStatus.REFUSED, reason)
        assert math.isnan(status.tip_distance)
    assert np.array_equal(where(tip), there) and np.array_equal(joints(tip), stand)
    assert tip.to(there, "ctr_base", tip_orientation(tip)).tip_distance < 1e-9  # the next good one is answered


def test_bad_poses_change_nothing(tip):
    good, plain = [0.1, 0.0, 0.0], (0.0, 0.0, 0.0, 1.0)
    check_refused(
        tip,
        [
            ([0.1, math.nan, 0.0], "", plain, "non_finite"),
            ([-math.inf, 0.0, 0.0], "", plain, "non_finite"),
            (good, "world", plain, "unknown_frame"),
            ([99.0, 0.0, 0.0], "", plain, "out_of_limits"),
            ([1e300, 1e300, 0.0], "", plain, "out_of_limits"),
        ],
    )
    assert tip.to(where(tip), "", (0.0,) * 4).outcome == EquilibriumStatus.ACCEPTED  # no orientation is asked for


@pytest.mark.parametrize("goal", ["tangent", "orientation"])
def test_bad_orientations_change_nothing_where_they_count(tip, goal):
    assert tip.peer.set_parameter("servo_cp_goal", goal).successful
    try:
        check_refused(
            tip,
            [
                ([0.1, 0.0, 0.0], "", (0.0,) * 4, "out_of_limits"),
                ([0.1, 0.0, 0.0], "", (0.0, 0.0, 0.0, 2.0), "out_of_limits"),
                ([0.1, 0.0, 0.0], "", (1e300, 0.0, 0.0, 1e300), "out_of_limits"),
                ([0.1, 0.0, 0.0], "", (0.0, math.nan, 0.0, 1.0), "non_finite"),
            ],
        )
    finally:
        assert tip.peer.set_parameter("servo_cp_goal", "position").successful


def test_out_of_reach_the_tip_comes_as_near_as_it_can(tip):
    tip.joints_to(START)
    far = np.array([0.5, 0.0, 0.0])
    distances = [tip.to(far).tip_distance for _ in range(40)]
    assert all(b <= a + 1e-12 for a, b in pairwise(distances))
    # All tubes in, and straight but for their own curvature: no command comes nearer than a coarse grid of them does.
    solver = EquilibriumSolver(load_robot(share_file("config", "renda2021.yaml")))
    grid = solver.solve_batch(*ways_in())
    assert distances[-1] < 1.02 * np.linalg.norm(grid.tip_position[grid.success] - far, axis=1).min()


def test_rates_bound_the_way(tip):
    tip.joints_to(START)
    there = where(tip)
    assert tip.peer.set_parameter("translation_rate", 0.001).successful
    assert tip.peer.set_parameter("rotation_rate", 0.01).successful
    status = tip.to(there + np.array([0.0, 5e-3, 5e-3]))
    assert status.outcome == EquilibriumStatus.ACCEPTED
    assert 0.0 < np.linalg.norm(where(tip) - there) < 5e-4
    for name in ("translation_rate", "rotation_rate"):
        assert tip.peer.set_parameter(name, 0.0).successful
