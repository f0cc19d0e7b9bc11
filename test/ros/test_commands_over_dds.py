"""Commands in, answers out."""

import json
import math
import time
from pathlib import Path

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import PoseStamped
from sensor_msgs.msg import JointState

from ros.load import ENDLESS
from ros.load import JOINTS
from ros.load import NEAR
from ros.load import joint_state

GOOD = dict(zip(JOINTS, (0.0, 0.0935, 0.5, 0.2085), strict=True))
REFERENCE = json.loads((Path(__file__).parents[1] / "data" / "reference_values.json").read_text(encoding="utf-8"))
ROWS = [(sweep, row) for sweep in ("fig4_full", "fig4_partial") for row in REFERENCE[sweep]["rows"][::4]]
TIMEOUT = 5.0


@pytest.fixture(scope="module")
def peer(start_node):
    return start_node("/served")


def joints(sweep, row):
    outer, inner = REFERENCE[sweep]["D"]
    return dict(zip(JOINTS, (0.0, outer, math.radians(row["alpha2_deg"]), inner), strict=True))


def xyz(pose):
    return np.array([pose.position.x, pose.position.y, pose.position.z])


@pytest.mark.parametrize(("sweep", "row"), ROWS)
def test_answers_meet_the_reference(peer, sweep, row):
    reply = peer.client.command(joints(sweep, row), TIMEOUT)
    assert np.linalg.norm(xyz(reply.tip.pose) - row["tip_m"]) < 1e-5
    assert reply.joints.name == JOINTS
    assert list(reply.joints.position) == list(joints(sweep, row).values())
    assert reply.joints.effort[2] == pytest.approx(row["torque2_Nm"], rel=1e-4, abs=1e-9)
    assert reply.joints.effort[0] == pytest.approx(-reply.joints.effort[2], abs=1e-12)
    assert 0.0 < reply.stability_margin <= 1.0


def test_poses_run_from_the_orifice_to_the_tip(peer):
    reply = peer.client.command(GOOD, TIMEOUT)
    assert reply.tip.header.frame_id == reply.backbone.header.frame_id == "ctr_base"
    assert len(reply.backbone.poses) == 60
    assert xyz(reply.backbone.poses[0]).tolist() == [0.0, 0.0, 0.0]
    assert xyz(reply.backbone.poses[-1]) == pytest.approx(xyz(reply.tip.pose), abs=1e-7)
    for pose in reply.backbone.poses:
        q = pose.orientation
        assert math.hypot(q.x, q.y, q.z, q.w) == pytest.approx(1.0, abs=1e-12)


def test_order_velocity_and_effort_do_not_matter(peer):
    expected = peer.client.command(GOOD, TIMEOUT).tip.pose
    tips = peer.subscribe(PoseStamped, "setpoint_cp")
    message = JointState(name=JOINTS[::-1], position=[GOOD[name] for name in JOINTS[::-1]])
    message.velocity = [math.nan]
    message.effort = [1.0, 2.0]
    message.header.stamp.sec = 7
    peer.send(message)
    peer.wait(lambda: tips and tips[-1].header.stamp.sec == 7, "answer")
    assert xyz(tips[-1].pose) == pytest.approx(xyz(expected), abs=1e-9)


def test_a_late_joiner_sees_the_last_answer(peer):
    reply = peer.client.command(GOOD, TIMEOUT)
    tips = peer.subscribe(PoseStamped, "setpoint_cp")
    peer.wait(lambda: bool(tips), "last answer")
    assert tips == [reply.tip]


def test_a_zero_stamp_means_receipt_time(peer):
    tips = peer.subscribe(PoseStamped, "setpoint_cp")
    _, before = peer.diagnostics()
    key = "commands with zero stamp (receipt time used)"
    tips.clear()
    sent = peer.ros.get_clock().now().nanoseconds
    peer.send(JointState(name=list(GOOD), position=list(GOOD.values())))
    peer.wait(lambda: bool(tips), "answer")
    stamp = tips[-1].header.stamp
    assert 0 <= stamp.sec * 10**9 + stamp.nanosec - sent < 1e9
    _, after = peer.diagnostics()
    assert int(after[key]) == int(before[key]) + 1


