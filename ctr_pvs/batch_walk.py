"""Equilibria of many commands at once: along their paths in certified steps, and at their ends by Newton.

Rows walk in lock-step, each on the straight path of its own.  A step predicts along the tangent, corrects by one Newton
step, and is taken where the energy of the finer model is certainly convex on a box that holds the angles of the state
left and of the state reached: what is reached need not be accurate.  Rows whose step cannot be proven shorten it, and
give up at a fold.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.batch_linear import circle
from ctr_pvs.batch_linear import factorise
from ctr_pvs.batch_linear import product
from ctr_pvs.batch_linear import solve
from ctr_pvs.batch_tables import Tables
from ctr_pvs.batch_values import Values
from ctr_pvs.solve import CONTRACTION
from ctr_pvs.solve import RESIDUAL_TWIST
from ctr_pvs.solve import ROUNDING

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Indices = NDArray[np.int64]

#: A Newton step shorter than this [rad] leaves less than rounding does.
LAST_STEP = 2e-7
MOST_NEWTON_STEPS = 8
#: Longest step of a walk, and the shortest that is tried [rad between tubes].
LONGEST, SHORTEST = 1.2, 4e-3
MOST_WALKING_STEPS = 60
#: A box is wider than the way between two states by this share of the way, on either side.
BEYOND = 0.25
#: What a Newton step leaves is taken to be less than this share of it; steps are taken if their correction is less
#: than ``WORST`` of the way plus a little and what the step before has left, and if they leave less than so much [rad].
LEFT, WORST, LITTLE, FARTHEST_OFF = 0.5, 0.3, 0.02, 0.15


class Problem:
    """Rows of base angles ``alpha`` (N, rows) at base positions of one table (one for all rows or one for each)."""

    def __init__(self, tables: Tables, values: Values, alpha: Array) -> None:
        self.tables, self.values, self.alpha = tables, values, alpha
        self.rows = alpha.shape[1]

    def take(self, rows: Indices) -> Problem:
        return Problem(self.tables, self.values.take(rows), self.alpha[:, rows])

    def angles(self, u: Array, alpha: Array) -> Array:
        """(R, rows) angle of each pair."""
        theta = product(self.tables.waves, np.concatenate([u, alpha, np.ones((1, u.shape[1]))]))
        if not self.tables.layout.constant:
            theta += self.values.phase
        return theta

    def gradient(self, sin: Array, u: Array) -> Array:
        """(n, rows) of the energy."""
        return product(self.tables.pull, self.values.amplitude * sin) + self.values.stiff(u)

    def hessian(self, cos: Array, table: Array) -> Array:
        """Packed Hessians; ``table`` : one of those of ``Tables``, whose last result is overwritten."""
        pairs = self.tables.pairs
        columns, scratch = cos.shape[1], self.tables.scratch
        parts = scratch.array("parts", table.shape[1], columns)
        np.multiply(self.values.amplitude, cos, out=parts[:pairs])
        parts[pairs:] = self.values.entries
        name = "finer" if table is self.tables.finer_hessian else "hessian"
        return product(table, parts, scratch.array(name, len(table), columns))

    def twist(self, change: Array) -> Array:
        """(rows,) bound of the angles [rad] that a change of the unknowns stands for."""
        square = (change * self.values.stiff(change)).sum(axis=0)
        return np.asarray(self.values.twist_norm * np.sqrt(square))


@dataclass(eq=False)
class Found:
    """Where Newton ended: ``good`` (rows,) where that is a certainly stable equilibrium.

    theta, sin (R, rows) angles of the pairs; bound [m] as ``Served`` has it; change (finer, rows) : the finer model's.
    """

    good: Mask
    u: Array
    theta: Array
    sin: Array
    residual: Array
    bound: Array
    change: Array
    iterations: Indices

    def put(self, rows: Indices, other: Found) -> None:
        """Takes over ``other`` for these rows."""
        for name in ("good", "u", "theta", "sin", "residual", "bound", "change", "iterations"):
            getattr(self, name)[..., rows] = getattr(other, name)


def converge(problem: Problem, u: Array) -> Found:
    """Newton from ``u`` (n, rows), overwritten, to the equilibria, and the check."""
    rows = problem.rows
    iterations = np.zeros(rows, dtype=np.int64)
    good = np.ones(rows, dtype=bool)
    pending, previous = np.arange(rows), np.full(rows, np.inf)
    for _ in range(MOST_NEWTON_STEPS if len(u) else 0):
        whole = len(pending) == rows
        part = problem if whole else problem.take(pending)
        here = u if whole else u[:, pending]
        step, certain = _newton_step(part, here)
        size = part.twist(step)
        certain &= (size < CONTRACTION * previous[pending]) | (size <= LAST_STEP)
        here -= step
        if not whole:
            u[:, pending] = here
        iterations[pending] += 1
        previous[pending] = size
        good[pending] = certain
        pending = pending[certain & ~(size <= LAST_STEP)]
        if not len(pending):
            break
    good[pending] &= len(u) == 0
    return check(problem, u, good, iterations)


def _newton_step(problem: Problem, u: Array) -> tuple[Array, Mask]:
    cos, sin = circle(problem.angles(u, problem.alpha))
    packed = problem.hessian(cos, problem.tables.hessian)
    inverse, certain = factorise(packed, problem.tables.n)
    return solve(packed, inverse, problem.gradient(sin, u)), certain


def check(
    problem: Problem, u: Array, good: Mask, iterations: Indices, reach: Array | None = None, settled: bool = True
) -> Found:
    """What ``ServingModel`` checks of a state: that the finer model is certainly convex within ``reach`` (the slack
    if None), that the residual is small if it is to be ``settled``, and how far the finer model would move the tip."""
    tables, values = problem.tables, problem.values
    theta = problem.angles(u, problem.alpha)
    cos, sin = circle(theta)
    if not tables.n:
        none = np.zeros(problem.rows)
        return Found(good, u, theta, sin, none, none.copy(), u, iterations)
    packed = problem.hessian(cos - (values.slack if reach is None else reach), tables.finer_hessian)
    inverse, certain = factorise(packed, tables.finer)
    gradient = product(tables.finer_pull, values.amplitude * sin)
    gradient[: tables.n] += values.stiff(u)
    residual = values.twist_norm * np.sqrt(values.soft_square(gradient[: tables.n]))
    change = solve(packed, inverse, gradient)
    bound = values.tip_motion(change)
    good = good & certain
    bound[problem.twist(change) > values.slack] = np.inf
    if settled:
        good &= residual <= RESIDUAL_TWIST + ROUNDING * np.abs(problem.alpha).max(axis=0)
    return Found(good, u, theta, sin, residual, bound, change, iterations)


def lowest_cosines(cos: Array, sin: Array, low: Array, high: Array) -> Array:
    """A lower bound of cos(theta + x) for x in [low, high]: by the tangent, and what a parabola may add."""
    drop = np.maximum(sin * low, sin * high)
    drop += 0.5 * np.maximum(low * low, high * high)
    return np.maximum(cos - drop, -1.0)


def convex_between(problem: Problem, theta: Array, cos: Array, sin: Array, others: list[Array], pad: Array) -> Mask:
    """(rows,) true where the finer energy is certainly convex on the box that holds the angles ``theta`` and ``others``
    (R, rows) and reaches ``pad`` (R, rows) beyond."""
    low = high = np.zeros(theta.shape)
    for other in others:
        away = other - theta
        low, high = np.minimum(low, away), np.maximum(high, away)
    lowered = lowest_cosines(cos, sin, low - pad, high + pad)
    packed = problem.hessian(lowered, problem.tables.finer_hessian)
    return factorise(packed, problem.tables.finer)[1]


@dataclass(eq=False)
class _Walk:
    """Where rows stand on their paths: t of the way (rows,), unknowns u (n, rows) and angles theta (R, rows) there, how
    far off these may be, the tangents du/dt, and the next step."""

    t: Array
    u: Array
    theta: Array
    off: Array
    rate: Array
    step: Array

    def take(self, rows: Indices) -> _Walk:
        parts = (self.t, self.u, self.theta, self.off, self.rate, self.step)
        return _Walk(*(part[..., rows] for part in parts))

    def put(self, rows: Indices, other: _Walk, which: Mask) -> None:
        """Take over ``other``'s columns ``which`` for ``rows``."""
        into = rows[which]
        for name in ("t", "u", "theta", "off", "rate", "step"):
            getattr(self, name)[..., into] = getattr(other, name)[..., which]


