"""The service ~/inverse: what it finds is sent back as commands, and the node says where the tip then is."""

import math
import signal
import time

import numpy as np
import pytest
from busy_machine import check_in_time
from geometry_msgs.msg import PoseStamped
from sensor_msgs.msg import JointState

from ctr_pvs import EquilibriumSolver
from ctr_pvs import Loads
from ctr_pvs import load_robot
from ctr_pvs.tasks.aim import tangent_of
from ctr_pvs_interfaces.srv import SolveEquilibrium
from ctr_pvs_interfaces.srv import SolveInverse
from ctr_pvs_ros.process import share_file
from ros.load import ENDLESS
from ros.load import JOINTS
from ros.load import NEAR
from ros.load import Load
from ros.load import faults_in
from ros.load import joint_state
from ros.load import wrench

pytestmark = pytest.mark.alone

ROBOT = share_file("config", "renda2021.yaml")
START = [0.0, 0.09, 1.0, 0.17]
NOT_FAR = [0.3, 0.085, 1.5, 0.165]  # where the targets' tips are
FAR = [0.5, 0.1, 0.0]  # m, out of reach
TOLERANCE = 1e-5  # m, of the node's answers
WITHIN = 1e-6
TIMEOUT = 30.0  # s
LIMIT = 2.0  # s, to end after a signal
GRACE, WIRE = 0.1, 0.1  # s
PERIOD = 0.01  # s, of a stream


@pytest.fixture(scope="module")
def peer(start_node):
    # Leniencies are for the stream only. A busy machine must not look like a target out of reach.
    peer = start_node("/inverse", merge_partial="true", clamp_to_limits="true", compute_budget="20.0", on_snap="hold")
    # Both ends of a service find each other at its first use, which takes its time.
    peer.client.wait_for_services(TIMEOUT)
    find(peer, FAR, goal="")
    return peer


@pytest.fixture(scope="module")
def goal():
    """The tip of a command, by a solver that knows nothing of the node's."""
    return EquilibriumSolver(load_robot(ROBOT), 1e-8).solve(*np.split(np.array(NOT_FAR)[[0, 2, 1, 3]], 2)).tip


def target(position, orientation=(0.0, 0.0, 0.0, 1.0), frame=""):
    message = PoseStamped()
    message.header.frame_id = frame
    for part, names, values in (
        (message.pose.position, "xyz", position),
        (message.pose.orientation, "xyzw", orientation),
    ):
        for name, value in zip(names, values, strict=True):
            setattr(part, name, float(value))
    return message


def find(peer, position, orientation=(0.0, 0.0, 0.0, 1.0), frame="", **fields):
    return peer.client.inverse(SolveInverse.Request(target=target(position, orientation, frame), **fields), TIMEOUT)


def stand_at(peer, positions):
    return peer.client.command(dict(zip(JOINTS, positions, strict=True)), TIMEOUT)


def place_of(pose):
    return np.array([pose.position.x, pose.position.y, pose.position.z])


def steps_of(solution):
    return np.reshape(solution.way, (-1, len(solution.command.name)))


def check_sent(peer, solution):
    """The way, sent command by command, is answered without a snap with the margins that were told, and ends where the
    tip was told to be."""
    for step, margin in zip(steps_of(solution), solution.way_stability_margin, strict=True):
        reply = stand_at(peer, step.tolist())
        assert reply.stability_margin == pytest.approx(margin, abs=1e-3)
    assert list(reply.joints.position) == list(solution.command.position)
    assert list(reply.joints.effort) == pytest.approx(list(solution.command.effort), rel=1e-3, abs=1e-5)
    assert np.linalg.norm(place_of(reply.tip.pose) - place_of(solution.tip.pose)) < TOLERANCE
    return place_of(reply.tip.pose)


def test_before_the_first_answer_the_way_begins_half_out(start_node, goal):
    fresh = start_node("/inverse_fresh", compute_budget="20.0")
    response = find(fresh, goal.position)
    assert response.success
    lengths = [tube.length for tube in load_robot(ROBOT).tubes]
    assert steps_of(response.solution)[0].tolist() == pytest.approx([0.0, lengths[0] / 2, 0.0, lengths[1] / 2])
    check_sent(fresh, response.solution)


