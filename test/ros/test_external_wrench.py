"""Loads on the tip: external_wrench bends the robot as the solver says, in either frame, and so does the service."""

import math
import time

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import PoseStamped
from geometry_msgs.msg import WrenchStamped
from scipy.spatial.transform import Rotation
from sensor_msgs.msg import JointState

import ctr_pvs
from ctr_pvs import Loads
from ctr_pvs_interfaces.srv import SolveEquilibrium
from ctr_pvs_ros.inputs.commands import CommandReader
from ctr_pvs_ros.parameters import LOADED_FIDELITIES
from ctr_pvs_ros.parameters import LOADED_FORCE_MODELS
from ctr_pvs_ros.parameters import PARAMETERS
from ctr_pvs_ros.process import share_file
from ctr_pvs_ros.service.jobs import do
from ctr_pvs_ros.service.solve_service import job_of
from ros.load import JOINTS
from ros.load import faults_in
from ros.load import joint_state
from ros.load import stamp_of
from ros.load import wrench
from ros.load import wrench_message

ROBOT = share_file("config", "renda2021.yaml")
POSITIONS = [0.0, 0.0935, 0.5, 0.2085]
GOOD = dict(zip(JOINTS, POSITIONS, strict=True))
FORCE, MOMENT = (0.05, 0.1, -0.05), (0.0, 1e-3, 2e-3)
ZERO = (0.0, 0.0, 0.0)
SAME = 1e-7  # m; the node comes on another way than the solver beside it, and no solve is exact
TIMEOUT = 20.0  # s; kernels may run interpreted
SECOND = 1_000_000_000  # ns


@pytest.fixture(scope="module")
def robot():
    return ctr_pvs.load_robot(ROBOT)


@pytest.fixture(scope="module")
def solver(robot):
    return ctr_pvs.EquilibriumSolver(robot)


@pytest.fixture(scope="module")
def peer(start_node):
    return start_node("/loaded", use_external_wrench="true", compute_budget="20.0")


@pytest.fixture(scope="module")
def tips(peer):
    return peer.subscribe(PoseStamped, "setpoint_cp")


@pytest.fixture(scope="module")
def joints(peer):
    return peer.subscribe(JointState, "setpoint_js")


@pytest.fixture(scope="module")
def publisher(peer):
    publisher = peer.ros.create_publisher(WrenchStamped, "external_wrench", 1)
    peer.wait(lambda: publisher.get_subscription_count() > 0, "subscription of external_wrench")
    return publisher


@pytest.fixture
def apply(peer, publisher, tips):
    """Let a wrench act, and the tip that answers it."""

    def apply(*vectors, frame="ctr_base"):
        stamp = time.time_ns()
        publisher.publish(wrench_message(*vectors, frame=frame, stamp=stamp))
        peer.wait(lambda: bool(tips) and stamp_of(tips[-1]) == stamp, "answer to the wrench", TIMEOUT)
        return tips[-1].pose

    return apply


def xyz(pose):
    return np.array([pose.position.x, pose.position.y, pose.position.z])


def turn_of(pose):
    q = pose.orientation
    return Rotation.from_quat([q.x, q.y, q.z, q.w])


def solved(solver, loads, alpha=0.5, D=0.2085):
    """What the solver says, from the relaxed robot."""
    answer = solver.solve([0.0, alpha], [0.0935, D], start="cold", loads=loads)
    assert answer.success
    return answer


def test_a_wrench_before_the_first_command_is_kept_for_it(peer, publisher, tips, solver):
    publisher.publish(wrench_message(FORCE))
    status, values = peer.diagnostics(lambda values: values["wrenches accepted"] == "1")
    assert status.message == "waiting for the first command"
    assert values["external force [N]"] == "(0.05, 0.1, -0.05)"
    assert values["commands accepted"] == values["answers published"] == "0"
    assert tips == []
    reply = peer.client.command(GOOD, TIMEOUT)
    answer = solved(solver, Loads(FORCE))
    assert xyz(reply.tip.pose) == pytest.approx(answer.tip.position, abs=SAME)
    assert np.linalg.norm(answer.tip.position - solved(solver, None).tip.position) > 1e-4
    _, values = peer.diagnostics(lambda values: values["answers published"] == "1")
    assert values["commands accepted"] == "1"
    assert values["fidelity"] == "full" and int(values["degrees of freedom"]) == answer.degrees_of_freedom


