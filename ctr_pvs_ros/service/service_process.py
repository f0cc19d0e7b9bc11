"""The node's end of the process that does jobs.

In one process the two would share one interpreter lock. Compiled kernels do without it, so a solve in another thread
holds it for some microseconds between two calls only; but whoever gets it from there is woken on the processor of that
thread, and may have to wait until its time slice is over. docs/node_latency.md has the figures.

A thread here waits for what comes back. Every job is answered once: with what came of it, or, when its deadline passes
or the process ends, with the reason why nothing did.
"""

from __future__ import annotations

import itertools
import os
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from multiprocessing.connection import Connection
from multiprocessing.connection import wait

from ctr_pvs import Status
from ctr_pvs_ros.service.jobs import Job
from ctr_pvs_ros.service.jobs import LookForKernels
from ctr_pvs_ros.service.jobs import Ready
from ctr_pvs_ros.service.jobs import Solved
from ctr_pvs_ros.service.jobs import SolverOptions

GRACE = 0.01  # s; a job that keeps to its budget is not told to be late
DEAF = 1.0  # s past a deadline without an answer: the process hangs, and another one takes its place
START_TIME = 30.0  # s; while it starts it may be deaf
MOST_WAITING = 100  # jobs, as many as the connection holds while nobody reads
STOP_TIMEOUT = 0.8  # s; after it the process is killed
RESTART_PAUSE = 0.5  # s; a process that dies at once is not started all the time

OnSolved = Callable[[Solved], None]


class ServiceProcess:
    """Starts the process, and starts it again should it die or hang.

    Args:
        options: of its solver.
        on_trouble: called with one line when it has died or hangs, from a thread of its own.

    Attributes:
        ready: whether it has been up once.
    """

    def __init__(self, options: SolverOptions, on_trouble: Callable[[str], None]) -> None:
        self._options = options
        self._on_trouble = on_trouble
        self._numbers = itertools.count()
        self._waiting: dict[int, tuple[Job, OnSolved]] = {}  # the first is the one that is being done
        self._lock = threading.Lock()
        self._wake_end, self._wake = os.pipe()
        #: From when on it counts as hanging, on a steady clock [s]; an answer takes it back.
        self._overdue: float | None = None
        self._ended = self.ready = False
        self._start()
        self._thread = threading.Thread(target=self._watch, name="service", daemon=True)
        self._thread.start()

    @property
    def id(self) -> int:
        """Of the process."""
        return self._process.pid

    def ask(self, job: Job, on_solved: OnSolved) -> None:
        """Have a job done; ``on_solved`` is called once, from another thread, its number set here."""
        with self._lock:
            if len(self._waiting) >= MOST_WAITING:
                on_solved(_late(job, "while a hundred other requests were waiting"))
                return
            job = replace(job, number=next(self._numbers))
            self._waiting[job.number] = job, on_solved
            self._send(job)
        os.write(self._wake, b"w")  # there is a deadline to keep

    def look_for_kernels(self) -> None:
        """Compiled kernels may be there by now."""
        with self._lock:
            self._send(LookForKernels())

    def stop(self) -> None:
        """End the process, whatever it is doing."""
        self._ended = True
        os.write(self._wake, b"e")
        self._thread.join()
        self._connection.close()
        try:
            self._process.wait(STOP_TIMEOUT)
        except subprocess.TimeoutExpired:
            self._kill()
        os.close(self._wake)
        os.close(self._wake_end)

    def _start(self) -> None:
        ours, its = socket.socketpair()
        with its:
            # A session of its own: Ctrl-C in a terminal is for the node, which ends this process.
            self._process = subprocess.Popen(
                [sys.executable, "-m", "ctr_pvs_ros.service.job_process", str(its.fileno())],
                pass_fds=(its.fileno(),),
                stdin=subprocess.DEVNULL,
                start_new_session=True,
            )
        self._connection = Connection(ours.detach())
        self._began = time.monotonic()
        self._overdue = self._began + START_TIME
        self._send(self._options)

    def _send(self, what: Job | LookForKernels | SolverOptions) -> None:
        with suppress(OSError):  # it has died, which `_watch` hears of
            self._connection.send(what)

    def _watch(self) -> None:
        while not self._ended:
            ready = wait([self._connection, self._wake_end], self._until_something_is_due())
            if self._wake_end in ready:
                os.read(self._wake_end, 1024)
            try:
                if self._connection in ready:
                    self._pass_on(self._connection.recv())
                self._tell_late_ones()
            except (EOFError, OSError):
                self._begin_anew("the service's process ended unexpectedly and was started again")

    def _until_something_is_due(self) -> float | None:
        """Time [s]; None: nothing is waited for."""
        with self._lock:
            deadlines = [job.deadline for job, _ in self._waiting.values()]
        if deadlines:
            return max(min(deadlines) + GRACE - time.monotonic(), 0.0)
        return None if self._overdue is None else max(self._overdue - time.monotonic(), 0.0)

    def _pass_on(self, solved: Solved | Ready) -> None:
        self._overdue = None
        if isinstance(solved, Ready):
            self.ready = True
            return
        with self._lock:
            found = self._waiting.pop(solved.number, None)
        if found is not None:  # else its client has been told already that it is late
            found[1](solved)

    def _tell_late_ones(self) -> None:
        now = time.monotonic()
        with self._lock:
            first = next(iter(self._waiting), None)
            late = [found for found in self._waiting.values() if now > found[0].deadline + GRACE]
            for job, _ in late:
                del self._waiting[job.number]
        for job, on_solved in late:
            done = "while the solve went on" if job.number == first else "before other requests were done"
            on_solved(_late(job, done))
        if late and self._overdue is None:
            self._overdue = now + DEAF
        if self._overdue is not None and now > self._overdue:
            self._begin_anew("the service's process did not answer and was replaced")

    def _begin_anew(self, why: str) -> None:
        """Start another process, once those who wait for this one have been told."""
        self._kill()
        self._connection.close()
        with self._lock:
            lost = list(self._waiting.values())
            self._waiting.clear()
        for job, on_solved in lost:
            on_solved(Solved(job.number, Status.NOT_CONVERGED.value, f"internal error: {why}; ask again"))
        if self._ended:
            return
        self._on_trouble(why)
        time.sleep(max(self._began + RESTART_PAUSE - time.monotonic(), 0.0))
        with self._lock:
            self._start()

    def _kill(self) -> None:
        self._process.kill()
        self._process.wait()


def _late(job: Job, when: str) -> Solved:
    return Solved(job.number, Status.TIMEOUT.value, f"the budget was over {when}")
