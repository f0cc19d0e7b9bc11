"""The judge of loaded sweeps: small steps of plain Newton on the dense virtual work, and nothing else.

It goes along a straight path in (alpha, D, loads), from stable state to stable state, and stops where its own branch
ends: Newton's method finds nothing near enough ahead, or what it finds is not stable.  No tangent, no certificate, no
landing; of the package only the robot, its materials and the loads.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from numpy.typing import NDArray
from scipy.linalg.lapack import dgetrf
from scipy.linalg.lapack import dgetrs

from bench.loaded.loaded_galerkin import Fields
from bench.loaded.loaded_galerkin import Galerkin
from bench.loaded.loaded_galerkin import is_stable
from ctr_pvs import Robot
from ctr_pvs.robot.loads import ZERO
from ctr_pvs.robot.loads import Loads
from ctr_pvs.robot.loads import PointForce

Array = NDArray[np.float64]

DEGREE = 6
ANGLE_STEP, SLIDE_STEP, LOAD_STEP = 0.02, 0.5e-3, 0.02  # rad, m, of the change of load
#: A step may twist a tube or turn the centreline by this much [rad]; where the response is steep the judge goes down
#: to this share of its step.
MOST_TURN, FINEST = 0.1, 1e-3
#: Newton's method ends when a step moves less than this [rad], or goes farther than its room, or after so many.
EXACT, MOST_ITERATIONS = 1e-10, 30
#: A tangent is kept while steps shrink by this factor.
CONTRACTION = 0.3


@dataclass(frozen=True, eq=False)
class Place:
    """A state: unknowns x (n,) of ``model`` at base angles alpha (N,) [rad]."""

    model: Galerkin
    alpha: Array
    x: Array

    @cached_property
    def fields(self) -> Fields:
        return self.model.fields(self.x, self.alpha)

    @cached_property
    def tangent(self) -> Array:
        return self.model.tangent(self.fields)

    @property
    def stable(self) -> bool:
        """Whether the symmetric part of the tangent is positive definite."""
        return is_stable(self.tangent)

    @property
    def least_stiffness(self) -> float:
        """Smallest eigenvalue of the tangent's symmetric part, in the metric of torsional and bending stiffness."""
        return float(np.linalg.eigvalsh(0.5 * (self.tangent + self.tangent.T))[0]) if self.model.n else 1.0

    @property
    def tip(self) -> Array:
        """Position (3,) [m]."""
        return self.model.tip(self.fields)

    @property
    def psi_ends(self) -> Array:
        """psi (N,) [rad] at each tube's own end; of a tube in the guide, at the orifice."""
        return self.model.psi_ends(self.x, self.alpha)

    def apart(self, other: Place) -> float:
        """How far [rad] another state at the same command is, in the twist of tubes and the turn of the centreline."""
        there = resampled(other, self.model)
        return self.model.changes(there - self.x, self.fields)


@dataclass(frozen=True, eq=False)
class LoadedPath:
    """The straight line from (alpha, D, loads) to another such; loads on the same points or not."""

    alpha: Array
    D: Array
    loads: Loads
    alpha_end: Array
    D_end: Array
    loads_end: Loads

    def at(self, t: float) -> tuple[Array, Array, Loads]:
        """The command at the fraction ``t``; the ends are exact."""
        if t in (0.0, 1.0):
            return (self.alpha_end, self.D_end, self.loads_end) if t else (self.alpha, self.D, self.loads)
        alpha, D = (a + t * (b - a) for a, b in ((self.alpha, self.alpha_end), (self.D, self.D_end)))
        return alpha, D, self.loads if self.loads == self.loads_end else mixed(self.loads, self.loads_end, t)

    @property
    def steps(self) -> int:
        """Into which the judge divides it."""
        turn, slide = np.abs(self.alpha_end - self.alpha).max(), np.abs(self.D_end - self.D).max()
        load = 0.0 if self.loads == self.loads_end else 1.0
        return 1 + int(max(turn / ANGLE_STEP, slide / SLIDE_STEP, load / LOAD_STEP))


def mixed(a: Loads, b: Loads, t: float) -> Loads:
    """(1 - t) a + t b; points that both have keep one entry."""
    a, b = a.scaled(1.0 - t), b.scaled(t)

    def both(u: ArrayLike, v: ArrayLike) -> tuple[float, float, float]:
        x, y, z = (np.array(u) + np.array(v)).tolist()
        return x, y, z

    points = {(p.tube, p.X): p for p in a.point_forces}
    for p in b.point_forces:
        had = points.get((p.tube, p.X))
        points[p.tube, p.X] = (
            p if had is None else type(p)(p.tube, p.X, both(had.force, p.force), both(had.moment, p.moment))
        )
    tubes = {*a.line_forces, *b.line_forces}
    return Loads(
        both(a.tip_force, b.tip_force),
        both(a.tip_moment, b.tip_moment),
        tuple(points.values()),
        {j: both(a.line_forces.get(j, ZERO), b.line_forces.get(j, ZERO)) for j in tubes},
        both(a.gravity, b.gravity),
    )


