"""How the equilibrium moves with the command: the implicit function theorem on dE/dq = 0.

A rate is taken at fixed torque coefficients first (the *explicit* part: sections stretch, material slides, compliances
grow), then the torques answer through the Hessian.  Sections stretch because their boundaries ride on the tubes:
a boundary of tube j moves with -dD_j.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor
from scipy.linalg import cho_solve

from ctr_pvs.energy import TorsionEnergy
from ctr_pvs.sections import ABSENT
from ctr_pvs.twist import TorqueField

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class DomainRate:
    """Rates for P directions of (alpha, D): boundaries (M + 1, P), lengths (M, P) and slides (N, P), all per unit."""

    boundaries: Array
    lengths: Array
    slides: Array


def domain_rate(energy: TorsionEnergy, D_rate: Array) -> DomainRate:
    """Boundary motion for base motions ``D_rate`` (N, P).  Where several events share a boundary, their mean moves
    it."""
    domain = energy.materials.domain
    boundaries = np.zeros((domain.n_sections + 1, D_rate.shape[1]))
    for index, events in enumerate(domain.events):
        if index > 0:  # the orifice stays
            boundaries[index] = -D_rate[[event.tube for event in events]].mean(axis=0)
    return DomainRate(boundaries, np.diff(boundaries, axis=0), D_rate)


def guide_compliance_rate(energy: TorsionEnergy, D_rate: Array) -> Array:
    """(N, P) growth of each tube's guided compliance: 1/GJ of the segment that slides in."""
    domain, rate = energy.materials.domain, np.zeros(D_rate.shape)
    for tube, index in enumerate(domain.guide_segment):
        if index != ABSENT:
            rate[tube] = D_rate[tube] / energy.materials.segment(tube, index).torsional_stiffness
    return rate


class Sensitivity:
    """Rates of the equilibrium q of ``energy`` at ``alpha`` along P directions ``alpha_rate``, ``D_rate`` (N, P).

    twists : false for tubes that are taken for rigid in torsion: then only the explicit part is left.
    """

    def __init__(
        self, energy: TorsionEnergy, alpha: Array, q: Array, alpha_rate: Array, D_rate: Array, twists: bool = True
    ) -> None:
        self.energy, self.q = energy, q
        self.alpha_rate = alpha_rate
        self.torques = energy.space.field(q)
        self.domain = domain_rate(energy, D_rate)
        self.guide_rate = guide_compliance_rate(energy, D_rate)
        self.q_rate = self._implicit(alpha) if twists else np.zeros((energy.n, alpha_rate.shape[1]))

    def _implicit(self, alpha: Array) -> Array:
        """(n, P) rate of q at fixed scale: what the torques answer to the explicit changes."""
        energy = self.energy
        if energy.n == 0:
            return np.zeros((0, self.alpha_rate.shape[1]))
        psi = energy.angles(self.q, alpha)
        moments = energy.turned_moments(psi)
        torque = energy.torque_density(moments)
        push = np.empty((*torque.shape, self.alpha_rate.shape[1]))
        for node, part in zip(energy.nodes, energy.slices, strict=True):
            m, x = node.section, node.rule.x
            steepness = node.bending * energy.materials.pre_curvature_rate(m, node.s) * np.exp(1j * psi[part])
            slide = steepness[:, :, None] * self.material_motion(m, x)
            turn = 1j * moments[part][:, :, None] * self.explicit_angle_rate(m, x)
            push[part] = energy.torque_change(moments, slide + turn, part)
            stretch = self.domain.lengths[m] / energy.materials.domain.lengths[m]
            push[part] += torque[part][:, :, None] * stretch
        _, hessian = energy.derivatives(self.q, alpha)
        force = np.tensordot(energy.angle_map, push, ((0, 1), (0, 1)))
        return -cho_solve(cho_factor(hessian, check_finite=False), force, check_finite=False)

    def material_motion(self, m: int, x: Array) -> Array:
        """(g, N, P) motion dX of the material under the places ``x`` (g,) of section m."""
        place = self.domain.boundaries[m] + x[:, None] * self.domain.lengths[m]
        return place[:, None, :] + self.domain.slides

    def explicit_angle_rate(self, m: int, x: Array) -> Array:
        """(g, N, P) d psi at the places ``x`` of section m with the torque coefficients held."""
        rate = self.alpha_rate + self.torques.guide[:, None] * self.guide_rate
        for before in range(m):
            rate = rate + self._twist_per_length(before, np.ones(1))[0][:, None] * self.domain.lengths[before]
        inside = self._twist_per_length(m, x)
        return rate + inside[:, :, None] * self.domain.lengths[m]

    def _twist_per_length(self, m: int, x: Array) -> Array:
        """(g, N) int_0^x T / GJ dx in section m: its twist is this times its length."""
        coefficients = self.torques.sections[m]
        stiffness = self.energy.materials.torsional[m]
        compliance = np.divide(1.0, stiffness, out=np.zeros_like(stiffness), where=stiffness > 0.0)
        return self.torques.bases[m].tabulate(x)[1] @ coefficients.T * compliance

    def angle_rate(self, m: int, x: Array) -> Array:
        """(g, N, P) total d psi [rad per unit] at the places ``x`` of section m."""
        return self.explicit_angle_rate(m, x) + self.energy.space.angle_map(m, x) @ self.q_rate

    def field_rate(self, direction: int = 0) -> TorqueField:
        """Rate of the torque field's coefficients along one direction."""
        return self.energy.space.field(self.q_rate[:, direction])
