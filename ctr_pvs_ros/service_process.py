"""The service in a process of its own, so that no request, however slow, holds up the command stream.

In one process the two would share one interpreter lock. Compiled kernels do without it, so a solve in another thread
holds it for some microseconds between two calls only; but whoever gets it from there is woken on the processor of that
thread, and may have to wait until its time slice is over. docs/node_latency.md has the figures.

The node starts this process and tells it its settings, one JSON line for each change; the end of that pipe is the end
of the process, whatever became of the node.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
from contextlib import suppress
from dataclasses import asdict
from typing import IO
from typing import Any

import rclpy
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.signals import SignalHandlerOptions

import ctr_pvs
from ctr_pvs import load_robot
from ctr_pvs_interfaces.srv import SolveEquilibrium
from ctr_pvs_ros.commands import CommandReader
from ctr_pvs_ros.commands import narrowed
from ctr_pvs_ros.messages import receipt_header
from ctr_pvs_ros.parameters import ARRAYS
from ctr_pvs_ros.parameters import Settings
from ctr_pvs_ros.responses import send_patiently
from ctr_pvs_ros.service import SolveService

CLIENTS = 16  # requests that are waited for at the same time; more wait in the middleware
SWITCH_INTERVAL = 5e-5  # s; a thread that has an answer to send waits no longer for the one that solves
TIDY_TIME = 0.5  # s; to take leave of the middleware
STOP_TIMEOUT = 0.8  # s; after it the process is killed and cannot tidy up its shared memory


class ServiceProcess:
    """The node's side: starts the process, and starts it again should it die.

    Args:
        node: names the service `~/solve` as remapped, and whether time is simulated.
        settings: its parameters.
    """

    def __init__(self, node: Node, settings: Settings) -> None:
        self._names = {
            "service": node.resolve_service_name("~/solve"),
            "name": f"_{node.get_name()}_solve",  # the underscore hides it in lists of nodes
            "namespace": node.get_namespace(),
            "use_sim_time": node.get_parameter("use_sim_time").value,
        }
        self._settings = settings
        self._start()

    def _start(self) -> None:
        # A session of its own: Ctrl-C in a terminal is for the node, which ends this process.
        self._process = subprocess.Popen(
            [sys.executable, "-m", "ctr_pvs_ros.service_process"], stdin=subprocess.PIPE, start_new_session=True
        )
        self._tell(self._names)
        self._tell(asdict(self._settings))

    def _tell(self, values: dict[str, object]) -> None:
        assert self._process.stdin is not None
        with suppress(OSError):  # it has died; `revive` starts another one
            self._process.stdin.write(json.dumps(values).encode() + b"\n")
            self._process.stdin.flush()

    def update(self, settings: Settings) -> None:
        """Let changed settings take effect from the next request on."""
        self._settings = settings
        self._tell(asdict(settings))

    def revive(self) -> bool:
        """Start the process again if it has ended; whether it had."""
        if self._process.poll() is None:
            return False
        self._close()
        self._start()
        return True

    def stop(self) -> None:
        """End the process, whatever it is doing."""
        self._close()
        try:
            self._process.wait(STOP_TIMEOUT)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def _close(self) -> None:
        assert self._process.stdin is not None
        with suppress(OSError):  # what was not told any more is of no use to anyone
            self._process.stdin.close()


class SolveNode(Node):
    """Answers requests, several at a time where they are quick to refuse, and solves one after the other."""

    def __init__(self, names: dict[str, str], settings: Settings) -> None:
        simulated = Parameter("use_sim_time", value=names["use_sim_time"])
        super().__init__(
            names["name"],
            namespace=names["namespace"],
            start_parameter_services=False,
            enable_rosout=False,
            parameter_overrides=[simulated],
        )
        self._robot = load_robot(settings.robot_file)
        solver = ctr_pvs.EquilibriumSolver(
            self._robot, tolerance=settings.tolerance, fidelity=settings.fidelity, force_model=settings.force_model
        )
        self._service = SolveService(self._reader(settings), solver)
        self._settings = settings
        # The service comes last: who finds it finds everything ready.
        callback_group = ReentrantCallbackGroup()
        send_patiently(
            self.create_service(SolveEquilibrium, names["service"], self._on_solve, callback_group=callback_group)
        )

    def _reader(self, settings: Settings) -> CommandReader:
        return CommandReader(narrowed(self._robot, settings.rotation_limits, settings.translation_limits))

    def update(self, settings: Settings) -> None:
        """Let changed settings take effect."""
        self._service.reader = self._reader(settings)
        self._settings = settings

    def _on_solve(
        self, request: SolveEquilibrium.Request, response: SolveEquilibrium.Response
    ) -> SolveEquilibrium.Response:
        settings = self._settings
        header = receipt_header(request.joints.header, self.get_clock(), settings.frame_id)
        return self._service.answer(request, response, header, settings.backbone_poses, settings.compute_budget)


def _settings_from(line: bytes) -> Settings:
    values: dict[str, Any] = json.loads(line)
    values.update({name: tuple(values[name]) for name in ARRAYS})
    return Settings(**values)


def _listen(pipe: IO[bytes], node: SolveNode, ended: threading.Event) -> None:
    """Take over settings until the node's end of the pipe closes; then end, even in mid-solve.

    The node also tells them again when it has compiled the kernels: they are looked for each time."""
    from ctr_pvs.kernel import compiler  # not where the node imports this module: see there

    for line in pipe:
        node.update(_settings_from(line))
        compiler.use_compiled()
    ended.set()
    threading.Timer(TIDY_TIME, os._exit, (0,)).start()
    rclpy.try_shutdown()


def main() -> None:
    """Serve until standard input ends."""
    pipe = sys.stdin.buffer
    names, settings = pipe.readline(), pipe.readline()
    if not settings:
        return
    sys.setswitchinterval(SWITCH_INTERVAL)
    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
    node = SolveNode(json.loads(names), _settings_from(settings))
    # Everything is there before the pipe is listened to: half an executor complains when it is thrown away.
    executor = MultiThreadedExecutor(CLIENTS)
    executor.add_node(node)
    ended = threading.Event()
    threading.Thread(target=_listen, args=(pipe, node, ended), daemon=True).start()
    try:
        executor.spin()
    except Exception:  # the end takes the middleware away under the executor
        if not ended.is_set():
            raise
    # Without this the middleware would leave its shared memory behind. A solve that is under way is not waited for.
    node.destroy_node()
    os._exit(0)


if __name__ == "__main__":
    main()
