"""The page's end of the process that looks for other equilibria.

A search takes from a tenth of a second to some seconds; here it would hold up whoever moves a slider.  Only the newest
question counts, and a search that takes too long ends with its process.
"""

from __future__ import annotations

import socket
import subprocess
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from multiprocessing.connection import Connection

from ctr_pvs.cli.live.others import Others
from ctr_pvs.cli.live.others import Question
from ctr_pvs.robot.robot import Robot

#: Seconds that one search may take, and its process to start.
BUDGET, START = 5.0, 30.0


class Searcher:
    """Finds the other equilibria of ``robot`` to a tolerance [m].

    found : called from a thread with a question and what was found, unless a newer one was asked meanwhile.
    """

    def __init__(self, robot: Robot, tolerance: float, found: Callable[[Question, Others], None]) -> None:
        self._robot, self._tolerance, self._found = robot, tolerance, found
        self._changed = threading.Condition()
        self._wanted: Question | None = None
        self._ended = False
        self._process: subprocess.Popen[bytes] | None = None
        self._connection: Connection | None = None
        self._thread = threading.Thread(target=self._work, name="other equilibria", daemon=True)
        self._thread.start()

    def ask(self, question: Question | None) -> None:
        """Asks a question in place of all before; None: what is being looked for is not wanted any more."""
        with self._changed:
            self._wanted = question
            self._changed.notify_all()

    def stop(self) -> None:
        """Ends the process, whatever it is doing."""
        with self._changed:
            self._ended = True
            self._changed.notify_all()
            if self._process is not None:
                self._process.kill()
        self._thread.join()

    def _work(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._wanted is not None or self._ended)
                question = self._wanted
            if self._ended or question is None:
                break
            answer = self._search(question)
            with self._changed:
                current = self._wanted is question and not self._ended
                if current:
                    self._wanted = None
            if current:
                self._found(question, answer)
        self._drop()

    def _search(self, question: Question) -> Others:
        try:
            first = self._connection is None
            if first:
                self._start()
            connection = self._connection
            assert connection is not None
            connection.send(question)
            if connection.poll(BUDGET + (START if first else 0.0)):
                answer: Others = connection.recv()
                return answer
            why = f"given up after {BUDGET:g} s"
        except (EOFError, OSError):
            why = "its process ended unexpectedly"
        self._drop()
        return Others((), why)

    def _start(self) -> None:
        ours, its = socket.socketpair()
        with its, self._changed:
            if self._ended:
                raise EOFError
            # A session of its own: Ctrl-C in a terminal is for the page, which ends this process.
            self._process = subprocess.Popen(
                [sys.executable, "-m", "ctr_pvs.cli.live.search_process", str(its.fileno())],
                pass_fds=(its.fileno(),),
                stdin=subprocess.DEVNULL,
                start_new_session=True,
            )
        self._connection = Connection(ours.detach())
        self._connection.send((self._robot, self._tolerance))

    def _drop(self) -> None:
        """Ends the process; the next question starts another one."""
        if self._connection is not None:
            self._connection.close()
        if self._process is not None:
            with suppress(ProcessLookupError):
                self._process.kill()
            self._process.wait()
        self._connection = self._process = None