def test_what_is_reached_is_reached_when_it_is_sent(peer, goal):
    before = stand_at(peer, START)
    response = find(peer, goal.position, frame="ctr_base")
    solution = response.solution
    assert (response.success, response.status) == (True, "reached")
    assert "reached" in response.message and response.iterations > 0 and response.solve_time > 0.0
    assert response.others == []
    assert list(solution.command.name) == JOINTS
    assert solution.distance < WITHIN and solution.angle == 0.0 and 0.1 <= solution.stability_margin <= 1.0
    assert solution.tip.header.frame_id == solution.command.header.frame_id == "ctr_base"
    assert np.linalg.norm(place_of(solution.tip.pose) - goal.position) == pytest.approx(solution.distance, abs=1e-12)
    assert steps_of(solution)[0].tolist() == list(before.joints.position)  # where the stream is
    assert steps_of(solution)[-1].tolist() == list(solution.command.position)
    assert np.linalg.norm(check_sent(peer, solution) - goal.position) < TOLERANCE + WITHIN


def test_a_start_that_is_named_is_where_the_way_begins(peer, goal):
    stand_at(peer, START)
    request = JointState(name=JOINTS[::-1], position=NEAR[::-1])
    solution = find(peer, goal.position, start=request).solution
    assert steps_of(solution)[0].tolist() == pytest.approx(NEAR, abs=1e-15)
    check_sent(peer, solution)


def test_the_stamp_is_kept(peer, goal):
    request = SolveInverse.Request(target=target(goal.position))
    request.target.header.stamp.sec = 5
    solution = peer.client.inverse(request, TIMEOUT).solution
    assert solution.command.header.stamp.sec == solution.tip.header.stamp.sec == 5


def test_a_tangent_that_is_asked_for_is_met_or_told(peer):
    """Two tubes have one freedom beside a position; where the robot stands they meet its own tangent."""
    tip = stand_at(peer, NOT_FAR).tip.pose
    turned = (tip.orientation.x, tip.orientation.y, tip.orientation.z, tip.orientation.w)
    stay = find(peer, place_of(tip), turned, goal="tangent")
    assert stay.success and stay.solution.angle < 1e-4 and len(stay.solution.way_stability_margin) == 1
    other = find(peer, place_of(tip), goal="tangent")  # along +x, which this tip is not
    assert not other.success and other.solution.angle > 0.01
    orientation = other.solution.tip.pose.orientation
    tangent = tangent_of(np.array([orientation.x, orientation.y, orientation.z, orientation.w]))
    assert other.solution.angle == pytest.approx(math.acos(tangent[0]), abs=1e-6)


def test_out_of_reach_the_closest_point_is_told(peer):
    stand_at(peer, START)
    response = find(peer, FAR)
    assert (response.success, response.status) == (False, "closest")
    assert f"{1e3 * response.solution.distance:.6g} mm off" in response.message
    tip = check_sent(peer, response.solution)
    assert np.linalg.norm(tip - FAR) == pytest.approx(response.solution.distance, abs=TOLERANCE)
    rng = np.random.default_rng(1)
    D = np.sort(rng.random((2000, 2)) ** 2 * [0.17, 0.3], axis=1)
    alpha = np.column_stack([rng.uniform(-np.pi, np.pi, 2000), rng.uniform(-np.pi, np.pi, 2000)])
    some = EquilibriumSolver(load_robot(ROBOT)).solve_batch(alpha, D)
    assert response.solution.distance < np.linalg.norm(some.tip_position[some.success] - FAR, axis=1).min()


def test_all_solutions_bring_the_tip_there(peer, goal):
    response = find(peer, goal.position, all=True)
    every = [response.solution, *response.others]
    assert response.success and len(every) > 1
    margins = [one.stability_margin for one in every]
    assert margins == sorted(margins, reverse=True)
    for one in every:
        begin = JointState(name=JOINTS, position=steps_of(one)[0].tolist())
        assert list(begin.position) == steps_of(every[0])[0].tolist()
        stand_at(peer, begin.position)
        assert np.linalg.norm(check_sent(peer, one) - goal.position) < TOLERANCE + WITHIN


