"""Random targets from one start: how many are reached, how fast, and whether any way snaps; and, of points out of
reach, how near the closest point found is to that of a dense search.

    scripts/in_env.sh python3 -m bench.inverse.reach            # writes its tables into docs/inverse.md, some minutes
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from bench.common.clock import Stopwatch
from bench.common.document import publish
from bench.common.document import table
from bench.common.places import INVERSE
from bench.inverse.scenes import FLOOR
from bench.inverse.scenes import TOLERANCE
from bench.inverse.scenes import Scene
from bench.inverse.scenes import dense_tips
from bench.inverse.scenes import least_distances
from bench.inverse.scenes import reachable
from bench.inverse.scenes import scenes
from bench.inverse.scenes import unreachable
from ctr_pvs import EquilibriumSolver
from ctr_pvs import InverseResult
from ctr_pvs import Loads
from ctr_pvs import Robot
from ctr_pvs import Status

Array = NDArray[np.float64]

#: On the tip [N], in every second run.
FORCE = (0.0, 0.1, -0.1)
#: Commands of the dense search, without and with a load.
DENSE, DENSE_LOADED = 150_000, 6_000
#: A closest point is as good as that of the dense search if it is no farther than this much more.
AS_GOOD = 1.01


@dataclass(frozen=True, eq=False)
class Run:
    """The searches for some targets: results, times, those of the processor (M,) [s], and how many ways snap, or fall
    below the floor, when a solver that knows nothing of the search goes along them."""

    results: list[InverseResult]
    watch: Stopwatch
    cpu: Array
    bad_ways: int

    @property
    def distances(self) -> Array:
        return np.array([result.distance for result in self.results])


def run(scene: Scene, targets: Array, loads: Loads | None) -> Run:
    """Searches for all targets (M, 3) [m] from the scene's start with one solver."""
    solver, watch = EquilibriumSolver(scene.robot, TOLERANCE), Stopwatch()
    start = EquilibriumSolver(scene.robot, TOLERANCE).solve(*scene.start, loads=loads)
    solver.inverse(np.array([9.0, 0.0, 0.0]), start=start, loads=loads)  # makes the table of starts
    results, cpu = list[InverseResult](), list[float]()

    def search(target: Array) -> None:
        begin = time.process_time()
        results.append(solver.inverse(target, start=start, loads=loads))
        cpu.append(time.process_time() - begin)

    for target in targets:
        watch.time(partial(search, target))
    bad = sum(not keeps(scene.robot, result, loads) for result in results)
    return Run(results, watch, np.array(cpu), bad)


def keeps(robot: Robot, result: InverseResult, loads: Loads | None) -> bool:
    """Whether a fresh solver goes along the way without a snap and above the floor, and comes to the same tip."""
    fresh, answer = EquilibriumSolver(robot, TOLERANCE), None
    for step in result.way:
        answer = fresh.solve(step.alpha, step.D, loads=loads)
        if answer.status is not Status.OK or answer.stability_margin < FLOOR - 1e-6:
            return False
    return answer is None or bool(
        np.linalg.norm(answer.tip.position - result.equilibrium.tip.position) < 10.0 * TOLERANCE
    )


def reached_row(name: str, done: Run) -> list[str]:
    seconds, units = np.array(done.watch.seconds), np.array(done.watch.units)
    reached = sum(result.success and result.distance <= 1e-6 for result in done.results)
    return [
        name,
        f"{reached} of {len(done.results)}",
        *(f"{1e3 * np.quantile(seconds, q):.1f}" for q in (0.5, 0.99)),
        *(f"{1e3 * np.quantile(done.cpu, q):.1f}" for q in (0.5, 0.99)),
        *(f"{np.quantile(units, q):.0f}" for q in (0.5, 0.99)),
        f"{np.median([result.iterations for result in done.results]):.0f}",
        str(done.bad_ways),
    ]


def closest_row(name: str, done: Run, dense: Array) -> list[str]:
    share = done.distances / dense
    return [
        name,
        f"{(share <= AS_GOOD).sum()} of {len(dense)}",
        f"{share.max():.3f}",
        f"{np.median(share):.3f}",
        f"{1e3 * np.median(done.watch.seconds):.0f}",
        str(sum(result.success for result in done.results)),
        str(done.bad_ways),
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--targets", type=int, default=1000)
    parser.add_argument("--out-of-reach", type=int, default=200)
    parser.add_argument("--seed", type=int, default=16)
    parser.add_argument("--print-only", action="store_true", help="leave the document as it is")
    arguments = parser.parse_args()
    document = None if arguments.print_only else INVERSE
    reached, closest = [], []
    for loads in (None, Loads(tip_force=FORCE)):
        for scene in scenes():
            name = scene.name + (", loaded" if loads else "")
            count = arguments.targets if loads is None else max(1, arguments.targets // 5)
            reached.append(reached_row(name, run(scene, reachable(scene, count, arguments.seed, loads), loads)))
            print(reached[-1], flush=True)
            force = np.array(FORCE) if loads else None
            tips = dense_tips(scene, DENSE_LOADED if loads else DENSE, arguments.seed, force)
            targets = unreachable(scene, tips, arguments.out_of_reach, arguments.seed, loads is None)
            dense = least_distances(targets, tips, loads is None)
            closest.append(closest_row(name, run(scene, targets, loads), dense))
            print(closest[-1], flush=True)
    head = ["robot", "within 1 µm", "median ms", "p99 ms", "median CPU ms", "p99 CPU ms", "median u", "p99 u", "steps",
            "bad ways"]  # fmt: skip
    publish("reached", table(head, reached), document)
    head = ["robot", "as near", "worst share", "median share", "median ms", "told as reached", "bad ways"]
    publish("closest", table(head, closest), document)


if __name__ == "__main__":
    main()
