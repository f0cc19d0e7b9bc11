"""The fields of one equilibrium along s, whatever model it came from: twist angles psi_j, their rates, the curvature.

Fields are told by section m and place x = (s - s_m) / h in [0, 1].  The backbone is not among them: it is an integral
of the curvature, and each room that needs it takes its own.
"""

from __future__ import annotations

from abc import ABC
from abc import abstractmethod

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.model.materials import Materials
from ctr_pvs.model.sections import ABSENT
from ctr_pvs.model.sections import Domain

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
        """psi (g, N) [rad] at the places ``x`` (g,) in [0, 1] of section m; past its tip a tube keeps its last
        angle."""

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

    @property
    def leader(self) -> int:
        """See ``Domain.leader``."""
        return self.domain.leader

    def angles_at(self, s: Array) -> Array:
        """psi (g, N) [rad] at arc lengths ``s`` (g,) [m], NaN where a tube has ended (its tip still counts).

        At the orifice and before it, every tube has the angle with which it leaves the guide or ends there.
        """
        s = np.asarray(s, dtype=np.float64)
        if not self.domain.n_sections:
            return np.repeat(self.angle_at_boundaries, len(s), axis=0)
        psi = self.angles_held(s)
        psi[self.domain.segment[self.domain.locate(s)] == ABSENT] = np.nan
        at_orifice = s <= self.domain.boundaries[0]
        psi[at_orifice] = self.angle_at_boundaries[0]  # a tube that ends on the orifice has an angle there
        return psi

    def angles_held(self, s: Array) -> Array:
        """psi (g, N) [rad] at arc lengths ``s`` (g,) [m], where past its tip a tube keeps its last angle."""
        s = np.asarray(s, dtype=np.float64)
        if not self.domain.n_sections:
            return np.repeat(self.angle_at_boundaries, len(s), axis=0)
        psi = np.empty((len(s), len(self.alpha)))
        section = self.domain.locate(s)
        for m in np.unique(section).tolist():
            here = section == m
            x = (s[here] - self.domain.boundaries[m]) / self.domain.lengths[m]
            psi[here] = self.angle(m, x)
        return psi
