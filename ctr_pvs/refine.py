"""The `full` level: degrees are raised until two successive tips agree.

The first rung integrates the backbone with looser steps, so that the comparison sees the integration error too.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.backbone import chain
from ctr_pvs.backbone import position_of
from ctr_pvs.full_solution import FullSolution
from ctr_pvs.pvs.energy import FullEnergy
from ctr_pvs.pvs.solution import solve_full
from ctr_pvs.pvs.strain_basis import PolynomialBasis
from ctr_pvs.shape import Shape
from ctr_pvs.solution import TorsionSolution

Array = NDArray[np.float64]

#: Polynomial degrees of all strains at the `full` level.
FULL_DEGREES = (2, 4, 6, 9, 12, 16, 20)
#: Share of the tolerance that integrating the backbone may use, and how much looser the first rung is.
INTEGRATION_SHARE = 0.01
LOOSER = 64.0


@dataclass(frozen=True, eq=False)
class Refined:
    """A state with its residual twist [rad], its error estimate [m] and the Newton iterations spent."""

    solution: FullSolution
    residual: float
    estimate: float
    iterations: int


def refine_full(start: TorsionSolution, tolerance: float) -> Refined | None:
    """The `full` level with Legendre bases, from the `torsion` equilibrium that it converges to."""
    tip, iterations, refined = None, 0, None
    integration = LOOSER * INTEGRATION_SHARE * tolerance
    for degree in FULL_DEGREES:
        energy = FullEnergy(start.energy.materials, start.alpha, PolynomialBasis(degree), nodes=degree + 6)
        result = solve_full(energy, energy.project(start.shape))
        if not result.converged:
            return None
        solution = FullSolution(energy, result.q, start)
        iterations += result.iterations
        before, tip = tip, tip_position(solution.shape, integration)
        integration = INTEGRATION_SHARE * tolerance
        if before is not None:
            estimate = float(np.linalg.norm(tip - before))
            refined = Refined(solution, result.residual, estimate, iterations)
            if estimate <= tolerance:
                break
    return refined


def tip_position(shape: Shape, tolerance: float) -> Array:
    """Tip (3,) [m], integrated for an error of ``tolerance`` [m]."""
    return position_of(chain(shape.pieces(tolerance))[-1])
