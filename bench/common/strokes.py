"""Commands as a controller sends them: small steps back and forth, and what is asked of every answer."""

from __future__ import annotations

from collections.abc import Callable
from collections.abc import Iterator
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from bench.common.clock import Stopwatch
from bench.common.clock import Timing
from bench.common.nested_robots import nested
from bench.common.nested_robots import turned
from bench.common.scenes import FIG2
from bench.common.scenes import PARTIAL_FOLD
from bench.common.scenes import PARTIAL_OVERLAP
from bench.common.scenes import SEED
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
    "solve alone": (solve_alone, 30.0),
    "solve and tip pose": (solve_and_tip, 45.0),
    "full answer": (full_answer, 110.0),
}


class Served:
    """A stroke that is being served: the way to its first command is behind it.

    sliding : whether each step moves the bases, too.  unknowns : of the last answer.
    """

    unknowns = 0

    def __init__(self, stroke: Stroke, ask: Ask, sliding: bool = False, tolerance: float = TOLERANCE) -> None:
        self.stroke, self.ask, self.sliding = stroke, ask, sliding
        self.solver, self.watch = EquilibriumSolver(stroke.robot, tolerance), Stopwatch()
        for alpha in stroke.approach():
            self.solver.solve(alpha, stroke.D)

    def step(self, alpha: Array) -> None:
        D = self.stroke.slid(alpha) if self.sliding else self.stroke.D
        answer = self.watch.time(partial(self.ask, self.solver, alpha, D))
        assert isinstance(answer, Equilibrium)
        if answer.status is not Status.OK:
            raise RuntimeError(f"{self.stroke.name} at {np.degrees(alpha)} deg: {answer.message}")
        self.unknowns = answer.degrees_of_freedom


def serve(stroke: Stroke, ask: Ask, many: int = STEPS, sliding: bool = False) -> Timing:
    """The median over ``many`` warm steps."""
    (timing,) = serve_in_turn([Served(stroke, ask, sliding)], many)
    return timing


def serve_in_turn(every: Sequence[Served], many: int) -> list[Timing]:
    """The medians over ``many`` warm steps of each, one step of each after the other: ratios that do not depend on what
    the machine does meanwhile."""
    for steps in zip(*(served.stroke.steps(many) for served in every), strict=True):
        for served, alpha in zip(every, steps, strict=True):
            served.step(alpha)
    return [served.watch.median for served in every]
