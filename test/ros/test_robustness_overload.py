"""Ten times more commands than the node can solve: the newest wins, and no answer is older than it must be."""

import math
import time

import pytest
from geometry_msgs.msg import PoseStamped

from ctr_pvs_interfaces.msg import EquilibriumStatus
from ros.load import EVERY_ANSWER
from ros.load import JOINTS
from ros.load import NEAR
from ros.load import Load
from ros.load import faults_in
from ros.load import joint_state
from ros.load import stamp_of

pytestmark = pytest.mark.alone

POSE_RATE = 2000.0  # Hz
RADIUS, REVOLUTION = 2e-3, 1.0  # of a circle [m], and the time it takes [s]
BEGIN, FIRST = [0.0, 0.09, 1.0, 0.17], 1_000_000  # a command, and its stamp; later than those of other tests [ns]
TURN = 30.0  # rad, each way
FACTOR = 10  # commands per solve
PROBES = 20  # commands in lock step that tell how long one takes
SECONDS = 1.5
SLACK = 0.05  # s, for the way there and back and a busy machine; a queue would add seconds
POSES = 1000  # of a backbone; a much larger message overflows the buffers of the loopback and waits for a resend


@pytest.fixture(scope="module")
def peer(start_node):
    return start_node("/overloaded", backbone_poses=str(POSES))


@pytest.fixture
def load(peer):
    load = Load(peer.namespace, backbone=False)
    yield load
    load.close()


def command(stamp):
    """Back and forth over very many turns, alternately: every solve follows a long path."""
    turn = TURN if stamp % 2 else -TURN
    return joint_state(JOINTS, [-turn, NEAR[1], turn, NEAR[3]], stamp)


def solve_times(load):
    """What answers in lock step take [s], the first one left out: it starts cold."""
    for stamp in range(1, PROBES + 2):
        load.send(command(stamp))
        assert load.spin_until(lambda stamp=stamp: stamp in load.answered, 5.0)
    return [load.answered[stamp] - load.sent[stamp] for stamp in range(2, PROBES + 2)]


def test_at_ten_times_the_load_the_newest_wins(peer, load):
    times = sorted(solve_times(load))
    usual, longest = times[PROBES // 2], times[-1]
    period = usual / FACTOR
    begin = time.monotonic()
    stamps = range(PROBES + 2, PROBES + 2 + int(SECONDS / period))
    for count, stamp in enumerate(stamps):
        load.spin_to(begin + count * period)
        load.send(command(stamp))
    assert load.spin_until(lambda: stamps[-1] in load.answered, 5.0), "the newest command is not answered"
    answered = [stamp for stamp in load.answered if stamp in stamps]
    lags = sorted(load.answered[stamp] - load.sent[stamp] for stamp in answered)
    assert answered == sorted(answered), "an older command was answered after a newer one"
    assert len(answered) < len(stamps) / 2, "this was no overload"
    print(
        f"one in lock step {usual * 1e3:.1f} ms (max {longest * 1e3:.1f}), a command every"
        f" {period * 1e3:.2f} ms: {len(stamps)} sent, {len(answered)} answered,"
        f" lag median {lags[len(lags) // 2] * 1e3:.1f} ms, max {lags[-1] * 1e3:.1f} ms"
    )
    assert lags[-1] < longest + period + SLACK
    assert faults_in(peer.log) == []


def test_poses_at_2000_hz_are_followed_by_the_newest(peer, load):
    """Far more than can be answered: answers keep their order and are not late, and the tip stays on the circle."""
    statuses, tips = {}, {}
    load.ros.create_subscription(
        EquilibriumStatus, "ctr_equilibrium/status", lambda it: statuses.update({stamp_of(it): it}), EVERY_ANSWER
    )
    load.ros.create_subscription(PoseStamped, "setpoint_cp", lambda it: tips.update({stamp_of(it): it}), EVERY_ANSWER)
    poses = load.ros.create_publisher(PoseStamped, "servo_cp", 1)
    load.send(joint_state(JOINTS, BEGIN, FIRST))
    assert load.spin_until(lambda: FIRST in tips and FIRST in statuses, 5.0)
    assert load.spin_until(lambda: poses.get_subscription_count() > 0, 5.0)
    begin = tips[FIRST].pose.position
    count, sent, start = int(SECONDS * POSE_RATE), {}, time.monotonic()
    for number in range(count):
        angle, stamp = 2.0 * math.pi * number / POSE_RATE / REVOLUTION, FIRST + 1 + number
        message = PoseStamped()
        message.header.stamp.nanosec = stamp
        place = message.pose.position
        place.x, place.z = begin.x, begin.z + RADIUS * math.sin(angle)
        place.y = begin.y + RADIUS * (math.cos(angle) - 1.0)
        load.spin_to(start + number / POSE_RATE)
        sent[stamp] = time.monotonic(), (place.x, place.y, place.z)
        poses.publish(message)
    last = FIRST + count
    assert load.spin_until(lambda: last in tips and last in statuses, 5.0), "the newest pose is not answered"
    answered = [stamp for stamp in load.answered if stamp in sent and stamp in tips]
    assert answered == sorted(answered), "an older pose was answered after a newer one"
    assert all(statuses[stamp].outcome == EquilibriumStatus.ACCEPTED for stamp in answered)
    for stamp in answered:
        place = tips[stamp].pose.position
        off = math.dist(sent[stamp][1], (place.x, place.y, place.z))
        assert off == pytest.approx(statuses[stamp].tip_distance, abs=1e-12)
    lags = sorted(load.answered[stamp] - sent[stamp][0] for stamp in answered)
    offs = sorted(statuses[stamp].tip_distance for stamp in answered)
    print(
        f"{count} sent, {len(answered)} answered, lag median {lags[len(lags) // 2] * 1e3:.1f} ms, max"
        f" {lags[-1] * 1e3:.1f} ms, tip off {offs[len(offs) // 2]:.1e} m, max {offs[-1]:.1e} m"
    )
    assert offs[len(offs) // 2] < 1e-5 and statuses[last].tip_distance < 1e-4
    assert faults_in(peer.log) == []
