"""Long runs: how far they are, on standard error, and a Ctrl-C that lets the current chunk end."""

from __future__ import annotations

import signal
import sys
import time
from types import FrameType
from types import TracebackType
from typing import Any

#: Seconds between two lines on a terminal, where they replace each other, and elsewhere.
ON_TERMINAL, ELSEWHERE = 0.5, 10.0


class Progress:
    """Tells rows, rate and time left from time to time."""

    def __init__(self, done: int, total: int) -> None:
        self._first, self._total = done, total
        self._began = self._told = time.monotonic()
        self._terminal = sys.stderr.isatty()

    def tell(self, done: int) -> None:
        """A line, if it is time for one or all is done."""
        now = time.monotonic()
        last = done == self._total
        if not last and now - self._told < (ON_TERMINAL if self._terminal else ELSEWHERE):
            return
        self._told = now
        rate = (done - self._first) / max(now - self._began, 1e-9)
        rest = f"{now - self._began:.0f} s" if last else f"{_span((self._total - done) / max(rate, 1e-9))} left"
        line = f"{done} of {self._total} rows, {rate:.0f} rows/s, {rest}"
        end = "\n" if last or not self._terminal else ""
        print(f"\r{line:<60}" if self._terminal else line, end=end, file=sys.stderr, flush=True)


def _span(seconds: float) -> str:
    if seconds < 120.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 7200.0 else f"{seconds / 3600.0:.1f} h"


class Stop:
    """While entered, the first Ctrl-C sets ``asked``; the second is a ``KeyboardInterrupt``."""

    def __init__(self) -> None:
        self.asked = False
        self._before: Any = None

    def __enter__(self) -> Stop:
        self._before = signal.signal(signal.SIGINT, self._handle)
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        signal.signal(signal.SIGINT, self._before)

    def _handle(self, number: int, frame: FrameType | None) -> None:
        if self.asked:
            raise KeyboardInterrupt
        self.asked = True
