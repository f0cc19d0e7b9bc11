"""Start-up is refused for every kind of wrong robot file, and the node ends cleanly from whatever it is doing."""

import copy
import fcntl
import os
import signal
import subprocess
import time
from pathlib import Path

import pytest
import yaml
from busy_machine import check_in_time

from ctr_pvs_ros.process import NodeProcess
from ctr_pvs_ros.process import share_file
from ros.load import ENDLESS
from ros.load import JOINTS
from ros.load import NEAR
from ros.load import children
from ros.load import faults_in
from ros.load import joint_state

pytestmark = pytest.mark.alone

ROBOT = share_file("config", "renda2021.yaml")
LIMIT = 2.0  # s, to refuse a start and to end after a signal


def edited(*changes):
    """renda2021.yaml with values replaced: (path, value) each; the value None takes the key away."""
    robot = copy.deepcopy(yaml.safe_load(ROBOT.read_text(encoding="utf-8")))
    for path, value in changes:
        *parents, last = path
        place = robot
        for key in parents:
            place = place[key]
        if value is None:
            del place[last]
        else:
            place[last] = value
    return yaml.safe_dump(robot).encode()


WRONG_FILES = {
    "no_such_key": (edited((("tubes", 0, "diameter"), 2e-3)), ("tubes[0]", "'diameter'")),
    "not_a_number": (edited((("tubes", 1, "youngs_modulus"), "soft")), ("tubes[1].youngs_modulus", "soft", "expected")),
    "tubes_that_do_not_fit": (edited((("tubes", 1, "outer_diameter"), 3e-3)), ("tubes[1]", "0.003", "expected")),
    "missing_key": (edited((("tubes", 1, "segments"), None)), ("tubes[1]", "segments")),
    "limits_that_leave_nothing": (edited((("limits",), {"D": {"outer": [0.2, 0.1]}})), ("limits.D", "0.2")),
    "no_yaml": (b"\x89PNG\r\n\x1a\n\x00\x00", ()),
}


@pytest.mark.parametrize("kind", WRONG_FILES)
def test_a_wrong_robot_file_is_refused_naming_file_key_value_and_rule(graph, tmp_path, kind):
    content, words = WRONG_FILES[kind]
    robot_file, log = tmp_path / f"{kind}.yaml", tmp_path / "log.txt"
    robot_file.write_bytes(content)
    began = time.monotonic()
    with log.open("wb") as output, NodeProcess(robot_file, log=output) as process:
        code = process.wait(10.0)
    check_in_time(time.monotonic() - began, LIMIT)
    text = log.read_text(encoding="utf-8")
    assert code == 2
    assert text.count("\n") == 1, text
    for word in (robot_file.name, *words):
        assert word in text, text


@pytest.mark.soak
def test_a_wrong_robot_file_never_opens_an_output(graph, tmp_path, start_node):
    """Seen from a node that does run, in the same graph."""
    peer = start_node("/stays")
    robot_file = tmp_path / "wrong.yaml"
    robot_file.write_bytes(WRONG_FILES["not_a_number"][0])
    with (tmp_path / "log.txt").open("wb") as output:
        process = NodeProcess(robot_file, namespace="/refused", log=output)
        outputs = []
        while process.running:
            outputs += peer.ros.get_publishers_info_by_topic("/refused/setpoint_cp")
            time.sleep(0.01)
    assert process.wait(0.0) == 2
    assert outputs == []


@pytest.mark.soak
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_ten_stops_in_mid_solve(start_node, number):
    for count in range(10):
        peer = start_node(f"/mid_solve_{number.name.lower()}_{count}", compute_budget="60.0")
        peer.client.command(dict(zip(JOINTS, NEAR, strict=True)), 5.0)
        peer.send(joint_state(JOINTS, ENDLESS))
        time.sleep(0.1 + 0.05 * count)
        began = time.monotonic()
        assert peer.process.stop(number) == 0
        check_in_time(time.monotonic() - began, LIMIT)
        assert faults_in(peer.log) == []


def shared_memory(pid):
    """Paths of the middleware's shared memory that a process uses; its ports belong to nobody in particular."""
    lines = Path(f"/proc/{pid}/maps").read_text(encoding="utf-8").splitlines()
    paths = {Path(line.split()[-1]) for line in lines if "/dev/shm/fastrtps_" in line}
    return {path for path in paths if "_port" not in path.name}


def abandoned(path):
    """Whether nobody holds the lock that the owner of a piece of shared memory has on its companion file."""
    with open(f"{path}_el", encoding="utf-8") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
    return True


def test_nothing_is_left_in_shared_memory(start_node):
    """Half a megabyte each time would fill the memory of a machine that starts and stops nodes for months."""
    before = set(Path("/dev/shm").iterdir())
    peer = start_node("/tidy")
    processes = [peer.process.id, *children(peer.process.id)]
    used = set().union(*map(shared_memory, processes)) - before
    assert used
    assert peer.process.stop(signal.SIGTERM) == 0
    assert [path.name for path in used if path.exists() and abandoned(path)] == []


def test_impatience_does_not_spoil_a_clean_end(start_node):
    """Ctrl-C again and again, as people do."""
    peer = start_node("/impatient", compute_budget="60.0")
    peer.client.command(dict(zip(JOINTS, NEAR, strict=True)), 5.0)
    peer.send(joint_state(JOINTS, ENDLESS))
    time.sleep(0.2)
    began = time.monotonic()
    code = None
    while code is None and time.monotonic() - began < LIMIT:
        if peer.process.running:
            os.kill(peer.process.id, signal.SIGINT)
        try:
            code = peer.process.wait(0.05)
        except subprocess.TimeoutExpired:
            code = None
    check_in_time(time.monotonic() - began, LIMIT)
    assert code == 0
    assert faults_in(peer.log) == []
