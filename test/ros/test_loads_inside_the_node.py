"""Loads on a node in this process: both inputs at once, before there is an answer, and what a load does to snaps."""

import math
import time

import numpy as np
import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import WrenchStamped
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from rclpy.serialization import serialize_message
from scipy.spatial.transform import Rotation
from sensor_msgs.msg import JointState

import ctr_pvs
from ctr_pvs import Loads
from ctr_pvs import Status
from ctr_pvs.kernel import compiler
from ctr_pvs_ros.executable import new_executor
from ctr_pvs_ros.node import EquilibriumNode
from ctr_pvs_ros.process import share_file
from ctr_pvs_ros.stream import Stream
from ros.load import JOINTS
from ros.load import joint_state
from ros.load import wrench_message

ROBOT = share_file("config", "renda2021.yaml")
POSITIONS = [0.0, 0.0935, 0.5, 0.2085]
FORCE, MOMENT = (0.05, 0.1, -0.05), (0.0, 1e-3, 2e-3)
SAME = 1e-7  # m; the node comes on another way than the solver beside it, and no solve is exact
TIMEOUT = 20.0  # s; kernels may run interpreted
SECOND = 1_000_000_000  # ns


@pytest.fixture(scope="module")
def robot():
    return ctr_pvs.load_robot(ROBOT)


@pytest.fixture
def others(graph):
    """A node that publishes to the one that is tested."""
    node = rclpy.create_node("others")
    yield node
    node.destroy_node()


@pytest.fixture
def new_node(graph):
    """Makes a node in this process; it is taken away afterwards."""
    nodes = []

    def new_node(**parameters):
        values = {"robot_file": str(ROBOT), "compute_budget": 20.0, **parameters}
        overrides = [Parameter(name, value=value) for name, value in values.items()]
        nodes.append(EquilibriumNode(namespace="/in_here", parameter_overrides=overrides))
        return nodes[-1]

    yield new_node
    for node in nodes:
        node.destroy_node()


class Told:
    """In place of the outputs: the answers that went out, and their stamps as bytes."""

    def __init__(self):
        self.answers = []

    def publish(self, sent):
        self.answers.append(sent)

    def catch_up(self):
        pass


@pytest.fixture
def told(monkeypatch):
    """What a node in this process says instead of publishing it."""

    def told(node):
        monkeypatch.setattr(node._outputs, "publish", (told := Told()).publish)
        return told.answers

    return told


def seconds(sent):
    """The stamp of an answer, s."""
    return int.from_bytes(sent.stamp[:4], "little")


def status_of(node):
    status = node.handler.report.status("node", "robot", 0.0)
    return status, {value.key: value.value for value in status.values}


def test_by_default_nothing_is_listened_to_and_nothing_told_of_loads(new_node):
    node = new_node()
    assert [each.topic_name for each in node.subscriptions if "wrench" in each.topic_name] == []
    assert not [key for key in status_of(node)[1] if "wrench" in key or "external" in key]


def test_a_wrench_in_the_tips_frame_before_the_first_command_is_turned_with_the_first_answer(new_node, told, robot):
    node = new_node(use_external_wrench=True)
    answers = told(node)
    node.handler.answer(None, wrench_message(FORCE, MOMENT, "ctr_tip", 7 * SECOND))
    assert answers == []
    node.handler.answer(joint_state(JOINTS, POSITIONS, 8 * SECOND), None)
    assert [seconds(sent) for sent in answers] == [8, 7]
    unloaded, loaded = (sent.equilibrium for sent in answers)
    assert unloaded.applied_loads is None
    turn = Rotation.from_quat(unloaded.tip.orientation)
    assert loaded.applied_loads.tip_force == pytest.approx(turn.apply(FORCE), abs=1e-12)
    assert loaded.applied_loads.tip_moment == pytest.approx(turn.apply(MOMENT), abs=1e-12)
    alone = ctr_pvs.EquilibriumSolver(robot).solve(loaded.alpha, loaded.D, start="cold", loads=loaded.applied_loads)
    assert loaded.tip.position == pytest.approx(alone.tip.position, abs=SAME)


