"""Equilibria of any kind from many starts at once, for robots in which more than two tubes pull at each other.

The energy is q.q / 2 plus a bounded, periodic function of the twist, so its equilibria, stable or not, lie in a box of
twist angles known beforehand.  Starts fill that box evenly; from each, Levenberg-Marquardt steps reduce the gradient
of the energy.  That finds the equilibria that any start leads to: it is no proof that there are no others.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.kernel.twist.newton import residual_limit
from ctr_pvs.solve.dense import DenseEnergy

Array = NDArray[np.float64]

#: Starts for each relative angle squared, and the most.
STARTS, MOST_STARTS = 200, 2000
#: Starts twist a tube by no more than this [rad] against its base: equilibria beyond are many and far from stable.
MOST_TWIST = 3.0 * np.pi
#: Levenberg-Marquardt steps, the damping they begin with, and how it changes after a good and a bad step.
STEPS, DAMPING, EASE, BRAKE = 80, 1e-2, 0.2, 6.0
#: A start is given up if after this many steps its unbalanced torque would still twist more than this [rad].
PATIENCE, HOPELESS = 20, 1e-3
#: Equilibria whose angles differ by less than this [rad] everywhere are one.
SAME = 1e-5


@dataclass(frozen=True, eq=False)
class Search:
    """What a search found: q (n,) of each equilibrium and how many starts led to it; starts and those that led to
    one."""

    found: list[Array]
    hits: list[int]
    starts: int
    converged: int


def search(energy: DenseEnergy, alpha: Array) -> Search:
    """All equilibria of ``energy`` at base angles ``alpha`` (N,) [rad] that the starts lead to."""
    starts = _starts(energy)
    q = _descend(energy, alpha, starts)
    residual = np.array([energy.twist_size(energy.gradient(row, alpha)) for row in q])
    good = q[residual <= 100.0 * residual_limit(alpha)]
    found: list[Array] = []
    hits: list[int] = []
    for row in good:
        index = next((i for i, other in enumerate(found) if energy.twist_size(row - other) < SAME), None)
        if index is None:
            found.append(row)
            hits.append(1)
        else:
            hits[index] += 1
    return Search(found, hits, len(starts), len(good))


def _starts(energy: DenseEnergy) -> Array:
    """(S, n) the least twist that turns the tubes' ends by given angles: none, and a low-discrepancy set of a box."""
    end = energy.angle_map[-1]
    # At an equilibrium q = -sum A^T torque: a bound on the torques bounds the twist.
    strength = np.abs(energy.moment)
    most = energy.coupling[:, None] * strength * (strength.sum(axis=1, keepdims=True) - strength)
    bound = np.einsum("jgn,gn->j", np.abs(np.einsum("jp,gnp->jgn", end, energy.angle_map)), most)
    box = np.minimum(bound, MOST_TWIST)
    pulled = int((bound > 0.0).sum())
    count = min(STARTS * max(pulled - 1, 1) ** 2, MOST_STARTS)
    turns = (2.0 * _low_discrepancy(count, len(box)) - 1.0) * box
    return np.vstack([np.zeros(energy.n), turns @ np.linalg.pinv(end).T])


def _low_discrepancy(count: int, dimensions: int) -> Array:
    """(count, dimensions) points that fill the unit cube evenly: multiples of powers of the generalised golden ratio,
    modulo 1."""
    ratio = 2.0
    for _ in range(64):
        ratio = (1.0 + ratio) ** (1.0 / (dimensions + 1))
    return np.mod(0.5 + np.outer(np.arange(1, count + 1), ratio ** -np.arange(1.0, dimensions + 1.0)), 1.0)


def _descend(energy: DenseEnergy, alpha: Array, q: Array) -> Array:
    """Levenberg-Marquardt on the gradient from all rows of ``q`` (S, n) at once."""
    batch = _Batch(energy, alpha)
    q = q.copy()
    gradient = batch.gradient(q)
    damping = np.full(len(q), DAMPING)
    active = np.arange(len(q))
    limit = residual_limit(alpha)
    for taken in range(STEPS):
        size = batch.twist(gradient[active])
        active = active[(size > limit) & ((size < HOPELESS) | (taken < PATIENCE))]
        if not len(active):
            break
        hessian = batch.hessian(q[active])
        normal = hessian @ hessian
        index = np.arange(energy.n)
        normal[:, index, index] += damping[active, None]
        step = np.linalg.solve(normal, -(hessian @ gradient[active][..., None]))[..., 0]
        trial = q[active] + step
        new = batch.gradient(trial)
        better = np.linalg.norm(new, axis=1) < np.linalg.norm(gradient[active], axis=1)
        q[active[better]], gradient[active[better]] = trial[better], new[better]
        damping[active] *= np.where(better, EASE, BRAKE)
        damping[active] = np.maximum(damping[active], 1e-16)
    return q


class _Batch:
    """Derivatives of the energy at many q (S, n) at once."""

    def __init__(self, energy: DenseEnergy, alpha: Array) -> None:
        self.energy, self.alpha = energy, alpha
        self.map = energy.angle_map.reshape(-1, energy.n)
        self.squares = np.einsum("fp,fr->fpr", self.map, self.map).reshape(len(self.map), -1)

    def _moments(self, q: Array) -> NDArray[np.complex128]:
        psi = self.alpha + (q @ self.map.T).reshape(len(q), *self.energy.moment.shape)
        return np.asarray(self.energy.moment * np.exp(1j * psi))

    def gradient(self, q: Array) -> Array:
        """(S, n)"""
        moments = self._moments(q)
        torque = self.energy.coupling[:, None] * (moments.sum(axis=2).conj()[..., None] * moments).imag
        return np.asarray(q + torque.reshape(len(q), -1) @ self.map)

    def hessian(self, q: Array) -> Array:
        """(S, n, n), by the terms of ``DenseEnergy.curvature_form``."""
        moments = self._moments(q)
        diagonal = self.energy.coupling[:, None] * (moments.sum(axis=2).conj()[..., None] * moments).real
        n = self.energy.n
        hessian = (diagonal.reshape(len(q), -1) @ self.squares).reshape(-1, n, n)
        scaled = np.sqrt(self.energy.coupling)[:, None] * moments
        along, across = (np.einsum("sgn,gnp->sgp", part, self.energy.angle_map) for part in (scaled.real, scaled.imag))
        hessian -= along.transpose(0, 2, 1) @ along + across.transpose(0, 2, 1) @ across
        index = np.arange(n)
        hessian[:, index, index] += 1.0
        return hessian

    def twist(self, q: Array) -> Array:
        """(S,) largest twist angle [rad]."""
        return np.abs(q @ self.map.T).max(axis=1)
