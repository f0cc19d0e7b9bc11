"""A way through commands on which nothing snaps: every step is a solve that follows the branch from the last one, and
one that snaps, or comes too near to it, is not taken."""

from __future__ import annotations

import time
from collections.abc import Sequence
from enum import Enum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.answer.equilibrium import Equilibrium
from ctr_pvs.answer.status import Status
from ctr_pvs.robot.loads import Loads
from ctr_pvs.solve.solver import EquilibriumSolver

Array = NDArray[np.float64]

#: Between two looks at the margin tubes turn against each other by no more than this [rad], and slide no farther than
#: this share of the longest tube.
TURN, SLIDE = 0.5, 0.05
#: A solve that comes too late still ends as one that is out of time [s].
LEAST_BUDGET = 1e-6


class Step(NamedTuple):
    """A command of a way, alpha (N,) [rad], D (N,) [m], and the stability margin there."""

    alpha: Array
    D: Array
    margin: float


class Refusal(Enum):
    """Why a step was not taken."""

    SNAP = "the robot would snap"
    MARGIN = "the stability margin would fall below the floor"
    TIMEOUT = "out of time"
    FAILED = "no equilibrium was found"


def left(deadline: float) -> float | None:
    """The budget [s] until a ``time.monotonic()`` value; None where there is none."""
    return None if deadline == np.inf else max(deadline - time.monotonic(), LEAST_BUDGET)


class Walker:
    """Stands on an answer and remembers how it came there.

    floor : margin that no step may lead below, or below where the walk began.  deadline : a ``time.monotonic()`` value.
    """

    def __init__(
        self, solver: EquilibriumSolver, answer: Equilibrium, floor: float, deadline: float, way: Sequence[Step] = ()
    ) -> None:
        self._solver, self.answer, self.floor, self.deadline = solver.fork(answer, True), answer, floor, deadline
        self.loads: Loads | None = answer.applied_loads
        self.way = list(way) or [Step(answer.alpha, answer.D, answer.stability_margin)]

    def branch(self) -> Walker:
        """Another that stands here, too, and goes its own way."""
        return Walker(self._solver, self.answer, self.floor, self.deadline, self.way)

    @property
    def late(self) -> bool:
        return time.monotonic() > self.deadline

    def go(self, alpha: Array, D: Array) -> Refusal | None:
        """One step; where it is refused the walker stays."""
        if self.late:
            return Refusal.TIMEOUT
        answer = self._solver.solve(alpha, D, budget=left(self.deadline), loads=self.loads)
        refusal = self._judged(answer)
        if refusal is None:
            self.answer = answer
            self.way.append(Step(alpha, D, answer.stability_margin))
        else:
            self._solver = self._solver.fork(self.answer)
        return refusal

    def back_to(self, answer: Equilibrium) -> None:
        """Undo the last step, which was taken from ``answer``."""
        self.way.pop()
        self.answer, self._solver = answer, self._solver.fork(answer)

    def along(self, commands: Sequence[tuple[Array, Array]]) -> Refusal | None:
        """Straight from command to command, in steps short enough to see the margin fall."""
        longest = SLIDE * max(tube.length for tube in self._solver.robot.tubes)
        for alpha_end, D_end in commands:
            alpha, D = self.answer.alpha, self.answer.D
            turn, slide = float(np.ptp(alpha_end - alpha)), float(np.abs(D_end - D).max())
            pieces = max(1, int(np.ceil(max(turn / TURN, slide / longest))))
            for share in np.arange(1, pieces + 1) / pieces:
                whole = share == 1.0
                there = (alpha_end, D_end) if whole else (alpha + share * (alpha_end - alpha), D + share * (D_end - D))
                refusal = self.go(*there)
                if refusal is not None:
                    return refusal
        return None

    def _judged(self, answer: Equilibrium) -> Refusal | None:
        if answer.status is Status.TIMEOUT:
            return Refusal.TIMEOUT
        if answer.status is Status.NO_STABLE_EQUILIBRIUM:  # the branch ends
            return Refusal.SNAP
        if not answer.success:
            return Refusal.FAILED
        if answer.stability_margin < min(self.floor, self.answer.stability_margin):
            return Refusal.MARGIN
        return None
