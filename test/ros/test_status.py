"""~/status tells what became of each command and each wrench, with its stamp."""

import math

import pytest
from geometry_msgs.msg import PoseStamped
from geometry_msgs.msg import WrenchStamped
from std_msgs.msg import Float64

from ctr_pvs_interfaces.msg import EquilibriumStatus
from ros.load import ENDLESS
from ros.load import EVERY_ANSWER
from ros.load import JOINTS
from ros.load import NEAR
from ros.load import joint_state
from ros.load import stamp_of
from ros.load import wrench_message

GOOD = [0.0, 0.0935, 0.5, 0.2085]
PAST_THE_FOLD = [0.0, 0.0935, 5.5, 0.2085]
COMMAND, WRENCH = EquilibriumStatus.COMMAND, EquilibriumStatus.WRENCH
TIMEOUT = 10.0


class Told:
    """Sends messages to a node, and has the status of each."""

    def __init__(self, peer):
        self.peer = peer
        self.statuses = []
        peer.ros.create_subscription(
            EquilibriumStatus, f"{peer.namespace}/ctr_equilibrium/status", self.statuses.append, EVERY_ANSWER
        )
        self._wrenches = peer.ros.create_publisher(WrenchStamped, f"{peer.namespace}/external_wrench", 1)
        self._stamp = 0
        self.of(GOOD)  # both ways are open from now on

    def of(self, positions=None, force=None, names=JOINTS):
        """The status of a command, or of a force on the tip [N]."""
        self._stamp += 1
        stamp = self._stamp
        if force is None:
            self.peer.send(joint_state(list(names), list(positions), stamp))
        else:
            self._wrenches.publish(wrench_message(force, stamp=stamp))
        self.peer.wait(lambda: any(stamp_of(status) == stamp for status in self.statuses), "status", TIMEOUT)
        (found,) = [status for status in self.statuses if stamp_of(status) == stamp]
        return found


@pytest.fixture(scope="module")
def told(start_node):
    return Told(start_node("/told", use_external_wrench="true", compute_budget="0.5"))


def test_of_a_command_that_is_answered(told):
    tips = told.peer.subscribe(PoseStamped, "setpoint_cp")
    margins = told.peer.subscribe(Float64, "stability_margin")
    told.peer.wait(lambda: bool(tips) and bool(margins), "last answer")
    tips.clear()
    margins.clear()
    status = told.of(GOOD)
    told.peer.wait(lambda: bool(tips) and bool(margins), "answer")
    assert (status.trigger, status.outcome, status.reason) == (COMMAND, EquilibriumStatus.ACCEPTED, "ok")
    assert status.header.frame_id == "ctr_base"
    assert tips[0].header.stamp == status.header.stamp
    assert status.stability_margin == margins[0].data
    assert 0.0 < status.snap_reserve <= 1.0
    assert 0.0 <= status.error_estimate <= 1e-5
    assert 0.0 < status.solve_time < 0.5
    assert status.message and not status.hint
    assert status.fidelity and status.degrees_of_freedom > 0
    assert math.isnan(status.tip_distance)
    assert status.applied_wrench.force.z == 0.0


@pytest.mark.parametrize(
    ("names", "positions", "reason", "word"),
    [
        (JOINTS, [0.0, 0.0935, math.nan, 0.2085], "non_finite", "inner_rotation"),
        (JOINTS, [0.0, -0.0935, 0.0, 0.2085], "out_of_limits", "outer_translation"),
        (JOINTS[:2], GOOD[:2], "missing_joint", "inner_rotation"),
        ([*JOINTS, "elbow"], [*GOOD, 0.0], "unknown_joint", "elbow"),
    ],
)
def test_of_a_command_that_is_refused(told, names, positions, reason, word):
    status = told.of(positions, names=names)
    assert (status.trigger, status.outcome, status.reason) == (COMMAND, EquilibriumStatus.REFUSED, reason)
    assert word in status.message
    assert all(map(math.isnan, (status.stability_margin, status.snap_reserve, status.error_estimate)))
    assert math.isnan(status.solve_time) and status.degrees_of_freedom == 0 and status.fidelity == ""


def test_of_a_command_that_runs_out_of_time(told):
    told.of(NEAR)
    status = told.of(ENDLESS)
    assert (status.outcome, status.reason) == (EquilibriumStatus.FAILED, "timeout")
    assert "the last answer stays" in status.message
    assert 0.4 < status.solve_time < 1.0
    assert math.isnan(status.stability_margin)


