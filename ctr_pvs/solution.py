"""A state of one model level, from which every output of an answer is read."""

from __future__ import annotations

from abc import ABC
from abc import abstractmethod

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.actuation import Loads
from ctr_pvs.actuation import virtual_work_loads
from ctr_pvs.energy import TorsionEnergy
from ctr_pvs.jacobian import tip_jacobian
from ctr_pvs.shape import Shape
from ctr_pvs.shape import TorsionlessShape
from ctr_pvs.shape import TorsionShape
from ctr_pvs.stability import rechecked_margin
from ctr_pvs.stability import snap_reserve

Array = NDArray[np.float64]


class Solution(ABC):
    """What an ``Equilibrium`` asks of the model level it was solved with.

    degrees_of_freedom : unknowns solved for; shape : the fields along the robot.
    """

    shape: Shape

    @property
    @abstractmethod
    def degrees_of_freedom(self) -> int: ...

    @abstractmethod
    def loads(self) -> Loads:
        """Actuation loads by virtual work."""

    @abstractmethod
    def elastic_energy(self) -> float:
        """Energy [J], straightening in the guide counted."""

    @abstractmethod
    def stability_margin(self) -> float:
        """Smallest eigenvalue of the energy Hessian relative to torsional stiffness, clipped at 1."""

    @abstractmethod
    def snap_reserve(self) -> float:
        """1 at the relaxed robot, 0 at a fold, falling smoothly."""

    @abstractmethod
    def tip_jacobian(self, tolerance: float) -> Array:
        """(6, 2 N) rates of the tip; ``tolerance`` [m] of the backbone's integration."""


class TorsionSolution(Solution):
    """An equilibrium q (n,) of ``energy`` under base angles ``alpha`` (N,)."""

    def __init__(self, energy: TorsionEnergy, alpha: Array, q: Array) -> None:
        self.energy, self.alpha, self.q = energy, alpha, q
        self.shape: TorsionShape = TorsionShape(energy.space, alpha, q)

    @property
    def degrees_of_freedom(self) -> int:
        return self.energy.n

    def loads(self) -> Loads:
        return virtual_work_loads(self.shape, self.energy.all_nodes)

    def elastic_energy(self) -> float:
        return self.energy.value(self.q, self.alpha) + self.energy.constant()

    def stability_margin(self) -> float:
        return rechecked_margin(self.energy, self.q, self.alpha)

    def snap_reserve(self) -> float:
        return snap_reserve(self.energy, self.q, self.alpha)

    def tip_jacobian(self, tolerance: float) -> Array:
        return tip_jacobian(self.energy, self.shape, tolerance)


class TorsionlessSolution(TorsionSolution):
    """No twist anywhere: eq. (28)-(31).  The margin is that of the twist it neglects."""

    def __init__(self, energy: TorsionEnergy, alpha: Array) -> None:
        super().__init__(energy, alpha, np.zeros(energy.n))
        self.shape = TorsionlessShape(energy.space, alpha, self.q)

    @property
    def degrees_of_freedom(self) -> int:
        return 0
