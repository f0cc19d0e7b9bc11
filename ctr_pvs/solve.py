"""Newton's method for dE/dq = 0 from a warm start, at one command."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError
from scipy.linalg import cho_factor
from scipy.linalg import cho_solve

from ctr_pvs.energy import TorsionEnergy

Array = NDArray[np.float64]

#: An equilibrium is accepted when its residual twist [rad] is below this, plus rounding of large base angles.
RESIDUAL_TWIST = 1e-11
#: Newton has converged when a step is shorter than this [rad]: the next one would be about its square.
LAST_STEP = 1e-8
MAX_ITERATIONS = 12
#: Rounding of cos and sin at large base angles, as a share of them.
ROUNDING = 64.0 * float(np.finfo(float).eps)
#: A step that is not shorter than the one before by this factor is not Newton converging.
CONTRACTION = 0.5


class NewtonEnd(Enum):
    """How a Newton run ended."""

    CONVERGED = "converged"
    INDEFINITE = "the energy Hessian is not positive definite"
    NOT_CONTRACTING = "Newton steps do not shrink"


@dataclass(frozen=True, eq=False)
class NewtonResult:
    """q (n,) with its residual twist [rad] evaluated at q itself, the number of steps, and the first step's size
    [rad]."""

    end: NewtonEnd
    q: Array
    residual: float
    iterations: int
    first_step: float

    @property
    def converged(self) -> bool:
        return self.end is NewtonEnd.CONVERGED


def twist_size(energy: TorsionEnergy, q: Array) -> float:
    """Largest twist angle [rad] that a vector of unknowns (n,) stands for, over the nodes."""
    return float(np.abs(energy.angle_map @ q).max(initial=0.0))


def residual_limit(alpha: Array) -> float:
    """Residual twist [rad] that counts as zero: cos and sin lose digits where base angles are many turns."""
    return RESIDUAL_TWIST + ROUNDING * float(np.abs(alpha).max(initial=0.0))


def newton(energy: TorsionEnergy, alpha: Array, q: Array, steps: int = MAX_ITERATIONS) -> NewtonResult:
    """Newton from ``q`` (n,), kept to the basin it starts in: it stops rather than take a longer second step.

    steps : the most Newton steps to take; when they are spent before convergence, the result has not converged.

    The result's residual is what the unbalanced torque would twist the tubes against their torsional stiffness alone.
    """
    if energy.n == 0:
        return NewtonResult(NewtonEnd.CONVERGED, q, 0.0, 0, 0.0)
    limit = residual_limit(alpha)
    first = previous = np.inf
    for iteration in range(1, steps + 1):
        gradient, hessian = energy.derivatives(q, alpha)
        try:
            step = -cho_solve(cho_factor(hessian, check_finite=False), gradient, check_finite=False)
        except LinAlgError:
            return NewtonResult(NewtonEnd.INDEFINITE, q, twist_size(energy, gradient), iteration - 1, first)
        size = twist_size(energy, step)
        if iteration == 1:
            first = size
        elif not size < CONTRACTION * previous and size > LAST_STEP:
            return NewtonResult(NewtonEnd.NOT_CONTRACTING, q, twist_size(energy, gradient), iteration - 1, first)
        q = q + step
        previous = size
        if size <= LAST_STEP:
            residual = twist_size(energy, energy.gradient(q, alpha))
            if residual <= limit:
                return NewtonResult(NewtonEnd.CONVERGED, q, residual, iteration, first)
    residual = twist_size(energy, energy.gradient(q, alpha))
    return NewtonResult(NewtonEnd.NOT_CONTRACTING, q, residual, steps, first)