def follow(problem: Problem, begin: Array, u: Array) -> tuple[Mask, Array]:
    """Walk from base angles ``begin`` (N, rows), where the stable equilibria are ``u`` (n, rows), straight to those of
    ``problem``.

    Returns (rows,) true where the end was reached, and the unknowns there (n, rows), near the equilibria.
    """
    rows = problem.rows
    way = problem.alpha - begin
    if not problem.tables.n:
        return np.ones(rows, dtype=bool), np.zeros((0, rows))
    walk = _set_out(problem, begin, u, way)
    active = np.arange(rows)
    for _ in range(MOST_WALKING_STEPS):
        if not len(active):
            break
        whole = len(active) == rows
        part, here = (problem, walk) if whole else (problem.take(active), walk.take(active))
        there, proven, speed = _step(part, here, begin[:, active], way[:, active])
        walk.put(active, there, proven)
        shorter = 0.5 * np.minimum(here.step, 1.0 - here.t)[~proven]
        walk.step[active[~proven]] = shorter
        stuck = np.zeros(len(active), dtype=bool)
        stuck[~proven] = shorter * speed[~proven] < SHORTEST
        active = active[~stuck & (walk.t[active] < 1.0)]
    return walk.t >= 1.0, walk.u


def _set_out(problem: Problem, begin: Array, u: Array, way: Array) -> _Walk:
    rows = problem.rows
    u = np.array(np.broadcast_to(u, (problem.tables.n, rows)))
    theta = problem.angles(u, begin)
    cos, sin = circle(theta)
    packed = problem.hessian(cos, problem.tables.hessian)
    inverse, _ = factorise(packed, problem.tables.n)
    rate, step, _ = _tangent(problem, packed, inverse, cos, sin, way)
    return _Walk(np.zeros(rows), u, theta, np.full(rows, 1e-6), rate, step)


