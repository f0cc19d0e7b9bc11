"""Curvature and inner moments along the robot, between neighbouring places, at any model level and under any loads.

The curvature is how far the poses turn; a tube's moment is its stiffness times how much it is bent beyond its own
curvature, or twisted.  Over all tubes that balances the loads beyond: without a load the moments of the tubes cancel.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ctr_pvs.model.sections import ABSENT

if TYPE_CHECKING:
    from ctr_pvs.answer.backbone import Backbone
    from ctr_pvs.answer.equilibrium import Equilibrium
    from ctr_pvs.model.sections import Domain

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True)
class Moments:
    """Sizes of the bending moment and moments about the tangent [N m]: bending, twisting (g, N) of each tube, NaN past
    its tip; all_bending, all_twisting (g,) of all tubes together."""

    bending: Array
    twisting: Array
    all_bending: Array
    all_twisting: Array


def places_along(domain: Domain, count: int) -> Array:
    """About ``count`` places (g,) [m] from the orifice to the tip, among them all where a material changes: between two
    of them everything is smooth."""
    if not domain.n_sections:
        return np.zeros(2)
    ends = domain.boundaries
    steps = np.ceil((count - 1) * domain.lengths / domain.length).astype(int)
    parts = [np.linspace(a, b, n, endpoint=False) for a, b, n in zip(ends[:-1], ends[1:], steps, strict=True)]
    return np.append(np.concatenate(parts), domain.length)


def curvature_between(backbone: Backbone) -> ComplexArray:
    """(g - 1,) k_y + i k_z [1/m] between neighbouring poses, in the material frame that they carry.

    Taken from the poses, not from the fields of a model, so that it holds at every model level and under loads."""
    turn = Rotation.from_quat(backbone.orientation)
    _, y, z = (turn[:-1].inv() * turn[1:]).as_rotvec().T
    length = np.diff(backbone.s)
    return np.divide(y + 1j * z, length, out=np.zeros(len(length), dtype=complex), where=length > 0.0)


def moments_between(equilibrium: Equilibrium, s: Array, curvature: ComplexArray) -> Moments:
    """Halfway between the places ``s`` (g + 1,) of ``places_along``, where the poses have the ``curvature`` (g,)."""
    shape = equilibrium.shape
    domain, materials = shape.domain, shape.materials
    middle = 0.5 * (s[1:] + s[:-1])
    section = domain.locate(middle)
    bending = np.full((len(middle), len(equilibrium.alpha)), np.nan, dtype=complex)
    twisting = np.full(bending.shape, np.nan)
    for m in range(domain.n_sections):
        here = section == m
        x = (middle[here] - domain.boundaries[m]) / domain.lengths[m]
        turned = np.exp(1j * shape.angle(m, x))
        bent = curvature[here] * turned[:, domain.leader]
        own = materials.pre_curvature(m, middle[here]) * turned
        present = domain.segment[m] != ABSENT
        rows = np.ix_(here, present)
        bending[rows] = (materials.bending[m] * (bent[:, None] - own))[:, present]
        twisting[rows] = (materials.torsional[m] * shape.twist_rate(m, x))[:, present]
    return Moments(
        np.abs(bending), twisting, np.abs(np.nansum(bending, axis=1)), np.asarray(np.nansum(twisting, axis=1))
    )
