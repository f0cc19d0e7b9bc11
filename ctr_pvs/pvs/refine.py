"""The `full` level to a tolerance: degrees are raised until two successive tips agree."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ctr_pvs.model.shape import Shape
from ctr_pvs.pvs.energy import FullEnergy
from ctr_pvs.pvs.frames import tip_position
from ctr_pvs.pvs.solution import FullSolution
from ctr_pvs.pvs.solution import solve_full
from ctr_pvs.pvs.strain_basis import PolynomialBasis

#: Polynomial degrees of all strains at the `full` level.
FULL_DEGREES = (2, 4, 6, 9, 12, 16, 20)
#: Gauss points of a section beyond the degree.
MORE_NODES = 6
#: Share of the tolerance that integrating the backbone may use.
INTEGRATION_SHARE = 0.01


@dataclass(frozen=True, eq=False)
class Refined:
    """A state with its residual twist [rad], its error estimate [m] and the Newton iterations spent.

    estimate : how far the tip moved with the last raise of the degree; above the tolerance if degrees ran out.
    """

    solution: FullSolution
    residual: float
    estimate: float
    iterations: int


def refine_full(start: Shape, tolerance: float) -> Refined | None:
    """The `full` level with Legendre bases, from any shape near the equilibrium: that of the `torsion` level, which it
    converges to.

    tolerance : error [m] that the tip may have.

    None where Newton does not converge at some degree.
    """
    tip, iterations, refined = None, 0, None
    for degree in FULL_DEGREES:
        energy = FullEnergy(start.materials, start.alpha, PolynomialBasis(degree), nodes=degree + MORE_NODES)
        result = solve_full(energy, energy.project(start))
        if not result.converged:
            return None
        solution = FullSolution(energy, result.q)
        iterations += result.iterations
        before, tip = tip, tip_position(solution.shape, INTEGRATION_SHARE * tolerance)
        if before is not None:
            estimate = float(np.linalg.norm(tip - before))
            refined = Refined(solution, result.residual, estimate, iterations)
            if estimate <= tolerance:
                break
    return refined
