"""ctr_client view: what a node in another process publishes, on a page."""

from __future__ import annotations

import math
import signal
import socket
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator

import numpy as np
import pytest
import rclpy
from geometry_msgs.msg import Vector3
from geometry_msgs.msg import Wrench
from geometry_msgs.msg import WrenchStamped

from ctr_pvs import EquilibriumSolver
from ctr_pvs import load_robot
from ctr_pvs_ros.client.follower import Follower
from ctr_pvs_ros.process import share_file
from ros.load import JOINTS
from ros.load import joint_state

pytest.importorskip("viser", reason="viser is not installed: no live page")
from ctr_pvs.cli.live.followed import FollowedPage
from ctr_pvs.cli.live.view import new_server

TIMEOUT = 60.0  # s
UNITS = 10.0
PROGRAM = [sys.executable, "-c", "from ctr_pvs_ros.front import ctr_client; raise SystemExit(ctr_client())"]
COMMAND = [0.0, 0.0935, 1.0, 0.1705]

pytestmark = pytest.mark.filterwarnings("default")  # viser's


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Following:
    """A page in this process that follows the nodes of a namespace."""

    def __init__(self, peer) -> None:
        self.node = rclpy.create_node("follower", namespace=peer.namespace)
        self.follower = Follower(self.node)
        self.page = FollowedPage(new_server("127.0.0.1", free_port(), "test"), self.follower.name, 1.0)

    @property
    def message(self) -> str:
        return self.page.readout.message.content

    def until(self, done, timeout: float = TIMEOUT) -> None:
        end = time.monotonic() + timeout
        while not done():
            assert time.monotonic() < end, self.message
            self.follower.look(self.page)


@pytest.fixture
def follow() -> Iterator[object]:
    started: list[Following] = []

    def start(peer) -> Following:
        started.append(Following(peer))
        return started[-1]

    yield start
    for following in started:
        following.page.stop()
        following.node.destroy_node()


def answer_to(command):
    robot = load_robot(share_file("config", "renda2021.yaml"))
    return EquilibriumSolver(robot).solve([command[0], command[2]], [command[1], command[3]])


def test_the_page_shows_what_the_node_says(start_node, follow):
    peer = start_node("/shown", use_external_wrench="true")
    peer.client.command(dict(zip(JOINTS, COMMAND, strict=True)), TIMEOUT)
    following = follow(peer)  # late: the last answer is kept for it
    page, scene = following.page, following.page.scene
    assert following.follower.name == "/shown/ctr_equilibrium"
    following.until(lambda: scene.tubes and "accepted: ok" in following.message)
    expected = answer_to(COMMAND)
    assert scene.tip.position == pytest.approx(UNITS * expected.tip.position, abs=1e-3)
    for tube, name in enumerate(("tube 1", "tube 2")):
        centres = UNITS * expected.tube_backbone(tube, 2000).position
        corners = scene.tubes[name].vertices
        distance = np.linalg.norm(corners[:, None] - centres, axis=2).min(axis=1)
        assert distance.max() < 0.5 * UNITS * 2.5e-3
        assert np.linalg.norm(corners - centres[-1], axis=1).min() < 1e-3
    assert f"snap reserve {expected.snap_reserve:.3f}" in page.readout.reserve_told.content
    assert f"| inner_rotation | {math.degrees(1.0):.2f}° | {1e3 * expected.torque[1]:.2f} mN m |" in (
        page.readout.table.content
    )
    assert f"| outer_translation | 93.50 mm | {expected.force[0]:.3f} N |" in page.readout.table.content
    turned = [*COMMAND[:2], 1.5, COMMAND[3]]
    peer.client.command(dict(zip(JOINTS, turned, strict=True)), TIMEOUT)
    tip = UNITS * answer_to(turned).tip.position
    following.until(lambda: np.abs(scene.tip.position - tip).max() < 1e-3)
    assert scene.trace.points.shape == (1, 2, 3) and scene.trace.points[0, 1] == pytest.approx(tip, abs=1e-3)
    peer.send(joint_state(JOINTS[:1], [0.0], stamp=5_000_000_000))
    following.until(lambda: "refused: missing_joint" in following.message)
    assert following.message.startswith("**") and scene.tip.position == pytest.approx(tip, abs=1e-3)
    loads = peer.ros.create_publisher(WrenchStamped, "external_wrench", 1)
    peer.wait(lambda: loads.get_subscription_count() > 0, "listener to wrenches")
    loads.publish(WrenchStamped(wrench=Wrench(force=Vector3(z=0.5))))
    following.until(lambda: np.abs(scene.arrow.points[0, 1] - scene.arrow.points[0, 0]).max() > 0.1)
    start, end = scene.arrow.points[0]
    assert end - start == pytest.approx([0.0, 0.0, UNITS * 0.015])  # half of the largest
    assert end == pytest.approx(scene.tip.position) and np.abs(end - tip).max() > 1e-2