class LoadedJudge:
    """Follows paths of one robot with polynomials of one degree."""

    def __init__(self, robot: Robot, degree: int = DEGREE) -> None:
        self.robot, self.degree = robot, degree
        self._last: Galerkin | None = None

    def model(self, D: Array, loads: Loads) -> Galerkin:
        last = self._last
        if last is None or last.loads != loads or not np.array_equal(last.D, D):
            last = self._last = Galerkin(self.robot, D, loads, self.degree)
        return last

    def newton(
        self, model: Galerkin, alpha: Array, x: Array, room: float, tangent: Array | None = None
    ) -> Place | None:
        """The state that Newton's method finds from x (n,); None where that leads farther than ``room`` [rad], or
        nowhere.  A ``tangent`` nearby is used as long as that converges."""
        gone, last = 0.0, np.inf
        factors = None if tangent is None else dgetrf(tangent)
        for _ in range(MOST_ITERATIONS):
            fields = model.fields(x, alpha)
            if factors is None:
                factors = dgetrf(model.tangent(fields))
            if factors[2] != 0:  # singular
                return None
            change = dgetrs(*factors[:2], -model.residual(x, fields))[0]
            size = model.changes(change, fields)
            gone += size
            if not gone <= room:  # nor where numbers overflow
                return None
            x = x + change
            if size < EXACT:
                return Place(model, alpha, x)
            if size > CONTRACTION * last:
                factors = None
            last = size
        return None

    def solve(
        self, alpha: ArrayLike, D: ArrayLike, loads: Loads | None = None, start: Place | None = None, room: float = 0.3
    ) -> Place | None:
        """The state next to ``start`` at a command; None is the straight untwisted robot, then in any room."""
        alpha, D = np.array(alpha, dtype=float), np.array(D, dtype=float)
        model = self.model(D, Loads() if loads is None else loads)
        if start is None:
            return self.newton(model, alpha, shared_bending(model, alpha), np.inf)
        return self.newton(model, alpha, resampled(start, model), room)

    def go(self, path: LoadedPath, place: Place, begin: float = 0.0, finest: float = FINEST) -> tuple[Place, float]:
        """The state where the branch from ``place`` at ``begin`` ends, and that fraction of the path (1: its end)."""
        usual = 1.0 / path.steps
        t, step = begin, usual
        while t < 1.0:
            target = min(1.0, t + step)
            ahead = self._step(*path.at(target), place)
            if ahead is not None:
                place, t, step = ahead, target, min(usual, 2.0 * step)
            elif step < usual * finest:
                ahead = self._handed_over(*path.at(target), place)
                if ahead is None:
                    return place, t
                place, t = ahead, target
            else:
                step *= 0.5
        return place, t

    def _step(self, alpha: Array, D: Array, loads: Loads, place: Place) -> Place | None:
        model = self.model(D, loads)
        x = resampled(place, model)
        tangent = place.tangent if model.signature == place.model.signature else None
        found = self.newton(model, alpha, x, MOST_TURN, tangent)
        if found is None and tangent is not None:
            found = self.newton(model, alpha, x, MOST_TURN)
        return found if found is not None and found.stable else None

    def _handed_over(self, alpha: Array, D: Array, loads: Loads, place: Place) -> Place | None:
        """The state where the tip's moment has gone over to another tube, which reaches farthest from here on; None if
        that is not so, or ends the branch."""
        old = place.model.leader
        if not any(loads.tip_moment) or self.model(D, loads).leader == old:
            return None
        tip = PointForce(old, self.robot.tubes[old].length, loads.tip_force, loads.tip_moment)
        before = replace(loads, tip_force=ZERO, tip_moment=ZERO, point_forces=(*loads.point_forces, tip))
        start = self._step(alpha, D, before, place)
        if start is None:
            return None
        reached, t = self.go(LoadedPath(alpha, D, before, alpha, D, loads), start)
        return reached if t == 1.0 else None

    def placed(
        self,
        alpha: ArrayLike,
        D: ArrayLike,
        loads: Loads | None,
        psi: Callable[[Array], Array],
        frames: Callable[[Array], Array],
        room: float = 0.3,
    ) -> Place | None:
        """The state next to one of another method, which has angles psi(s) (g, N) [rad] and Bishop frames (g, 3, 3) at
        s (g,) [m]; None where Newton's method leads away from it."""
        alpha, D = np.array(alpha, dtype=float), np.array(D, dtype=float)
        model = self.model(D, Loads() if loads is None else loads)
        s, shape = model.s.ravel(), (model.P, model.G)
        k = curvature_of(model, frames(s).reshape(*shape, 3, 3))
        return self.newton(model, alpha, nearest(model, alpha, psi(s).reshape(*shape, -1), k), room)


