"""How far an equilibrium is from losing stability."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigvalsh

from ctr_pvs.energy import TorsionEnergy

Array = NDArray[np.float64]


def stability_margin(energy: TorsionEnergy, q: Array, alpha: Array) -> float:
    """Smallest eigenvalue of d2E/dq2 relative to the torsional stiffness, clipped at 1.

    1: nothing pulls the tubes off; 0: a fold, where the branch ends; negative: unstable.  The unknowns are scaled so
    that the torsional energy is q.q / 2, hence this is an ordinary eigenvalue.  A twist field outside the basis has 1.
    """
    if energy.n == 0:
        return 1.0
    _, hessian = energy.derivatives(q, alpha)
    return min(1.0, float(eigvalsh(hessian, subset_by_index=(0, 0), check_finite=False)[0]))
