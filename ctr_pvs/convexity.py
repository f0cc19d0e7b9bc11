"""A certificate that two equilibria lie on one branch: the energy is convex on a box that holds both.

In pairs of tubes the energy is q.q / 2 - sum amplitude_ij cos(theta_ij), theta_ij the angle between the turned
pre-curvatures, so its Hessian is

    I + sum amplitude_ij cos(theta_ij) d_ij d_ij^T,        d_ij = d theta_ij / dq.

Replacing each cosine by its least value over an interval of theta_ij gives a lower bound of the Hessian on the whole
box.  If that is positive definite, the box holds one equilibrium at most, and no fold.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError
from scipy.linalg import cho_factor

from ctr_pvs.energy import TorsionEnergy

Array = NDArray[np.float64]

#: The branch between two states may leave the straight line between them: the box is this much wider on either side ..
WIDER = 0.25
#: .. and at least by this [rad].
AT_LEAST = 1e-9


class PairForm:
    """The coupling of every two curved tubes at the nodes (G,) of ``energy``, for P pairs."""

    def __init__(self, energy: TorsionEnergy) -> None:
        first, second = np.triu_indices(energy.materials.robot.n_tubes, 1)
        product = energy.moment[:, first].conj() * energy.moment[:, second]
        self.first, self.second = first, second
        self.amplitude = energy.coupling[:, None] * np.abs(product)
        self.phase = np.angle(product)
        self.map = energy.angle_map[:, second] - energy.angle_map[:, first]
        self.n = energy.n

    def angles(self, psi: Array) -> Array:
        """theta (G, P) [rad] between the turned pre-curvatures, from psi (G, N)."""
        return self.phase + psi[:, self.second] - psi[:, self.first]

    def convex_between(self, psi: Array, other: Array) -> bool:
        """True if the energy is certainly convex around the states with angles ``psi`` and ``other`` (G, N)."""
        if self.n == 0:
            return True
        a, b = self.angles(psi), self.angles(other)
        slack = WIDER * np.abs(b - a) + AT_LEAST
        lowest = least_cosine(np.minimum(a, b) - slack, np.maximum(a, b) + slack)
        flat = self.map.reshape(-1, self.n)
        bound = (flat * (self.amplitude * lowest).reshape(-1, 1)).T @ flat
        bound[np.diag_indices(self.n)] += 1.0
        try:
            cho_factor(bound, overwrite_a=True, check_finite=False)
        except LinAlgError:
            return False
        return True


def least_cosine(low: Array, high: Array) -> Array:
    """Least value of cos on [low, high], each (...)."""
    # An odd multiple of pi lies inside if the next one from low on does.
    turning = np.pi * (2.0 * np.ceil((low / np.pi - 1.0) / 2.0) + 1.0)
    return np.where(turning <= high, -1.0, np.minimum(np.cos(low), np.cos(high)))
