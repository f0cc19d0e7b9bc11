"""A coarse table of where tips are: starts for a search that has not found its target from where the robot stands."""

from __future__ import annotations

import time

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.answer.status import Status
from ctr_pvs.solve.solver import EquilibriumSolver
from ctr_pvs.tasks.aim import Aim
from ctr_pvs.tasks.aim import turned_about_x
from ctr_pvs.tasks.bounds import Bounds

Array = NDArray[np.float64]

#: Rows, by the number of tubes, and at most.
ROWS, MOST_ROWS = 256, 2048
#: Rows between two looks at the clock.
BLOCK = 32
#: Starts nearer to each other than this, in units of ``Bounds.scaled``, count as one.
APART = 0.6


class Table:
    """Commands spread evenly within the bounds, with the tips of cold starts there, without loads; empty until it is
    filled.

    x : (M, 2 N) commands, see ``Bounds``, of which those that snapped are left out; position (M, 3), orientation
    (M, 4).  A common rotation of all tubes turns the tip about +x and is left to ``starts``.
    """

    def __init__(self, solver: EquilibriumSolver, bounds: Bounds) -> None:
        N = bounds.tubes
        count = min(ROWS * 2 ** (2 * N - 3), MOST_ROWS) if N > 1 else ROWS
        share = spread(count, 2 * N - 1)
        low, high = bounds.low, bounds.high
        first = np.clip(0.0, low[0], high[0])
        least, most = np.maximum(low[1:N], first - np.pi), np.minimum(high[1:N], first + np.pi)
        alpha = np.column_stack([np.full(count, first), least + share[:, : N - 1] * np.maximum(most - least, 0.0)])
        # The square makes rows of tubes far out more frequent: there the tip is farthest from that of its neighbours.
        D = np.maximum.accumulate(low[N:] + share[:, N - 1 :] ** 1.5 * (high[N:] - low[N:]), axis=1)
        self._solver, self._bounds, self._left = solver.fork(halts=True), bounds, np.concatenate([alpha, D], axis=1)
        self.x, self.position, self.orientation = np.empty((0, 2 * N)), np.empty((0, 3)), np.empty((0, 4))

    def fill(self, deadline: float) -> None:
        """Solves for what is not solved for yet, as far as it goes until a ``time.monotonic()`` value."""
        while len(self._left) and time.monotonic() < deadline:
            rows, self._left = self._left[:BLOCK], self._left[BLOCK:]
            alpha, D = np.split(rows, 2, axis=1)
            batch = self._solver.solve_batch(alpha, D)
            good = batch.status == Status.OK
            self.x = np.concatenate([self.x, rows[good] / self._bounds.scale])
            self.position = np.concatenate([self.position, batch.tip_position[good]])
            self.orientation = np.concatenate([self.orientation, batch.tip_orientation[good]])

    def starts(self, aim: Aim, count: int) -> list[tuple[Array, Array]]:
        """The ``count`` commands, alpha and D (N,), with the tips nearest to the aim, all tubes turned together to
        bring them there; no two of them close to each other."""
        turn = aim.turn_from(self.position)
        miss = aim.miss(*turned_about_x(turn, self.position, self.orientation))
        chosen: list[int] = []
        for row in np.argsort(miss).tolist():
            if all(np.abs(self.x[row] - self.x[other]).max() > APART for other in chosen):
                chosen.append(row)
                if len(chosen) == count:
                    break
        return [self._turned(row, float(turn[row])) for row in chosen]

    def _turned(self, row: int, turn: float) -> tuple[Array, Array]:
        alpha, D = self._bounds.command(self.x[row])
        return self._bounds.clamped(alpha + self._bounds.turn_within(alpha, turn), D)


def spread(count: int, dimensions: int) -> Array:
    """(count, dimensions) numbers from 0 to 1 that fill the cube evenly: multiples of the powers of the root of
    x^(dimensions + 1) = x + 1, modulo 1, the golden ratio's relatives."""
    root = 2.0
    for _ in range(60):
        root = (1.0 + root) ** (1.0 / (dimensions + 1))
    return np.asarray((0.5 + np.arange(1, count + 1)[:, None] * root ** -np.arange(1.0, dimensions + 1)) % 1.0)
