"""ctr_client, as it is called from a shell, against a running node."""

import json
import math
import re
import signal
import subprocess
import sys
import time

import pytest

from ros.load import JOINTS
from ros.load import joint_state

POSITIONS = [0.0, 0.0935, 100.0, 0.2085]  # rotations in deg: row 100 deg of the full overlap sweep
TIP = [0.080947838, 0.014570095, -0.038894751]  # m
TORQUE = 0.061670524708276796  # N m
SNAPS_AT = 282.0  # deg
WORDS = [f"{name}={position}" for name, position in zip(JOINTS, POSITIONS, strict=True)]
PROGRAM = [sys.executable, "-c", "from ctr_pvs_ros.front import ctr_client; raise SystemExit(ctr_client())"]
TIMEOUT = 60.0  # s
QUICK = 2.0  # s


@pytest.fixture(scope="module")
def peer(start_node):
    return start_node("/shell", compute_budget="30.0")  # where kernels run interpreted, the usual second is little


def client(*words):
    return subprocess.run([*PROGRAM, *words], capture_output=True, text=True, timeout=TIMEOUT)


def at_the_node(command, *words):
    return client(command, *words, "--namespace", "shell")


def turned_to(degrees):
    return [word if "inner_rotation" not in word else f"inner_rotation={degrees}" for word in WORDS]


class Watching:
    """A watcher that has found the node."""

    def __init__(self, peer, *words):
        command = [*PROGRAM, "watch", "--namespace", "shell", *words]
        before = peer.ros.count_subscribers("ctr_equilibrium/status")
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        peer.wait(lambda: peer.ros.count_subscribers("ctr_equilibrium/status") > before, "watcher", TIMEOUT)

    def __enter__(self):
        return self

    def __exit__(self, *error):
        if self.process.poll() is None:
            self.process.kill()
        self.process.communicate()

    def next_line(self):
        return self.process.stdout.readline()


def test_an_answer_is_told_and_exit_code_0(peer):
    run = at_the_node("send", *WORDS, "--degrees")
    assert (run.returncode, run.stderr) == (0, "")
    lines = dict(line.split(maxsplit=1) for line in run.stdout.splitlines())
    assert lines["accepted"] == "ok: stable equilibrium"
    assert [float(value) for value in lines["tip"].split()[:3]] == pytest.approx([1e3 * x for x in TIP], abs=1e-2)
    assert lines["inner_rotation"].split() == ["100.000", "deg", f"{TORQUE:.4f}", "N", "m"]
    assert lines["outer_translation"].split()[:2] == ["0.093500", "m"]
    assert "estimate" in lines["error"] and "ms" in lines["solve"]


def test_json_tells_all_of_it_to_the_last_bit(peer):
    run = at_the_node("send", *WORDS, "--degrees", "--json")
    assert run.returncode == 0
    told = json.loads(run.stdout)
    assert told["tip"]["position"] == pytest.approx(TIP, abs=1e-5)
    assert told["joints"]["name"] == JOINTS
    assert told["joints"]["position"] == [0.0, 0.0935, math.radians(100.0), 0.2085]
    assert told["joints"]["effort"][2] == pytest.approx(TORQUE, rel=1e-4)
    assert (told["outcome"], told["trigger"]) == ("accepted", ["command"])
    assert 0.0 < told["snap_reserve"] <= told["stability_margin"] <= 1.0
    reply = peer.client.command(dict(zip(JOINTS, told["joints"]["position"], strict=True)), TIMEOUT)
    assert reply.tip.pose.position.x == pytest.approx(told["tip"]["position"][0], abs=1e-9)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (WORDS[:2], "missing_joint: missing joints: 'inner_rotation', 'inner_translation'"),
        ([*WORDS, WORDS[0]], "duplicate_joint"),
        ([*WORDS, "elbow=1"], "unknown_joint"),
        ([*WORDS[:3], "inner_translation=9"], "out_of_limits: inner_translation: "),
    ],
)
def test_a_refusal_is_told_with_its_reason_and_exit_code_1(peer, words, told):
    run = at_the_node("send", *words)
    assert run.returncode == 1
    assert run.stdout.startswith(f"refused  {told}")
    assert len(run.stdout.splitlines()) == 1
    assert run.stderr == ""


