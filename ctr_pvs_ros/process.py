"""The node in a process of its own, started the way a launch file composes it; for the demo and the tests."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import IO
from typing import Self

from ament_index_python.packages import get_package_prefix
from ament_index_python.packages import get_package_share_directory

STOP_TIMEOUT = 5.0  # s; after it the process is killed
ISOLATION = {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST", "ROS_DOMAIN_ID": str(1 + os.getpid() % 100)}


def share_file(*parts: str) -> Path:
    """Path of a file under share/ctr_pvs."""
    return Path(get_package_share_directory("ctr_pvs"), *parts)


def isolate() -> None:
    """Keep this process, and those it starts, apart from every other ROS graph; call it before rclpy.init."""
    os.environ.update(ISOLATION)


class NodeProcess:
    """A running equilibrium_node; leaving the `with` block stops it.

    Args:
        robot_file: path of the robot file.
        parameters: values as they stand on the command line, such as {"margin_warn": "0.2"}.
        namespace: such as /left; empty for none.
        log: where the node's output goes; None: where this process's error output goes.
        parameter_file: None: the one with the defaults.
    """

    def __init__(
        self,
        robot_file: str | Path,
        parameters: Mapping[str, str] | None = None,
        namespace: str = "",
        log: IO[bytes] | None = None,
        parameter_file: Path | None = None,
    ) -> None:
        executable = Path(get_package_prefix("ctr_pvs"), "lib", "ctr_pvs", "equilibrium_node")
        arguments = ["--params-file", str(parameter_file or share_file("config", "equilibrium_node.yaml"))]
        for name, value in {"robot_file": str(robot_file), **(parameters or {})}.items():
            arguments += ["-p", f"{name}:={value}"]
        if namespace:
            arguments += ["-r", f"__ns:={namespace}"]
        output = sys.stderr if log is None else log
        self._process = subprocess.Popen([executable, "--ros-args", *arguments], stdout=output, stderr=output)

    @property
    def id(self) -> int:
        """Of the process."""
        return self._process.pid

    @property
    def running(self) -> bool:
        """Whether the process is still there."""
        return self._process.poll() is None

    def wait(self, timeout: float) -> int:
        """The exit code once the process has ended by itself; raises subprocess.TimeoutExpired after `timeout` [s]."""
        return self._process.wait(timeout)

    def stop(self, signal_number: int = signal.SIGINT) -> int:
        """End the process and return its exit code; it is killed (negative code) when the signal does not end it."""
        if self.running:
            self._process.send_signal(signal_number)
        try:
            return self._process.wait(STOP_TIMEOUT)
        except subprocess.TimeoutExpired:
            self._process.kill()
            return self._process.wait()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()
