"""Material properties of every tube in every section, and what the guide behind the orifice holds.

Proximal to the orifice the guide keeps each tube straight while it may twist (section III-C of the seed paper), so
there the pre-curvature costs a fixed straightening energy and the twist is that of a shaft under constant torque.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.robot import Robot
from ctr_pvs.robot import Segment
from ctr_pvs.sections import ABSENT
from ctr_pvs.sections import Domain

Array = NDArray[np.float64]

#: Places in a section where the strength of its coupling is sampled.
FIVE_PLACES = np.linspace(0.0, 1.0, 5)


@dataclass(frozen=True, eq=False)
class Materials:
    """Stiffnesses and pre-curvatures of ``robot`` laid over ``domain``: N tubes, M sections."""

    robot: Robot
    domain: Domain

    def segment(self, tube: int, index: int) -> Segment:
        return self.robot.tubes[tube].segments[index]

    @cached_property
    def bending(self) -> Array:
        """(M, N) bending stiffness K [N m^2], 0 where a tube is absent."""
        return self._per_section(lambda segment: segment.bending_stiffness)

    @cached_property
    def torsional(self) -> Array:
        """(M, N) torsional stiffness GJ [N m^2], 0 where a tube is absent."""
        return self._per_section(lambda segment: segment.torsional_stiffness)

    @cached_property
    def curved(self) -> NDArray[np.bool_]:
        """(M, N) true where a tube is present and pre-curved."""
        return self._per_section(lambda segment: 0.0 if segment.is_straight else 1.0) > 0.0

    @cached_property
    def coupled(self) -> NDArray[np.bool_]:
        """(M,) true for sections where two or more curved tubes overlap: only there do tubes twist one another."""
        return self.curved.sum(axis=1) >= 2

    @cached_property
    def curved_tubes(self) -> list[list[int]]:
        """The pre-curved tubes of each section."""
        return [np.flatnonzero(row).tolist() for row in self.curved]

    def coupling(self, m: int) -> float:
        """Strength of the coupling in section m: the most that twist can be pulled, relative to torsion (two tubes of
        constant pre-curvature: lambda of the stability literature)."""
        if m not in self._couplings:
            self._couplings[m] = self._coupling(m)
        return self._couplings[m]

    @cached_property
    def _couplings(self) -> dict[int, float]:
        return {}

    def _coupling(self, m: int) -> float:
        start, length = self.domain.boundaries[m], self.domain.lengths[m]
        tubes = self.curved[m]
        kappa = np.abs(self.pre_curvature(m, start + length * FIVE_PLACES)).max(axis=0)[tubes]
        moment = self.bending[m, tubes] * kappa
        pull = np.outer(moment, moment) / self.bending[m].sum()
        soft = 1.0 / np.sqrt(self.torsional[m, tubes])
        laplacian = np.diag(pull.sum(axis=1)) - pull
        return float(length**2 * np.linalg.eigvalsh(laplacian * np.outer(soft, soft))[-1])

    def _per_section(self, value: Callable[[Segment], float]) -> Array:
        table = np.zeros(self.domain.segment.shape)
        for m, tube in zip(*np.nonzero(self.domain.segment != ABSENT), strict=True):
            table[m, tube] = value(self.segment(int(tube), int(self.domain.segment[m, tube])))
        return table

    def pre_curvature(self, m: int, s: Array) -> NDArray[np.complex128]:
        """(..., N) kappa_y + i kappa_z [1/m] of each tube at arc lengths ``s`` (...) [m] of section m, 0 where
        absent."""
        return self._along(m, s, Segment.pre_curvature)

    def pre_curvature_rate(self, m: int, s: Array) -> NDArray[np.complex128]:
        """(..., N) derivative of ``pre_curvature`` along the tube [1/m^2]."""
        return self._along(m, s, Segment.pre_curvature_rate)

    def _along(
        self, m: int, s: Array, value: Callable[[Segment, Array], NDArray[np.complex128]]
    ) -> NDArray[np.complex128]:
        out = np.zeros((*s.shape, self.robot.n_tubes), dtype=complex)
        for tube in self.curved_tubes[m]:
            index = int(self.domain.segment[m, tube])
            start = self.robot.tubes[tube].breaks[index]
            out[..., tube] = value(self.segment(tube, index), s + self.domain.D[tube] - start)
        return out

    @cached_property
    def guide_compliance(self) -> Array:
        """(N,) twist of each tube's guided part per torque, int_0^D_j dX / GJ [rad/(N m)]."""
        return np.array(
            [self._guided(tube, lambda g, x: x / g.torsional_stiffness) for tube in range(len(self.domain.D))]
        )

    @cached_property
    def straightening_energy(self) -> Array:
        """(N,) energy [J] it takes to hold each tube's guided part straight, int_0^D_j K |kappa*|^2 / 2 dX."""
        return np.array([self._guided(tube, _straightening) for tube in range(len(self.domain.D))])

    def _guided(self, tube: int, integral: Callable[[Segment, float], float]) -> float:
        material, base = self.robot.tubes[tube], self.domain.D[tube]
        total = 0.0
        for start, segment in zip(material.breaks, material.segments, strict=False):
            if start < base:
                total += integral(segment, min(base - start, segment.length))
        return total


def _straightening(segment: Segment, x: float) -> float:
    """int_0^x K |kappa*|^2 / 2 along a segment; the helical turn drops out of the absolute value."""
    c = np.asarray(segment.curvature)
    if not len(c):
        return 0.0
    square = np.convolve(c, c.conj()).real
    powers = np.arange(1, len(square) + 1)
    return float(0.5 * segment.bending_stiffness * np.sum(square * x**powers / powers))
