"""Serialized answers are the messages they stand for, to the last bit."""

from types import SimpleNamespace

import numpy as np
import pytest
from geometry_msgs.msg import PoseArray
from geometry_msgs.msg import PoseStamped
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from std_msgs.msg import Float64MultiArray
from std_msgs.msg import Header

from ctr_pvs import EquilibriumSolver
from ctr_pvs import load_robot
from ctr_pvs_ros.inputs.joints import Joints
from ctr_pvs_ros.outputs import messages
from ctr_pvs_ros.outputs.forms import Forms
from ctr_pvs_ros.outputs.forms import NotFinite
from ctr_pvs_ros.outputs.serialized import STAMP
from ctr_pvs_ros.outputs.serialized import Form
from ctr_pvs_ros.outputs.serialized import FormError
from ctr_pvs_ros.outputs.serialized import stamp_bytes
from ctr_pvs_ros.process import share_file

STAMPS = [(0, 0), (7, 5), (-1, 999_999_999), (2**31 - 1, 1)]
# Frame names of every length modulo 8: what follows them is aligned.
FRAMES = ["", *("abcdefgh"[:length] for length in range(1, 9))]


@pytest.fixture(scope="module")
def robot(graph):
    return load_robot(share_file("config", "three_tubes.yaml"))


@pytest.fixture(scope="module")
def equilibrium(robot):
    answer = EquilibriumSolver(robot).solve([0.1, 0.7, -0.4], [tube.length / 2 for tube in robot.tubes])
    assert answer.success
    return answer


def header(stamp, frame=""):
    result = Header(frame_id=frame)
    result.stamp.sec, result.stamp.nanosec = stamp
    return result


@pytest.mark.parametrize("frame", FRAMES)
def test_poses_are_the_ordinary_messages(robot, equilibrium, frame):
    forms = Forms(Joints.of(robot), frame)
    for stamp in STAMPS:
        tip = forms.tip(equilibrium, stamp_bytes(*stamp))
        assert deserialize_message(tip, PoseStamped) == messages.tip_of(equilibrium, header(stamp, frame))
        for count in (2, 3, 60):
            backbone = equilibrium.backbone(count)
            expected = messages.backbone_of(backbone, header(stamp, frame))
            assert deserialize_message(forms.backbone(backbone, stamp_bytes(*stamp)), PoseArray) == expected


def test_joints_and_margin_are_the_ordinary_messages(robot, equilibrium):
    names = Joints.of(robot).names
    for joints in (
        Joints.of(robot),
        Joints.of(robot, "arm_", -1),
        Joints(tuple(f"{name}{'x' * index}" for index, name in enumerate(names))),
    ):
        forms = Forms(joints, "base")
        for stamp in STAMPS:
            sent = deserialize_message(forms.joints(equilibrium, stamp_bytes(*stamp)), JointState)
            assert sent == messages.joint_state_of(equilibrium, joints, header(stamp))
    assert deserialize_message(forms.margin(equilibrium), Float64).data == equilibrium.stability_margin


@pytest.mark.parametrize("sign", [1, -1])
def test_the_jacobian_is_that_of_the_joints(robot, equilibrium, sign):
    """A step of one joint moves the tip as its column says."""
    joints = Joints.of(robot, "arm_", sign)
    message = deserialize_message(Forms(joints, "base").jacobian(equilibrium), Float64MultiArray)
    rows, columns = message.layout.dim
    assert (rows.size, rows.stride, columns.size, columns.stride) == (6, 36, 6, 6)
    assert rows.label.split() == ["x", "y", "z", "rx", "ry", "rz"] and columns.label.split() == list(joints.names)
    jacobian = np.reshape(message.data, (6, 6))
    solver, start = EquilibriumSolver(robot, tolerance=1e-9), joints.in_turn(equilibrium.alpha, equilibrium.D)
    for joint, step in enumerate((1e-4, 1e-6) * 3):
        ends = []
        for change in (step, -step):
            moved = start.copy()
            moved[joint] += change
            ends.append(solver.solve(*joints.apart(moved)).tip.position)
        assert (ends[0] - ends[1]) / (2.0 * step) == pytest.approx(jacobian[:3, joint], rel=1e-3, abs=1e-5)


def test_a_form_may_be_filled_again_and_again(robot, equilibrium):
    forms = Forms(Joints.of(robot), "base")
    first = forms.tip(equilibrium, stamp_bytes(1, 2))
    forms.tip(equilibrium, stamp_bytes(3, 4))
    assert forms.tip(equilibrium, stamp_bytes(1, 2)) == first


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_what_is_not_finite_never_becomes_a_message(robot, equilibrium, value):
    forms, stamp = Forms(Joints.of(robot), "base"), stamp_bytes(1, 0)
    for part in ("position", "orientation"):
        backbone = equilibrium.backbone(5)
        getattr(backbone, part)[3, 1] = value
        with pytest.raises(NotFinite, match="backbone"):
            forms.backbone(backbone, stamp)
    names = ("alpha", "D", "stability_margin", "tip", "torque", "force")
    broken = SimpleNamespace(**{name: getattr(equilibrium, name) for name in names})
    broken.stability_margin = value
    with pytest.raises(NotFinite, match="margin"):
        forms.margin(broken)
    broken.tip = type(equilibrium.tip)(np.array([0.0, value, 0.0]), equilibrium.tip.orientation)
    with pytest.raises(NotFinite, match="tip"):
        forms.tip(broken, stamp)
    broken.force = np.array([0.0, value, 0.0])
    with pytest.raises(NotFinite, match="loads"):
        forms.joints(broken, stamp)


def test_a_middleware_with_another_layout_is_found_out(graph):
    with pytest.raises(FormError, match="JointState"):
        Form(JointState(header=Header(stamp=STAMP), position=[1.5, 2.5]), (STAMP, [2.5, 1.5]))
