"""From a state on the right branch to an answer within tolerance, at the model level that was asked for.

Each level raises its polynomial degree until two successive tips agree.  The first rung integrates the backbone with
looser steps, so that the comparison sees the integration error too.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Generic
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.backbone import chain
from ctr_pvs.backbone import position_of
from ctr_pvs.full import FullEnergy
from ctr_pvs.full_solution import FullSolution
from ctr_pvs.full_solution import solve_full
from ctr_pvs.shape import Shape
from ctr_pvs.solution import Solution
from ctr_pvs.solution import TorsionSolution
from ctr_pvs.strain_basis import PolynomialBasis

Array = NDArray[np.float64]
S = TypeVar("S", bound=Solution)

#: Polynomial degrees of the twist rates, tried in turn.
DEGREES = (5, 7, 9, 12, 16, 21, 28)
#: Polynomial degrees of all strains at the `full` level.
FULL_DEGREES = (2, 4, 6, 9, 12, 16, 20)
#: Share of the tolerance that integrating the backbone may use, and how much looser the first rung is.
INTEGRATION_SHARE = 0.01
LOOSER = 64.0


@dataclass(frozen=True, eq=False)
class Refined(Generic[S]):
    """A state with its residual twist [rad], its error estimate [m] and the Newton iterations spent."""

    solution: S
    residual: float
    estimate: float
    iterations: int


@dataclass(frozen=True, eq=False)
class _Rung(Generic[S]):
    solution: S
    residual: float
    iterations: int


def refine_full(start: TorsionSolution, tolerance: float) -> Refined[FullSolution] | None:
    """The `full` level with Legendre bases, from the `torsion` equilibrium that it converges to."""
    return _climb(_full_rungs(start), tolerance)


def _climb(rungs: Iterator[_Rung[S] | None], tolerance: float) -> Refined[S] | None:
    tip, iterations, refined = None, 0, None
    integration = LOOSER * INTEGRATION_SHARE * tolerance
    for rung in rungs:
        if rung is None:
            return None
        iterations += rung.iterations
        before, tip = tip, tip_position(rung.solution.shape, integration)
        integration = INTEGRATION_SHARE * tolerance
        if before is not None:
            estimate = float(np.linalg.norm(tip - before))
            refined = Refined(rung.solution, rung.residual, estimate, iterations)
            if estimate <= tolerance:
                break
    return refined


def _full_rungs(start: TorsionSolution) -> Iterator[_Rung[FullSolution] | None]:
    shape: Shape = start.shape
    for degree in FULL_DEGREES:
        energy = FullEnergy(start.energy.materials, start.alpha, PolynomialBasis(degree), nodes=degree + 6)
        result = solve_full(energy, energy.project(shape))
        if not result.converged:
            yield None
            return
        yield _Rung(FullSolution(energy, result.q, start), result.residual, result.iterations)


def tip_position(shape: Shape, tolerance: float) -> Array:
    """Tip (3,) [m], integrated for an error of ``tolerance`` [m]."""
    return position_of(chain(shape.pieces(tolerance))[-1])