def test_a_partial_command_is_for_the_nodes_merge_partial_to_allow(peer):
    assert at_the_node("send", *WORDS, "--degrees").returncode == 0
    peer.set_parameter("merge_partial", True)
    run = at_the_node("send", "outer_rotation=10", "--degrees", "--json")
    peer.set_parameter("merge_partial", False)
    assert run.returncode == 0
    positions = json.loads(run.stdout)["joints"]["position"]
    assert positions == [math.radians(10.0), 0.0935, math.radians(100.0), 0.2085]


def test_a_snap_is_told_and_still_an_answer(start_node):
    start_node("/snapping", compute_budget="30.0")
    before, after = (
        client("send", *turned_to(degrees), "--degrees", "--wait", "40", "--namespace", "snapping")
        for degrees in (SNAPS_AT - 12.0, SNAPS_AT + 8.0)
    )
    assert before.stdout.startswith("accepted ")
    assert after.returncode == 0
    assert after.stdout.startswith("snap ")
    assert "\ntip " in after.stdout


def test_the_watcher_tells_of_every_command_and_ends_on_ctrl_c(peer):
    good = [0.0, 0.0935, math.radians(100.0), 0.2085]
    peer.client.command(dict(zip(JOINTS, good, strict=True)), TIMEOUT)
    with Watching(peer) as watching:
        last = watching.next_line().split()
        assert last[1:3] == ["accepted", "ok"]
        peer.send(joint_state(JOINTS, good, stamp=5_250_000_000))
        line = watching.next_line().split()
        assert line[:3] == ["5.250", "accepted", "ok"]
        place = line.index("tip") + 1
        assert [float(value) for value in line[place : place + 3]] == pytest.approx([1e3 * x for x in TIP], abs=1e-2)
        peer.send(joint_state(JOINTS[:1], [0.0], stamp=6_000_000_000))
        assert watching.next_line().startswith("6.000 refused  missing_joint  missing joints: ")
        began = time.monotonic()
        watching.process.send_signal(signal.SIGINT)
        assert watching.process.wait(TIMEOUT) == 0
        assert time.monotonic() - began < QUICK
        assert "Traceback" not in watching.process.stderr.read()


def test_a_line_of_json_for_each_status_and_no_more_than_asked_for(peer):
    with Watching(peer, "--json", "--count", "4") as watching:
        watching.next_line()
        for stamp in (1, 2, 3):
            peer.send(joint_state(JOINTS[:1], [0.0], stamp=stamp))
            told = json.loads(watching.next_line())
            assert told["stamp"] == {"sec": 0, "nanosec": stamp}
            assert (told["outcome"], told["reason"], told["tip"]) == ("refused", "missing_joint", None)
        assert watching.process.wait(TIMEOUT) == 0


def test_of_what_was_before_the_watcher_shows_only_the_last(peer):
    with Watching(peer) as hearing:  # so that both are said aloud, and the node keeps them for late joiners
        hearing.next_line()
        for stamp in (7_000_000_000, 8_000_000_000):
            peer.send(joint_state(JOINTS[:1], [0.0], stamp=stamp))
            assert hearing.next_line().startswith(f"{stamp // 10**9}.000")
        run = at_the_node("watch", "--count", "1")
    assert run.returncode == 0
    assert [line[:5] for line in run.stdout.splitlines()] == ["8.000"]


def test_the_service_answers_beside_the_stream(peer):
    run = at_the_node("solve", *WORDS, "--degrees", "--json", "--wait", "40")
    assert (run.returncode, run.stderr) == (0, "")
    told = json.loads(run.stdout)
    assert told["tip"]["position"] == pytest.approx(TIP, abs=1e-5)
    assert told["torque"][1] == pytest.approx(TORQUE, rel=1e-4)
    assert told["force_upper"][0] == pytest.approx(2.0081, abs=1e-4)
    assert len(told["backbone"]["s"]) == len(told["backbone"]["position"]) == 60
    text = at_the_node("solve", *WORDS, "--degrees", "--warm", "--wait", "40").stdout
    assert "tube 2 of 2" in text and "from 0.3853 to 2.0081 N" in text


def test_the_service_takes_a_load(peer):
    words = ["solve", *WORDS, "--degrees", "--json", "--wait", "40"]
    free, pulled, turned = (
        json.loads(at_the_node(*words, *load).stdout)["tip"]["position"]
        for load in ([], ["--force", "0", "0", "-1e-1"], ["--moment", "0", "0", "0.01"])
    )
    assert -1e-3 < pulled[2] - free[2] < -1e-4
    assert turned[1] - free[1] > 1e-4


