"""Where the tubes overlap: the piecewise domain beyond the orifice, for one set of base positions D.

Sections are the open intervals between neighbouring boundaries.  A boundary is the orifice or the place of an
*event*: a segment boundary or a tip of some tube, at ``s = X - D_j``.  Between two boundaries every material
property is smooth.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.robot.robot import Robot
from ctr_pvs.robot.robot import Tube

#: Places closer than this [m] are one place.  Fixed, so that a kink is found by geometry and not by rounding.
SAME_PLACE = 1e-12

#: Marks a tube that is not there, in the tables of segment indices.
ABSENT = -1


@dataclass(frozen=True)
class Event:
    """A segment boundary of tube ``tube``: it ends segment ``before`` and starts segment ``after``.

    Either is ``ABSENT`` where the tube itself starts or ends.
    """

    tube: int
    before: int
    after: int


@dataclass(frozen=True, eq=False)
class Domain:
    """The piecewise domain of one D: M sections of N tubes.

    D : (N,) base positions [m].
    boundaries : (M + 1,) arc lengths [m] from the orifice (0) to the farthest tip.
    segment : (M, N) index of the segment that tube j has in section m, or ``ABSENT``.
    events : for every boundary the events that lie on it (more than one: a kink of the energy in D).
    guide_segment : (N,) segment of tube j just behind the orifice (``ABSENT`` if its base is there).
    """

    D: NDArray[np.float64]
    boundaries: NDArray[np.float64]
    segment: NDArray[np.int64]
    events: tuple[tuple[Event, ...], ...]
    guide_segment: NDArray[np.int64]

    @property
    def n_sections(self) -> int:
        return len(self.segment)

    @cached_property
    def lengths(self) -> NDArray[np.float64]:
        """(M,) section lengths [m]."""
        return np.diff(self.boundaries)

    @property
    def length(self) -> float:
        """Arc length [m] from the orifice to the farthest tip."""
        return float(self.boundaries[-1])

    @cached_property
    def leader(self) -> int:
        """The tube that reaches farthest, the innermost of equals: poses carry its material frame."""
        # With nothing out, what lies in the guide just behind the orifice.
        reach = self.segment[-1] if self.n_sections else self.guide_segment
        return int(np.flatnonzero(reach != ABSENT)[-1])

    def kinked_tubes(self) -> NDArray[np.bool_]:
        """(N,) true where the energy has a kink in D_j: an event of tube j on the orifice or on another tube's
        event."""
        kinked = np.zeros(len(self.D), dtype=bool)
        for index, events in enumerate(self.events):
            if index == 0 or len(events) > 1:
                kinked[[event.tube for event in events]] = True
        return kinked

    def locate(self, s: NDArray[np.float64]) -> NDArray[np.int64]:
        """Section index of each arc length [m]; a boundary counts to the section before it, the orifice to the
        first."""
        inside = np.searchsorted(self.boundaries, s, side="left") - 1
        return np.clip(inside, 0, max(self.n_sections - 1, 0))


def piecewise_domain(robot: Robot, D: NDArray[np.float64]) -> Domain:
    """The sections of ``robot`` for base positions ``D`` (N,) [m], already checked by ``Robot.check_command``."""
    D = np.array(D, dtype=np.float64)
    beyond: list[tuple[float, Event]] = []
    at_orifice = [ABSENT] * robot.n_tubes
    guide = [ABSENT] * robot.n_tubes
    on_orifice: list[Event] = []
    for tube, material in enumerate(robot.tubes):
        for event, s in zip(_events(tube, material), (material.breaks - D[tube]).tolist(), strict=True):
            if s > SAME_PLACE:
                beyond.append((s, event))
                continue
            # Passing the breaks in order, the last one not beyond the orifice tells what lies on either side of it.
            at_orifice[tube] = event.after
            guide[tube] = event.before if s >= -SAME_PLACE else event.after
            # A tube's base on the orifice is no event: it cannot come out any farther.
            if s >= -SAME_PLACE and event.before != ABSENT:
                on_orifice.append(event)
    boundaries, events = _merge(beyond)
    segment = _segments(at_orifice, events)
    return Domain(D, boundaries, segment, (tuple(on_orifice), *events), np.array(guide, dtype=np.int64))


def _events(tube: int, material: Tube) -> list[Event]:
    """Every break of one tube, from its base to its tip."""
    last = len(material.segments)
    return [Event(tube, i - 1 if i > 0 else ABSENT, i if i < last else ABSENT) for i in range(last + 1)]


def _merge(places: list[tuple[float, Event]]) -> tuple[NDArray[np.float64], list[tuple[Event, ...]]]:
    """Boundaries, orifice first, with the events of each; events within ``SAME_PLACE`` share one boundary."""
    boundaries = [0.0]
    events: list[list[Event]] = []
    for s, event in sorted(places, key=lambda place: place[0]):
        if events and s - boundaries[-1] <= SAME_PLACE:
            events[-1].append(event)
        else:
            boundaries.append(s)
            events.append([event])
    return np.array(boundaries), [tuple(group) for group in events]


def _segments(at_orifice: list[int], events: list[tuple[Event, ...]]) -> NDArray[np.int64]:
    """(M, N) segment of each tube in each section, by walking from the orifice over the events."""
    rows = []
    current = at_orifice.copy()
    for group in events:
        rows.append(tuple(current))
        for event in group:
            current[event.tube] = event.after
    return np.array(rows, dtype=np.int64).reshape(-1, len(current))
