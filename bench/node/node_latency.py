"""What the node adds to a solve: the generated tables of docs/node_latency.md.

    scripts/in_env.sh python3 -m bench.node.node_latency

A client in this process sends commands at a steady pace to a node in another one.  Node-side times run from the entry
of the command callback to the end of the last publish; ages from the sending of a command to the arrival of the last
message that answers it.  u is the time of one np.sin of 8 doubles (see ``clock``).
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import rclpy

from bench.common.clock import unit
from bench.common.document import publish
from bench.common.document import table
from bench.common.places import DOCS
from bench.common.places import ROOT
from bench.node.paced_commands import PacedClient
from bench.node.paced_commands import Run
from ctr_pvs_ros.process import isolate

DOCUMENT = DOCS / "node_latency.md"
RATES = (200.0, 500.0)  # Hz
COMMANDS = 2000
#: Of poses: the last is more than the node can take.
POSE_RATES = (200.0, 2000.0)
#: First commands of a run, which find caches empty.
WARMING = 50
#: Most u from callback to last publish at the first of the rates: median and 99th percentile.
TARGET = (400.0, 1500.0)
EXECUTORS = {
    "events": "EventsExecutor",
    "single": "SingleThreadedExecutor",
    "multi": "MultiThreadedExecutor, 2 threads",
}
#: What runs, how its client differs from the usual one, and what that is called.
NODES: list[tuple[str, dict[str, bool], str]] = [
    ("node", {}, "the node"),
    ("node", {"sliding": True}, "the node, every command also slides the tubes"),
    ("node", {"status": True}, "the node, with a listener to its status"),
    ("loaded", {"loaded": True}, "the node, as many wrenches between the commands"),
    ("objects", {}, "the node, messages as Python objects"),
    ("echo", {}, "echo, nothing solved"),
]


class Measured:
    """Node-side times of one run."""

    def read(self, path: Path) -> None:
        """Take over what the process has written at its end."""
        content = json.loads(path.read_text())
        self._u = content["u"]
        self._times = {part: np.array(times) for part, times in content["times"].items()}

    def told(self, percent: float) -> str:
        if len(self._times["in all"]) <= WARMING:
            return "too few"
        time = float(np.percentile(self._times["in all"][WARMING:], percent))
        return f"{1e6 * time:.0f} µs, {time / self._u:.0f} u"

    def share(self, part: str) -> str:
        """Median time of a part for each command, us; publish counts all messages of a command."""
        commands, times = len(self._times["in all"]), self._times[part]
        each = len(times) // commands
        if not each:
            return ""
        sums = times[: each * commands].reshape(commands, each).sum(axis=1)
        return f"{1e6 * float(np.median(sums[WARMING:])):.0f} µs"


@contextmanager
def timed_node(what: str, executor: str) -> Iterator[Measured]:
    """A node in its own process; its times are there once it has ended."""
    measured = Measured()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "times.json"
        command = [sys.executable, "-m", "bench.node.timed_node", what, executor, path]
        process = subprocess.Popen(command, cwd=ROOT, stderr=subprocess.DEVNULL)
        try:
            yield measured
        finally:
            if process.poll() is None:
                process.send_signal(signal.SIGINT)
            process.wait(20.0)
        measured.read(path)


def measure(
    what: str, executor: str, rate: float, count: int, busy: bool = False, **options: bool
) -> tuple[Run, Measured, str]:
    """One run with the ``options`` of the client; ``busy`` with another one that keeps the service at work all the
    time, and says what it saw."""
    node = rclpy.create_node("paced_client")
    said = ""
    with timed_node(what, executor) as measured:
        client = PacedClient(node, **options)
        client.connect()
        if busy:
            load = subprocess.Popen(
                [sys.executable, "-m", "bench.node.service_load"],
                cwd=ROOT,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                text=True,
            )
            assert load.stdout is not None
            load.stdout.readline()  # it has begun
        run = client.run(rate, count)
        if busy:
            said, _ = load.communicate("")
    node.destroy_node()
    return run, measured, said.strip()


def row(run: Run, measured: Measured) -> list[str]:
    """Node-side and age, p50 and p99."""
    ages = [f"{run.age(50):.0f} µs", f"{run.age(99):.0f} µs"]
    return [f"{100.0 * run.answered:.2f} %", measured.told(50), measured.told(99), *ages]


HEAD = ["answered", "node side p50", "p99", "age p50", "p99"]


def executors_table(count: int) -> str:
    rows = []
    for executor, name in EXECUTORS.items():
        for rate in RATES:
            run, measured, _ = measure("node", executor, rate, count)
            rows.append([f"{name}, {rate:.0f} Hz", *row(run, measured)])
    return table(["", *HEAD], rows)


def nodes_table(count: int) -> str:
    rows = []
    for what, options, name in NODES:
        for rate in RATES:
            run, measured, _ = measure(what, "events", rate, count, **options)
            rows.append(
                [f"{name}, {rate:.0f} Hz", *row(run, measured), measured.share("solve"), measured.share("publish")]
            )
    return table(["", *HEAD, "of it solve", "publish"], rows)


def poses_table(count: int) -> str:
    rows = []
    for rate in POSE_RATES:
        run, measured, _ = measure("node", "events", rate, count, posing=True)
        errors = [f"{1e6 * np.quantile(run.errors, share):.3g} µm" for share in (0.5, 0.99, 1.0)]
        rows.append([f"{rate:.0f} Hz", *row(run, measured), *errors])
    return table(["poses", *HEAD, "tip off p50", "p99", "most"], rows)


def service_table(count: int) -> str:
    rows = []
    for busy, name in ((False, "service idle"), (True, "service always at work")):
        run, measured, said = measure("node", "events", RATES[0], count, busy=busy)
        rows.append([f"{name}, {RATES[0]:.0f} Hz", *row(run, measured), said])
    return table(["", *HEAD, "service: budget 1 s, answered within"], rows)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--quick", action="store_true", help="short runs, printed only")
    options = parser.parse_args()
    isolate()
    rclpy.init(args=[])
    document, count = (None, 400) if options.quick else (DOCUMENT, COMMANDS)
    target = f"target {TARGET[0]:.0f} u and {TARGET[1]:.0f} u at {RATES[0]:.0f} Hz"
    versions = f"Python {platform.python_version()}, numpy {np.__version__}, {os.cpu_count()} cores"
    publish("node machine", f"{platform.machine()}, {versions}; u = {1e6 * unit():.3f} µs; {target}.", document)
    publish("node", nodes_table(count), document)
    publish("executors", executors_table(count), document)
    publish("service", service_table(count), document)
    publish("poses", poses_table(count), document)
    rclpy.try_shutdown()


if __name__ == "__main__":
    main()