@pytest.mark.parametrize(("force", "moment"), [((0.0, -0.1, 0.1), ZERO), (ZERO, MOMENT), (FORCE, MOMENT), (ZERO, ZERO)])
def test_a_wrench_moves_the_tip_as_the_solver_says(peer, apply, tips, joints, solver, force, moment):
    pose = apply(force, moment)
    answer = solved(solver, Loads(force, moment))
    assert xyz(pose) == pytest.approx(answer.tip.position, abs=SAME)
    assert turn_of(pose).as_matrix() == pytest.approx(
        Rotation.from_quat(answer.tip.orientation).as_matrix(), abs=SAME / 0.1
    )
    peer.wait(lambda: bool(joints) and stamp_of(joints[-1]) == stamp_of(tips[-1]), "joints of that answer")
    assert joints[-1].position.tolist() == POSITIONS
    assert joints[-1].effort[0::2].tolist() == pytest.approx(answer.torque, abs=1e-6)
    assert joints[-1].effort[1::2].tolist() == pytest.approx(answer.force, abs=1e-4)


def test_the_load_acts_on_the_commands_that_follow_also_where_they_slide(peer, apply, solver):
    apply(FORCE, MOMENT)
    reply = peer.client.command({**GOOD, "inner_rotation": 0.7, "inner_translation": 0.2}, TIMEOUT)
    answer = solved(solver, Loads(FORCE, MOMENT), 0.7, 0.2)
    assert xyz(reply.tip.pose) == pytest.approx(answer.tip.position, abs=SAME)
    peer.client.command(GOOD, TIMEOUT)


def test_a_wrench_in_the_tips_frame_is_turned_with_the_last_tip_and_dead_from_there_on(peer, apply, solver):
    before = apply(ZERO, ZERO)
    turn = turn_of(before)
    loads = Loads(tuple(turn.apply(FORCE)), tuple(turn.apply(MOMENT)))
    pose = apply(FORCE, MOMENT, frame="ctr_tip")
    assert xyz(pose) == pytest.approx(solved(solver, loads).tip.position, abs=SAME)
    reply = peer.client.command({**GOOD, "inner_rotation": 1.5}, TIMEOUT)
    assert xyz(reply.tip.pose) == pytest.approx(solved(solver, loads, 1.5).tip.position, abs=SAME)
    _, values = peer.diagnostics()
    assert values["external force [N]"] == "({:.6g}, {:.6g}, {:.6g})".format(*loads.tip_force)
    assert values["external moment [N m]"] == "({:.6g}, {:.6g}, {:.6g})".format(*loads.tip_moment)
    peer.client.command(GOOD, TIMEOUT)


def test_a_wrench_without_a_frame_is_in_base_axes(apply, solver):
    assert xyz(apply(FORCE, frame="")) == pytest.approx(solved(solver, Loads(FORCE)).tip.position, abs=SAME)


def test_a_wrench_without_a_stamp_is_answered_with_the_time_of_receipt(peer, publisher, tips):
    tips.clear()
    sent = peer.ros.get_clock().now().nanoseconds
    publisher.publish(wrench_message(FORCE))
    peer.wait(lambda: bool(tips), "answer", TIMEOUT)
    assert 0 <= stamp_of(tips[-1]) - sent < 5 * SECOND


@pytest.mark.parametrize(
    ("reason", "frame", "force"),
    [
        ("unknown_frame", "world", FORCE),
        ("non_finite", "ctr_base", (math.nan, 0.0, 0.0)),
        ("non_finite", "ctr_tip", (0.0, math.inf, 0.0)),
        ("out_of_limits", "ctr_base", (0.0, 0.0, 1e12)),
    ],
)
def test_a_bad_wrench_is_refused_and_told_and_the_last_load_is_held(
    peer, publisher, apply, tips, solver, reason, frame, force
):
    apply(FORCE)
    _, before = peer.diagnostics()
    tips.clear()
    publisher.publish(wrench_message(force, frame=frame, stamp=5))
    rejected = str(int(before["wrenches rejected"]) + 1)
    status, after = peer.diagnostics(lambda values: values["wrenches rejected"] == rejected)
    assert status.level == DiagnosticStatus.WARN
    assert reason in status.message and "held" in status.message
    assert after["last wrench rejection"].startswith(f"{reason}: ")
    assert reason in after["wrenches rejected by reason"]
    for key in ("wrenches accepted", "external force [N]", "answers published", "commands rejected"):
        assert after[key] == before[key]
    assert tips == []
    reply = peer.client.command({**GOOD, "inner_rotation": 0.52}, TIMEOUT)
    assert xyz(reply.tip.pose) == pytest.approx(solved(solver, Loads(FORCE), 0.52).tip.position, abs=SAME)
    peer.client.command(GOOD, TIMEOUT)


def test_refusals_are_logged(peer):
    text = peer.log.read_text(encoding="utf-8")
    assert "wrench rejected: unknown_frame: frame_id: expected 'ctr_base' (base axes) or 'ctr_tip'" in text
    assert faults_in(peer.log) == []


