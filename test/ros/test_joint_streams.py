"""Joint streams as other people have them: shared, wrapped, counted the other way, with prefixes; rates of the tip."""

import math

import numpy as np
import pytest
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray

from ctr_pvs_interfaces.srv import SolveEquilibrium
from ctr_pvs_ros.process import NodeProcess
from ctr_pvs_ros.process import share_file
from ros.load import JOINTS

D = [0.0935, 0.2085]
GOOD = dict(zip(JOINTS, (0.0, D[0], 0.5, D[1]), strict=True))
TIMEOUT = 10.0


def xyz(pose):
    return [pose.position.x, pose.position.y, pose.position.z]


@pytest.fixture(scope="module")
def plain(start_node):
    return start_node("/plain", publish_jacobian="true")


def test_joints_of_other_robots_are_passed_over(start_node, plain):
    peer = start_node("/shared", ignore_unknown_joints="true")
    reply = peer.client.command({"elbow": math.nan, **GOOD, "wrist": 7.0}, TIMEOUT)
    assert reply.tip.pose == plain.client.command(GOOD, TIMEOUT).tip.pose
    for _ in range(3):
        peer.send(JointState(name=["elbow", "wrist"], position=[1.0, 2.0]))
    _, values = peer.diagnostics(lambda values: int(values["messages without joints of this robot"]) > 0)
    assert values["commands accepted"] == "1" and values["commands rejected"] == "0"


def test_a_wrapped_encoder_is_followed(start_node):
    """170, 178, -178 deg: the motor has gone on to 182, where the tip is 47 mm from where -178 deg leads."""
    peer = start_node("/wrapped", unwrap_rotations="true")
    for degrees in (0, 60, 120, 170, 178, -178):
        reply = peer.client.command({**GOOD, "inner_rotation": math.radians(degrees)}, TIMEOUT)
    assert math.degrees(reply.joints.position[2]) == pytest.approx(182.0)
    assert xyz(reply.tip.pose) == pytest.approx([0.08262, 0.02376, -0.03116], abs=1e-5)


def test_translations_counted_the_other_way(start_node, plain):
    """As beta = -D, with forces along it, in and out, in parameters, and through the service."""
    peer = start_node(
        "/beta",
        translation_sign="-1",
        joint_prefix="arm/",
        initial_command=f"[0.0, 0.5, {-D[0]}, {-D[1]}]",
        translation_limits="[-0.1, 0.0, -0.3, 0.0]",
        publish_jacobian="true",
    )
    plain_reply = plain.client.command(GOOD, TIMEOUT)
    sign = np.array([1.0, -1.0, 1.0, -1.0])
    answers = peer.subscribe(JointState, "setpoint_js")
    peer.wait(lambda: bool(answers), "initial answer")
    assert answers[0].name == [f"arm/{name}" for name in JOINTS]
    command = {f"arm/{name}": value * s for (name, value), s in zip(GOOD.items(), sign, strict=True)}
    reply = peer.client.command(command, TIMEOUT)
    assert reply.tip.pose == plain_reply.tip.pose
    assert list(reply.joints.position) == list(command.values())
    assert np.array(reply.joints.effort) == pytest.approx(sign * plain_reply.joints.effort, rel=1e-9)
    jacobians = [each.subscribe(Float64MultiArray, "jacobian") for each in (peer, plain)]
    for each, messages in zip((peer, plain), jacobians, strict=True):
        each.wait(lambda messages=messages: bool(messages), "jacobian")
    ours, plains = (np.reshape(messages[-1].data, (6, 4)) for messages in jacobians)
    assert ours == pytest.approx(sign * plains, rel=1e-9)
    joints = JointState(name=list(command), position=list(command.values()))
    response = peer.client.solve(SolveEquilibrium.Request(joints=joints), TIMEOUT)
    plain_joints = JointState(name=list(GOOD), position=list(GOOD.values()))
    plain_response = plain.client.solve(SolveEquilibrium.Request(joints=plain_joints), TIMEOUT)
    assert response.success and plain_response.success
    assert np.array(response.force) == pytest.approx(-np.array(plain_response.force))
    assert np.array(response.force_lower) == pytest.approx(-np.array(plain_response.force_upper))
    assert np.array(response.force_upper) == pytest.approx(-np.array(plain_response.force_lower))
    assert response.torque == plain_response.torque
    peer.send(JointState(name=list(command), position=[0.0, -0.12, 0.5, -D[1]]))
    _, values = peer.diagnostics(lambda values: values["last rejection"] != "")
    assert "arm/outer_translation: expected 0 <= D <= 0.1 m" in values["last rejection"]
    assert "the parameter translation_limits" in values["last rejection"]
    assert "got D = 0.12 (the position is -D" in values["last rejection"]


def test_a_negative_translation_names_the_other_way_of_counting(plain):
    plain.send(JointState(name=list(GOOD), position=[0.0, -D[0], 0.5, D[1]]))
    _, values = plain.diagnostics(lambda values: "beta" in values["last rejection"])
    assert "outer_translation" in values["last rejection"] and "translation_sign" in values["last rejection"]


def test_a_second_node_of_the_same_name_is_warned_of(start_node, tmp_path):
    peer = start_node("/twins")
    with (
        (tmp_path / "log.txt").open("wb") as log,
        NodeProcess(share_file("config", "renda2021.yaml"), namespace="/twins", log=log),
    ):
        told = "another node is called /twins/ctr_equilibrium, too"
        peer.wait(lambda: told in peer.log.read_text(encoding="utf-8"), "warning", TIMEOUT)
        peer.diagnostics(lambda values: True)
        for _ in range(10):
            status, _ = peer.diagnostics()
            if told in status.message:
                break
        assert told in status.message
