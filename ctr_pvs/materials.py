"""Material properties of every tube in every section, and what the guide behind the orifice holds.

Proximal to the orifice the guide keeps each tube straight while it may twist (section III-C of the seed paper), so
there the pre-curvature costs a fixed straightening energy and the twist is that of a shaft under constant torque.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.composition import composition
from ctr_pvs.lazy import lazy
from ctr_pvs.model import materials
from ctr_pvs.robot.robot import Robot
from ctr_pvs.robot.robot import Segment
from ctr_pvs.sections import Domain

Array = NDArray[np.float64]

#: Places in a section where the strength of its coupling is sampled.
FIVE_PLACES = np.linspace(0.0, 1.0, 5)


class Materials(materials.Materials):
    """Stiffnesses and pre-curvatures of ``robot`` laid over ``domain``: N tubes, M sections.

    composition : what the sections hold.  Of its tables, bending, torsional (M, N), curved (M, N), coupled (M,) and
    curved_tubes are at hand here as well.
    """

    domain: Domain

    def __init__(self, robot: Robot, domain: Domain) -> None:
        self.robot, self.domain = robot, domain
        made = self.composition = composition(robot, domain)
        self.bending, self.torsional = made.bending, made.torsional
        self.curved, self.coupled, self.curved_tubes = made.curved, made.coupled, made.curved_tubes

    def segment(self, tube: int, index: int) -> Segment:
        return self.robot.tubes[tube].segments[index]

    def coupling(self, m: int) -> float:
        """Strength of the coupling in section m: the most that twist can be pulled, relative to torsion (two tubes of
        constant pre-curvature: lambda of the stability literature)."""
        return self._couplings[m]

    @lazy
    def _couplings(self) -> list[float]:
        """(M,) for each section, 0 where nothing couples the tubes."""
        strengths = [0.0] * self.domain.n_sections
        sections = self.composition.coupled_sections
        if len(sections):
            lengths = self.domain.lengths.take(sections)
            most = self.composition.constant_stiffest_twist
            if most is None:
                s = self.domain.boundaries.take(sections) + lengths * FIVE_PLACES[:, None]
                most = self.composition.stiffest_twist(sections, np.abs(self.pre_curvature(sections, s)).max(axis=0))
            for m, value in zip(sections.tolist(), (lengths**2 * most).tolist(), strict=True):
                strengths[m] = value
        return strengths

    def pre_curvature(self, m: int | NDArray[np.int64], s: Array) -> NDArray[np.complex128]:
        """(..., N) kappa_y + i kappa_z [1/m] of each tube at arc lengths ``s`` (...) [m] of section m, 0 where absent.

        ``m`` may be as many sections as ``s`` has places along its last axis.
        """
        return self.composition.pre_curvature(m, s[..., None] + self._shift[m])

    @lazy
    def _shift(self) -> Array:
        """(M, N) what leads from s to the abscissa of each segment [m]."""
        return self.domain.D - self.composition.start

    def pre_curvature_rate(self, m: int, s: Array) -> NDArray[np.complex128]:
        """(..., N) derivative of ``pre_curvature`` along the tube [1/m^2]."""
        out = np.zeros((*s.shape, self.robot.n_tubes), dtype=complex)
        for tube in self.curved_tubes[m]:
            segment = self.segment(tube, int(self.domain.segment[m, tube]))
            out[..., tube] = segment.pre_curvature_rate(s + self._shift[m, tube])
        return out

    @lazy
    def guide_compliance(self) -> Array:
        """(N,) twist of each tube's guided part per torque, int_0^D_j dX / GJ [rad/(N m)]."""
        return np.array([sum([x / g.torsional_stiffness for g, x in part], 0.0) for part in self._guided()])

    @lazy
    def straightening_energy(self) -> Array:
        """(N,) energy [J] it takes to hold each tube's guided part straight, int_0^D_j K |kappa*|^2 / 2 dX."""
        return np.array([sum([_straightening(g, x) for g, x in part], 0.0) for part in self._guided()])

    def _guided(self) -> list[list[tuple[Segment, float]]]:
        """For each tube its segments in the guide, and how much [m] of each."""
        return [
            [(g, min(base - start, g.length)) for start, g in starts if start < base]
            for starts, base in zip(self.composition.starts, self.domain.D.tolist(), strict=True)
        ]


def _straightening(segment: Segment, x: float) -> float:
    """int_0^x K |kappa*|^2 / 2 along a segment; the helical turn drops out of the absolute value."""
    c = np.asarray(segment.curvature)
    if not len(c):
        return 0.0
    square = np.convolve(c, c.conj()).real
    powers = np.arange(1, len(square) + 1)
    return float(0.5 * segment.bending_stiffness * np.sum(square * x**powers / powers))
