"""A node in this process, to break its parts and to see their order: code that fails in a way nobody has thought of
does not end it, a signal is not outlived by a solve, and diagnostics wait for their turn."""

import time
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import PoseStamped
from rclpy.parameter import Parameter
from sensor_msgs.msg import JointState

from ctr_pvs import Loads
from ctr_pvs.robot.plausibility import implausible
from ctr_pvs_interfaces.msg import EquilibriumStatus
from ctr_pvs_ros.node import CATCH_UP_PERIOD
from ctr_pvs_ros.node import EquilibriumNode
from ctr_pvs_ros.process import share_file
from ctr_pvs_ros.service.jobs import SolveJob
from ctr_pvs_ros.service.jobs import do
from ctr_pvs_ros.service.jobs import robot_of
from ctr_pvs_ros.tip_servo import TRIES

ROBOT = str(share_file("config", "renda2021.yaml"))
JOINTS = ["outer_rotation", "outer_translation", "inner_rotation", "inner_translation"]
GOOD = JointState(name=JOINTS, position=[0.0, 0.0935, 0.5, 0.2085])


class BrokenSolver:
    """Fails as code with a mistake in it does."""

    def solve(self, *arguments, **options):
        raise ZeroDivisionError("a mistake")


@pytest.fixture
def node(graph):
    """A node in this process, so that its parts can be broken."""
    node = EquilibriumNode(namespace="/faulty", parameter_overrides=[Parameter("robot_file", value=ROBOT)])
    yield node
    node.destroy_node()


def command(node):
    """Hand it a command as an executor does."""
    (subscription,) = (each for each in node.subscriptions if each.topic_name == "/faulty/servo_jp")
    subscription.callback(GOOD)
    status = node.handler.report.status("node", "robot", 0.0)
    return status, {value.key: value.value for value in status.values}


def test_a_broken_solve_is_told_and_the_stream_goes_on(node, monkeypatch):
    statuses = []
    monkeypatch.setattr(node._outputs._status, "publish", lambda outcome, message: statuses.append(outcome))
    monkeypatch.setattr(type(node._outputs._status), "wanted", True)
    with monkeypatch.context() as broken:
        broken.setattr(node.handler._stream, "_solver", BrokenSolver())
        status, values = command(node)
    (told,) = statuses
    assert (told.code, told.reason) == (EquilibriumStatus.FAILED, "internal_error")
    assert told.message == "ZeroDivisionError: a mistake; the last answer stays"
    assert status.level == DiagnosticStatus.ERROR
    assert "ZeroDivisionError: a mistake" in status.message
    assert values["internal errors"] == "1"
    status, values = command(node)
    assert status.level == DiagnosticStatus.OK
    assert values["answers published"] == "1"


def test_a_command_that_comes_after_the_signal_is_not_solved(node, monkeypatch):
    """Both can find the executor asleep; a solve that began after the signal could not be ended by it."""
    monkeypatch.setattr(node.handler._stream, "_solver", BrokenSolver())
    node.handler.interrupted = True
    _, values = command(node)
    assert values["internal errors"] == "0"
    assert values["commands accepted"] == "0"
    assert not node.handler.solving


def test_an_answer_that_cannot_be_sent_is_told_and_the_stream_goes_on(node, monkeypatch):
    with monkeypatch.context() as broken:
        broken.setattr(node._outputs, "publish", BrokenSolver().solve)
        status, values = command(node)
    assert status.level == DiagnosticStatus.ERROR
    assert values["answers published"] == "0"
    assert command(node)[0].level == DiagnosticStatus.OK


def test_the_service_answers_when_its_solver_is_broken():
    job = SolveJob(
        number=7,
        alpha=np.zeros(2),
        D=np.zeros(2),
        loads=Loads(),
        start="cold",
        poses=60,
        deadline=time.monotonic() + 1.0,
    )
    solved = do(BrokenSolver(), job)
    assert solved.number == 7 and solved.numbers is None
    assert solved.status == "not_converged"
    assert "a mistake" in solved.message


class Told:
    """In place of the publisher of diagnostics."""

    def __init__(self):
        self.count = 0

    def get_subscription_count(self):
        return 1

    def publish(self, message):
        self.count += 1


def test_diagnostics_go_out_right_after_an_answer_or_when_none_comes(node, monkeypatch):
    """They take longer than an answer: begun just before a command they would make it late, and overtaken."""
    told = Told()
    monkeypatch.setattr(node, "_diagnostics", told)
    node._look_round()
    node._catch_up()
    assert told.count == 0
    command(node)
    assert told.count == 1
    command(node)
    assert told.count == 1
    node._look_round()
    time.sleep(2.0 * CATCH_UP_PERIOD)
    node._catch_up()
    assert told.count == 2


def test_diagnostics_go_out_although_an_output_fails(node, monkeypatch):
    told = Told()
    monkeypatch.setattr(node, "_diagnostics", told)
    monkeypatch.setattr(node._outputs, "catch_up", BrokenSolver().solve)
    node._look_round()
    time.sleep(2.0 * CATCH_UP_PERIOD)
    node._guarded(node._catch_up)()
    assert told.count == 1


def test_a_robot_that_looks_wrong_is_told_of_once_in_the_log_and_for_good_in_diagnostics(graph, tmp_path, capfd):
    file = tmp_path / "odd.yaml"
    file.write_text(Path(ROBOT).read_text(encoding="utf-8").replace("[13.8]", "[588]"), encoding="utf-8")
    overrides = [Parameter("robot_file", value=str(file))]
    node = EquilibriumNode(namespace="/odd", parameter_overrides=overrides)
    try:
        first, second = (node.handler.report.status("node", "robot", 0.0) for _ in range(2))
    finally:
        node.destroy_node()
    (remark,) = implausible(robot_of(str(file)))
    assert (first.level, first.message) == (DiagnosticStatus.WARN, remark)
    assert second.level == DiagnosticStatus.OK
    assert {value.key: value.value for value in second.values}["robot warnings"] == remark
    logged = [line for line in capfd.readouterr().err.splitlines() if remark in line]
    assert len(logged) == 1
    assert "[WARN]" in logged[0]


def test_the_steps_of_a_pose_share_one_budget_and_end_with_a_signal(node, monkeypatch):
    """However many are tried; a signal ends the first that comes after it."""
    command(node)
    budgets = []
    monkeypatch.setattr(
        node.handler._stream, "try_out", lambda command, budget, loads: budgets.append(budget) or late()
    )
    (poses,) = (each for each in node.subscriptions if each.topic_name == "/faulty/servo_cp")
    far = PoseStamped()
    far.pose.position.x = 0.2

    def late():
        time.sleep(0.01)
        return SimpleNamespace(equilibrium=SimpleNamespace(success=False))

    poses.callback(far)
    assert len(budgets) == TRIES + 1
    assert all(b <= a - 0.01 for a, b in pairwise(budgets))
    node.handler.interrupted = True
    poses.callback(far)
    assert len(budgets) == TRIES + 1
    assert not node.handler.solving
