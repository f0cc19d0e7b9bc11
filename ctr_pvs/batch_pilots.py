"""Many commands at one D whose tubes have one relative angle: all of them lie on one path.

A few pilots walk it.  Between two neighbours that are proven to be on one branch, by a box on which the energy is
convex, every row starts from their cubic interpolant.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.batch_linear import circle
from ctr_pvs.batch_linear import factorise
from ctr_pvs.batch_linear import solve
from ctr_pvs.batch_tables import Tables
from ctr_pvs.batch_values import Values
from ctr_pvs.batch_walk import BEYOND
from ctr_pvs.batch_walk import Problem
from ctr_pvs.batch_walk import converge
from ctr_pvs.batch_walk import convex_between
from ctr_pvs.batch_walk import follow

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Indices = NDArray[np.int64]

#: Relative angle between neighbours [rad], and how many rows there are at least for each pilot.
SPACING = 0.05
ROWS_PER_PILOT = 12


def relative_angle(tables: Tables, alpha: Array) -> Array | None:
    """(rows,) the one angle between two tubes that counts, or None if there are several."""
    if not tables.pairs or np.any(tables.turns != tables.turns[0]):
        return None
    return np.asarray(tables.turns[0] @ alpha)


def pilots(tables: Tables, values: Values, begin: Array, u: Array, relative: Array) -> Pilots | None:
    """Pilots for rows of these ``relative`` angles (rows,), from the relaxed robot at ``begin`` (N, 1) with unknowns
    ``u`` (n, 1); None if they are too few for their spread."""
    low, high = float(relative.min()), float(relative.max())
    count = int((high - low) / SPACING) + 2
    if count * ROWS_PER_PILOT > len(relative):
        return None
    return Pilots(tables, values, begin, u, np.linspace(low, high, count))


class Pilots:
    """Equilibria at increasing ``relative`` angles (P,).

    linked (P - 1,) : true where two neighbours are proven to be on one branch.
    """

    def __init__(self, tables: Tables, values: Values, begin: Array, u: Array, relative: Array) -> None:
        self.relative = relative
        away = relative - float(tables.turns[0] @ begin[:, 0])
        alpha = begin + np.maximum(tables.turns[0], 0.0)[:, None] * away
        problem = Problem(tables, values, alpha)
        reached, near = follow(problem, np.broadcast_to(begin, alpha.shape), u)
        found = converge(problem, near)
        self.good = reached & found.good
        self.u, self.theta = found.u, found.theta
        cos, sin = circle(found.theta)
        self.slope = _slopes(problem, cos)
        self._reach = BEYOND * np.abs(np.diff(self.theta, axis=1)) + values.slack
        start = problem.take(np.arange(len(relative) - 1))
        convex = convex_between(start, self.theta[:, :-1], cos[:, :-1], sin[:, :-1], [self.theta[:, 1:]], self._reach)
        self.linked = convex & self.good[1:] & self.good[:-1]

    def guess(self, relative: Array) -> tuple[Indices, Array]:
        """Number of the interval (rows,) that each of the angles is in, and the unknowns (n, rows) there."""
        width = self.relative[1] - self.relative[0]
        index = np.minimum(((relative - self.relative[0]) / width).astype(np.int64), len(self.relative) - 2)
        t = (relative - self.relative[index]) / width
        left = 1.0 - t
        u = np.take(self.u, index, axis=1) * (left * left * (1.0 + 2.0 * t))
        u += np.take(self.u, index + 1, axis=1) * (t * t * (3.0 - 2.0 * t))
        u += np.take(self.slope, index, axis=1) * (width * t * left * left)
        u -= np.take(self.slope, index + 1, axis=1) * (width * t * t * left)
        return index, u

    def hopeful(self, index: Indices) -> Mask:
        """(rows,) true where an end of the interval has an equilibrium: beyond a fold neither has."""
        return np.asarray(self.good[index] | self.good[index + 1])

    def holds(self, index: Indices, theta: Array) -> Mask:
        """(rows,) true where ``theta`` (R, rows) is inside the box of a linked interval."""
        start, way = self.theta[:, :-1], np.diff(self.theta, axis=1)
        middle, half = start + 0.5 * way, 0.5 * np.abs(way) + self._reach
        off = np.abs(theta - np.take(middle, index, axis=1)) <= np.take(half, index, axis=1)
        return np.asarray(off.all(axis=0) & self.linked[index])


def _slopes(problem: Problem, cos: Array) -> Array:
    """(n, P) du per relative angle."""
    packed = problem.hessian(cos, problem.tables.hessian)
    inverse, _ = factorise(packed, problem.tables.n)
    return -solve(packed, inverse, problem.tables.pull @ (problem.values.amplitude * cos))
