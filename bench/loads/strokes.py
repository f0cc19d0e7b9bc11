"""Loaded commands as a controller sends them: steps of one degree back and forth, and what is asked of every answer."""

from __future__ import annotations

from collections.abc import Callable
from collections.abc import Iterator
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from bench.common.clock import Stopwatch
from bench.common.nested_robots import nested
from bench.common.nested_robots import turned
from bench.common.places import CONFIG
from bench.common.scenes import FULL_OVERLAP
from bench.common.scenes import PARTIAL_OVERLAP
from bench.common.scenes import SEED
from bench.common.strokes import POSES
from bench.common.strokes import SLIDE
from ctr_pvs import Equilibrium
from ctr_pvs import EquilibriumSolver
from ctr_pvs import Loads
from ctr_pvs import Robot
from ctr_pvs import Status
from ctr_pvs import load_robot

Array = NDArray[np.float64]

#: Half a newton across the tip; on the seed's robot away from its folds, the first of which is at 219.3 deg.
FORCE = Loads((0.0, 0.5, 0.0))
STEP = 1.0  # deg
#: Tolerance [m] of the judge that tips are compared with.
EXACT = 1e-10


@dataclass(frozen=True, eq=False)
class Stroke:
    """Commands alpha = ``direction`` * angle at one D, the angle going from ``low`` to ``high`` [deg] and back."""

    name: str
    robot: Robot
    D: Array
    direction: Array
    low: float
    high: float
    loads: Loads | None = FORCE
    sliding: bool = False

    def commands(self, many: int) -> Iterator[tuple[Array, Array]]:
        """``many`` commands (alpha, D), each ``STEP`` from the one before, the first at ``low``; where bases slide,
        inner tubes come out by ``SLIDE`` more with each step, and go back with the way back."""
        turns = round((self.high - self.low) / STEP)
        slide = SLIDE * np.linspace(0.0, 1.0, len(self.D))
        for index in range(many):
            lap = index % (2 * turns)
            count = min(lap, 2 * turns - lap)
            yield np.radians(self.low + STEP * count) * self.direction, self.D - self.sliding * count * slide


def strokes() -> dict[str, Stroke]:
    """None of them crosses a fold."""
    second, families = np.array([0.0, 1.0]), {n: nested(n) for n in (2, 3)}
    three = load_robot(CONFIG / "three_tubes.yaml")
    every = [
        Stroke("Fig. 4, partial overlap", SEED, PARTIAL_OVERLAP, second, 0.0, 200.0),
        Stroke("Fig. 4, full overlap", SEED, FULL_OVERLAP, second, 0.0, 200.0),
        Stroke("two nested tubes", *families[2], turned(2), 0.0, 160.0),
        Stroke("three nested tubes", *families[3], turned(3), 0.0, 160.0),
        Stroke("three_tubes.yaml", three, np.array([0.06, 0.13, 0.2]), turned(3), 0.0, 160.0),
    ]
    return {stroke.name: stroke for stroke in every}


def tip_and_estimate(answer: Equilibrium) -> None:
    """The least that is asked: where the tip is, and how well that is known."""
    _ = answer.tip, answer.error_estimate


def everything(answer: Equilibrium) -> None:
    """Tip, 60 poses, torques, forces, Jacobian, compliance and margin."""
    _ = answer.tip, answer.backbone(POSES), answer.torque, answer.force
    _ = answer.jacobian, answer.compliance, answer.stability_margin


Ask = Callable[[Equilibrium], object]


class Served:
    """A stroke that is being served to a tolerance [m]; errors [m] are told where ``truth`` follows the same commands.

    unknowns : of the last answer.
    """

    def __init__(self, stroke: Stroke, tolerance: float, ask: Ask = tip_and_estimate) -> None:
        self.stroke, self.ask, self.tolerance = stroke, ask, tolerance
        self.solver, self.watch = EquilibriumSolver(stroke.robot, tolerance), Stopwatch()
        self.errors: list[float] = []
        self.estimates: list[float] = []
        self.unknowns = 0

    def answered(self, alpha: Array, D: Array) -> Equilibrium:
        """What is timed."""
        answer = self.solver.solve(alpha, D, loads=self.stroke.loads)
        self.ask(answer)
        return answer

    def step(self, alpha: Array, D: Array, tip: Array | None, counts: bool) -> None:
        """One command; the first of a stroke, to which the way is long, does not count."""
        task = partial(self.answered, alpha, D)
        answer = self.watch.time(task) if counts else task()
        assert isinstance(answer, Equilibrium)
        if answer.status is not Status.OK:
            raise RuntimeError(f"{self.stroke.name} at {np.degrees(alpha)} deg: {answer.message}")
        self.unknowns = answer.degrees_of_freedom
        if tip is not None:
            self.errors.append(float(np.linalg.norm(answer.tip.position - tip)))
            self.estimates.append(answer.error_estimate)


def serve_in_turn(every: Sequence[Served], many: int, judged: bool = False) -> None:
    """``many`` steps of each, one of each after the other: ratios do not depend on what the machine does meanwhile.

    judged : whether tips are compared with those of the first one's stroke at ``EXACT``.
    """
    first = every[0].stroke
    judge = Served(first, EXACT) if judged else None
    commands = (served.stroke.commands(many + 1) for served in every)
    for index, (here, steps) in enumerate(zip(first.commands(many + 1), zip(*commands, strict=True), strict=True)):
        tip = None if judge is None else judge.answered(*here).tip.position
        for served, step in zip(every, steps, strict=True):
            served.step(*step, tip, index > 0)
