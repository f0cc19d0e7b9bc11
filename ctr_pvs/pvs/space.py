"""The unknown strains of the `full` level: PVS coordinates of every section, in the guide and beyond the orifice.

The domain starts at the innermost tube's base.  In every section xi_1 = B_1 p_1 + xi_bar of the outermost tube present
(eq. 19) and the relative twist rates B_theta p_theta of the inner ones (eq. 20) are free; in the guide only torsion is
(section III-C), and a single tube beyond the orifice has its rest shape.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.model.basis import gauss_legendre
from ctr_pvs.model.materials import Materials
from ctr_pvs.model.sections import ABSENT
from ctr_pvs.model.sections import SAME_PLACE
from ctr_pvs.pvs.strain_basis import SectionBasis
from ctr_pvs.pvs.strain_basis import SectionView
from ctr_pvs.pvs.strain_basis import StrainBasis

Array = NDArray[np.float64]

#: Gauss points to integrate a basis over part of a section: exact for polynomials up to degree 47.
INTEGRATION_NODES = 24


@dataclass(frozen=True, eq=False)
class StrainSection:
    """One section: a guided one (index -1) or section ``index`` of the domain.

    tubes : those present, outermost first; torsional (N,) GJ, 0 where absent; columns of q, first those of B_1.
    """

    index: int
    start: float
    length: float
    tubes: tuple[int, ...]
    torsional: Array
    columns: slice

    @property
    def lead(self) -> int:
        return self.tubes[0]

    @property
    def bends(self) -> bool:
        return self.index >= 0


@dataclass(frozen=True, eq=False)
class StrainMaps:
    """Linear maps from q (n,) at g places of a section: psi' (g, N, n), psi - alpha (g, N, n), and the leading tube's
    curvature k_y, k_z (g, 2, n)."""

    rate: Array
    angle: Array
    curvature: Array


class FullSpace:
    """All sections with their coordinates under one command; n : number of coordinates."""

    def __init__(self, materials: Materials, alpha: Array, basis: StrainBasis) -> None:
        self.materials, self.alpha, self.basis = materials, alpha, basis
        self.sections: list[StrainSection] = []
        self.n = 0
        for index, start, length, segment in [*self._guide(), *self._free()]:
            self._add(index, start, length, segment)
        self._angle_before = self._accumulate()

    def _guide(self) -> list[tuple[int, float, float, NDArray[np.int64]]]:
        """Sections behind the orifice, cut at tube bases and at segment boundaries."""
        robot, D = self.materials.robot, self.materials.domain.D
        places = np.concatenate([[0.0], *(tube.breaks - base for tube, base in zip(robot.tubes, D, strict=True))])
        cuts = np.unique(places[places < -SAME_PLACE])
        cuts = np.append(cuts[np.diff(cuts, append=0.0) > SAME_PLACE], 0.0)
        out = []
        for start, end in pairwise(cuts):
            segment = np.full(robot.n_tubes, ABSENT)
            for tube, base in enumerate(D):
                abscissa = 0.5 * (start + end) + base
                if 0.0 < abscissa < robot.tubes[tube].length:
                    segment[tube] = int(np.searchsorted(robot.tubes[tube].breaks, abscissa)) - 1
            out.append((-1, float(start), float(end - start), segment))
        return out

    def _free(self) -> list[tuple[int, float, float, NDArray[np.int64]]]:
        domain = self.materials.domain
        return [
            (m, float(domain.boundaries[m]), float(domain.lengths[m]), domain.segment[m])
            for m in range(domain.n_sections)
        ]

    def _add(self, index: int, start: float, length: float, segment: NDArray[np.int64]) -> None:
        tubes = tuple(int(tube) for tube in np.flatnonzero(segment != ABSENT))
        torsional = np.zeros(len(segment))
        for tube in tubes:
            torsional[tube] = self.materials.segment(tube, int(segment[tube])).torsional_stiffness
        section = StrainSection(index, start, length, tubes, torsional, slice(self.n, self.n))
        if not self._at_rest(section):
            table = self.table(section, np.array([0.5]))
            self.n += table.lead.shape[2] + sum(relative.shape[1] for relative in table.relative)
        self.sections.append(
            StrainSection(index, start, length, tubes, torsional, slice(section.columns.start, self.n))
        )

    @staticmethod
    def _at_rest(section: StrainSection) -> bool:
        """True where nothing is unknown: no tube, or a single one beyond the orifice."""
        return not section.tubes or (section.bends and len(section.tubes) == 1)

    def table(self, section: StrainSection, x: Array) -> SectionBasis:
        """The basis of ``section`` at the places ``x`` (g,)."""
        s = section.start + section.length * x
        kappa = np.zeros((len(x), len(section.tubes)), dtype=complex)
        if section.bends:
            kappa = self.materials.pre_curvature(section.index, s)[:, section.tubes]
        return self.basis(SectionView(x, s, kappa, self.alpha[list(section.tubes)]), section.bends)

    def maps(self, number: int, x: Array) -> StrainMaps:
        """The linear maps at the places ``x`` (g,) of section ``number`` of ``sections``."""
        section = self.sections[number]
        angle = self._angle_before[number] + self._twist(section, x)
        rate, curvature = self._local(section, x)
        return StrainMaps(rate, angle, curvature)

    def _local(self, section: StrainSection, x: Array) -> tuple[Array, Array]:
        rate = np.zeros((len(x), self.materials.robot.n_tubes, self.n))
        curvature = np.zeros((len(x), 2, self.n))
        if self._at_rest(section):
            return rate, curvature
        table = self.table(section, x)
        column = section.columns.start + table.lead.shape[2]
        own = slice(section.columns.start, column)
        curvature[:, :, own] = table.lead[:, 1:]
        rate[:, section.tubes, own] = table.lead[:, :1]
        for order, relative in enumerate(table.relative, start=1):
            # A relative twist turns its tube and all inner ones with it (eq. 12).
            rate[:, section.tubes[order:], column : column + relative.shape[1]] = relative[:, None, :]
            column += relative.shape[1]
        return rate, curvature

    def _twist(self, section: StrainSection, x: Array) -> Array:
        """(g, N, n) int_0^x psi' ds from the section's start: J_theta of eq. (22) and the leading tube's own twist."""
        rule = gauss_legendre(INTEGRATION_NODES)
        rate, _ = self._local(section, (x[:, None] * rule.x).ravel())
        weighted = rate.reshape(len(x), len(rule.x), *rate.shape[1:]) * rule.weights[:, None, None]
        return section.length * x[:, None, None] * weighted.sum(axis=1)

    def _accumulate(self) -> list[Array]:
        """Per section the (N, n) map to psi - alpha at its start."""
        before = [np.zeros((self.materials.robot.n_tubes, self.n))]
        for section in self.sections:
            before.append(before[-1] + self._twist(section, np.ones(1))[0])
        return before