def _tangent(
    problem: Problem, packed: Array, inverse: Array, cos: Array, sin: Array, way: Array
) -> tuple[Array, Array, Array]:
    """du/dt (n, rows), the step to try next and the speed [rad] of the angles (rows,).

    Where the coupling is nearly that of one mode, it overcomes torsion when the mean of the cosines falls below -1 over
    its strength.  Steps are as long as this can be expected not to happen within the box of the step.
    """
    tables, values = problem.tables, problem.values
    turning = product(tables.turns, way)
    rate = -solve(packed, inverse, product(tables.pull, values.amplitude * cos * turning))
    moving = product(tables.difference[:, : tables.n], rate) + turning
    share = values.share / values.coupled
    reserve = 0.8 * np.maximum(1.0 / values.coupled + (share * cos).sum(axis=0), 0.02)
    falling = 1.25 * np.maximum((share * sin * moving).sum(axis=0), 0.0)
    bending = 0.8 * (share * moving * moving).sum(axis=0)
    speed = np.maximum(np.abs(moving).max(axis=0), 1e-12)
    step = 2.0 * reserve / (falling + np.sqrt(falling * falling + 4.0 * bending * reserve) + 1e-300)
    step = np.where(values.calm, np.inf, step)
    return rate, np.minimum(step, LONGEST / speed), speed


def _step(problem: Problem, walk: _Walk, begin: Array, way: Array) -> tuple[_Walk, Mask, Array]:
    """The states one step further on, where that is proven, and the speed [rad] there."""
    tables = problem.tables
    step = np.minimum(walk.step, 1.0 - walk.t)
    t = np.where(walk.step >= 1.0 - walk.t, 1.0, walk.t + step)
    alpha = begin + t * way
    u = walk.u + step * walk.rate
    theta = problem.angles(u, alpha)
    cos, sin = circle(theta)
    packed = problem.hessian(cos, tables.hessian)
    inverse, certain = factorise(packed, tables.n)
    correction = solve(packed, inverse, problem.gradient(sin, u))
    corrected = theta - product(tables.difference[:, : tables.n], correction)
    moved = np.abs(corrected - walk.theta)
    off = LEFT * np.abs(corrected - theta).max(axis=0)
    pad = BEYOND * moved + (off + walk.off + problem.values.slack)
    certain &= off <= np.minimum(LEFT * (WORST * moved.max(axis=0) + LITTLE) + walk.off, FARTHEST_OFF)
    calm = problem.values.calm
    if not calm.all():
        certain &= convex_between(problem, theta, cos, sin, [walk.theta, corrected], pad) | calm
    rate, following, speed = _tangent(problem, packed, inverse, cos, sin, way)
    return _Walk(t, u - correction, corrected, off, rate, following), certain, speed
