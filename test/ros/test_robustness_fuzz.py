"""Fuzzed commands over DDS: nothing breaks the node, nothing that is not finite comes out, every refusal is counted."""

import contextlib
import time
from collections import Counter

import pytest
from joint_state_fuzz import fuzz
from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState

from ctr_pvs_ros.client.client import NoReply
from ros.load import Load
from ros.load import faults_in
from ros.load import joint_state
from ros.load import rejections

pytestmark = pytest.mark.alone

# s between broken commands, in one try of a batch after the other: long enough for the node to take each from its queue
# of one. A command that is overwritten there by the next, while the machine was busy elsewhere, is not counted, and
# rightly so; then the batch is sent again, more slowly. What is never counted fails at any pace.
PACES = (0.002, 0.006, 0.018, 0.054)
BATCH = 250
ANSWER_TIMEOUT = 5.0  # s
JOINTS = ["outer_rotation", "outer_translation", "inner_rotation", "inner_translation"]
GOOD = dict(zip(JOINTS, (0.0, 0.0935, 0.5, 0.2085), strict=True))


@pytest.fixture(scope="module")
def peer(start_node):
    return start_node("/fuzzed")


@pytest.fixture
def load(peer):
    load = Load(peer.namespace)
    yield load
    load.close()


def send_all(load, messages, first_stamp, pace):
    """Broken commands at a pace, good ones in lock step; the good ones that were not answered."""
    silent = []
    for stamp, message in enumerate(messages, start=first_stamp):
        command = joint_state(message.names, message.positions, stamp)
        command.velocity, command.effort = message.velocities, message.efforts
        load.send(command)
        if message.reasons:
            load.spin_to(time.monotonic() + pace)
        elif not load.spin_until(lambda stamp=stamp: stamp in load.answered, ANSWER_TIMEOUT):
            silent.append(message)
    return silent


def told(peer, rejected):
    """The diagnostics once they count so many rejections; the last ones where they never do."""
    last = {}

    def reached(values):
        last.update(values)
        return int(values["commands rejected"]) >= rejected

    with contextlib.suppress(NoReply):
        peer.diagnostics(reached)
    return last


def exchange(peer, load, messages, first_stamp, pace):
    """Send a batch and compare the node's account of it with ours; what differs, in words."""
    before = told(peer, rejected=0)
    silent = send_all(load, messages, first_stamp, pace)
    broken = [message for message in messages if message.reasons]
    wanted = int(before["commands rejected"]) + len(broken)
    after = told(peer, wanted)
    faults = [f"no answer to {message}" for message in silent]
    if int(after["commands rejected"]) != wanted:
        faults.append(f"{after['commands rejected']} rejections counted, {wanted} expected")
    counted = Counter(rejections(after)) - Counter(rejections(before))
    least = Counter(next(iter(message.reasons)) for message in broken if len(message.reasons) == 1)
    if least - counted:
        faults.append(f"rejections by reason fall short by {least - counted}")
    if sum(rejections(after).values()) != int(after["commands rejected"]):
        faults.append("the reasons do not add up to the rejections")
    return faults


def check(peer, load, seed, count):
    messages = list(fuzz(seed, count))
    stamp = 1
    for begin in range(0, count, BATCH):
        batch = messages[begin : begin + BATCH]
        for pace in PACES:
            faults = exchange(peer, load, batch, stamp, pace)
            stamp += len(batch)
            if not faults:
                break
        assert not faults
    assert load.not_finite == []
    assert faults_in(peer.log) == []
    assert peer.process.running


def test_five_hundred_fuzzed_commands(peer, load):
    check(peer, load, seed=2, count=500)


@pytest.mark.soak
def test_ten_thousand_fuzzed_commands(peer, load):
    check(peer, load, seed=3, count=10_000)


def test_bytes_that_are_no_joint_state(peer, load):
    """Cut off, lengthened, with wild lengths and text that is not UTF-8, as a broken client of another kind sends."""
    whole = bytearray(serialize_message(JointState(name=JOINTS, position=list(GOOD.values()))))
    wild_length, no_text = whole.copy(), whole.copy()
    wild_length[16:20] = b"\xff\xff\xff\x7f"
    at = whole.index(b"outer_rotation")
    no_text[at : at + 4] = b"\xff\xfe\x80\xc3"
    garbage = [whole[: len(whole) // 2], whole[:5], whole + bytes(1000), wild_length, no_text, b"\x00\x01\x00\x00" * 99]
    for message in garbage:
        load.send_bytes(bytes(message))
        load.spin_to(time.monotonic() + 0.02)
    assert peer.client.command(GOOD, ANSWER_TIMEOUT).tip.pose
    assert load.not_finite == []
    assert faults_in(peer.log) == []
