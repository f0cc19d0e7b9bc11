"""The service ~/solve."""

import math

import numpy as np
import pytest
from sensor_msgs.msg import JointState

from ctr_pvs_interfaces.srv import SolveEquilibrium

JOINTS = ["outer_rotation", "outer_translation", "inner_rotation", "inner_translation"]
POSITIONS = [0.0, 0.0935, math.radians(100), 0.2085]
TIMEOUT = 5.0


@pytest.fixture(scope="module")
def peer(start_node):
    # Leniencies are for the stream only.
    return start_node("/service", merge_partial="true", clamp_to_limits="true")


def call(peer, names=JOINTS, positions=POSITIONS, **fields):
    request = SolveEquilibrium.Request(joints=JointState(name=list(names), position=list(positions)), **fields)
    return peer.client.solve(request, TIMEOUT)


def test_an_answer_is_complete(peer):
    response = call(peer, backbone_poses=17)
    assert response.success
    assert response.status == "ok"
    assert response.message
    tip = response.tip.pose.position
    # Row 100 deg of the full overlap sweep, and the forces of both sides of the kink it sits on.
    assert [tip.x, tip.y, tip.z] == pytest.approx([0.080947838, 0.014570095, -0.038894751], abs=1e-5)
    assert response.tip.header.frame_id == "ctr_base"
    assert response.tip.header.stamp.sec > 0
    assert len(response.backbone.poses) == len(response.backbone_s) == 17
    assert list(response.backbone_s) == pytest.approx(np.linspace(0.0, 0.095, 17))
    assert response.backbone.poses[-1].position.x == pytest.approx(tip.x, abs=1e-9)
    assert sum(response.torque) == pytest.approx(0.0, abs=1e-12)
    assert response.torque[1] == pytest.approx(0.061670524708276796, rel=1e-4)
    assert response.force_lower[0] == pytest.approx(0.3853, abs=1e-4)
    assert response.force_upper[0] == pytest.approx(2.0081, abs=1e-4)
    assert response.force[0] == response.force_upper[0]
    assert response.force_lower[1] == response.force_upper[1] == response.force[1]
    assert 0.0 < response.stability_margin <= 1.0
    assert response.fidelity
    assert response.degrees_of_freedom > 0
    assert 0.0 <= response.error_estimate <= 1e-5
    assert response.residual >= 0.0
    assert response.energy > 0.0
    assert response.solve_time > 0.0


def test_the_stamp_is_kept_and_the_number_of_poses_defaults_to_the_parameter(peer):
    joints = JointState(name=JOINTS, position=POSITIONS)
    joints.header.stamp.sec = 5
    response = peer.client.solve(SolveEquilibrium.Request(joints=joints), TIMEOUT)
    assert response.tip.header.stamp.sec == response.backbone.header.stamp.sec == 5
    assert len(response.backbone.poses) == 60


def test_warm_and_cold_starts_agree_where_the_equilibrium_is_unique(peer):
    cold, warm = (call(peer, warm_start=warm_start) for warm_start in (False, True))
    assert cold.torque[1] == pytest.approx(warm.torque[1], rel=1e-6)


@pytest.mark.parametrize(
    ("names", "positions", "poses", "word"),
    [
        (JOINTS, [0.0, 0.0935, math.nan, 0.2085], 0, "non_finite"),
        (JOINTS[:3], POSITIONS[:3], 0, "missing_joint"),
        (JOINTS, [0.0, 5.0, 0.0, 6.0], 0, "out_of_limits"),
        ([], POSITIONS, 0, "nameless"),
        (JOINTS, POSITIONS, 1, "backbone_poses"),
        (JOINTS, POSITIONS, 2**32 - 1, "backbone_poses"),
    ],
)
def test_bad_input_is_answered_with_the_reason(peer, names, positions, poses, word):
    response = call(peer, names, positions, backbone_poses=poses)
    assert not response.success
    assert response.status == "bad_input"
    assert word in response.message
    assert len(response.backbone.poses) == len(response.torque) == len(response.force) == 0
    assert math.isnan(response.tip.pose.position.x)
    assert math.isnan(response.stability_margin)


def test_the_stream_is_not_disturbed(peer):
    command = dict(zip(JOINTS, POSITIONS, strict=True))
    peer.client.command({**command, "inner_rotation": 1.0}, TIMEOUT)
    before = peer.client.command(command, TIMEOUT)
    _, counts = peer.diagnostics()
    call(peer, positions=[0.0, 0.0935, -2.0, 0.1705], warm_start=True)
    call(peer, positions=[0.0, 0.0935, math.nan, 0.2085])
    _, counts_after = peer.diagnostics()
    for key in ("commands accepted", "commands rejected", "answers published"):
        assert counts[key] == counts_after[key]
    peer.client.command({**command, "inner_rotation": 1.0}, TIMEOUT)
    assert peer.client.command(command, TIMEOUT).tip.pose == before.tip.pose
