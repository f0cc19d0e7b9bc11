"""The tracker that judges sweeps: small steps, plain Newton on the whole Hessian in numpy, and nothing else.

Of the solver it shares the elements and their quadrature.  It has no tangent, no certificate, no landing, and a
polynomial degree of its own.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.common.dense import FixedDegree
from bench.common.dense import nearest
from ctr_pvs import Robot
from ctr_pvs.answer.engine import Engine
from ctr_pvs.answer.shape import TorsionShape
from ctr_pvs.answer.state import State
from ctr_pvs.solve.equilibria import stationary
from ctr_pvs.solve.path import CommandPath

Array = NDArray[np.float64]

DEGREE = 10
ANGLE_STEP, SLIDE_STEP = 0.02, 0.5e-3  # rad, m
#: A step may change twist by this much [rad]; where the response is steep the judge goes down to this share of its
#: step.
MOST_TWIST, FINEST = 0.1, 1e-3
#: How far [rad] Newton may go from a state of the solver, which has a lower degree.
ROOM = 0.3


@dataclass(frozen=True, eq=False)
class Place:
    """A state that the judge has reached: unknowns y (n,) of ``energy`` at base angles alpha (N,) [rad]."""

    energy: FixedDegree
    alpha: Array
    y: Array

    def apart(self, other: Place) -> float:
        """Largest difference of twist [rad] to another state at the same command."""
        there = nearest(self.energy, other.energy.shape(other.y, other.alpha), self.alpha)
        return self.energy.twist_size(self.y - there)


class Judge:
    """Follows a path in small steps with plain Newton.

    tolerance [m] : that of the solver whose states are judged.
    """

    def __init__(self, robot: Robot, tolerance: float) -> None:
        self.robot, self.engine = robot, Engine(robot, tolerance)

    def steps(self, path: CommandPath) -> int:
        turn, slide = np.abs(path.alpha_rate).max(), np.abs(path.D_rate).max()
        return 1 + int(max(turn / ANGLE_STEP, slide / SLIDE_STEP))

    def place(self, state: State, degree: int = DEGREE) -> Place | None:
        """A state of the solver, polished; None where that leads away from it."""
        energy = FixedDegree(self.robot, state.D, degree)
        near = nearest(energy, TorsionShape(self.engine, state), state.alpha)
        found, _ = stationary(energy, state.alpha, near, ROOM)
        return None if found is None else Place(energy, state.alpha, found)

    def go(self, path: CommandPath, place: Place, begin: float) -> tuple[Place, float]:
        """The state where the branch from ``place`` at ``begin`` ends, and that fraction of the path (1: its end)."""
        usual = 1.0 / self.steps(path)
        t, step = begin, usual
        while t < 1.0:
            target = min(1.0, t + step)
            ahead = self._step(*path.at(target), place)
            if ahead is not None:
                place, t, step = ahead, target, min(usual, 2.0 * step)
            elif step < usual * FINEST:
                return place, t
            else:
                step *= 0.5
        return place, t

    def _step(self, alpha: Array, D: Array, place: Place) -> Place | None:
        energy, before = place.energy, place.y
        if not np.array_equal(D, energy.D):
            energy = FixedDegree(self.robot, D, DEGREE)
            before = nearest(energy, place.energy.shape(place.y, alpha), alpha)
        found, _ = stationary(energy, alpha, before, MOST_TWIST)
        return None if found is None else Place(energy, alpha, found)

    def apart(self, reached: Place, end: State) -> float:
        """Largest difference of twist [rad] between where the judge is and a state of the solver there."""
        other = self.place(end)
        return float("inf") if other is None else reached.apart(other)

    def margin(self, state: State) -> float:
        """At twice the degree; -1 where that has no equilibrium next to the state."""
        found = self.place(state, 2 * DEGREE)
        return -1.0 if found is None else found.energy.margin(found.y, found.alpha)
