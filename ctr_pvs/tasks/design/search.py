"""From many designs to one: all of them get a stage, the better half of them another, and the last as many as help.
Once some reach all targets, only those go on."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import FIRST_COMPLETED
from concurrent.futures import Executor
from concurrent.futures import wait

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.tasks.design.reach import Problem
from ctr_pvs.tasks.design.stage import Draft
from ctr_pvs.tasks.design.stage import blank
from ctr_pvs.tasks.design.stage import stage

Array = NDArray[np.float64]

#: The last design is done after a stage that lowers its sum of squares by less than this share, or so many stages.
SETTLED, MOST_STAGES = 1e-2, 12
#: Seconds between two looks whether it is to stop.
GLANCE = 0.2

Report = Callable[[str], None]
Stopped = Callable[[], bool]


def first_designs(problem: Problem, count: int, seed: int) -> list[Draft]:
    """The robot to begin with, as near as limits let it be, and others anywhere in the room."""
    parameters = problem.room.parameters
    begin = problem.room.shares(np.array([parameter.start for parameter in parameters]))
    others = np.random.default_rng(seed).random((count - 1, len(parameters)))
    return [blank(problem, shares) for shares in (begin, *others)]


def search(
    problem: Problem, starts: int, seed: int, executor: Executor, report: Report, stopped: Stopped
) -> Draft | None:  # fmt: skip
    """The best design found from so many; None if it was stopped before any was tried.

    The order in which stages end changes nothing: the same seed gives the same design, whatever the executor.
    """
    drafts, best = first_designs(problem, starts, seed), None
    for number in range(1, MOST_STAGES + 1):
        told = _stages(problem, drafts, executor, report, stopped, f"stage {number}")
        best = min([*([best] if best else []), *told], key=_order, default=None)
        alone = len(drafts) == 1
        if stopped() or (alone and told[0].cost > (1.0 - SETTLED) * drafts[0].cost):
            break
        there = [draft for draft in told if draft.worst == 0.0]
        drafts = sorted(there or told, key=_order)[: (len(told) + 1) // 2]
    return best


def _order(draft: Draft) -> tuple[bool, float]:
    """What reaches all comes before what does not."""
    return draft.worst > 0.0, draft.cost


def _stages(
    problem: Problem, drafts: list[Draft], executor: Executor, report: Report, stopped: Stopped, name: str
) -> list[Draft]:  # fmt: skip
    """A stage of each; if it is stopped, of those that have ended by then."""
    futures = [executor.submit(stage, problem, draft) for draft in drafts]
    left = set(futures)
    while left and not stopped():
        done, left = wait(left, GLANCE, FIRST_COMPLETED)
        for future in done:
            number = futures.index(future) + 1
            report(f"{name}, design {number} of {len(drafts)}: {_told(problem, future.result())}")
    for future in left:
        future.cancel()
    return [future.result() for future in futures if future not in left]


def _told(problem: Problem, draft: Draft) -> str:
    near = sum(off <= aim.within for off, aim in zip(draft.off.tolist(), problem.aims, strict=True))
    return f"{near} of {len(draft.off)} targets reached, worst {1e3 * draft.worst:.6f} mm off"