def test_of_a_snap(told):
    told.of(GOOD)
    status = told.of(PAST_THE_FOLD)
    assert (status.outcome, status.reason) == (EquilibriumStatus.SNAP, "snap")
    assert "4.91" in status.message and status.stability_margin > 0.0
    told.of(GOOD)
    assert told.peer.set_parameter("on_snap", "hold").successful
    status = told.of(PAST_THE_FOLD)
    assert (status.outcome, status.reason) == (EquilibriumStatus.FAILED, "snap_held")
    assert told.peer.set_parameter("on_snap", "stop").successful
    assert told.of(PAST_THE_FOLD).reason == "snap_held"
    status = told.of(GOOD)
    assert (status.outcome, status.reason) == (EquilibriumStatus.REFUSED, "stopped")
    assert told.peer.set_parameter("on_snap", "follow").successful
    assert told.of(GOOD).outcome == EquilibriumStatus.ACCEPTED


def test_of_a_wrench(told):
    told.of(GOOD)
    status = told.of(force=(0.0, 0.0, 0.2))
    assert (status.trigger, status.outcome) == (WRENCH, EquilibriumStatus.ACCEPTED)
    assert status.applied_wrench.force.z == 0.2 and status.fidelity == "full"
    held = told.of(GOOD)
    assert held.trigger == COMMAND and held.applied_wrench.force.z == 0.2
    bad = told.of(force=(math.nan, 0.0, 0.0))
    assert (bad.trigger, bad.outcome, bad.reason) == (WRENCH, EquilibriumStatus.REFUSED, "non_finite")
    assert told.of(force=(0.0, 0.0, 0.0)).applied_wrench.force.z == 0.0


def test_a_late_joiner_hears_the_last_one(told):
    last = told.of([0.0, 0.0935, math.inf, 0.2085])
    late = told.peer.subscribe(EquilibriumStatus, "ctr_equilibrium/status")
    told.peer.wait(lambda: bool(late), "last status")
    assert stamp_of(late[-1]) == stamp_of(last) and late[-1].outcome == EquilibriumStatus.REFUSED


def test_every_command_of_a_burst_that_is_taken_has_one(told):
    """In order, and none twice; newer commands displace those that wait to be taken, but never the last of a burst."""
    _, counts = told.peer.diagnostics()
    before = len(told.statuses)
    for burst in range(5):
        for number in range(20):
            told._stamp += 1
            told.peer.send(joint_state(JOINTS, GOOD if (burst + number) % 5 == 4 else [math.nan] * 4, told._stamp))
        told.peer.wait(lambda: stamp_of(told.statuses[-1]) == told._stamp, "last status", TIMEOUT)
    stamps = [stamp_of(status) for status in told.statuses[before:]]
    assert stamps == sorted(set(stamps))
    told.peer.diagnostics()
    _, after = told.peer.diagnostics()
    keys = ("commands accepted", "commands rejected")
    assert len(stamps) == sum(int(after[key]) - int(counts[key]) for key in keys) >= 5


def test_hints_stand_in_it_and_in_diagnostics(start_node):
    told = Told(start_node("/hinted", clamp_to_limits="true", merge_partial="true"))
    status = told.of([6.2], names=["outer_rotation"])
    assert status.outcome in (EquilibriumStatus.ACCEPTED, EquilibriumStatus.SNAP)
    assert "outer_rotation jumped by 355 deg" in status.hint
    _, values = told.peer.diagnostics(lambda values: "jumped" in values["last hint"])
    assert "unwrap_rotations" in values["last hint"]
    status = told.of([0.5], names=["inner_translation"])
    assert status.hint == "inner_translation moved from 0.5 to 0.3035 m, 0.197 m FURTHER IN"


def test_margin_stop_is_a_reason(start_node):
    told = Told(start_node("/margin_stopped", margin_stop="0.6", margin_warn="0.9"))
    told.of([0.0, 0.0935, 4.5379, 0.2085])
    status = told.of([0.0, 0.0935, 4.8869, 0.2085])  # 280 deg
    assert (status.outcome, status.reason) == (EquilibriumStatus.FAILED, "margin_stop")
    assert status.stability_margin == pytest.approx(0.45, abs=0.01)
