"""One stage of a search: commands are looked for where targets are missed, then least squares improve the design.

What a stage takes and gives can be pickled, so that stages run wherever an executor runs them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from ctr_pvs.tasks.design.reach import Commands
from ctr_pvs.tasks.design.reach import Made
from ctr_pvs.tasks.design.reach import Problem
from ctr_pvs.tasks.design.reach import rates

Array = NDArray[np.float64]

#: What counts as one of a distance [m], and the weight of a curvature as a share of the largest to begin with.
DISTANCE, WISH = 1e-3, 0.1
#: Of a share that leaves where the stage began: what targets do not ask for stays.
REST = 1e-2
#: Designs that a stage tries, and shares of the sum of squares, of the design, that end one.
TRIES, FINE = 15, 1e-6


@dataclass(frozen=True, eq=False)
class Draft:
    """A design on its way: shares of its room (P,), commands, how far each target is missed (M,) [m]; the sum of
    squares; designs tried on the way to it."""

    shares: Array
    commands: Commands
    off: Array
    cost: float
    tried: int

    @property
    def worst(self) -> float:
        return float(self.off.max())


def blank(problem: Problem, shares: Array) -> Draft:
    """A design that was not tried."""
    M, N = len(problem.aims), problem.room.robot.n_tubes
    none = Commands(np.zeros((M, N)), np.full((M, N), 0.5), np.zeros(M, dtype=bool))
    return Draft(shares, none, np.full(M, np.inf), math.inf, 0)


def stage(problem: Problem, draft: Draft, wish: float = WISH) -> Draft:
    """``draft``, improved.  wish : weight of less curvature, see ``_Squares``."""
    squares = _Squares(problem, draft, wish)
    least_squares(
        squares.residuals, draft.shares, squares.jacobian, (0.0, 1.0), "trf",
        ftol=FINE, xtol=FINE, gtol=1e-12, max_nfev=TRIES,
    )  # fmt: skip
    assert squares.best is not None
    return squares.best


class _Squares:
    """For scipy: distances over ``DISTANCE``, and ``wish`` times each curvature over the largest to begin with,
    and ``REST`` times how far shares have gone."""

    def __init__(self, problem: Problem, draft: Draft, wish: float) -> None:
        self.problem, self.wish, self.tried = problem, wish, draft.tried
        self.begin = draft.shares
        self.curved = [i for i, p in enumerate(problem.room.parameters) if p.kind == "curvature"]
        self.unit = max([problem.room.parameters[i].start for i in self.curved], default=1.0)
        self.best: Draft | None = None
        self._commands = draft.commands
        self._last: tuple[bytes, Made] | None = None
        made = self._made(draft.shares)
        for i in np.flatnonzero(made.off > 0.0).tolist():
            made.look(i)
        self._commands = made.commands

    def _made(self, shares: Array) -> Made:
        """The design, with commands that go on from those of the last one that was taken."""
        if self._last is None or self._last[0] != shares.tobytes():
            made = Made(self.problem, self.problem.room.robot_at(shares))
            made.go_on(self._commands)
            self._last = shares.tobytes(), made
            self.tried += 1
        return self._last[1]

    def residuals(self, shares: Array) -> Array:
        made = self._made(shares)
        values = self.problem.room.values(shares)[self.curved]
        residuals = np.concatenate([made.off / DISTANCE, self.wish * values / self.unit])
        cost = float(residuals @ residuals)
        if self.best is None or cost < self.best.cost:
            self.best = Draft(shares.copy(), made.commands, made.off, cost, self.tried)
        return np.concatenate([residuals, REST * (shares - self.begin)])

    def jacobian(self, shares: Array) -> Array:
        """Of a design that was taken."""
        made = self._made(shares)
        self._commands = made.commands
        wish = self.wish * self.problem.room.rates(shares)[self.curved] / self.unit
        rest = REST * np.eye(len(shares))
        return np.vstack([rates(self.problem, shares, made) / DISTANCE, wish, rest])
