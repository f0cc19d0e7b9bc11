"""Robots and commands that cost more than others: the table of docs/speed_accuracy.md that says how much.

    scripts/in_env.sh python3 -m bench.serving.hard_cases

The whole workspace of three tubes in a batch, two tubes of many segments, and strong coupling.
"""

from __future__ import annotations

import argparse
from functools import partial

import numpy as np

from bench.common.clock import Stopwatch
from bench.common.clock import Timing
from bench.common.document import publish
from bench.common.document import table
from bench.common.nested_robots import segmented
from bench.common.places import SPEED
from bench.common.strokes import STEP
from bench.common.strokes import TOLERANCE
from bench.common.strokes import solve_and_tip
from bench.serving.many import WORKSPACE
from bench.serving.many import workspace_table
from bench.stability.robots_that_snap import pair
from ctr_pvs import Equilibrium
from ctr_pvs import EquilibriumSolver
from ctr_pvs.oracles.two_tubes import TwoTubes

#: Segments of each of two tubes: the most [ms] of a cold and of a warm answer with its tip.
SEGMENTS = {80: (20.0, 0.3), 400: (100.0, 1.5)}
#: Cold starts and warm steps.
COLD, WARM = 5, 200
#: Where the tubes of many segments are turned to [deg].
BEGIN = 40.0
#: Coupling and guide of a strong pair, how far it is turned [rad], the most [s] it should take, and its snaps.
LAMBDA, GUIDE, TURNED, SECONDS, SNAPS = 100.0, 0.1, 2.2 * np.pi, 1.0, 1


def many_segments(number: int, cold: int, warm: int) -> tuple[Timing, Timing]:
    """Cold starts and warm steps of 0.1 deg, each with its tip."""
    robot, D = segmented(number)
    direction = np.array([0.0, 1.0])
    solver = EquilibriumSolver(robot, TOLERANCE)
    from_scratch, in_steps = Stopwatch(), Stopwatch()
    for _ in range(cold):
        solver.reset()
        _good(from_scratch.time(partial(solve_and_tip, solver, np.radians(BEGIN) * direction, D)))
    for step in range(1, warm + 1):
        _good(in_steps.time(partial(solve_and_tip, solver, np.radians(BEGIN + step * STEP) * direction, D)))
    return from_scratch.median, in_steps.median


def _good(answer: object) -> None:
    assert isinstance(answer, Equilibrium)
    if not answer.success or answer.snaps:
        raise RuntimeError(answer.message)


def segments_table(numbers: tuple[int, ...], cold: int, warm: int) -> str:
    """Cold and warm, and for each segment: where the cost is linear that stays the same."""
    rows = []
    for number in numbers:
        aims = SEGMENTS.get(number, (None, None))
        cells = []
        for timing, aim in zip(many_segments(number, cold, warm), aims, strict=True):
            each = f"{timing.units / number:.1f} u a segment"
            cells += [f"{1e3 * timing.seconds:.3g} ms, {each}", "" if aim is None else f"{aim} ms"]
        rows.append([str(number), *cells])
    return table(["curved segments in each of two tubes", "cold", "target", "warm, 0.1°", "target"], rows)


def strong_table(lam: float) -> str:
    """A pair turned by a little more than one turn, cold, through its snap."""
    robot, D = pair(lam, GUIDE)
    watch = Stopwatch()
    answer = watch.time(lambda: EquilibriumSolver(robot, TOLERANCE).solve([0.0, TURNED], D, "cold"))
    assert isinstance(answer, Equilibrium)
    exact = TwoTubes(lam, GUIDE).snap
    place = f"{answer.snaps[0].alpha[1]:.6f} rad" if answer.snaps else "none"
    closed = "none" if exact is None else f"{exact.alpha:.6f} rad"
    row = [f"{lam:g}", f"{watch.median.seconds:.3g} s", f"{SECONDS:g} s", str(len(answer.snaps)), str(SNAPS), place]
    head = ["λ, cold through the snap", "time", "target", "snaps", "should be", "snap at", "closed form"]
    return table(head, [[*row, closed]])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--quick", action="store_true", help="small robots, few rows, printed only")
    options = parser.parse_args()
    document = None if options.quick else SPEED
    rows, numbers = (4, (2, 4)) if options.quick else (WORKSPACE, tuple(SEGMENTS))
    cold, warm = (1, 2) if options.quick else (COLD, WARM)
    publish("workspace", workspace_table(rows), document)
    publish("many segments", segments_table(numbers, cold, warm), document)
    if not options.quick:
        publish("strong coupling", strong_table(LAMBDA), document)


if __name__ == "__main__":
    main()
