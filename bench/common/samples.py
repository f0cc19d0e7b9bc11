"""Where time goes, without slowing what is measured: a timer looks now and then which function is at work.

A tracing profiler makes small functions look dear, because it adds as much to each call as they take.
"""

from __future__ import annotations

import signal
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from types import FrameType

#: Seconds between two looks.
PERIOD = 1e-3
PACKAGE = "ctr_pvs"


class Samples:
    """Counts, at every tick of the clock, the innermost function of the package, and all modules on the stack.

    own : "module.function" at work itself or in what it calls outside the package, compiled kernels among that.
    within : modules on the stack.
    """

    def __init__(self) -> None:
        self.own: Counter[str] = Counter()
        self.within: Counter[str] = Counter()
        self.total = 0

    def run(self, task: Callable[[], object]) -> None:
        """Run ``task`` once under the timer."""
        before = signal.signal(signal.SIGALRM, self._look)
        signal.setitimer(signal.ITIMER_REAL, PERIOD, PERIOD)
        try:
            task()
        finally:
            signal.setitimer(signal.ITIMER_REAL, 0.0)
            signal.signal(signal.SIGALRM, before)

    def _look(self, _: int, frame: FrameType | None) -> None:
        modules: set[str] = set()
        own = ""
        while frame is not None:
            path = Path(frame.f_code.co_filename)
            if PACKAGE in path.parts:
                own = own or f"{path.stem}.{frame.f_code.co_qualname}"
                modules.add(path.stem)
            frame = frame.f_back
        if own:
            self.total += 1
            self.own[own] += 1
            self.within.update(modules)

    def share(self, count: int) -> float:
        """Percent of all samples."""
        return 100.0 * count / max(self.total, 1)
