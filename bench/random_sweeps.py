"""Random command sweeps through folds, each judged by an independent fine-step tracker.

    scripts/in_env.sh python3 bench/random_sweeps.py [--sweeps 10000] [--first 0] [--commands 1]

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

from ctr_pvs import Equilibrium
from ctr_pvs import EquilibriumSolver
from ctr_pvs import Robot
from ctr_pvs import Segment
from ctr_pvs import Tube
from ctr_pvs.continuation import CommandPath
from ctr_pvs.continuation import State
from ctr_pvs.models import Models
from ctr_pvs.snap import Snap
from ctr_pvs.solve import newton
from ctr_pvs.stability import stability_margin

DEGREE = 10
ANGLE_STEP, SLIDE_STEP = 0.02, 0.5e-3  # rad, m
#: A step may change twist by this much [rad]; where the response is steep the judge goes down to this share of its
#: step.
MOST_TWIST, FINEST = 0.1, 1e-3
#: Twist angles that agree within this [rad] are one state.
SAME = 1e-4


def random_robot(rng: np.random.Generator, tubes: int) -> Robot:
    """Straight and curved segments; from weak to strong coupling, in one plane or not."""
    length, curvature = rng.uniform(0.06, 0.16), rng.uniform(4, 22)
    planar = rng.random() < 0.5
    parts = []
    for index in range(tubes):
        K = 0.04 * rng.uniform(0.3, 1.0)
        G = K / rng.uniform(1.0, 1.6)
        kappa = curvature * rng.uniform(0.5, 1.2) * (1.0 if planar else np.exp(1j * rng.uniform(-1, 1)))
        slope = 0.0 if rng.random() < 0.5 else kappa * rng.uniform(-4, 4)
        bent = Segment(length * rng.uniform(0.7, 1.2), K, G, (kappa, slope))
        parts.append(Tube(f"t{index}", (Segment(0.03 + 0.03 * index, K, G), bent)))
    return Robot("random", tuple(parts))


def random_D(rng: np.random.Generator, robot: Robot) -> np.ndarray:
    D = [rng.uniform(0.1, 0.6) * tube.length for tube in robot.tubes]
    return np.minimum.accumulate(np.maximum.accumulate(D)[::-1])[::-1]


class Judge:
    """Follows a path in small steps with plain Newton."""

    def __init__(self, robot: Robot) -> None:
        self.models = Models(robot)

    def steps(self, path: CommandPath) -> int:
        turn, slide = np.abs(path.alpha_rate).max(), np.abs(path.D_rate).max()
        return 1 + int(max(turn / ANGLE_STEP, slide / SLIDE_STEP))

    def go(self, path: CommandPath, state: State, begin: float) -> tuple[State, float]:
        """The state where the branch from ``state`` at ``begin`` ends, and that fraction of the path (1: its end)."""
        usual = 1.0 / self.steps(path)
        t, step = begin, usual
        while t < 1.0:
            target = min(1.0, t + step)
            ahead = self._step(*path.at(target), state)
            if ahead is not None:
                state, t, step = ahead, target, min(usual, 2.0 * step)
            elif step < usual * FINEST:
                return state, t
            else:
                step *= 0.5
        return state, t

    def _step(self, alpha: np.ndarray, D: np.ndarray, state: State) -> State | None:
        energy = self.models.energy(D, DEGREE)
        before = energy.space.coordinates(state.torques)
        result = newton(energy, alpha, before)
        if not result.converged or np.abs(energy.angle_map @ (result.q - before)).max(initial=0.0) > MOST_TWIST:
            return None
        return State(alpha, D, energy.space.field(result.q))

    def apart(self, a: State, b: State) -> float:
        """Largest difference of twist [rad] between two states of one command."""
        energy = self.models.energy(a.D, DEGREE)
        difference = energy.space.coordinates(a.torques) - energy.space.coordinates(b.torques)
        return float(np.abs(energy.angle_map @ difference).max(initial=0.0))

    def margin(self, state: State) -> float:
        energy = self.models.energy(state.D, 2 * DEGREE)
        result = newton(energy, state.alpha, energy.space.coordinates(state.torques))
        return stability_margin(energy, result.q, state.alpha) if result.converged else -1.0


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
    solver, judge = EquilibriumSolver(robot, tolerance=1e-6), Judge(robot)
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
    reached, t = judge.go(path, start, 0.0)
    if not snaps:
        if t == 1.0 and judge.apart(reached, end) < SAME:
            return "right", ""
        return "WRONG BRANCH", f"judge ended at {t:.4f}, apart {judge.apart(reached, end) if t == 1.0 else np.nan:.3g}"
    (first, _), (last, landing) = snaps[0], snaps[-1]
    small = 3.0 / judge.steps(path)
    if t == 1.0 or abs(t - first) > small:
        return "WRONG BRANCH", f"snap at {first:.4f}, judge ended at {t:.4f}"
    reached, t = judge.go(path, landing.after, last)
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
