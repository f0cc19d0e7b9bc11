"""Whole gradients and Hessians of the energy, in plain numpy: for saddles, where a Cholesky factorisation stops, and as
a check of the kernel's condensation."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.answer.engine import Engine
from ctr_pvs.answer.state import State
from ctr_pvs.kernel.arrays import S_FLOOR
from ctr_pvs.kernel.arrays import S_TWISTS
from ctr_pvs.kernel.arrays import S_UNKNOWNS
from ctr_pvs.kernel.arrays import STATE
from ctr_pvs.kernel.arrays import TWISTED

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


class DenseEnergy:
    """E(y; alpha) at base positions D (N,) [m] with polynomials of at least ``degree``, and two more.

    n : number of unknowns; angle_map (G, N, n) : psi = alpha + A y at the Gauss points of the coupled elements; moment
    (G, N) K kappa* [N m]; coupling (G,) : quadrature weight over the sum of K [1/(N m)]; place (G,) [m].  Unknowns are
    scaled as in the kernel: the torsional energy is y.y / 2.
    """

    def __init__(self, engine: Engine, D: Array, degree: int) -> None:
        self.engine, self.D, self.degree = engine, D, degree
        blank = engine.blank(np.zeros(len(D)), D, degree)
        self.n = int(blank[S_UNKNOWNS])
        self.angle_map, self.moment, self.coupling, self.place = engine.dense_map(blank, self.n)
        self.angle_map = self.angle_map.reshape(*self.moment.shape, self.n)

    def state(self, y: Array, alpha: Array) -> State:
        """``y`` (n,) at base angles alpha (N,) [rad] as a state of the kernel, described."""
        N = len(alpha)
        vector = np.zeros(STATE + 3 * N + self.n)
        vector[S_FLOOR], vector[S_UNKNOWNS], vector[S_TWISTS] = self.degree, self.n, TWISTED
        vector[STATE : STATE + N], vector[STATE + N : STATE + 2 * N] = alpha, self.D
        vector[STATE + 3 * N :] = y
        return State(self.engine.describe(vector), N)

    def angles(self, y: Array, alpha: Array) -> Array:
        """psi (G, N) [rad]."""
        return np.asarray(alpha + self.angle_map @ y)

    def turned_moments(self, psi: Array) -> ComplexArray:
        """(G, N) K kappa* exp(i psi) [N m]."""
        return np.asarray(self.moment * np.exp(1j * psi))

    def torque_density(self, moments: ComplexArray) -> Array:
        """(G, N) dE/dpsi, quadrature weights included [N m]."""
        total = moments.sum(axis=1).conj()
        return np.asarray(self.coupling[:, None] * (total[:, None] * moments).imag)

    def value(self, y: Array, alpha: Array) -> float:
        """The part of E [J] that depends on y."""
        total = self.turned_moments(self.angles(y, alpha)).sum(axis=1)
        return 0.5 * float(y @ y) - 0.5 * float(self.coupling @ np.abs(total) ** 2)

    def gradient(self, y: Array, alpha: Array) -> Array:
        """dE/dy (n,) [sqrt(J)]."""
        torque = self.torque_density(self.turned_moments(self.angles(y, alpha)))
        return np.asarray(y + np.tensordot(torque, self.angle_map, 2))

    def hessian(self, y: Array, alpha: Array) -> Array:
        """d2E/dy2 (n, n).

        w'' = (delta_ij Re(conj(Z) b_j) - Re(conj(b_i) b_j)) / sum K with b the turned moments and Z their sum: a
        diagonal minus a form of rank two at each Gauss point.
        """
        moments = self.turned_moments(self.angles(y, alpha))
        diagonal = self.coupling[:, None] * (moments.sum(axis=1).conj()[:, None] * moments).real
        flat = self.angle_map.reshape(diagonal.size, self.n)
        root = np.sqrt(self.coupling)[:, None]
        along = np.einsum("gn,gnp->gp", root * moments.real, self.angle_map)
        across = np.einsum("gn,gnp->gp", root * moments.imag, self.angle_map)
        hessian = (flat * diagonal.reshape(-1, 1)).T @ flat - along.T @ along - across.T @ across
        hessian[np.diag_indices(self.n)] += 1.0
        return np.asarray(hessian)

    def eigenvalues(self, y: Array, alpha: Array) -> Array:
        """Of the Hessian, rising; empty without unknowns."""
        return np.asarray(np.linalg.eigvalsh(self.hessian(y, alpha)) if self.n else np.zeros(0), dtype=float)

    def twist_size(self, y: Array) -> float:
        """Largest twist angle [rad] at a Gauss point that unknowns (n,) stand for."""
        return float(np.abs(self.angle_map @ y).max(initial=0.0))

    def balanced(self, psi: Array) -> Array:
        """The y (n,) whose torques hold those that bending pulls at the angles psi (G, N) [rad]: at an equilibrium its
        own unknowns."""
        return np.asarray(-np.tensordot(self.torque_density(self.turned_moments(psi)), self.angle_map, 2))

    def carrier(self, y: Array) -> Callable[[DenseEnergy], Array]:
        """Carries ``y`` (n,) to the unknowns of an energy of another degree, by the psi that it stands for."""

        def carried(other: DenseEnergy) -> Array:
            turned = np.empty((len(other.place), self.moment.shape[1]))
            for j in range(turned.shape[1]):
                turned[:, j] = np.interp(other.place, self.place, (self.angle_map @ y)[:, j])
            found = np.linalg.lstsq(other.angle_map.reshape(-1, other.n), turned.ravel(), rcond=None)[0]
            return np.asarray(found, dtype=float)

        return carried