@pytest.mark.parametrize(
    ("reason", "names", "positions"),
    [
        ("unknown_joint", [*JOINTS, "elbow"], [*GOOD.values(), 0.0]),
        ("duplicate_joint", [*JOINTS, JOINTS[0]], [*GOOD.values(), 0.0]),
        ("missing_joint", JOINTS[:2], [0.0, 0.0935]),
        ("missing_joint", [], []),
        ("nameless", [], [*GOOD.values()]),
        ("ragged", JOINTS, [0.0, 0.0935]),
        ("non_finite", JOINTS, [0.0, 0.0935, math.nan, 0.2085]),
        ("out_of_limits", JOINTS, [0.0, -0.01, 0.0, 0.2085]),
    ],
)
def test_a_bad_command_changes_nothing_and_is_counted(peer, reason, names, positions):
    _, before = peer.diagnostics()
    tips = peer.subscribe(PoseStamped, "setpoint_cp")
    peer.wait(lambda: bool(tips), "last answer")
    tips.clear()
    peer.send(JointState(name=names, position=positions))
    rejected = str(int(before["commands rejected"]) + 1)
    status, after = peer.diagnostics(lambda values: values["commands rejected"] == rejected)
    assert tips == []
    assert status.level == DiagnosticStatus.WARN
    assert after["last rejection"].startswith(f"{reason}: ")
    assert reason in after["rejected by reason"]
    assert after["commands accepted"] == before["commands accepted"]


def test_rejections_are_logged(peer):
    assert "command rejected: " in peer.log.read_text(encoding="utf-8")


def test_a_solve_that_fails_publishes_nothing(peer):
    before = peer.client.command(dict(zip(JOINTS, NEAR, strict=True)), TIMEOUT)
    tips = peer.subscribe(PoseStamped, "setpoint_cp")
    peer.wait(lambda: bool(tips), "last answer")
    # A budget too small stands for all that can go wrong inside a solve.
    peer.set_parameter("compute_budget", 1e-4)
    peer.send(joint_state(JOINTS, ENDLESS))
    status, _ = peer.diagnostics(lambda values: values["last status"] == "timeout")
    peer.set_parameter("compute_budget", 1.0)
    assert tips == [before.tip]
    assert status.level == DiagnosticStatus.ERROR
    assert status.message.startswith("timeout: ")
    assert peer.client.command(dict(zip(JOINTS, NEAR, strict=True)), TIMEOUT).tip.pose == before.tip.pose


def test_diagnostics_tell_how_it_goes(peer):
    reply = peer.client.command(GOOD, TIMEOUT)
    peer.diagnostics()
    status, values = peer.diagnostics()
    assert status.level == DiagnosticStatus.OK
    assert status.hardware_id == "renda2021"
    assert values["last status"] == "ok"
    assert float(values["stability margin"]) == pytest.approx(reply.stability_margin, rel=1e-5)
    times = [float(values[f"solve time {which} [ms]"]) for which in ("p50", "p95", "max")]
    assert 0.0 < times[0] <= times[1] <= times[2]
    assert float(values["error estimate [m]"]) <= 1e-5
    assert int(values["degrees of freedom"]) > 0
    assert 0.0 <= float(values["last command's stamp age at receipt [s]"]) < 1.0
    assert float(values["residual"]) <= 1e-5
    assert values["fidelity"] in ("torsionless", "torsion")
    assert 0.0 < float(values["snap reserve"]) <= 1.0
    assert values["internal errors"] == "0"


def test_the_command_rate_is_told(peer):
    began = time.monotonic()
    peer.diagnostics()
    for count in range(40):
        peer.client.command({**GOOD, "inner_rotation": 0.5 + 0.001 * count}, TIMEOUT)
    _, values = peer.diagnostics()
    assert 40 / (time.monotonic() - began) < float(values["command rate [1/s]"]) <= 50.0
    _, values = peer.diagnostics()
    assert float(values["command rate [1/s]"]) == 0.0


def test_rejections_are_told_apart(peer):
    """By reason, each with its count."""
    _, values = peer.diagnostics()
    told = dict(part.split(": ") for part in values["rejected by reason"].split(", "))
    assert sum(map(int, told.values())) == int(values["commands rejected"])
    assert told["missing_joint"] == "2"
