"""The torsion equations of the boundary-value model the field uses, section by section.

For N tubes along the centreline, with curvatures as complex numbers, y + i z, in its Bishop frame:

    psi_i' = T_i / GJ_i,    T_i' = Im[conj(k) b_i],    b_i = K_i exp(i psi_i) kappa*_i,    k = sum_j b_j / sum_j K_j.

A section's unknowns are psi and T of the tubes present in it.  Both are continuous; T_i = 0 at tube i's tip, and
psi_i(0) = alpha_i + C_i T_i(0) at the orifice, where C_i is the compliance of what lies in the guide.

References: P. E. Dupont, J. Lock, B. Itkowitz, E. Butler, "Design and control of concentric-tube robots", IEEE
Transactions on Robotics 26(2) (2010); D. C. Rucker, B. A. Jones, R. J. Webster III, "A geometrically exact model for
externally loaded concentric-tube continuum robots", IEEE Transactions on Robotics 26(5) (2010).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from numpy.typing import NDArray

from ctr_pvs.model.materials import Materials
from ctr_pvs.model.sections import piecewise_domain
from ctr_pvs.robot.robot import Robot

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


class Section:
    """The equations in one section, for the p tubes present there.

    Its state y (2p, ...) is psi [rad], then torque in units of ``torque_unit`` [N m]; trailing axes are places s [m].
    """

    def __init__(self, materials: Materials, m: int, torque_unit: float) -> None:
        domain = materials.domain
        self.tubes = np.flatnonzero(materials.torsional[m])
        self.p = len(self.tubes)
        self.start, self.length = float(domain.boundaries[m]), float(domain.lengths[m])
        self.span = (self.start, self.start + self.length)
        self.bending = materials.bending[m, self.tubes]
        self.compliance = torque_unit / materials.torsional[m, self.tubes]
        self.torque_unit = torque_unit
        self._materials, self._m = materials, m
        segments = [materials.segment(int(j), int(domain.segment[m, j])) for j in self.tubes]
        uniform = all(segment.turn == 0.0 and len(segment.curvature) <= 1 for segment in segments)
        self._uniform = self._moments_at(np.array(self.start)) if uniform else None

    def _moments_at(self, s: Array) -> ComplexArray:
        return (self._materials.pre_curvature(self._m, s)[..., self.tubes] * self.bending).T

    def turned_moments(self, s: Array, psi: Array) -> ComplexArray:
        """b (p, ...) [N m]: K_j kappa*_j exp(i psi_j)."""
        if self._uniform is None:
            return self._moments_at(s) * np.exp(1j * psi)
        return (np.exp(1j * psi).T * self._uniform).T

    def curvature(self, s: Array, psi: Array) -> ComplexArray:
        """k (...) [1/m] of the centreline in the Bishop frame."""
        return self.turned_moments(s, psi).sum(axis=0) / self.bending.sum()

    def rates(self, s: Array, y: Array) -> Array:
        """y' (2p, ...) [1/m]."""
        b = self.turned_moments(s, y[: self.p])
        k = b.sum(axis=0) / self.bending.sum()
        return np.concatenate([(y[self.p :].T * self.compliance).T, (k.conj() * b).imag / self.torque_unit])

    def jacobian(self, s: Array, y: Array) -> Array:
        """dy'/dy (2p, 2p, ...) [1/m]: d psi'/dT is diagonal, and dT'/d psi a diagonal less a form of rank two."""
        p = self.p
        b = self.turned_moments(s, y[:p])
        k = b.sum(axis=0) / self.bending.sum()
        out = np.zeros((2 * p, *y.shape))
        i = np.arange(p)
        out[i, p + i] = self.compliance.reshape(p, *[1] * (y.ndim - 1))
        out[p:, :p] = -(b[:, None].conj() * b[None, :]).real / (self.bending.sum() * self.torque_unit)
        out[p + i, i] += (k.conj() * b).real / self.torque_unit
        return out


class Problem:
    """One command's boundary-value problem: the sections, and what holds at the orifice."""

    def __init__(self, robot: Robot, alpha: ArrayLike, D: ArrayLike) -> None:
        self.alpha, self.D = robot.check_command(alpha, D)
        self.domain = piecewise_domain(robot, self.D)
        materials = Materials(robot, self.domain)
        stiffest = max(segment.torsional_stiffness for tube in robot.tubes for segment in tube.segments)
        #: Of the torques in y [N m]: about what twists the robot by one radian, so that y is in radians throughout.
        self.torque_unit = stiffest / max(tube.length for tube in robot.tubes)
        self.guide_compliance = materials.guide_compliance
        self.sections = [Section(materials, m, self.torque_unit) for m in range(self.domain.n_sections)]

    @property
    def present(self) -> NDArray[np.intp]:
        """Tubes that come out of the orifice; any other ends in the guide and carries no torque."""
        return self.sections[0].tubes if self.sections else np.zeros(0, dtype=np.intp)
