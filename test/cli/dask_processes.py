"""A Dask scheduler and its workers as a user starts them: processes, on this machine only."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).parents[2]
PATIENCE = 60.0  # s


class DaskProcesses:
    """One scheduler, and the workers started for it; ``close`` ends them all."""

    def __init__(self, folder: Path) -> None:
        self._folder, self._file = folder, folder / "scheduler.json"
        self.workers: list[subprocess.Popen[bytes]] = []
        self._scheduler = self._start("scheduler", "--port", "0", "--scheduler-file", str(self._file))
        wait_for(self._file.exists, "the scheduler")
        self.address = str(json.loads(self._file.read_text())["address"])

    def _start(self, kind: str, *words: str, **variables: str) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-m", "dask", kind, "--host", "127.0.0.1", "--no-dashboard", *words]
        environment = {**os.environ, "PYTHONPATH": str(ROOT), **variables}
        with (self._folder / f"{kind}.txt").open("ab") as log:
            return subprocess.Popen(command, stdout=log, stderr=log, cwd=self._folder, env=environment)

    def start_worker(self, **variables: str) -> subprocess.Popen[bytes]:
        """A worker of one thread, with these environment variables; nobody starts it anew."""
        worker = self._start("worker", self.address, "--nthreads", "1", "--no-nanny", **variables)
        self.workers.append(worker)
        return worker

    def count(self) -> int:
        """Workers that the scheduler knows of."""
        from distributed import Client

        with Client(self.address, set_as_default=False, timeout=PATIENCE) as client:
            return len(client.nthreads())

    def wait_for_workers(self, count: int) -> None:
        wait_for(lambda: self.count() == count, f"{count} workers")

    def stop_workers(self) -> None:
        for worker in self.workers:
            worker.kill()
            worker.wait()
        self.workers = []
        self.wait_for_workers(0)

    def close(self) -> None:
        for process in (*self.workers, self._scheduler):
            process.send_signal(signal.SIGKILL)
            process.wait()


def wait_for(done: Callable[[], bool], what: str) -> None:
    until = time.monotonic() + PATIENCE
    while not done():
        assert time.monotonic() < until, f"{what}: not there after {PATIENCE:.0f} s"
        time.sleep(0.05)
