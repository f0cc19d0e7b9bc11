"""Ten times more commands than the node can solve: the newest wins, and no answer is older than it must be."""

import time

import pytest

from ros.load import JOINTS
from ros.load import NEAR
from ros.load import Load
from ros.load import faults_in
from ros.load import joint_state

pytestmark = pytest.mark.alone

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