def test_a_wrench_that_stays_away_is_warned_of_and_held(peer, apply, solver):
    apply(FORCE)
    assert peer.set_parameter("wrench_timeout", 1.5).successful
    status, values = peer.diagnostics(lambda values: float(values["time without a wrench [s]"]) > 1.5)
    assert status.level == DiagnosticStatus.WARN
    assert "wrench_timeout" in status.message and "held" in status.message
    assert values["external force [N]"] == "(0.05, 0.1, -0.05)"
    reply = peer.client.command({**GOOD, "inner_rotation": 0.52}, TIMEOUT)
    assert xyz(reply.tip.pose) == pytest.approx(solved(solver, Loads(FORCE), 0.52).tip.position, abs=SAME)
    peer.client.command(GOOD, TIMEOUT)
    assert peer.set_parameter("wrench_timeout", 0.0).successful
    status, _ = peer.diagnostics()
    assert status.level == DiagnosticStatus.OK


def test_commands_in_lock_step_are_all_answered_beside_a_stream_of_wrenches(peer, publisher):
    """Every answer that a wrench triggers stands between two commands, or is one with that of a command."""
    _, before = peer.diagnostics()
    sent = 0

    def send():
        nonlocal sent
        sent += 1
        publisher.publish(wrench_message((0.01 * (sent % 5), 0.0, 0.0), stamp=sent))

    timer = peer.ros.create_timer(0.01, send)
    for count in range(10):
        reply = peer.client.command({**GOOD, "inner_rotation": 0.5 + 0.01 * count}, TIMEOUT)
        assert reply.joints.position[2] == 0.5 + 0.01 * count
    peer.ros.destroy_timer(timer)
    accepted = str(int(before["commands accepted"]) + 10)
    _, after = peer.diagnostics(lambda values: values["commands accepted"] == accepted)
    assert int(after["wrenches accepted"]) > int(before["wrenches accepted"])
    assert after["wrenches rejected"] == before["wrenches rejected"]
    assert after["internal errors"] == "0"
    peer.client.command(GOOD, TIMEOUT)


def ask(peer, force=ZERO, moment=ZERO, **fields):
    request = SolveEquilibrium.Request(
        joints=joint_state(JOINTS, POSITIONS), tip_wrench=wrench(force, moment), **fields
    )
    return peer.client.solve(request, TIMEOUT)


@pytest.mark.parametrize("warm_start", [False, True])
def test_the_service_answers_under_a_load_as_the_solver_does(peer, apply, solver, warm_start):
    apply((0.0, 0.0, 0.2))  # what acts in the stream does not act here
    response = ask(peer, FORCE, MOMENT, warm_start=warm_start)
    answer = solved(solver, Loads(FORCE, MOMENT))
    assert response.success and response.fidelity == "full"
    assert xyz(response.tip.pose) == pytest.approx(answer.tip.position, abs=SAME)
    assert response.torque.tolist() == pytest.approx(answer.torque, abs=1e-6)
    assert response.force.tolist() == pytest.approx(answer.force, abs=1e-4)
    assert response.force_lower.tolist() == pytest.approx(answer.force_interval[:, 0], abs=1e-4)
    assert response.force_interval_reversed == answer.force_interval_reversed.tolist()
    unloaded = ask(peer, warm_start=warm_start)
    assert unloaded.fidelity != "full"
    assert xyz(unloaded.tip.pose) == pytest.approx(solved(solver, None).tip.position, abs=SAME)


@pytest.mark.parametrize(
    ("force", "moment", "words"),
    [
        ((0.0, math.nan, 0.0), ZERO, "non_finite: tip_wrench.force"),
        (ZERO, (0.0, 0.0, math.inf), "non_finite: tip_wrench.torque"),
        ((1e9, 0.0, 0.0), ZERO, "out_of_limits: tip_wrench.force"),
    ],
)
def test_the_service_refuses_a_load_that_no_robot_carries(peer, force, moment, words):
    response = ask(peer, force, moment)
    assert not response.success and response.status == "bad_input"
    assert response.message.startswith(words)
    assert len(response.force_interval_reversed) == 0


@pytest.mark.parametrize(
    ("option", "value"),
    [
        *(("fidelity", level) for level in PARAMETERS["fidelity"].choices),
        *(("force_model", model) for model in PARAMETERS["force_model"].choices),
    ],
)
def test_loads_are_taken_where_the_solver_takes_them(graph, robot, option, value):
    """By the service, which asks the solver, and by the rule for use_external_wrench, which does not."""
    request = SolveEquilibrium.Request(joints=joint_state(JOINTS, POSITIONS), tip_wrench=wrench(FORCE, ZERO))
    solved = do(ctr_pvs.EquilibriumSolver(robot, **{option: value}), job_of(request, CommandReader(robot), 2, TIMEOUT))
    taken = value in (LOADED_FIDELITIES if option == "fidelity" else LOADED_FORCE_MODELS)
    assert solved.status == ("ok" if taken else "bad_input")
    assert taken or value in solved.message
