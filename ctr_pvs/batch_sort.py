"""Sorting commands into groups that are solved together: by base positions, by layout, by degrees."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.batch_group import Group
from ctr_pvs.batch_group import Ladder
from ctr_pvs.batch_group import Part
from ctr_pvs.batch_layout import Geometry
from ctr_pvs.batch_layout import Layout
from ctr_pvs.batch_layout import hashed
from ctr_pvs.batch_layout import topology_keys
from ctr_pvs.batch_pilots import relative_angle
from ctr_pvs.batch_relaxed import start_of
from ctr_pvs.robot.robot import Robot

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Indices = NDArray[np.int64]

#: Rows solved together: enough to make the cost of a call small, and no more than fits a processor's own cache with
#: the few unknowns of two tubes.  No array of a step has more than so many numbers.
CHUNK, MOST_NUMBERS = 4096, 2_000_000
#: From so many rows on, a D is a group of its own.
OWN_GROUP = 64
#: Layouts whose tables are kept.
KEPT = 256


class Groups:
    """Sorts rows by base positions and solves them; keeps the tables of the layouts it meets."""

    def __init__(self, robot: Robot, tolerance: float, untwisted: bool) -> None:
        self.robot, self.tolerance, self.untwisted = robot, tolerance, untwisted
        self._ladders: OrderedDict[tuple[int, int], Ladder] = OrderedDict()

    def solve(self, rows: Indices, alpha: Array, D: Array, chunk: int) -> Iterator[tuple[Indices, Part, Mask]]:
        """Answers to the commands ``rows`` of ``alpha``, ``D`` (M, N): their rows, and where several relaxed states are
        equally near."""
        if not len(rows):
            return
        with np.errstate(all="ignore"):
            for same, inside in self._by_base(D[rows]):
                here = rows[inside]
                for which, ladder in self._by_degree(D[here[:1]] if same else D[here]):
                    yield from self._solve(here if same else here[which], ladder, alpha, D, same, chunk)

    def _by_base(self, D: Array) -> Iterator[tuple[bool, Indices]]:
        """Rows that share one D, if they are many, and all others together."""
        if len(D) == 1 or not np.any(D[1:] != D[0]):
            yield True, np.arange(len(D))
            return
        _, inverse, counts = np.unique(hashed(D.T), return_inverse=True, return_counts=True)
        for number in np.flatnonzero(counts >= OWN_GROUP).tolist():
            yield True, np.flatnonzero(inverse == number)
        rest = np.flatnonzero(counts[inverse] < OWN_GROUP)
        if len(rest):
            yield False, rest

    def _by_degree(self, D: Array) -> Iterator[tuple[Indices, Ladder]]:
        """Rows of ``D`` (K, N) that have one layout, one number of panels and one choice of degrees."""
        topology = topology_keys(self.robot, D.T)
        for value in np.unique(topology).tolist():
            rows = np.flatnonzero(topology == value)
            layout = Layout(self.robot, D[rows[0]])
            geometry = Geometry(layout, D[rows].T)
            first = geometry.first_degrees(self.tolerance)
            panels = [np.broadcast_to(geometry.panels(m), (len(rows),)) for m in layout.coupled]
            kind = np.concatenate([first, np.array(panels, dtype=np.int64).reshape(-1, len(rows))])
            key = hashed(kind)
            for choice in np.unique(key).tolist():
                inside = np.flatnonzero(key == choice)
                degrees = tuple(first[:, inside[0]].tolist())
                yield rows[inside], self._ladder((value, choice), D[rows[inside[0]]], degrees)

    def _ladder(self, key: tuple[int, int], D: Array, degrees: tuple[int, ...]) -> Ladder:
        ladder = self._ladders.get(key)
        if ladder is None:
            ladder = self._ladders[key] = Ladder(Layout(self.robot, D), degrees)
            if len(self._ladders) > KEPT:
                self._ladders.popitem(last=False)
        return ladder

    def _solve(
        self, rows: Indices, ladder: Ladder, alpha: Array, D: Array, same: bool, chunk: int
    ) -> Iterator[tuple[Indices, Part, Mask]]:
        if same:
            group = self._group(ladder, D[rows[:1]])
            relative = relative_angle(ladder[0], alpha[rows].T)
            if relative is not None:  # neighbours on the path start from the same pilots
                rows = rows[np.argsort(relative, kind="stable")]
                group.prepare(alpha[rows].T)
        elif ladder.layout.coupled:  # neighbours in length need the same number of Gauss points
            rows = rows[np.argsort(Geometry(ladder.layout, D[rows].T).lengths[ladder.layout.first], kind="stable")]
        chunk = min(chunk, 1 + MOST_NUMBERS // (1 + ladder[0].finer_hessian.shape[0]))
        for start in range(0, len(rows), chunk):
            here = rows[start : start + chunk]
            if not same:
                group = self._group(ladder, D[here])
            several = np.broadcast_to(group.start.several, (len(here),))
            for part in group.solve(np.ascontiguousarray(alpha[here].T)):
                yield here[part.rows], part, several[part.rows]

    def _group(self, ladder: Ladder, D: Array) -> Group:
        start = start_of(ladder.layout, D.T)
        return Group(ladder, np.ascontiguousarray(D.T), start, self.tolerance, self.untwisted)