def test_what_inverse_finds_can_be_sent(peer):
    assert at_the_node("send", *WORDS, "--degrees", "--wait", "40").returncode == 0
    words = ["inverse", "--position", "0.085", "0.01", "-0.035", "--wait", "40"]
    run = at_the_node(*words, "--json", "--all")
    assert (run.returncode, run.stderr) == (0, "")
    told = json.loads(run.stdout)
    first = told["solutions"][0]
    assert told["status"] == "reached" and first["distance"] < 1e-6
    assert first["way"][0] == [0.0, 0.0935, math.radians(100.0), 0.2085]
    sent = at_the_node("send", *map("{}={!r}".format, first["joints"]["name"], first["joints"]["position"]), "--json")
    assert json.loads(sent.stdout)["tip"]["position"] == pytest.approx([0.085, 0.01, -0.035], abs=1.2e-5)
    text = at_the_node(*words, *WORDS, "--degrees", "--tangent", "1", "0", "0")
    assert text.returncode == 1  # two tubes meet no direction beside a place
    assert re.search(r"^closest +tip [0-9.e-]+ mm off, [0-9.e-]+ rad turned", text.stdout)
    assert re.search(r"^outer_rotation +[0-9.-]+ deg", text.stdout, re.MULTILINE) and "\nway " in text.stdout


def test_the_service_refuses_with_exit_code_1(peer):
    run = at_the_node("solve", *WORDS[:3])
    assert run.returncode == 1
    assert run.stdout.startswith("bad_input  missing_joint: ")
    run = at_the_node("inverse", "--position", "0.1", "0", "0", *WORDS[:3])
    assert run.returncode == 1
    assert run.stdout.startswith("bad_input  missing_joint: ")
    run = at_the_node("inverse", "--position", "0.1", "0", "0", "--orientation", "0", "0", "0", "0")
    assert run.returncode == 1
    assert run.stdout == "bad_input  out_of_limits: target.orientation: expected a unit quaternion, got norm 0\n"


@pytest.mark.parametrize("command", ["send", "solve"])
def test_no_node_is_one_line_and_exit_code_2(graph, command):
    run = client(command, *WORDS, "--namespace", "nowhere", "--wait", "0.5")
    assert (run.returncode, run.stdout) == (2, "")
    (line,) = run.stderr.splitlines()
    assert line.startswith("ctr_client: no ") and "/nowhere/ctr_equilibrium" in line
    assert "within 0.5 s: is it running, under this --namespace" in line


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["send", "foo"], "expected JOINT=POSITION"),
        (["watch", "--namespace", "no such"], "Invalid namespace"),
        (["watch", "--node", "no/such"], "Invalid node name"),
    ],
)
def test_wrong_usage_is_one_line_and_exit_code_2(graph, words, told):
    run = client(*words)
    assert (run.returncode, run.stdout) == (2, "")
    (line,) = run.stderr.splitlines()
    assert line.startswith("ctr_client: ") and told in line


@pytest.mark.parametrize(("command", "code"), [("watch", 0), ("send", 130), ("solve", 130)])
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_it_quickly_while_it_waits_for_a_node(peer, command, code, number):
    words = [command, "--namespace", "signalled", *(WORDS if command != "watch" else [])]
    process = subprocess.Popen([*PROGRAM, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    node = f"ctr_client_{process.pid}"
    peer.wait(lambda: node in peer.ros.get_node_names(), "client", TIMEOUT)
    began = time.monotonic()
    process.send_signal(number)
    out, err = process.communicate(timeout=TIMEOUT)
    assert process.returncode == code, err
    assert time.monotonic() - began < QUICK
    assert out == ""
    assert "Traceback" not in err


def test_a_reader_who_has_seen_enough_is_no_fault(peer):
    with Watching(peer) as watching:
        watching.next_line()
        watching.process.stdout.close()
        peer.send(joint_state(JOINTS[:1], [0.0], stamp=9_000_000_000))
        assert watching.process.wait(TIMEOUT) == 0
        assert "Error" not in watching.process.stderr.read()
        watching.process.stdout = None
