"""Rows of one layout and one choice of first degrees, solved together: the answers of cold starts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.batch_backbone import tips
from ctr_pvs.batch_layout import Geometry
from ctr_pvs.batch_layout import Layout
from ctr_pvs.batch_pilots import Pilots
from ctr_pvs.batch_pilots import pilots
from ctr_pvs.batch_pilots import relative_angle
from ctr_pvs.batch_relaxed import Start
from ctr_pvs.batch_tables import Tables
from ctr_pvs.batch_values import Values
from ctr_pvs.batch_walk import Found
from ctr_pvs.batch_walk import Problem
from ctr_pvs.batch_walk import check
from ctr_pvs.batch_walk import converge
from ctr_pvs.batch_walk import follow
from ctr_pvs.convexity import REACH
from ctr_pvs.fidelity import RAISES
from ctr_pvs.fidelity import raised_degrees
from ctr_pvs.refine import INTEGRATION_SHARE

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Indices = NDArray[np.int64]


class Ladder:
    """The tables of one layout for rising degrees, made when first asked for."""

    def __init__(self, layout: Layout, first: tuple[int, ...]) -> None:
        self.layout, self._first = layout, first
        self._tables: list[Tables] = []

    def __getitem__(self, index: int) -> Tables:
        while len(self._tables) <= index:
            self._tables.append(Tables(self.layout, raised_degrees(self._first, RAISES[len(self._tables)])))
        return self._tables[index]


@dataclass(eq=False)
class Part:
    """Answers with one table: ``rows`` (k,) of the group, unknowns u (n, k), whether twist counts, and the outputs:
    torque (N, k), position (3, k), orientation (4, k), residual and iterations (k,)."""

    tables: Tables
    rows: Indices
    u: Array
    twists: bool
    torque: Array
    position: Array
    orientation: Array
    residual: Array
    iterations: Indices


class Group:
    """Base positions ``D`` (N, K) of one ladder, one for all rows or one for each; ``tolerance`` [m].

    untwisted : whether twist may be neglected where it is too small.
    """

    def __init__(self, ladder: Ladder, D: Array, start: Start, tolerance: float, untwisted: bool) -> None:
        self.ladder, self.geometry, self.start = ladder, Geometry(ladder.layout, D), start
        self.tolerance, self.goal, self.untwisted = tolerance, tolerance, untwisted
        self._values: dict[int, Values] = {}
        self._relaxed = start.unknowns(ladder[0], D)
        self._first_twist: list[tuple[int, int, Array]] | None = None
        self._pilots: Pilots | None = None

    def prepare(self, alpha: Array) -> None:
        """What pays for all of ``alpha`` (N, rows) together, before they are solved in chunks."""
        tables = self.ladder[0]
        relative = relative_angle(tables, alpha)
        if relative is not None and self.geometry.D.shape[1] == 1:
            self._pilots = pilots(tables, self._at(0), self.start.alpha, self._relaxed, relative)

    def solve(self, alpha: Array) -> list[Part]:
        """Answers to base angles ``alpha`` (N, rows); rows that are in none of them are for others to solve."""
        index, rows = 0, np.arange(alpha.shape[1])
        problem = Problem(self.ladder[0], self._at(0), alpha)
        found = self._reached(problem)
        parts: list[Part] = []
        waiting = found.good & self.start.found
        if self.untwisted:
            parts, flat = self._untwisted(problem, found, waiting)
            waiting &= ~flat
        while True:
            done = waiting & (found.bound <= self.goal)
            if done.any():
                parts.append(self._part(problem, rows, found, done, True))
            onward = np.flatnonzero(waiting & ~done)
            index += 1
            if not len(onward) or index == len(RAISES):
                return parts
            rows = rows[onward]
            problem, found = self._raised(index, alpha[:, rows], rows, found, onward)
            waiting = found.good

    def _at(self, index: int) -> Values:
        if index not in self._values:
            self._values[index] = Values(self.ladder[index], self.geometry, self.tolerance)
        return self._values[index]

    def _raised(self, index: int, alpha: Array, rows: Indices, before: Found, which: Indices) -> tuple[Problem, Found]:
        """The next rung for the rows ``which`` of ``before``."""
        tables = self.ladder[index]
        problem = Problem(tables, self._at(index).take(rows), alpha)
        place = tables.embedding(self.ladder[index - 1])
        u = np.where(place[:, None] >= 0, before.u[:, which][place], 0.0)
        found = converge(problem, u)
        found.iterations += before.iterations[which]
        return problem, found

    def _reached(self, problem: Problem) -> Found:
        """The equilibria at the end of every row's path."""
        if not problem.tables.n:
            return converge(problem, np.zeros((0, problem.rows)))
        if self._pilots is None:
            return self._walked(problem)
        relative = relative_angle(problem.tables, problem.alpha)
        assert relative is not None
        index, u = self._pilots.guess(relative)
        found = converge(problem, u)
        found.good &= self._pilots.holds(index, found.theta)
        lost = np.flatnonzero(~found.good & self._pilots.hopeful(index))
        if len(lost):
            found.put(lost, self._walked(problem.take(lost)))
        return found

    def _walked(self, problem: Problem) -> Found:
        relaxed = self.start.alpha
        reached, u = follow(problem, relaxed + (problem.alpha[0] - relaxed[0]), self._relaxed)
        found = converge(problem, u)
        found.good &= reached
        return found

    def _untwisted(self, problem: Problem, found: Found, waiting: Mask) -> tuple[list[Part], Mask]:
        """Answers where twist may be neglected, and which rows (rows,) these are."""
        flat = np.zeros(problem.rows, dtype=bool)
        rows = np.flatnonzero(waiting & self._may_be_untwisted(problem))
        if len(rows):
            here = problem.take(rows)
            none = np.zeros((problem.tables.n, len(rows)))
            moved = np.abs(here.angles(none, here.alpha) - found.theta[:, rows]).max(axis=0, initial=0.0)
            reach = here.values.slack + REACH * moved
            count = np.zeros(len(rows), dtype=np.int64)
            certain = check(here, none, np.ones(len(rows), dtype=bool), count, reach, settled=False)
            enough = certain.good & (certain.bound <= self.goal)
            flat[rows] = enough
            if enough.any():
                return [self._part(here, rows, certain, enough, False)], flat
        return [], flat

    def _may_be_untwisted(self, problem: Problem) -> Mask:
        """``ServingModel.may_be_untwisted`` of each row."""
        least = problem.values.least_first_twist()
        if least is None or self.geometry.D.shape[1] == 1:
            if self._first_twist is None:
                self._first_twist = problem.values.first_twist()
            return self._little(problem, self._first_twist)
        # The full sum takes long: only where its least value leaves it open.
        may = self._little(problem, [least])
        rows = np.flatnonzero(may)
        if len(rows):
            here = problem.take(rows)
            may[rows] = self._little(here, here.values.first_twist())
        return may

    def _little(self, problem: Problem, twist: list[tuple[int, int, Array]]) -> Mask:
        pull = np.zeros(problem.rows)
        for first, second, strength in twist:
            angle = problem.alpha[second] - problem.alpha[first]
            pull += np.abs(strength) * np.sin(angle + np.angle(strength))
        return np.abs(pull) <= self.goal

    def _part(self, problem: Problem, rows: Indices, found: Found, which: Mask, twists: bool) -> Part:
        """Outputs of the rows ``which`` of ``problem``."""
        u, sin, alpha, values = found.u, found.sin, problem.alpha, problem.values
        residual, iterations = found.residual, found.iterations
        if not which.all():
            index = np.flatnonzero(which)
            rows, u, sin, alpha, values = rows[index], u[:, index], sin[:, index], alpha[:, index], values.take(index)
            residual, iterations = residual[index], iterations[index]
        torque = problem.tables.turns.T @ (values.amplitude * sin)
        position, orientation = tips(values, u, alpha, INTEGRATION_SHARE * self.tolerance)
        return Part(problem.tables, rows, u, twists, torque, position, orientation, residual, iterations)
