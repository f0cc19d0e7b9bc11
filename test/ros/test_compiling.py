"""A node that finds no compiled kernels serves interpreted, compiles beside that, and switches; it says so."""

import math
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from busy_machine import check_in_time
from sensor_msgs.msg import JointState

from ctr_pvs_interfaces.srv import SolveEquilibrium
from ctr_pvs_ros.process import share_file
from ros.load import children
from ros.load import faults_in

pytestmark = pytest.mark.alone

ROBOT = share_file("config", "renda2021.yaml")
COMMAND = {"outer_rotation": 0.0, "outer_translation": 0.0935, "inner_rotation": 1.0, "inner_translation": 0.2085}
LIMIT = 2.0  # s, to end after a signal
COMPILING = 1200.0  # s; a busy machine takes its time
IMPORTS = """
import sys
from ctr_pvs_ros.executable import main
print(main(["node", "--ros-args", "-p", f"robot_file:={sys.argv[1]}"]), "numba" in sys.modules)
"""


@pytest.fixture
def cold(monkeypatch, tmp_path):
    """Nothing is compiled for what is started here."""
    pytest.importorskip("numba")
    monkeypatch.delenv("NUMBA_DISABLE_JIT", raising=False)
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "kernels"))


def descendants(pid):
    """All processes that a process has started, and those that they have."""
    own = children(pid)
    return own + [each for child in own for each in descendants(child)]


def compilers(pid):
    """Those of them that compile."""
    return [each for each in descendants(pid) if b"ctr_pvs.kernel" in Path(f"/proc/{each}/cmdline").read_bytes()]


def running(pid):
    """Whether a process is there and no zombie, which waits for nothing but its parent."""
    try:
        return "\nState:\tZ" not in Path(f"/proc/{pid}/status").read_text(encoding="ascii")
    except OSError:
        return False


def position(reply):
    """Of the tip [m]."""
    point = reply.tip.pose.position
    return [point.x, point.y, point.z]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_node_that_compiles_serves_meanwhile_and_ends_with_all_it_started(cold, start_node, number):
    peer = start_node(f"/cold_{number.name.lower()}")
    assert all(map(math.isfinite, position(peer.client.command(COMMAND, 10.0))))
    (line,) = (line for line in peer.log.read_text(encoding="utf-8").splitlines() if "interpreted" in line)
    assert "not compiled yet" in line and "beside the node" in line
    deadline = time.monotonic() + 30.0
    while len(compilers(peer.process.id)) < 2:  # the one that compiles has begun, and started others
        assert time.monotonic() < deadline
        time.sleep(0.05)
    processes = descendants(peer.process.id)
    began = time.monotonic()
    assert peer.process.stop(number) == 0
    check_in_time(time.monotonic() - began, LIMIT)
    assert [pid for pid in processes if running(pid)] == []
    assert faults_in(peer.log) == []


def test_a_killed_node_leaves_nobody_compiling(cold, start_node):
    peer = start_node("/cold_and_killed")
    deadline = time.monotonic() + 30.0
    while len(compilers(peer.process.id)) < 2:
        assert time.monotonic() < deadline
        time.sleep(0.05)
    processes = descendants(peer.process.id)
    peer.process.stop(signal.SIGKILL)
    while any(map(running, processes)):
        assert time.monotonic() < deadline + LIMIT
        time.sleep(0.05)


@pytest.mark.soak
def test_a_node_switches_to_compiled_kernels_and_says_the_same(cold, start_node):
    peer = start_node("/warms_up")
    before = position(peer.client.command(COMMAND, 10.0))
    deadline = time.monotonic() + COMPILING
    while "from now on they run compiled" not in peer.log.read_text(encoding="utf-8"):
        assert time.monotonic() < deadline
        peer.client.command(COMMAND | {"inner_rotation": 0.5}, 10.0)
        time.sleep(1.0)
    assert position(peer.client.command(COMMAND, 10.0)) == pytest.approx(before, abs=1e-9)
    joints = JointState(name=list(COMMAND), position=list(COMMAND.values()))
    answer = peer.client.solve(SolveEquilibrium.Request(joints=joints), 10.0)
    assert position(answer) == pytest.approx(before, abs=1e-9)
    assert compilers(peer.process.id) == []
    assert peer.process.stop() == 0
    assert faults_in(peer.log) == []


def test_a_node_that_must_not_compile_says_so_and_starts_nothing(start_node, monkeypatch):
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "1")
    peer = start_node("/told_not_to")
    peer.client.command(COMMAND, 10.0)
    (line,) = (line for line in peer.log.read_text(encoding="utf-8").splitlines() if "interpreted" in line)
    assert "NUMBA_DISABLE_JIT" in line
    assert compilers(peer.process.id) == []


@pytest.mark.parametrize("wrong", [True, False], ids=["wrong", "none"])
def test_a_wrong_robot_file_is_told_before_the_compiler_is_imported(graph, tmp_path, wrong):
    path = tmp_path / "robot.yaml"
    if wrong:
        path.write_text(ROBOT.read_text(encoding="utf-8").replace("length:", "lenght:", 1), encoding="utf-8")
    process = subprocess.run([sys.executable, "-c", IMPORTS, path], capture_output=True, text=True, check=False)
    assert process.stdout.split() == ["2", "False"], process.stderr