def curvature_of(model: Galerkin, R: Array) -> Array:
    """k (P, G, 2) [1/m] of frames R (P, G, 3, 3) at the Gauss points: k_y = -t'.d3, k_z = t'.d2."""
    slope = model.rule.slope @ R[..., 0] / model.h[:, None, None]
    return np.stack([-np.sum(slope * R[..., 2], axis=2), np.sum(slope * R[..., 1], axis=2)], axis=2)


def shared_bending(model: Galerkin, alpha: Array) -> Array:
    """Unknowns (n,) of untwisted tubes that share their bending without loads."""
    psi = np.broadcast_to(alpha, (model.P, model.G, len(alpha)))
    c_y, c_z = model.turned(psi)
    k = np.stack([c_y.sum(axis=2), c_z.sum(axis=2)], axis=2) / model.total[:, None, None]
    return nearest(model, alpha, psi, k)


def nearest(model: Galerkin, alpha: Array, psi: Array, k: Array) -> Array:
    """Unknowns (n,) whose fields are nearest to psi (P, G, N) [rad] and k (P, G, 2) [1/m] at the Gauss points."""
    x = np.zeros(model.n)
    for j, (at, _) in enumerate(model.angle_maps):
        P = int(model.pieces_of[j])
        if P:
            free = slice(0 if model.softness[j] > 0.0 else 1, None)
            flat = at.reshape(P * model.G, -1)[:, free]
            own = np.linalg.lstsq(flat, (psi[:P, :, j] - alpha[j]).ravel(), rcond=None)[0]
            x[j] = own[0] if free.start == 0 else 0.0
            x[model.rows[j]] = own[1 - free.start :]
    coefficients = k.swapaxes(1, 2) @ (model.rule.weight[:, None] * model.rule.value)
    x[model.first_k :] = (coefficients / model.k_scale[:, None, None]).ravel()
    return x


def resampled(place: Place, model: Galerkin) -> Array:
    """The unknowns (n,) of ``model`` with the fields of ``place``: coefficient by coefficient where the pieces are the
    same ones, else by what the fields are at the same s."""
    old, x = place.model, place.x
    if old is model:
        return x
    softness = np.divide(model.softness, old.softness, out=np.zeros(len(model.D)), where=old.softness > 0.0)
    if old.signature == model.signature:
        stretch = np.sqrt(model.h / old.h)
        out = x.copy()
        out[: len(softness)] *= softness
        for j, rows in enumerate(model.rows):
            out[rows] *= np.repeat(stretch[: int(model.pieces_of[j])], model.Q)
        out[model.first_k :] *= np.repeat(stretch, 2 * model.Q)
        return out
    return _projected(old, x, model, softness)


def _projected(old: Galerkin, x: Array, model: Galerkin, softness: Array) -> Array:
    """Projects psi' and k of the old pieces onto the new ones, 0 where there was no tube."""
    out = np.zeros(model.n)
    out[: len(softness)] = x[: len(softness)] * softness
    s = model.s
    piece = np.clip(np.searchsorted(old.edges, s) - 1, 0, max(old.P - 1, 0))
    inside = s <= old.edges[-1]
    place = np.clip((s - old.edges[piece]) / old.h[piece], 0.0, 1.0) if old.P else s
    value = np.polynomial.legendre.legvander(2.0 * place - 1.0, old.degree) * np.sqrt(2.0 * np.arange(old.Q) + 1.0)
    weighted = model.rule.weight[:, None] * model.rule.value

    def moved(coefficients: Array, scale: Array) -> Array:
        """New coefficients (P, Q) of a field with the old ones (P', Q) times ``scale`` (P',)."""
        there = np.einsum("pgq,pgq->pg", value, (coefficients * scale[:, None])[piece])
        return np.asarray(np.where(inside, there, 0.0) @ weighted)

    if not old.P:
        return out
    for j, rows in enumerate(model.rows):
        before, after = int(old.pieces_of[j]), int(model.pieces_of[j])
        coefficients, scale = np.zeros((old.P, old.Q)), np.zeros(old.P)
        coefficients[:before] = x[old.rows[j]].reshape(before, old.Q)
        scale[:before] = 1.0 / np.sqrt(old.GJ[:before, j] * old.h[:before])
        new = moved(coefficients, scale)[:after]
        out[rows] = (new * np.sqrt(model.GJ[:after, j] * model.h[:after])[:, None]).ravel()
    k = x[old.first_k :].reshape(old.P, 2, old.Q)
    new = np.stack([moved(k[:, side], old.k_scale) for side in (0, 1)], axis=1)
    out[model.first_k :] = (new / model.k_scale[:, None, None]).ravel()
    return out
