"""Past a fold the stream snaps: followed, held or stopped, as on_snap says, and always told."""

import math

import pytest
from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import PoseStamped
from sensor_msgs.msg import JointState

JOINTS = ["outer_rotation", "outer_translation", "inner_rotation", "inner_translation"]
TIMEOUT = 5.0


def full_overlap(degrees):
    return dict(zip(JOINTS, (0.0, 0.0935, math.radians(degrees), 0.2085), strict=True))


def send(peer, degrees):
    command = full_overlap(degrees)
    peer.send(JointState(name=list(command), position=list(command.values())))


@pytest.fixture
def before_the_fold(start_node, request):
    """A node with the given on_snap, followed to 280 deg; the fold is at 281.89 deg."""
    peer = start_node(f"/snap_{request.param}", on_snap=request.param)
    for degrees in (140, 280):
        reply = peer.client.command(full_overlap(degrees), TIMEOUT)
    assert reply.stability_margin == pytest.approx(0.4516, abs=1e-3)
    return peer


@pytest.mark.parametrize("before_the_fold", ["follow"], indirect=True)
def test_a_followed_snap_is_published_and_told(before_the_fold):
    peer = before_the_fold
    reply = peer.client.command(full_overlap(285), TIMEOUT)
    assert reply.stability_margin > 0.9
    status, values = peer.diagnostics(lambda values: values["last status"] == "snap")
    assert status.level == DiagnosticStatus.WARN and "snap" in status.message
    assert values["snaps"] == "1" and "4.91991" in values["last message"]
    before, after = values["last snap, tip before -> after [m]"].split(" -> ")
    tip = reply.tip.pose.position
    assert after == f"({tip.x:.6f}, {tip.y:.6f}, {tip.z:.6f})" != before
    again = peer.client.command(full_overlap(286), TIMEOUT)
    assert again.stability_margin > 0.9
    _, values = peer.diagnostics(lambda values: values["last status"] == "ok")
    assert 0.0 < float(values["snap reserve"]) <= 1.0


@pytest.mark.parametrize("before_the_fold", ["hold"], indirect=True)
def test_a_held_snap_is_not_published(before_the_fold):
    """The last answer stays, and the way back leads along the branch as if nothing had been."""
    peer = before_the_fold
    tips = peer.subscribe(PoseStamped, "setpoint_cp")
    peer.wait(lambda: len(tips) == 1, "last tip")
    send(peer, 285)
    status, _ = peer.diagnostics(lambda values: values["last status"] == "snap")
    assert status.level == DiagnosticStatus.ERROR and "held" in status.message
    assert len(tips) == 1
    back = peer.client.command(full_overlap(280), TIMEOUT)
    assert back.stability_margin == pytest.approx(0.4516, abs=1e-3)


@pytest.mark.parametrize("before_the_fold", ["stop"], indirect=True)
def test_a_stopped_stream_waits_for_release(before_the_fold):
    peer = before_the_fold
    send(peer, 285)
    peer.diagnostics(lambda values: values["last status"] == "snap")
    send(peer, 270)
    _, values = peer.diagnostics(lambda values: values["commands rejected"] == "1")
    assert "stopped" in values["last rejection"]
    assert peer.set_parameter("on_snap", "follow").successful
    assert peer.client.command(full_overlap(270), TIMEOUT).stability_margin < 1.0