def test_a_load_acts_on_the_whole_way(start_node, goal):
    loaded = start_node("/inverse_loaded", use_external_wrench="true", compute_budget="20.0")
    stand_at(loaded, START)
    force = (0.0, 0.15, -0.1)
    solution = find(loaded, goal.position, tip_wrench=wrench(force, (0.0, 0.0, 0.0))).solution
    assert solution.distance < WITHIN
    solver = EquilibriumSolver(load_robot(ROBOT), 1e-7)
    for step in steps_of(solution):
        answer = solver.solve(step[0::2], step[1::2], loads=Loads(force))
    assert np.linalg.norm(answer.tip.position - goal.position) < TOLERANCE + WITHIN


def test_limits_that_are_set_hold_for_searches(peer, goal):
    stand_at(peer, START)
    limits = [0.05, 0.12, 0.1, 0.2]
    assert peer.set_parameter("translation_limits", limits).successful
    try:
        solution = find(peer, goal.position).solution
        far = find(peer, FAR)
        for step in np.concatenate([steps_of(solution), steps_of(far.solution)]):
            assert limits[0] <= step[1] <= limits[1] and limits[2] <= step[3] <= limits[3]
        assert far.status == "limits" and "D[" in far.message
    finally:
        assert peer.set_parameter("translation_limits", [0.0, 0.17, 0.0, 0.3]).successful


def test_a_search_ends_in_its_time(peer):
    stand_at(peer, START)
    began = time.monotonic()
    response = find(peer, FAR, all=True, time_limit=0.05, tip_wrench=wrench((0.0, 0.1, 0.1), (0.0, 0.0, 0.0)))
    check_in_time(time.monotonic() - began, 0.05 + GRACE + WIRE)
    assert not response.success and response.status == "timeout"


@pytest.mark.parametrize(
    ("fields", "word"),
    [
        ({"position": [0.1, math.nan, 0.0]}, "non_finite: target.position"),
        ({"position": [99.0, 0.0, 0.0]}, "out_of_limits: target.position"),
        ({"frame": "world"}, "unknown_frame: target.header.frame_id"),
        ({"goal": "tangent", "orientation": [0.0] * 4}, "out_of_limits: target.orientation"),
        ({"goal": "orientation", "orientation": [math.nan, 0.0, 0.0, 1.0]}, "non_finite: target.orientation"),
        ({"goal": "sideways"}, "goal: expected one of position, tangent, orientation, got 'sideways'"),
        ({"goal": ""}, "goal: expected"),
        ({"within": 0.0}, "within: expected a number above 0"),
        ({"within": math.nan}, "within: expected"),
        ({"within_angle": -1.0}, "within_angle: expected"),
        ({"margin_floor": 1.0}, "margin_floor: expected"),
        ({"margin_floor": math.nan}, "margin_floor: expected"),
        ({"time_limit": -1.0}, "time_limit: expected"),
        ({"time_limit": 61.0}, "time_limit: expected 0 to 60 s"),
        ({"start": JointState(name=JOINTS[:3], position=START[:3])}, "missing_joint"),
        ({"start": JointState(position=START)}, "nameless"),
        ({"start": JointState(name=JOINTS, position=START[:3])}, "ragged"),
        ({"start": JointState(name=JOINTS, position=[0.0, math.nan, 0.0, 0.2])}, "non_finite"),
        ({"start": JointState(name=JOINTS, position=[0.0, 5.0, 0.0, 6.0])}, "out_of_limits"),
        ({"tip_wrench": wrench((math.nan, 0.0, 0.0), (0.0, 0.0, 0.0))}, "non_finite: tip_wrench.force"),
        ({"tip_wrench": wrench((0.0, 0.0, 0.0), (0.0, 1e3, 0.0))}, "out_of_limits: tip_wrench.torque"),
    ],
)
def test_bad_input_is_answered_with_the_reason(peer, fields, word):
    response = find(peer, **{"position": [0.1, 0.0, 0.0], **fields})
    assert (response.success, response.status) == (False, "bad_input")
    assert word in response.message
    solution = response.solution
    assert len(solution.command.name) == len(solution.command.position) == len(solution.way) == 0
    assert math.isnan(solution.tip.pose.position.x) and math.isnan(solution.distance)
    assert math.isnan(solution.stability_margin)


