"""With use_sim_time stamps follow /clock, while staleness and diagnostics go by a clock that never stands still."""

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import PoseStamped
from rosgraph_msgs.msg import Clock

from ros.load import joint_state
from ros.load import stamp_of

pytestmark = pytest.mark.alone

JOINTS = ["outer_rotation", "outer_translation", "inner_rotation", "inner_translation"]
POSITIONS = [0.0, 0.0935, 0.5, 0.2085]
SECOND = 1_000_000_000  # ns
STALE_AFTER = 0.7  # s


@pytest.fixture(scope="module")
def peer(start_node):
    return start_node("/simulated", use_sim_time="true", command_timeout=str(STALE_AFTER))


@pytest.fixture(scope="module")
def tips(peer):
    return peer.subscribe(PoseStamped, "setpoint_cp")


@pytest.fixture(scope="module")
def set_clock(peer, tips):
    """Sets the simulated time [ns], and waits until the node has it: a command without a stamp comes back with it."""
    publisher = peer.ros.create_publisher(Clock, "/clock", 1)
    peer.wait(lambda: publisher.get_subscription_count() > 0, "subscription of /clock")

    def set_clock(now):
        message = Clock()
        message.clock.sec, message.clock.nanosec = divmod(now, SECOND)

        def reached():
            publisher.publish(message)
            peer.send(joint_state(JOINTS, POSITIONS))
            return bool(tips) and stamp_of(tips[-1]) == now

        peer.wait(reached, f"answer at simulated time {now}")

    return set_clock


def test_a_command_without_a_stamp_is_stamped_by_the_clock_topic(set_clock, tips):
    for now in (100 * SECOND, 100 * SECOND + 1, 50 * SECOND):  # a bag that starts over goes back in time
        set_clock(now)
        assert stamp_of(tips[-1]) == now


def test_a_commands_own_stamp_is_kept_and_its_age_told_in_simulated_time(peer, set_clock, tips):
    set_clock(200 * SECOND)
    peer.send(joint_state(JOINTS, POSITIONS, stamp=197 * SECOND + 7))
    peer.wait(lambda: stamp_of(tips[-1]) == 197 * SECOND + 7, "answer")
    _, values = peer.diagnostics(lambda values: "nan" not in values["last command's stamp age at receipt [s]"])
    assert float(values["last command's stamp age at receipt [s]"]) == pytest.approx(3.0, abs=1e-6)


def test_an_hour_of_simulated_time_makes_nothing_stale(peer, set_clock):
    set_clock(300 * SECOND)
    set_clock(3900 * SECOND)
    status, values = peer.diagnostics()
    assert float(values["time without a command [s]"]) < 2.0
    assert "3600" not in status.message


def test_a_command_is_stale_though_simulated_time_stands_still(peer, set_clock):
    set_clock(5000 * SECOND)
    arrays = []
    peer.ros.create_subscription(DiagnosticArray, "/diagnostics", arrays.append, 10)
    status, _ = peer.diagnostics(lambda values: float(values["time without a command [s]"]) > STALE_AFTER)
    assert status.level == DiagnosticStatus.STALE
    peer.wait(lambda: bool(arrays), "diagnostics")
    assert stamp_of(arrays[-1]) == 5000 * SECOND
