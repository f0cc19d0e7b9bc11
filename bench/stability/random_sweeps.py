"""Random command sweeps through folds, each judged by an independent fine-step tracker.

    scripts/in_env.sh python3 -m bench.stability.random_sweeps [--sweeps 10000] [--first 0] [--commands 1]

A sweep is a random robot of two or three tubes, a cold start at a random command and one long straight path from
there, in one command or cut at random into several; half of the paths slide as well as rotate.  The judge goes the
same way in small steps (0.02 rad, 0.5 mm) with plain Newton at twice the polynomial degree, without tangent,
certificate or landing: where its own branch ends it says so.  Counted are

    right          the judge reached the end, the answer is its state and is not flagged
    flagged snap   the judge's branch ended where the solver reports its first snap; from the last landing on, the judge
                   goes along to the answer
    honest failure the solver gave no answer, and says why
    WRONG BRANCH   an unflagged answer on another branch than the judge's, or a snap that the judge does not see
    UNSTABLE       an answer whose energy Hessian at twice the degree is not positive definite
"""

from __future__ import annotations

import argparse
import time
from collections import Counter

import numpy as np

from bench.common.random_robots import random_D
from bench.common.random_robots import random_robot
from bench.stability.sweep_judge import Judge
from ctr_pvs import Equilibrium
from ctr_pvs import EquilibriumSolver
from ctr_pvs.answer.state import Snap
from ctr_pvs.solve.path import CommandPath
from ctr_pvs.solve.path import State

TOLERANCE = 1e-6  # m, of the solver
#: Twist angles that agree within this [rad] are one state.
SAME = 1e-4


def travel(
    solver: EquilibriumSolver, path: CommandPath, ends: np.ndarray
) -> tuple[Equilibrium, list[tuple[float, Snap]]]:
    """The answer at the end of ``path``, gone in commands that end at the fractions ``ends``, and the snaps with their
    fractions; an answer without success if one was met."""
    snaps, before = [], 0.0
    for end in ends:
        answer = solver.follow(*path.at(float(end)))
        if not answer.success:
            break
        snaps += [(before + snap.t * (end - before), snap) for snap in answer.snaps]
        before = end
    return answer, snaps


def sweep(seed: int, commands: int) -> tuple[str, str]:
    """Verdict on one sweep, and what to print of it."""
    rng = np.random.default_rng([seed, 2024])
    robot = random_robot(rng, 2 + seed % 2)
    n = robot.n_tubes
    solver, judge = EquilibriumSolver(robot, TOLERANCE), Judge(robot, TOLERANCE)
    D, alpha = random_D(rng, robot), rng.uniform(-1, 1, n)
    alpha_end = alpha + rng.uniform(-5, 5, n)
    D_end = random_D(rng, robot) if rng.random() < 0.5 else D
    first = solver.solve(alpha, D)
    if not first.success:
        return "honest failure", f"cold: {first.status.value}: {first.message}"
    start = first.state
    if judge.margin(start) <= 0.0:
        return "UNSTABLE", "cold start"
    path = CommandPath(alpha, D, alpha_end, D_end)
    answer, snaps = travel(solver, path, np.append(np.sort(rng.random(commands - 1)), 1.0))
    if not answer.success:
        return "honest failure", f"{answer.status.value}: {answer.message}"
    end = answer.state
    if judge.margin(end) <= 0.0 or answer.stability_margin <= 0.0:
        return "UNSTABLE", answer.status.value
    return verdict(judge, path, start, end, snaps)


def verdict(
    judge: Judge, path: CommandPath, start: State, end: State, snaps: list[tuple[float, Snap]]
) -> tuple[str, str]:
    """What the judge says to the answer ``end``, with ``snaps`` on the way from ``start``."""
    begin = judge.place(start)
    if begin is None:
        return "WRONG BRANCH", "the start is no equilibrium"
    reached, t = judge.go(path, begin, 0.0)
    if not snaps:
        if t == 1.0 and judge.apart(reached, end) < SAME:
            return "right", ""
        return "WRONG BRANCH", f"judge ended at {t:.4f}, apart {judge.apart(reached, end) if t == 1.0 else np.nan:.3g}"
    (first, _), (last, landing) = snaps[0], snaps[-1]
    small = 3.0 / judge.steps(path)
    if t == 1.0 or abs(t - first) > small:
        return "WRONG BRANCH", f"snap at {first:.4f}, judge ended at {t:.4f}"
    landed = judge.place(landing.after)
    if landed is None:
        return "WRONG BRANCH", f"the landing at {last:.4f} is no equilibrium"
    reached, t = judge.go(path, landed, last)
    if t == 1.0 and judge.apart(reached, end) < SAME and min(s.energy_released for _, s in snaps) > -1e-12:
        return "flagged snap", ""
    return "WRONG BRANCH", f"after the landing at {last:.4f} the judge ended at {t:.4f}"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sweeps", type=int, default=10_000)
    parser.add_argument("--first", type=int, default=0, help="seed of the first sweep")
    parser.add_argument("--commands", type=int, default=1, help="commands that each path is cut into")
    arguments = parser.parse_args()
    verdicts: Counter[str] = Counter()
    began = time.perf_counter()
    for seed in range(arguments.first, arguments.first + arguments.sweeps):
        found, remark = sweep(seed, arguments.commands)
        verdicts[found] += 1
        if remark:
            print(f"sweep {seed}: {found}: {remark}", flush=True)
    print(dict(verdicts), f"{time.perf_counter() - began:.0f} s")
    return int(verdicts["WRONG BRANCH"] + verdicts["UNSTABLE"] > 0)


if __name__ == "__main__":
    raise SystemExit(main())