def test_other_names_and_signs_of_joints_hold_for_searches(start_node, goal):
    named = start_node("/inverse_named", joint_prefix="left_", translation_sign="-1", compute_budget="20.0")
    joints = [f"left_{name}" for name in JOINTS]
    begin = JointState(name=joints, position=[0.0, -0.09, 1.0, -0.17])
    solution = find(named, goal.position, start=begin).solution
    assert solution.distance < WITHIN and list(solution.command.name) == joints
    assert all(position < 0.0 for position in solution.command.position[1::2])
    reply = named.client.command(dict(zip(joints, begin.position, strict=True)), TIMEOUT)
    for step in steps_of(solution):
        reply = named.client.command(dict(zip(joints, step.tolist(), strict=True)), TIMEOUT)
    assert np.linalg.norm(place_of(reply.tip.pose) - goal.position) < TOLERANCE + WITHIN
    assert list(reply.joints.effort) == pytest.approx(list(solution.command.effort), rel=1e-3, abs=1e-5)


def test_searches_leave_stream_and_solves_as_they_are(start_node, goal):
    """Of two nodes that are told the same, one searches beside it: they answer the same, to the last bit."""
    asked, left_alone = start_node("/searching"), start_node("/not_searching")
    for angle in (1.0, 1.7, -0.5):
        find(asked, goal.position, all=True)
        find(asked, FAR)
        there, here = (stand_at(peer, [0.0, 0.0935, angle, 0.2085]) for peer in (asked, left_alone))
        assert there.tip.pose == here.tip.pose and there.joints.effort == here.joints.effort
        request = SolveEquilibrium.Request(
            joints=JointState(name=JOINTS, position=[0.0, 0.09, 2.0 * angle, 0.17]), warm_start=True
        )
        there, here = (peer.client.solve(request, TIMEOUT) for peer in (asked, left_alone))
        assert there.success and there.tip.pose == here.tip.pose


def test_a_stream_at_100_hz_is_answered_while_searches_run(peer):
    """As commands come in, they are answered, not when a search is over: the newest wins, but hardly any is late."""
    load = Load(peer.namespace, backbone=False)
    ask = load.ros.create_client(SolveInverse, "ctr_equilibrium/inverse")
    assert load.spin_until(ask.service_is_ready, TIMEOUT)
    begin, beside, stamp, future = time.monotonic(), [], 0, None
    while len(beside) < 200:
        if future is None or future.done():
            assert future is None or future.result().status in ("closest", "timeout")
            future = ask.call_async(SolveInverse.Request(target=target(FAR), all=True, time_limit=10.0))
        stamp += 1
        load.spin_to(begin + PERIOD * stamp)
        if not future.done():
            beside.append(stamp)
        load.send(joint_state(JOINTS, [0.0, 0.09, 1.0 + 0.001 * (stamp % 500), 0.17], stamp))
        assert time.monotonic() - begin < 60.0
    assert load.spin_until(lambda: stamp in load.answered, TIMEOUT)
    answered = [load.answered[stamp] - load.sent[stamp] for stamp in beside if stamp in load.answered]
    median, most = 1e3 * np.median(answered), 1e3 * max(answered)
    print(f"{len(answered)} of {len(beside)} answered, median {median:.1f} ms, most {most:.1f} ms")
    load.close()
    assert len(answered) > 0.9 * len(beside)
    assert faults_in(peer.log) == []


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_the_end_of_the_node_does_not_wait_for_searches(start_node, number):
    peer = start_node(f"/searched_and_ended_by_{number.name.lower()}", compute_budget="60.0")
    stand_at(peer, NEAR)
    start = JointState(name=JOINTS, position=NEAR)
    endless = JointState(name=JOINTS, position=ENDLESS)
    ask = peer.ros.create_client(SolveInverse, "ctr_equilibrium/inverse")
    peer.wait(ask.service_is_ready, "service", TIMEOUT)
    futures = [ask.call_async(SolveInverse.Request(target=target(FAR), start=at)) for at in (endless, start)]
    time.sleep(0.5)
    began = time.monotonic()
    assert peer.process.stop(number) == 0
    check_in_time(time.monotonic() - began, LIMIT)
    assert not any(future.done() for future in futures)
    assert faults_in(peer.log) == []
