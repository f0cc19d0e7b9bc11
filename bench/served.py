"""Commands as a controller sends them: small steps back and forth, and what is asked of every answer."""

from __future__ import annotations

from collections.abc import Callable
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np
from clock import Stopwatch
from clock import Timing
from nested_robots import nested
from nested_robots import turned
from numpy.typing import NDArray
from speed_scenes import FIG2
from speed_scenes import PARTIAL_FOLD
from speed_scenes import PARTIAL_OVERLAP
from speed_scenes import SEED

from ctr_pvs import Equilibrium
from ctr_pvs import EquilibriumSolver
from ctr_pvs import Robot
from ctr_pvs import Status

Array = NDArray[np.float64]

TOLERANCE = 1e-6  # m
STEP = 0.1  # deg
#: Steps of 0.1 deg over which the median is taken, and the longest step [deg] of the way to the first of them.
STEPS, APPROACH = 2000, 5.0
#: How much farther the innermost tube is out after each step where bases move, too [m].
SLIDE = 1e-5
POSES = 60


@dataclass(frozen=True, eq=False)
class Stroke:
    """Commands alpha = ``direction`` * angle at one D, the angle going from ``low`` to ``high`` [deg] and back."""

    name: str
    robot: Robot
    D: Array
    direction: Array
    low: float
    high: float

    def approach(self) -> Iterator[Array]:
        """From no rotation to ``low``."""
        yield from (np.radians(x) * self.direction for x in np.arange(0.0, self.low, APPROACH))
        yield np.radians(self.low) * self.direction

    def steps(self, many: int) -> Iterator[Array]:
        """``many`` commands, each ``STEP`` from the one before."""
        turns = round((self.high - self.low) / STEP)
        for index in range(1, many + 1):
            lap = index % (2 * turns)
            yield np.radians(self.low + STEP * min(lap, 2 * turns - lap)) * self.direction

    def slid(self, alpha: Array) -> Array:
        """Base positions (N,) [m] at ``alpha`` where bases move with the angle: inner tubes farther than outer ones."""
        angle = np.degrees(alpha.dot(self.direction) / self.direction.dot(self.direction))
        return self.D - (angle - self.low) / STEP * SLIDE * np.linspace(0.0, 1.0, len(alpha))


def strokes() -> list[Stroke]:
    """None of them crosses a fold."""
    second, (three, D) = np.array([0.0, 1.0]), nested(3)
    last = PARTIAL_FOLD - 0.02
    return [
        Stroke("Fig. 4, partial overlap", SEED, PARTIAL_OVERLAP, second, 0.0, 200.0),
        Stroke("Fig. 2, lambda = 3.6", FIG2, np.zeros(2), second, 0.0, 190.0),
        Stroke("just before a fold", SEED, PARTIAL_OVERLAP, second, last - 5.0, last),
        Stroke("three tubes", three, D, turned(3), 0.0, 160.0),
    ]


def solve_alone(solver: EquilibriumSolver, alpha: Array, D: Array) -> Equilibrium:
    return solver.solve(alpha, D)


def solve_and_tip(solver: EquilibriumSolver, alpha: Array, D: Array) -> Equilibrium:
    answer = solver.solve(alpha, D)
    _ = answer.tip
    return answer


def full_answer(solver: EquilibriumSolver, alpha: Array, D: Array) -> Equilibrium:
    """What a node publishes: tip, backbone, torques, forces, margin."""
    answer = solver.solve(alpha, D)
    _ = answer.tip, answer.backbone(POSES), answer.torque, answer.force, answer.stability_margin
    return answer


Ask = Callable[[EquilibriumSolver, Array, Array], Equilibrium]
#: What is asked, and the most u that it should take.
ASKED: dict[str, tuple[Ask, float]] = {
    "solve alone": (solve_alone, 40.0),
    "solve and tip pose": (solve_and_tip, 100.0),
    "full answer": (full_answer, 200.0),
}


def serve(stroke: Stroke, ask: Ask, many: int = STEPS, sliding: bool = False) -> Timing:
    """The median over ``many`` warm steps; sliding : whether each moves the bases, too."""
    solver = EquilibriumSolver(stroke.robot, TOLERANCE)
    for alpha in stroke.approach():
        solver.solve(alpha, stroke.D)
    watch = Stopwatch()
    for alpha in stroke.steps(many):
        answer = watch.time(partial(ask, solver, alpha, stroke.slid(alpha) if sliding else stroke.D))
        assert isinstance(answer, Equilibrium)
        if answer.status is not Status.OK:
            raise RuntimeError(f"{stroke.name} at {np.degrees(alpha)} deg: {answer.message}")
    return watch.median
