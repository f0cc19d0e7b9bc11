"""What the cost grows with: tubes, segments, poses, and commands in a batch; and what it grows like."""

from __future__ import annotations

import csv
import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bench.common.batches import batch_tips
from bench.common.batches import commands
from bench.common.clock import Stopwatch
from bench.common.document import table
from bench.common.nested_robots import nested
from bench.common.nested_robots import segmented
from bench.common.nested_robots import turned
from bench.common.scenes import PARTIAL_OVERLAP
from bench.common.scenes import SEED
from ctr_pvs import Equilibrium
from ctr_pvs import EquilibriumSolver
from ctr_pvs import Robot

Array = NDArray[np.float64]

TOLERANCE = 1e-6  # m
TUBES, SEGMENTS = (2, 3, 4, 5, 6, 8, 10, 12, 16, 20), (1, 2, 4, 8, 16, 32, 64)
POSES = (2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000)
BATCHES = (1, 10, 100, 1000, 10_000)
#: Warm steps of 1 deg: where they begin [deg], and how many.
BEGIN, STEPS = 40.0, 40
#: Fewer tubes do not count where the exponent is fitted: what does not grow weighs most with them.
FIRST_FITTED = 4
#: The largest exponent of tubes, and the smallest R^2 of sections, that there should be.
EXPONENT_AIM, R2_AIM = 3.5, 0.99
#: What grows.
TUBE_NUMBER, SEGMENT_NUMBER, POSE_NUMBER = "tubes", "segments a tube", "poses"
SOLVE, TIP, BACKBONE, BATCH = "solve", "solve and tip", "poses of one answer", "tip of a command in a batch"


@dataclass(frozen=True)
class Point:
    """One measured cost: of what, as which number grows, and the number of unknowns; of a batch, per command."""

    what: str
    grows: str
    number: int
    unknowns: int
    time_us: float
    time_u: float


def point(what: str, grows: str, number: int, unknowns: int, watch: Stopwatch, share: int = 1) -> Point:
    """The median of ``watch``, divided among ``share`` commands."""
    median = watch.median
    return Point(what, grows, number, unknowns, median.microseconds / share, median.units / share)


def warm_steps(grows: str, number: int, robot: Robot, D: Array, direction: Array, steps: int) -> Iterator[Point]:
    """Solve alone, and with the tip."""
    solver = EquilibriumSolver(robot, TOLERANCE)
    alone, with_tip = Stopwatch(), Stopwatch()
    for degrees in (0.5 * BEGIN, BEGIN):
        answer = solver.solve(np.radians(degrees) * direction, D)
    for step in range(steps):
        alpha = np.radians(BEGIN + 1.0 + step) * direction
        answer = (alone if step % 2 else with_tip).time(partial(_answer, solver, alpha, D, step % 2 == 0))
        _check(answer)
    for what, watch in ((SOLVE, alone), (TIP, with_tip)):
        yield point(what, grows, number, answer.degrees_of_freedom, watch)


def _answer(solver: EquilibriumSolver, alpha: Array, D: Array, tip: bool) -> Equilibrium:
    answer = solver.solve(alpha, D)
    if tip:
        _ = answer.tip
    return answer


def _check(answer: object) -> None:
    assert isinstance(answer, Equilibrium)
    if not answer.success or answer.snaps:
        raise RuntimeError(answer.message)


def tubes(numbers: tuple[int, ...], steps: int) -> Iterator[Point]:
    for number in numbers:
        yield from warm_steps(TUBE_NUMBER, number, *nested(number), turned(number), steps)


def segments(numbers: tuple[int, ...], steps: int) -> Iterator[Point]:
    for number in numbers:
        robot, D = segmented(number)
        yield from warm_steps(SEGMENT_NUMBER, number, robot, D, np.array([0.0, 1.0]), steps)


def poses(numbers: tuple[int, ...], steps: int) -> Iterator[Point]:
    """``backbone(n)`` of answers that have not been asked before."""
    for number in numbers:
        solver, watch = EquilibriumSolver(SEED, TOLERANCE), Stopwatch()
        for step in range(steps):
            answer = solver.solve([0.0, np.radians(BEGIN + step)], PARTIAL_OVERLAP)
            watch.time(partial(answer.backbone, number))
        yield point(BACKBONE, POSE_NUMBER, number, answer.degrees_of_freedom, watch)


def batches(sizes: tuple[int, ...]) -> Iterator[Point]:
    """Cold commands of Fig. 4's robot: all at one D, and each at its own."""
    for name, slide in (("commands at one D", 0.0), ("commands at any D", 0.02)):
        for size in sizes:
            alpha, D = commands(size, np.array([0.0, 1.0]), np.radians(150.0), PARTIAL_OVERLAP, slide)
            solver, watch = EquilibriumSolver(SEED, TOLERANCE), Stopwatch()
            for _ in range(1 if size >= 1000 else 5):
                _, failed = watch.time(partial(batch_tips, solver, alpha, D))  # type: ignore[misc]
                if failed:
                    raise RuntimeError(f"{failed} of {size} commands have failed")
            yield point(BATCH, name, size, 0, watch, size)


def power(points: list[Point]) -> float:
    """Exponent p of time ~ number^p, by least squares in logarithms."""
    numbers, times = np.log([p.number for p in points]), np.log([p.time_u for p in points])
    return float(np.polyfit(numbers, times, 1)[0])


def fitted(points: list[Point]) -> list[Point]:
    """Those that the exponent is fitted to; all, where there are only few."""
    chosen = [point for point in points if point.number >= FIRST_FITTED]
    return chosen if len(chosen) > 1 else points


def line(points: list[Point]) -> tuple[float, float, float]:
    """a, b [u] and R^2 of time = a + b number."""
    numbers, times = np.array([p.number for p in points]), np.array([p.time_u for p in points])
    slope, start = np.polyfit(numbers, times, 1)
    left = times - start - slope * numbers
    return float(start), float(slope), 1.0 - float(left @ left / np.sum((times - times.mean()) ** 2))


def fits_table(points: list[Point]) -> str:
    """What everything grows like, and how that should be."""
    rows = []
    for grows in (TUBE_NUMBER, SEGMENT_NUMBER, POSE_NUMBER):
        for what in dict.fromkeys(point.what for point in points if point.grows == grows):
            chosen = [point for point in points if (point.grows, point.what) == (grows, what)]
            numbers = f"{chosen[0].number} to {chosen[-1].number}"
            if grows == TUBE_NUMBER:
                few = fitted(chosen)
                told = f"tubes^{power(few):.2f} from {few[0].number} on", f"exponent ≤ {EXPONENT_AIM}"
            else:
                start, slope, r2 = line(chosen)
                aim = f"R² > {R2_AIM}" if grows == SEGMENT_NUMBER else ""
                told = f"{start:,.0f} u + {slope:,.2f} u each, R² = {r2:.4f}", aim
            rows.append([what, f"{grows}, {numbers}", *told])
    return table(["warm, to 1e-6 m", "as this grows", "fit", "aim"], rows)


def write(points: list[Point], path: Path) -> None:
    with path.open("w", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow([field.name for field in dataclasses.fields(Point)])
        for row in points:
            writer.writerow([f"{v:.4g}" if isinstance(v, float) else v for v in dataclasses.astuple(row)])
