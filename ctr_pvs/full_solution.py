"""Equilibria of the `full` level as an ``Equilibrium`` reads them: with backbone, snap reserve and rates."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.actuation import Loads
from ctr_pvs.actuation import virtual_work_loads
from ctr_pvs.pvs import solution
from ctr_pvs.pvs.energy import FullEnergy
from ctr_pvs.shape import Shape
from ctr_pvs.solution import Solution
from ctr_pvs.solution import TorsionSolution
from ctr_pvs.status import NoEquilibriumError

Array = NDArray[np.float64]


class FullShape(solution.FullShape, Shape):
    """A shape that knows its backbone."""


class FullSolution(Solution):
    """A stationary point ``q`` (n,) of ``energy``; ``limit`` is the `torsion` solution it converges to, if known."""

    def __init__(self, energy: FullEnergy, q: Array, limit: TorsionSolution | None = None) -> None:
        self.energy, self.q, self.limit = energy, q, limit
        self.shape: FullShape = FullShape(energy, q)

    @property
    def degrees_of_freedom(self) -> int:
        return self.energy.n

    def loads(self) -> Loads:
        return virtual_work_loads(self.shape, self.energy.section_nodes())

    def elastic_energy(self) -> float:
        return self.energy.value(self.q) + float(self.energy.materials.straightening_energy.sum())

    def stability_margin(self) -> float:
        """At this basis, and below 1 no more than that of the `torsion` limit: a basis is optimistic."""
        own = solution.FullSolution(self.energy, self.q).stability_margin()
        return own if own == 1.0 or self.limit is None else min(own, self.limit.stability_margin())

    def snap_reserve(self) -> float:
        """That of the `torsion` solution, which this one converges to as its basis grows."""
        return self._limit.snap_reserve()

    def tip_jacobian(self, tolerance: float) -> Array:
        """Rates of the `torsion` solution, which this one converges to as its basis grows."""
        return self._limit.tip_jacobian(tolerance)

    @property
    def _limit(self) -> TorsionSolution:
        if self.limit is None:
            raise NoEquilibriumError("rates need the torsion solution that this full one came from")
        return self.limit
