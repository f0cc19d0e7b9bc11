"""Times in u, the time of one np.sin of 8 doubles, which is measured again between groups of calls.

Machines change their speed while they are being measured, and u changes with it: a cost in u holds for longer than
one in microseconds.  What it hides is how one machine's memory and array operations compare with another's.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from collections.abc import Iterable
from dataclasses import dataclass
from dataclasses import field

import numpy as np

Task = Callable[[], object]

#: Calls timed together, because a clock is too coarse for one; the number of such groups of which a median is taken.
CALLS, GROUPS = 100, 15
#: Seconds after which u is measured again.
STALE = 0.01
ARGUMENT = np.linspace(0.1, 1.0, 8)


@dataclass(frozen=True)
class Timing:
    """Medians of calls: seconds, and units of u."""

    seconds: float
    units: float

    @property
    def microseconds(self) -> float:
        return 1e6 * self.seconds


def unit() -> float:
    """u [s] now."""
    times = []
    for _ in range(GROUPS):
        begin = time.perf_counter()
        for _ in range(CALLS):
            np.sin(ARGUMENT)
        times.append(time.perf_counter() - begin)
    return float(np.median(times)) / CALLS


@dataclass(eq=False)
class Stopwatch:
    """Collects the times of single calls, each beside the u of its moment."""

    seconds: list[float] = field(default_factory=list)
    units: list[float] = field(default_factory=list)
    _u: float = 0.0
    _since: float = -np.inf

    def time(self, task: Task) -> object:
        """What ``task`` returns; its time is kept."""
        if time.perf_counter() - self._since > STALE:
            self._u, self._since = unit(), time.perf_counter()
        begin = time.perf_counter()
        result = task()
        taken = time.perf_counter() - begin
        self.seconds.append(taken)
        self.units.append(taken / self._u)
        return result

    @property
    def spent(self) -> float:
        """Seconds of all calls together."""
        return sum(self.seconds)

    @property
    def median(self) -> Timing:
        return Timing(float(np.median(self.seconds)), float(np.median(self.units)))


def timed(tasks: Iterable[Task]) -> Timing:
    """The median over ``tasks``, each called once."""
    watch = Stopwatch()
    for task in tasks:
        watch.time(task)
    return watch.median


def repeated(task: Task, calls: int) -> Timing:
    """The median of ``calls`` calls of one task."""
    task()
    return timed(task for _ in range(calls))