@pytest.mark.soak  # two nodes start, and twice some seconds must pass without a word
def test_a_node_that_dies_is_told_of_and_one_that_comes_back_is_followed(start_node, follow):
    peer = start_node("/dying")
    peer.client.command(dict(zip(JOINTS, COMMAND, strict=True)), TIMEOUT)
    following = follow(peer)
    scene = following.page.scene
    following.until(lambda: bool(scene.tubes))
    following.until(lambda: "accepted" in following.message)
    peer.process.stop(signal.SIGKILL)
    began = time.monotonic()
    following.until(lambda: "Nothing heard from /dying/ctr_equilibrium" in following.message)
    assert time.monotonic() - began > 1.5  # not at once: it might be busy
    assert scene.tubes["tube 2"].visible  # its last answer
    again = start_node("/dying")
    following.until(lambda: "Nothing heard" not in following.message)  # by its diagnostics
    turned = [*COMMAND[:2], 2.0, COMMAND[3]]
    again.client.command(dict(zip(JOINTS, turned, strict=True)), TIMEOUT)
    tip = UNITS * answer_to(turned).tip.position
    following.until(lambda: np.abs(scene.tip.position - tip).max() < 1e-3)
    assert "accepted" in following.message
    assert again.process.stop() == 0
    following.until(lambda: "has ended" in following.message and not scene.tubes["tube 2"].visible)
    following.until(lambda: "Nothing heard" in following.message)


def test_from_a_shell_until_ctrl_c(start_node):
    start_node("/served")
    port = free_port()
    command = ["env", "--default-signal=SIGINT", *PROGRAM, "view", "--namespace", "served", "--port", str(port)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    try:
        told = f"/served/ctr_equilibrium: http://127.0.0.1:{port} (Ctrl-C ends)"
        assert any(told in line for line in process.stdout)
        with urllib.request.urlopen(f"http://127.0.0.1:{port}/", timeout=TIMEOUT) as page:
            assert b"<script" in page.read()
        process.send_signal(signal.SIGINT)
        assert process.wait(TIMEOUT) == 0
        assert "Traceback" not in process.stdout.read()
    finally:
        process.kill()
        process.wait()
        process.stdout.close()


@pytest.mark.parametrize("words", [["--port", "0"], ["--largest-force", "0"], ["--json"]])
def test_wrong_words_are_one_line(words):
    run = subprocess.run([*PROGRAM, "view", *words], capture_output=True, text=True, timeout=TIMEOUT)
    assert (run.returncode, run.stdout) == (2, "")
    (line,) = run.stderr.splitlines()
    assert line.startswith("ctr_client: ") and words[0] in line


def test_without_viser_it_is_one_line(graph):
    program = f"import sys; sys.modules['viser'] = None; {PROGRAM[-1]}"
    run = subprocess.run([sys.executable, "-c", program, "view"], capture_output=True, text=True, timeout=TIMEOUT)
    assert (run.returncode, run.stdout) == (2, "")
    assert run.stderr == "ctr_client: view needs viser (pip install 'ctr_pvs[view]')\n"
