"""Where the tubes overlap: the piecewise domain beyond the orifice, for one set of base positions D.

Sections are the open intervals between neighbouring boundaries.  A boundary is the orifice or the place of an
*event*: a segment boundary or a tip of some tube, at ``s = X - D_j``.  Between two boundaries every material
property is smooth.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.lazy import lazy
from ctr_pvs.robot.robot import Robot

#: Places closer than this [m] are one place.  Fixed, so that a kink is found by geometry and not by rounding.
SAME_PLACE = 1e-12

#: Marks a tube that is not there, in the tables of segment indices.
ABSENT = -1


@dataclass(frozen=True)
class Event:
    """Segment boundary ``index`` of tube ``tube``: it ends segment ``index - 1`` and starts segment ``index``.

    ``before`` and ``after`` are those two segments, ``ABSENT`` where the tube itself starts or ends.
    """

    tube: int
    before: int
    after: int


#: Which segments the sections and the guide hold: the shape and bytes of ``Domain.segment``, and ``guide_segment``'s.
Topology: TypeAlias = tuple[int, int, bytes, bytes]
#: Where an event lies [m], its tube, the index of its break, and itself: in this order places are sorted.
Place: TypeAlias = tuple[float, int, int, Event]


@dataclass(frozen=True, eq=False)
class Domain:
    """The piecewise domain of one D: M sections of N tubes.

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

    @lazy
    def lengths(self) -> NDArray[np.float64]:
        """(M,) section lengths [m]."""
        return self.boundaries[1:] - self.boundaries[:-1]

    @property
    def length(self) -> float:
        """Arc length [m] from the orifice to the farthest tip."""
        return self.boundaries.item(-1)

    @lazy
    def leader(self) -> int:
        """The tube that reaches farthest, the innermost of equals: poses carry its material frame."""
        # With nothing out, what lies in the guide just behind the orifice.
        reach = self.segment[-1] if self.n_sections else self.guide_segment
        return int(np.flatnonzero(reach != ABSENT)[-1])

    @lazy
    def topology(self) -> Topology:
        """Equal for two domains whose sections hold the same segments in the same order."""
        return (*self.segment.shape, self.segment.tobytes(), self.guide_segment.tobytes())

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
    places: list[Place] = []
    at_orifice = [ABSENT] * robot.n_tubes
    guide = [ABSENT] * robot.n_tubes
    orifice_events: list[Event] = []
    for abscissa, tube, index, event in _events(robot):
        place = abscissa - D.item(tube)
        if place > SAME_PLACE:
            places.append((place, tube, index, event))
            continue
        # Passing the breaks in order, the last one not beyond the orifice tells what lies on either side of it.
        at_orifice[tube] = event.after
        if place >= -SAME_PLACE:
            guide[tube] = event.before
            if index > 0:  # a tube's base on the orifice is no event: it cannot come out any farther
                orifice_events.append(event)
        else:
            guide[tube] = event.after
    boundaries, events = _merge(places)
    segment = _segments(at_orifice, events)
    return Domain(np.array(D, dtype=float), boundaries, segment, (tuple(orifice_events), *events), np.array(guide))


@lru_cache(maxsize=64)
def _events(robot: Robot) -> tuple[Place, ...]:
    """Every break of every tube, by its abscissa [m]."""
    places = []
    for tube, material in enumerate(robot.tubes):
        last = len(material.segments)
        for index, abscissa in enumerate(material.breaks.tolist()):
            event = Event(tube, index - 1 if index > 0 else ABSENT, index if index < last else ABSENT)
            places.append((abscissa, tube, index, event))
    return tuple(places)


def _merge(places: list[Place]) -> tuple[NDArray[np.float64], list[tuple[Event, ...]]]:
    """Boundaries, orifice first, with the events of each; events within ``SAME_PLACE`` share one boundary."""
    boundaries = [0.0]
    events: list[list[Event]] = []
    for place, _, _, event in sorted(places):
        if events and place - boundaries[-1] <= SAME_PLACE:
            events[-1].append(event)
        else:
            boundaries.append(place)
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
