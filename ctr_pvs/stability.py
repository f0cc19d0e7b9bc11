"""How far an equilibrium is from losing stability: the margin, and an early warning that moves long before it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigvalsh

from ctr_pvs.energy import TorsionEnergy
from ctr_pvs.relaxed import relaxed_state
from ctr_pvs.sections import ABSENT
from ctr_pvs.sensitivity import Sensitivity
from ctr_pvs.serving import raised

Array = NDArray[np.float64]


def stability_margin(energy: TorsionEnergy, q: Array, alpha: Array) -> float:
    """Smallest eigenvalue of d2E/dq2 relative to the torsional stiffness, clipped at 1, at the state ``q`` (n,).

    1: nothing pulls the tubes off; 0: a fold, where the branch ends; negative: unstable.  The unknowns are scaled so
    that the torsional energy is q.q / 2, hence this is an ordinary eigenvalue.  A twist field outside the basis has 1.
    """
    if energy.n == 0:
        return 1.0
    _, hessian = energy.derivatives(q, alpha)
    return min(1.0, float(eigvalsh(hessian, subset_by_index=(0, 0), check_finite=False)[0]))


def rechecked_margin(energy: TorsionEnergy, q: Array, alpha: Array) -> float:
    """The smaller of the margins at this degree and at a higher one, wherever the first is below 1: a Ritz value of low
    degree is optimistic."""
    margin = stability_margin(energy, q, alpha)
    if margin == 1.0:
        return margin
    finer = TorsionEnergy(energy.materials, raised(energy.space.degree))
    return min(margin, stability_margin(finer, finer.space.coordinates(energy.space.field(q)), alpha))


def snap_reserve(energy: TorsionEnergy, q: Array, alpha: Array, relaxed: float) -> float:
    """What is left of det(d alpha / d psi_tip), as a share of its value at the relaxed robot of the same D.

    relaxed : ``relaxed_gain`` there.  1 at the relaxed robot, 0 at a fold, falling smoothly in between, while the
    margin stays at 1 until a snap is near.  It says how much less the tips' rotations are held by the bases (Gilbert,
    Hendrick, Webster, T-RO 2016).  NaN if no relaxed state was found.
    """
    return 1.0 if energy.n == 0 else relaxed / _tip_gain(energy, q, alpha)


def relaxed_gain(energy: TorsionEnergy) -> float:
    """det(d psi_tip / d alpha) of the relaxed robot; NaN if no relaxed state was found."""
    relaxed = relaxed_state(energy)
    return float("nan") if relaxed is None else _tip_gain(energy, relaxed.q, relaxed.alpha)


def _tip_gain(energy: TorsionEnergy, q: Array, alpha: Array) -> float:
    """det(d psi_tip / d alpha): how much the tubes' own tips turn with their bases."""
    tubes = len(alpha)
    rates = Sensitivity(energy, alpha, q, np.eye(tubes), np.zeros((tubes, tubes)))
    segment = energy.materials.domain.segment
    gain = np.eye(tubes)  # a tube that is not out turns with its base
    for tube in np.flatnonzero(np.any(segment != ABSENT, axis=0)):
        last = int(np.flatnonzero(segment[:, tube] != ABSENT)[-1])
        gain[tube] = rates.angle_rate(last, np.ones(1))[0, tube]
    return float(np.linalg.det(gain))
