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

from ctr_pvs.pair_form import Pairs

Array = NDArray[np.float64]

#: The branch between two states may leave the straight line between them: the box is this much wider on either side ..
WIDER = 0.25
#: .. so that from one state it reaches this share of the way to the other.
REACH = 1.0 + WIDER
#: The box is wider at least by this [rad].
AT_LEAST = 1e-9


def convex_between(pairs: Pairs, psi: Array, other: Array) -> bool:
    """True if the energy is certainly convex around the states with angles ``psi`` and ``other`` (G, N) [rad]."""
    n = pairs.map.shape[1]
    if n == 0:
        return True
    lowest = least_cosines(pairs.angles(psi), pairs.angles(other), AT_LEAST)
    bound = (pairs.map * (pairs.amplitude * lowest)[:, None]).T @ pairs.map
    bound[np.diag_indices(n)] += 1.0
    try:
        cho_factor(bound, overwrite_a=True, check_finite=False)
    except LinAlgError:
        return False
    return True


def least_cosines(start: Array, end: Array, at_least: float) -> Array:
    """Least value of cos in the box that holds ``start`` and ``end`` (...) [rad], wider at least by ``at_least``
    [rad]."""
    beyond = WIDER * np.abs(end - start) + at_least
    return _least_cosine(np.minimum(start, end) - beyond, np.maximum(start, end) + beyond)


def _least_cosine(low: Array, high: Array) -> Array:
    """Least value of cos on [low, high]."""
    # An odd multiple of pi lies inside if the next one from low on does.
    turning = np.pi * (2.0 * np.ceil((low / np.pi - 1.0) / 2.0) + 1.0)
    return np.where(turning <= high, -1.0, np.minimum(np.cos(low), np.cos(high)))
