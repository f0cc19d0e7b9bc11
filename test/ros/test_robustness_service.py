"""The service answers in time whatever it is asked and whatever the stream does; one node's trouble stays its own."""

import time

import pytest
from busy_machine import check_in_time

from ctr_pvs_interfaces.srv import SolveEquilibrium
from ros.load import ENDLESS
from ros.load import JOINTS
from ros.load import NEAR
from ros.load import Load
from ros.load import faults_in
from ros.load import joint_state

pytestmark = pytest.mark.alone

GOOD = dict(zip(JOINTS, (0.0, 0.0935, 0.5, 0.2085), strict=True))
BUDGET = 0.4  # s
GRACE = 0.1  # s, over the budget
TIMEOUT = 5.0
OWN_TOPICS = {"setpoint_js", "setpoint_cp", "backbone", "stability_margin"}
SHARED_TOPICS = {"/diagnostics", "/rosout", "/parameter_events"}


@pytest.fixture(scope="module")
def peer(start_node):
    peer = start_node("/asked", compute_budget=str(BUDGET))
    # Both ends of a service find each other at its first use, which takes its time.
    assert ask(peer, NEAR)[0].success
    return peer


@pytest.fixture(scope="module")
def other(start_node):
    return start_node("/other")


def ask(peer, positions, names=JOINTS):
    """The answer and the time it took [s]."""
    request = SolveEquilibrium.Request(
        joints=joint_state(list(names), positions), backbone_poses=2, warm_start=positions[2:3] == ENDLESS[2:3]
    )
    began = time.monotonic()
    return peer.client.solve(request, TIMEOUT), time.monotonic() - began


def send_endless(peer):
    """A command that the stream cannot follow to its end."""
    peer.client.command(dict(zip(JOINTS, NEAR, strict=True)), TIMEOUT)
    peer.send(joint_state(JOINTS, ENDLESS))


def xyz(reply):
    """Where the tip is [m]."""
    position = reply.tip.pose.position
    return [position.x, position.y, position.z]


def test_an_endless_request_ends_with_the_budget(peer):
    answer, took = ask(peer, ENDLESS)
    assert not answer.success
    assert answer.status == "timeout"
    assert answer.message
    check_in_time(took, BUDGET + GRACE)


@pytest.mark.parametrize("names", [JOINTS, JOINTS[:2]])
def test_the_service_does_not_wait_for_a_stream_that_is_out_of_time(peer, names):
    """The stream is at an endless command of its own when the request comes."""
    send_endless(peer)
    time.sleep(0.05)
    answer, took = ask(peer, ENDLESS[: len(names)], names)
    assert not answer.success
    check_in_time(took, BUDGET + GRACE)


def test_the_stream_goes_on_after_it_ran_out_of_time(peer):
    before = peer.client.command(GOOD, TIMEOUT)
    send_endless(peer)
    peer.diagnostics(lambda values: values["last status"] == "timeout")
    after = peer.client.command(GOOD, TIMEOUT)
    assert xyz(after) == pytest.approx(xyz(before), abs=1e-9)
    assert faults_in(peer.log) == []


def test_all_topics_of_a_node_lie_in_its_namespace(peer, other):
    for node in (peer, other):
        # The names of nodes come by another way than their topics do, and may be later.
        node.wait(
            lambda node=node: ("ctr_equilibrium", node.namespace) in node.ros.get_node_names_and_namespaces(), "it"
        )
        topics = node.ros.get_publisher_names_and_types_by_node("ctr_equilibrium", node.namespace)
        names = {name for name, _ in topics} - SHARED_TOPICS
        assert names >= {f"{node.namespace}/{topic}" for topic in OWN_TOPICS}
        assert all(name.startswith(f"{node.namespace}/") for name in names)


def test_trouble_in_one_namespace_is_not_seen_in_the_other(peer, other):
    before = other.client.command(GOOD, TIMEOUT)
    _, counts = other.diagnostics()
    load = Load(peer.namespace, backbone=False)
    for stamp in range(1, 51):
        load.send(joint_state(JOINTS, [float("nan")] * 4, stamp))
        load.spin_to(time.monotonic() + 0.005)
    load.send(joint_state(JOINTS, NEAR, 51))
    assert load.spin_until(lambda: 51 in load.answered, TIMEOUT)
    load.send(joint_state(JOINTS, ENDLESS, 52))
    took = other.client.command(GOOD, TIMEOUT).reply_time
    load.close()
    _, counts_after = other.diagnostics(lambda values: values["commands accepted"] != counts["commands accepted"])
    assert counts_after["commands rejected"] == counts["commands rejected"] == "0"
    assert int(counts_after["commands accepted"]) == int(counts["commands accepted"]) + 1
    assert xyz(other.client.command(GOOD, TIMEOUT)) == pytest.approx(xyz(before), abs=1e-9)
    check_in_time(took, BUDGET)
