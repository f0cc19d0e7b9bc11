"""Material properties of every tube in every section, and what the guide behind the orifice holds.

Proximal to the orifice the guide keeps each tube straight while it may twist (section III-C of the seed paper), so
there the pre-curvature costs a fixed straightening energy and the twist is that of a shaft under constant torque.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.model.basis import GaussRule
from ctr_pvs.model.sections import ABSENT
from ctr_pvs.model.sections import Domain
from ctr_pvs.robot.robot import Robot
from ctr_pvs.robot.robot import Segment

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


class Materials:
    """Stiffnesses and pre-curvatures of ``robot`` laid over ``domain``: N tubes, M sections.

    bending, torsional : (M, N) K and GJ [N m^2], 0 where a tube is absent.
    curved : (M, N) true where a tube is present and pre-curved.
    coupled : (M,) true where two or more tubes are: only there do they twist each other.
    """

    def __init__(self, robot: Robot, domain: Domain) -> None:
        self.robot, self.domain = robot, domain
        self.bending, self.torsional = np.zeros(domain.segment.shape), np.zeros(domain.segment.shape)
        self.curved = np.zeros(domain.segment.shape, dtype=bool)
        for m, tube in np.argwhere(domain.segment != ABSENT).tolist():
            segment = self.segment(tube, int(domain.segment[m, tube]))
            self.bending[m, tube] = segment.bending_stiffness
            self.torsional[m, tube] = segment.torsional_stiffness
            self.curved[m, tube] = not segment.is_straight
        self.coupled = self.curved.sum(axis=1) >= 2

    def segment(self, tube: int, index: int) -> Segment:
        """Segment ``index`` of tube ``tube``, both counted from 0."""
        return self.robot.tubes[tube].segments[index]

    def abscissa(self, tube: int, index: int, s: Array) -> Array:
        """X [m] of segment ``index`` of tube ``tube``, from its own start, at arc lengths ``s`` (...) [m]."""
        return np.asarray(s + self.domain.D[tube] - self.robot.tubes[tube].breaks[index])

    def pre_curvature(self, m: int, s: Array) -> ComplexArray:
        """(..., N) kappa_y + i kappa_z [1/m] of each tube at arc lengths ``s`` (...) [m] of section m, 0 where
        absent."""
        out = np.zeros((*np.shape(s), self.robot.n_tubes), dtype=complex)
        for tube, index in self._curved_in(m):
            out[..., tube] = self.segment(tube, index).pre_curvature(self.abscissa(tube, index, s))
        return out

    def pre_curvature_rate(self, m: int, s: Array) -> ComplexArray:
        """(..., N) derivative of ``pre_curvature`` along the tube [1/m^2]."""
        out = np.zeros((*np.shape(s), self.robot.n_tubes), dtype=complex)
        for tube, index in self._curved_in(m):
            out[..., tube] = self.segment(tube, index).pre_curvature_rate(self.abscissa(tube, index, s))
        return out

    def _curved_in(self, m: int) -> list[tuple[int, int]]:
        """Pre-curved tubes of section m, each with its segment there."""
        return [(tube, int(self.domain.segment[m, tube])) for tube in np.flatnonzero(self.curved[m]).tolist()]

    @cached_property
    def guide_compliance(self) -> Array:
        """(N,) twist of each tube's guided part per torque, int_0^D_j dX / GJ [rad/(N m)]."""
        return np.array([sum((x / g.torsional_stiffness for g, x in part), 0.0) for part in self._guided()])

    @cached_property
    def straightening_energy(self) -> Array:
        """(N,) energy [J] it takes to hold each tube's guided part straight, int_0^D_j K |kappa*|^2 / 2 dX."""
        return np.array([sum((_straightening(g, x) for g, x in part), 0.0) for part in self._guided()])

    def _guided(self) -> list[list[tuple[Segment, float]]]:
        """For each tube its segments in the guide, and how much [m] of each."""
        return [
            [
                (segment, min(base - start, segment.length))
                for start, segment in zip(tube.breaks.tolist(), tube.segments, strict=False)
                if start < base
            ]
            for tube, base in zip(self.robot.tubes, self.domain.D.tolist(), strict=True)
        ]


def _straightening(segment: Segment, x: float) -> float:
    """int_0^x K |kappa*|^2 / 2 along a segment; the helical turn drops out of the absolute value."""
    c = np.asarray(segment.curvature)
    if not len(c):
        return 0.0
    square = np.convolve(c, c.conj()).real
    powers = np.arange(1, len(square) + 1)
    return float(0.5 * segment.bending_stiffness * np.sum(square * x**powers / powers))


def shared_curvature(bending: Array, moment: ComplexArray) -> ComplexArray:
    """Curvature k [1/m] of the backbone where tubes with stiffnesses ``bending`` (..., N) [N m^2] share the bending
    ``moment`` (..., N), K_j exp(i psi_j) kappa*_j: the balance of eq. (26), point by point, without a load."""
    return moment.sum(axis=-1) / bending.sum(axis=-1)


def bending_density(bending: Array, pre_curvature: ComplexArray, psi: Array, k: ComplexArray) -> Array:
    """Energy density w [J/m] (...) of tubes (..., N) bent to the curvature ``k`` (...) [1/m]; a sum of squares, so
    nothing cancels."""
    strain = pre_curvature - np.asarray(k)[..., None] * np.exp(-1j * psi)
    return 0.5 * np.sum(bending * np.abs(strain) ** 2, axis=-1)


@dataclass(frozen=True, eq=False)
class SectionNodes:
    """Gauss points of one section: where an energy density is sampled.

    s, weight : (g,) arc lengths [m] and quadrature weights [m]; bending (N,) K; kappa (g, N) pre-curvatures [1/m].
    """

    section: int
    rule: GaussRule
    s: Array
    weight: Array
    bending: Array
    kappa: ComplexArray


def section_nodes(materials: Materials, m: int, rule: GaussRule) -> SectionNodes:
    """The points of ``rule`` in section m."""
    length = float(materials.domain.lengths[m])
    s = materials.domain.boundaries[m] + length * rule.x
    return SectionNodes(m, rule, s, length * rule.weights, materials.bending[m], materials.pre_curvature(m, s))
