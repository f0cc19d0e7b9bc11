"""Equilibria of the `full` level: Newton, the shape, and the stability margin after bending is eliminated.

The backbone of a shape is integrated by ``frames``, its loads are derivatives of its energy (``virtual_work``).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh
from scipy.linalg import eigvalsh

from ctr_pvs.errors import FieldError
from ctr_pvs.model.shape import Shape
from ctr_pvs.pvs.energy import FullEnergy
from ctr_pvs.pvs.virtual_work import Loads
from ctr_pvs.pvs.virtual_work import virtual_work_loads

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

#: Newton has converged when its step changes no angle by more than this [rad].
LAST_STEP = 1e-10
MAX_ITERATIONS = 40
#: Longest Newton step [rad]: a damped start keeps to the basin of the guess.
LONGEST_STEP = 0.5


@dataclass(frozen=True, eq=False)
class FullResult:
    """q (n,), whether dE/dq = 0 was met, the angle [rad] that a further Newton step would change, and the steps."""

    converged: bool
    q: Array
    residual: float
    iterations: int


def solve_full(energy: FullEnergy, guess: Array) -> FullResult:
    """The stationary point of ``energy`` that damped Newton reaches from ``guess`` (n,), stable or not."""
    q = np.array(guess, dtype=float)
    if q.shape != (energy.n,):
        raise FieldError("guess", q.shape, f"an array ({energy.n},)")
    for iteration in range(MAX_ITERATIONS):
        step = energy.step(q)
        size = energy.size(step)
        if size <= LAST_STEP:
            return FullResult(True, q, size, iteration)
        q = q + step * min(1.0, LONGEST_STEP / size)
    return FullResult(False, q, size, MAX_ITERATIONS)


class FullShape(Shape):
    """The shape of coordinates ``q`` (n,) of ``energy``."""

    def __init__(self, energy: FullEnergy, q: Array) -> None:
        super().__init__(energy.materials, energy.alpha)
        self.energy, self.q = energy, q
        self._number = {section.index: number for number, section in enumerate(energy.space.sections) if section.bends}

    def angle(self, m: int, x: Array) -> Array:
        return self.alpha + self.energy.space.maps(self._number[m], x).angle @ self.q

    def twist_rate(self, m: int, x: Array) -> Array:
        return self.energy.space.maps(self._number[m], x).rate @ self.q

    def curvature(self, m: int, x: Array) -> ComplexArray:
        section = self.energy.space.sections[self._number[m]]
        maps = self.energy.space.maps(self._number[m], x)
        turn = np.exp(1j * (self.alpha + maps.angle @ self.q)[:, section.lead])
        if len(section.tubes) == 1:
            own: ComplexArray = self.materials.pre_curvature(m, section.start + section.length * x)[:, section.lead]
            return own * turn
        bent = maps.curvature @ self.q
        return (bent[:, 0] + 1j * bent[:, 1]) * turn

    @cached_property
    def angle_at_boundaries(self) -> Array:
        guided = [number for number, section in enumerate(self.energy.space.sections) if not section.bends]
        start = self.alpha
        if guided:
            start = self.alpha + self.energy.space.maps(guided[-1], np.ones(1)).angle[0] @ self.q
        ends = [self.angle(m, np.ones(1))[0] for m in range(self.domain.n_sections)]
        return np.array([start, *ends])


class FullSolution:
    """A stationary point ``q`` (n,) of ``energy``.

    shape : its fields along the robot; degrees_of_freedom : number of unknowns solved for.
    """

    def __init__(self, energy: FullEnergy, q: Array) -> None:
        self.energy, self.q = energy, q
        self.shape = FullShape(energy, q)

    @property
    def degrees_of_freedom(self) -> int:
        return self.energy.n

    def loads(self) -> Loads:
        """Actuation loads by virtual work."""
        return virtual_work_loads(self.shape, self.energy.section_nodes())

    def elastic_energy(self) -> float:
        """Energy [J], straightening in the guide counted."""
        return self.energy.value(self.q) + float(self.energy.materials.straightening_energy.sum())

    def stability_margin(self) -> float:
        """Smallest eigenvalue of the energy Hessian relative to torsional stiffness, clipped at 1.

        It is that of the twist after bending, always stiff, has taken its own minimum (Schur complement).  A basis is
        optimistic: below 1 the limit of all bases has no more than this.
        """
        hessian = self.energy.hessian(self.q)
        values, vectors = eigh(self.energy.torsion_metric)
        twists = values > 1e-12 * max(float(values.max(initial=0.0)), 1e-300)
        if not twists.any():
            return 1.0
        basis = vectors[:, twists] / np.sqrt(values[twists])
        bends = vectors[:, ~twists]
        mixed = basis.T @ hessian @ bends
        stiff = bends.T @ hessian @ bends
        schur = basis.T @ hessian @ basis - mixed @ np.linalg.lstsq(stiff, mixed.T, rcond=1e-13)[0]
        return min(1.0, float(eigvalsh(0.5 * (schur + schur.T))[0]))
