"""What the sections of one topology are made of: all that follows from the segments in them, whatever their lengths.

As long as base positions change the order of no two boundaries these tables stay what they are, so they are made once.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.lazy import lazy
from ctr_pvs.robot.robot import Robot
from ctr_pvs.robot.robot import Segment
from ctr_pvs.sections import ABSENT
from ctr_pvs.sections import Domain

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


class Composition:
    """M sections that hold the ``segments`` (M, N) of the tubes of ``robot``.  All tables are read-only.

    bending, torsional (M, N) : K and GJ [N m^2], 0 where a tube is absent.  total (M,) : sum of K.
    softness (M, N) : 1 / GJ, 0 where absent.
    start (M, N) : abscissa [m] of each segment's own start.  starts : for each tube those of all segments, and these.
    curved (M, N) : true where a tube is present and pre-curved.  coupled (M,) : true where two or more of them are.
    curved_tubes : the pre-curved tubes of each section.  coupled_sections : indices of the coupled ones.
    first, last : the outermost coupled sections, (0, -1) without any.
    twisting (last + 1, N) : tubes that carry torque in each section: curved in a coupled one from there on.
    size (M, N) : of the pre-curvature [1/m], None unless it is the same all along every segment.
    sections (M,) : all indices.  share (M, N) : K / sum of K.  fastest_turn (M,) : of a pre-curvature [rad/m].
    """

    def __init__(self, robot: Robot, segments: NDArray[np.int64]) -> None:
        self.robot, self.segments = robot, segments
        self.bending = self._per_section(lambda segment: segment.bending_stiffness)
        self.torsional = self._per_section(lambda segment: segment.torsional_stiffness)
        self.total = self.bending.sum(axis=1)
        self.share = self.bending / self.total[:, None]
        self.sections = np.arange(len(segments))
        turn = self._per_section(lambda segment: 0.0 if segment.is_straight else segment.turn)
        self.fastest_turn = np.abs(turn).max(axis=1)
        self.curved = self._per_section(lambda segment: 0.0 if segment.is_straight else 1.0) > 0.0
        self.coupled = self.curved.sum(axis=1) >= 2
        self.coupled_sections = np.flatnonzero(self.coupled)
        coupled = self.coupled_sections.tolist()
        self.first, self.last = (coupled[0], coupled[-1]) if coupled else (0, -1)
        pulled = self.curved[: self.last + 1] & self.coupled[: self.last + 1, None]
        self.twisting = np.logical_or.accumulate(pulled[::-1], axis=0)[::-1]
        self.curved_tubes = [np.flatnonzero(row).tolist() for row in self.curved]
        self.starts = [list(zip(tube.breaks.tolist(), tube.segments, strict=False)) for tube in robot.tubes]
        self.start = np.zeros(segments.shape)
        for m, tube, _ in self._segments():
            self.start[m, tube] = self.starts[tube][segments[m, tube]][0]
        self.softness = np.divide(1.0, self.torsional, out=np.zeros_like(self.start), where=self.torsional > 0.0)
        self._coefficients = self._pre_curvatures()
        self._spin = 1j * turn if turn.any() else None
        self.size = np.abs(self._coefficients[0]) if len(self._coefficients) == 1 else None
        sealed(self)

    def _segments(self) -> list[tuple[int, int, Segment]]:
        """Section, tube and segment wherever there is one."""
        places = zip(*(index.tolist() for index in np.nonzero(self.segments != ABSENT)), strict=True)
        return [(m, tube, self.robot.tubes[tube].segments[self.segments[m, tube]]) for m, tube in places]

    def _per_section(self, value: Callable[[Segment], float]) -> Array:
        table = np.zeros(self.segments.shape)
        for m, tube, segment in self._segments():
            table[m, tube] = value(segment)
        return table

    def _pre_curvatures(self) -> list[ComplexArray]:
        """Coefficients (M, N) of the pre-curvatures' polynomials, that of the highest power first."""
        parts = self._segments()
        count = max((len(segment.curvature) for _, _, segment in parts), default=0)
        table = np.zeros((max(1, count), *self.segments.shape), dtype=complex)
        for m, tube, segment in parts:
            table[: len(segment.curvature), m, tube] = segment.curvature
        return list(table[::-1])

    def pre_curvature(self, m: int | NDArray[np.int64], X: Array) -> ComplexArray:
        """(..., N) kappa_y + i kappa_z [1/m] of each tube in the sections ``m`` at the abscissae ``X`` (..., N) [m] of
        their segments, 0 where absent."""
        value = np.empty(X.shape, dtype=complex)
        value[...] = self._coefficients[0][m]
        for coefficient in self._coefficients[1:]:
            value *= X
            value += coefficient[m]
        if self._spin is not None:
            value *= np.exp(self._spin[m] * X)
        return value

    @lazy
    def constant_stiffest_twist(self) -> Array | None:
        """``stiffest_twist`` (C,) of the coupled sections where ``size`` tells it."""
        m = self.coupled_sections
        return None if self.size is None else self.stiffest_twist(m, self.size[m])

    @lazy
    def constant_bend(self) -> Array | None:
        """(1, M) curvature [1/m] if all tubes bent to the same side, where ``size`` tells it."""
        return None if self.size is None else (self.size * self.share).sum(axis=1)[None]

    def stiffest_twist(self, m: NDArray[np.int64], kappa: Array) -> Array:
        """(C,) the most that tubes of curvatures ``kappa`` (C, N) [1/m] in the sections ``m`` (C,) can pull each
        other's twist, relative to torsion and per square of the section's length [1/m^2]."""
        moment = self.bending[m] * kappa
        pull = moment[:, :, None] * moment[:, None, :] / self.total[m, None, None]
        laplacian = pull.sum(axis=2)[:, :, None] * np.eye(moment.shape[1]) - pull
        soft = np.sqrt(self.softness[m])
        return np.linalg.eigvalsh(laplacian * soft[:, :, None] * soft[:, None, :])[:, -1]


def sealed(shared: object) -> None:
    """Makes the arrays that are attributes of ``shared`` read-only."""
    for value in vars(shared).values():
        if isinstance(value, np.ndarray):
            value.flags.writeable = False


def composition(robot: Robot, domain: Domain) -> Composition:
    """That of the sections of ``domain``; the last few are kept."""
    sections, tubes, segments, _ = domain.topology
    return _composition(robot, (sections, tubes), segments)


@lru_cache(maxsize=64)
def _composition(robot: Robot, shape: tuple[int, int], segments: bytes) -> Composition:
    return Composition(robot, np.frombuffer(segments, dtype=np.int64).reshape(shape))