@pytest.mark.parametrize("executor", [new_executor, SingleThreadedExecutor])
@pytest.mark.parametrize("wrench_first", [True, False])
def test_what_waits_on_both_inputs_is_answered_with_one_solve(new_node, told, others, executor, wrench_first):
    node = new_node(use_external_wrench=True)
    answers = told(node)
    runs = executor()
    runs.add_node(node)
    publishers = [
        others.create_publisher(kind, f"/in_here/{topic}", 1)
        for kind, topic in ((JointState, "servo_jp"), (WrenchStamped, "external_wrench"))
    ]
    wait(lambda: all(each.get_subscription_count() > 0 for each in publishers))
    for number in (1, 2, 3):  # of which the newest win
        messages = [
            joint_state(JOINTS, [0.0, 0.0935, 0.1 * number, 0.2085], number * SECOND),
            wrench_message((0.0, 0.01 * number, 0.0), stamp=(10 + number) * SECOND),
        ]
        both = list(zip(publishers, messages, strict=True))
        for publisher, message in reversed(both) if wrench_first else both:
            publisher.publish(message)
    time.sleep(0.5)  # both have come; whoever solves finds both
    deadline = time.monotonic() + TIMEOUT
    while not answers and time.monotonic() < deadline:
        runs.spin_once(timeout_sec=0.1)
    for _ in range(20):  # what the executor has noticed before
        runs.spin_once(timeout_sec=0.01)
    runs.shutdown()
    assert [seconds(sent) for sent in answers] == [3]
    equilibrium = answers[0].equilibrium
    assert equilibrium.alpha[1] == pytest.approx(0.3) and equilibrium.applied_loads.tip_force == (0.0, 0.03, 0.0)
    _, values = status_of(node)
    assert values["commands accepted"] == values["wrenches accepted"] == values["answers published"] == "1"
    assert values["internal errors"] == "0"


def wait(done):
    """Until the nodes in this process have found each other."""
    deadline = time.monotonic() + TIMEOUT
    while not done():
        assert time.monotonic() < deadline
        time.sleep(0.05)


def garbage():
    """Cut off, with a wild length, and with text that is not UTF-8, as a broken client of another kind sends."""
    whole = bytearray(serialize_message(wrench_message(FORCE, frame="ctr_base")))
    wild_length, no_text = whole.copy(), whole.copy()
    at = whole.index(b"ctr_base")
    wild_length[at - 4 : at] = b"\xff\xff\xff\x7f"
    no_text[at : at + 4] = b"\xff\xfe\x80\xc3"
    return [bytes(message) for message in (whole[:30], whole[:5], wild_length, no_text)]


def test_bytes_that_are_no_wrench_cost_no_command(new_node, told, others):
    """Whichever of the two the executor finds first."""
    node = new_node(use_external_wrench=True)
    answers = told(node)
    runs = new_executor()
    runs.add_node(node)
    commands = others.create_publisher(JointState, "/in_here/servo_jp", 1)
    wrenches = others.create_publisher(WrenchStamped, "/in_here/external_wrench", 1)
    found = (commands.get_subscription_count, wrenches.get_subscription_count)
    wait(lambda: all(count() > 0 for count in found))
    stamps = []
    for message in garbage():
        for command_first in (True, False):
            stamps.append(len(stamps) + 1)
            command = joint_state(JOINTS, POSITIONS, stamps[-1] * SECOND)
            both = [(commands, command), (wrenches, message)]
            for publisher, each in both if command_first else reversed(both):
                publisher.publish(each)
            time.sleep(0.1)
            deadline = time.monotonic() + TIMEOUT
            while len(answers) < len(stamps) and time.monotonic() < deadline:
                runs.spin_once(timeout_sec=0.1)
            assert [seconds(sent) for sent in answers] == stamps
    runs.shutdown()
    assert status_of(node)[1]["wrenches accepted"] == "0"


