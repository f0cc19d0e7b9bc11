"""The tutorial on ROS 2, followed to the letter: a node in one terminal, clients and a program in another."""

from __future__ import annotations

import shutil
import signal
import subprocess
import time

import pytest
import tutorial

from ctr_pvs.kernel.compiler import mode

PAGE = "tutorials/ros.md"
SERVING = "serving robot 'renda2021'"  # the reader waits for it, and so does the test
START_TIMEOUT, STOP_TIMEOUT = 60.0, 10.0  # s


class Terminals:
    """What a reader types into: the node goes on in the first terminal, the rest goes into the second."""

    def __init__(self) -> None:
        self.nodes: list[subprocess.Popen[bytes]] = []

    def shell(self, block, folder):
        if not block.code.startswith("equilibrium_node "):
            return tutorial.run_shell(block, folder)
        log = folder / "log.txt"
        with log.open("wb") as output:
            command = ["bash", "-c", f"exec {block.code}"]
            self.nodes.append(subprocess.Popen(command, cwd=folder, stdout=output, stderr=subprocess.STDOUT))
        end = time.monotonic() + START_TIMEOUT
        while SERVING not in log.read_text(encoding="utf-8"):
            assert time.monotonic() < end, log.read_text(encoding="utf-8")
            time.sleep(0.1)
        return ""

    def stop(self):
        """Ctrl-C in the first terminal; its exit code."""
        for node in self.nodes:
            node.send_signal(signal.SIGINT)
            try:
                yield node.wait(STOP_TIMEOUT)
            except subprocess.TimeoutExpired:
                node.kill()
                raise


@pytest.mark.skipif(shutil.which("ctr_client") is None, reason="the executables are not on the path here")
@pytest.mark.skipif(mode() == "interpreted", reason="kernels are interpreted: too slow for the budgets of the tutorial")
def test_the_tutorial_does_and_prints_what_it_says(graph, tmp_path):
    terminals = Terminals()
    try:
        tutorial.follow(PAGE, tmp_path, terminals.shell)
    finally:
        codes = list(terminals.stop())
    assert codes == [0]
