"""The fields of one equilibrium along s, at any model level: twist angles psi_j, their rates, the curvature."""

from __future__ import annotations

from abc import ABC
from abc import abstractmethod
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.energy import shared_curvature
from ctr_pvs.materials import Materials
from ctr_pvs.sections import ABSENT
from ctr_pvs.sections import Domain
from ctr_pvs.twist import TorqueField
from ctr_pvs.twist import TwistSpace

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


class Shape(ABC):
    """Fields of N tubes over the M sections of a domain, under base angles ``alpha`` (N,) [rad].

    twists : false if tubes are taken for rigid in torsion, so that their torques do no work.
    """

    twists = True

    def __init__(self, materials: Materials, alpha: Array) -> None:
        self.materials = materials
        self.alpha = alpha

    @property
    def domain(self) -> Domain:
        return self.materials.domain

    @abstractmethod
    def angle(self, m: int, x: Array) -> Array:
        """psi (g, N) [rad] at the places ``x`` (g,) in [0, 1] of section m."""

    @abstractmethod
    def twist_rate(self, m: int, x: Array) -> Array:
        """psi' (g, N) [rad/m] at the places ``x`` of section m, 0 for absent tubes."""

    @abstractmethod
    def curvature(self, m: int, x: Array) -> ComplexArray:
        """k (g,) [1/m] of the backbone, k_y + i k_z in the Bishop frame, at the places ``x`` of section m."""

    @property
    @abstractmethod
    def angle_at_boundaries(self) -> Array:
        """psi (M + 1, N) [rad] at the section boundaries; past its tip a tube keeps its last angle."""

    def panels(self, m: int) -> int:
        """Number of equal panels of section m on which the fields are smooth: quadrature must not cross their seams."""
        return 1

    @cached_property
    def leader(self) -> int:
        """The tube that reaches farthest, the innermost of equals: poses carry its material frame."""
        # With nothing out, what lies in the guide just behind the orifice.
        reach = self.domain.segment[-1] if self.domain.n_sections else self.domain.guide_segment
        return int(np.flatnonzero(reach != ABSENT)[-1])

    def angles_at(self, s: Array) -> Array:
        """psi (g, N) [rad] at arc lengths ``s`` (g,) [m], NaN where a tube has ended (its tip still counts)."""
        if not self.domain.n_sections:
            return np.repeat(self.angle_at_boundaries, len(s), axis=0)
        psi = self.angles_held(s)
        psi[self.domain.segment[self.domain.locate(s)] == ABSENT] = np.nan
        at_orifice = s <= self.domain.boundaries[0]
        psi[at_orifice] = self.angle_at_boundaries[0]  # a tube that ends on the orifice has an angle there
        return psi

    def angles_held(self, s: Array) -> Array:
        """psi (g, N) [rad] at arc lengths ``s`` (g,) [m], where past its tip a tube keeps its last angle."""
        psi = np.empty((len(s), len(self.alpha)))
        section = self.domain.locate(s)
        for m in np.unique(section):
            here = section == m
            x = (s[here] - self.domain.boundaries[m]) / self.domain.lengths[m]
            psi[here] = self.angle(int(m), x)
        return psi


class TorsionShape(Shape):
    """The shape of unknowns ``q`` (n,) at the `torsion` level: curvature follows the twist point by point."""

    def __init__(self, space: TwistSpace, alpha: Array, q: Array) -> None:
        super().__init__(space.materials, alpha)
        self.space = space
        self.q = q

    @cached_property
    def torques(self) -> TorqueField:
        """Torque of every tube, to start another solve from."""
        return self.space.field(self.q)

    def angle(self, m: int, x: Array) -> Array:
        psi = np.broadcast_to(self.angle_at_boundaries[m], (len(x), len(self.alpha)))
        twist = self.torques.bases[m].tabulate(x)[1] @ self.torques.sections[m].T
        return psi + twist * self._compliance(m)

    def panels(self, m: int) -> int:
        return self.torques.bases[m].panels

    def twist_rate(self, m: int, x: Array) -> Array:
        torque = self.torques.bases[m].tabulate(x)[0] @ self.torques.sections[m].T
        return torque * self._compliance(m) / self.domain.lengths[m]

    def curvature(self, m: int, x: Array) -> ComplexArray:
        kappa = self.materials.pre_curvature(m, self.domain.boundaries[m] + x * self.domain.lengths[m])
        stiffness = self.materials.bending[m]
        return shared_curvature(stiffness, stiffness * kappa * np.exp(1j * self.angle(m, x)))

    def _compliance(self, m: int) -> Array:
        stiffness = self.materials.torsional[m]
        return np.divide(self.domain.lengths[m], stiffness, out=np.zeros_like(stiffness), where=stiffness > 0.0)

    @cached_property
    def angle_at_boundaries(self) -> Array:
        psi = [self.alpha + self.materials.guide_compliance * self.torques.guide]
        for m, (basis, coefficients) in enumerate(zip(self.torques.bases, self.torques.sections, strict=True)):
            mean = coefficients @ basis.tabulate(np.ones(1))[1][0]
            psi.append(psi[-1] + mean * self._compliance(m))
        return np.array(psi)


class TorsionlessShape(TorsionShape):
    """The shape of tubes that are taken for rigid in torsion: angles are the base angles everywhere."""

    twists = False