def test_of_two_inputs_the_bad_one_is_told_and_the_good_one_answered(new_node, told):
    node = new_node(use_external_wrench=True)
    answers = told(node)
    node.handler.answer(joint_state(JOINTS, POSITIONS, SECOND), wrench_message(FORCE, frame="world", stamp=2 * SECOND))
    node.handler.answer(joint_state(JOINTS, POSITIONS[:2], 3 * SECOND), wrench_message(FORCE, stamp=4 * SECOND))
    assert [seconds(sent) for sent in answers] == [1, 4]
    assert answers[0].equilibrium.applied_loads is None
    assert answers[1].equilibrium.applied_loads == Loads(FORCE)
    status, values = status_of(node)
    assert status.level == DiagnosticStatus.WARN
    assert "ragged" in status.message and "unknown_frame" in status.message
    assert values["commands rejected"] == values["wrenches rejected"] == "1"


class SnapsUnderLoad(ctr_pvs.EquilibriumSolver):
    """Calls what it reaches under more than 0.2 N a landing."""

    def solve(self, *arguments, loads, **options):
        answer = super().solve(*arguments, loads=loads, **options)
        if loads is not None and math.hypot(*loads.tip_force) > 0.2:
            answer.status = Status.SNAP
        return answer


@pytest.mark.parametrize("on_snap", ["follow", "hold", "stop"])
def test_a_load_that_makes_the_tubes_snap_is_dealt_with_as_on_snap_says(new_node, told, robot, monkeypatch, on_snap):
    node = new_node(use_external_wrench=True, on_snap=on_snap)
    monkeypatch.setattr(node.handler, "_stream", Stream(SnapsUnderLoad(robot)))
    answers = told(node)
    node.handler.answer(joint_state(JOINTS, POSITIONS, SECOND), None)
    node.handler.answer(None, wrench_message((0.0, -0.26, 0.0), stamp=2 * SECOND))
    status, values = status_of(node)
    assert values["last status"] == "snap" and values["snaps"] == "1"
    assert values["external force [N]"] == "(0, -0.26, 0)"
    assert status.level == (DiagnosticStatus.WARN if on_snap == "follow" else DiagnosticStatus.ERROR)
    node.handler.answer(None, wrench_message(FORCE, stamp=3 * SECOND))
    if on_snap == "stop":  # the load is kept for the command that comes after the release
        assert [seconds(sent) for sent in answers] == [1]
        node.set_parameters([Parameter("on_snap", value="follow")])
        node.handler.answer(joint_state(JOINTS, POSITIONS, 4 * SECOND), None)
    assert [seconds(sent) for sent in answers] == {"follow": [1, 2, 3], "hold": [1, 3], "stop": [1, 4]}[on_snap]
    assert answers[-1].equilibrium.applied_loads == Loads(FORCE)
    assert status_of(node)[1]["commands rejected"] == "0"


@pytest.mark.skipif(compiler.mode() != "compiled", reason="interpreted, a snap under load takes a minute")
def test_a_force_pushes_the_tip_through_a_fold(new_node, told):
    """With the inner tube at 200 deg and D_2 = 170.5 mm a force along -y lets the tubes snap at 0.225 N."""
    node = new_node(use_external_wrench=True)
    answers = told(node)
    node.handler.answer(joint_state(JOINTS, [0.0, 0.0935, math.radians(200.0), 0.1705], SECOND), None)
    for number, force in enumerate((0.22, 0.23), 2):
        node.handler.answer(None, wrench_message((0.0, -force, 0.0), stamp=number * SECOND))
    before, close, landed = (sent.equilibrium for sent in answers)
    assert close.status is Status.OK and landed.status is Status.SNAP
    assert 0.0 < close.stability_margin < before.stability_margin
    assert landed.snaps[0].t == pytest.approx((0.225244 - 0.22) / 0.01, abs=1e-3)
    assert np.linalg.norm(landed.tip.position - close.tip.position) > 1e-2
    assert status_of(node)[1]["snaps"] == "1"
