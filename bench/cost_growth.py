"""How the cost grows with the work: tubes, sections, poses, and commands in a batch.

    OPENBLAS_NUM_THREADS=1 python bench/cost_growth.py

Writes docs/cost_growth.csv, .png and .svg.  Solves are warm, 1 deg from the last answer, at a tolerance of 1e-6 m.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy is loaded: all matrices are small

import argparse
import csv
import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from batches import batch_tips
from batches import commands
from clock import Stopwatch
from nested_robots import nested
from nested_robots import segmented
from nested_robots import turned
from numpy.typing import NDArray
from speed_scenes import PARTIAL_OVERLAP
from speed_scenes import SEED

from ctr_pvs import Equilibrium
from ctr_pvs import EquilibriumSolver
from ctr_pvs import Robot

Array = NDArray[np.float64]

DOCS = Path(__file__).resolve().parents[1] / "docs"
TOLERANCE = 1e-6  # m
TUBES, SEGMENTS = tuple(range(2, 9)), (1, 2, 4, 8, 16)
POSES = (2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000)
BATCHES = (1, 10, 100, 1000, 10_000)
#: Warm steps of 1 deg: where they begin [deg], and how many.
BEGIN, STEPS = 40.0, 40
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
        yield from warm_steps("tubes", number, *nested(number), turned(number), steps)


def segments(numbers: tuple[int, ...], steps: int) -> Iterator[Point]:
    for number in numbers:
        robot, D = segmented(number)
        yield from warm_steps("segments a tube", number, robot, D, np.array([0.0, 1.0]), steps)


def poses(numbers: tuple[int, ...], steps: int) -> Iterator[Point]:
    """``backbone(n)`` of answers that have not been asked before."""
    for number in numbers:
        solver, watch = EquilibriumSolver(SEED, TOLERANCE), Stopwatch()
        for step in range(steps):
            answer = solver.solve([0.0, np.radians(BEGIN + step)], PARTIAL_OVERLAP)
            watch.time(partial(answer.backbone, number))
        yield point(BACKBONE, "poses", number, answer.degrees_of_freedom, watch)


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


def line(points: list[Point]) -> tuple[float, float, float]:
    """a, b [u] and R^2 of time = a + b number."""
    numbers, times = np.array([p.number for p in points]), np.array([p.time_u for p in points])
    slope, start = np.polyfit(numbers, times, 1)
    left = times - start - slope * numbers
    return float(start), float(slope), 1.0 - float(left @ left / np.sum((times - times.mean()) ** 2))


def write(points: list[Point], path: Path) -> None:
    with path.open("w", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow([field.name for field in dataclasses.fields(Point)])
        for row in points:
            writer.writerow([f"{v:.4g}" if isinstance(v, float) else v for v in dataclasses.astuple(row)])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--quick", action="store_true", help="few numbers and steps, no figure")
    parser.add_argument("--output", type=Path, default=DOCS, help="folder for the files (default: docs)")
    options = parser.parse_args()
    few = 2 if options.quick else None
    steps = 4 if options.quick else STEPS
    points: list[Point] = []
    for part in (
        tubes(TUBES[:few], steps),
        segments(SEGMENTS[:few], steps),
        poses(POSES[:few], steps),
        batches(BATCHES[:few]),
    ):
        points += part
    options.output.mkdir(parents=True, exist_ok=True)
    write(points, options.output / "cost_growth.csv")
    if not options.quick:
        from growth_chart import draw

        draw(points, options.output / "cost_growth")


if __name__ == "__main__":
    main()
