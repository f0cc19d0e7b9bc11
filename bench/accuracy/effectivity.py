"""Is the error estimate of ``fidelity="auto"`` true?  Random scenes, judged by a much finer model.

    scripts/in_env.sh python3 -m bench.accuracy.effectivity [--scenes 2000] [--first 0]

A scene is a random robot of two to four tubes (straight, polynomial and helical pre-curvatures, weak to strong
coupling), a random command, cold, and a random tolerance between 1e-2 and 1e-9 m.  The judge takes the answer's twist
to twelve polynomial degrees more and polishes it by plain Newton on the whole Hessian, in numpy.  Scenes where that is
not the branch of the answer (a fold between the two models) count as wrong.  The solver itself, at its tightest
tolerance and from the same state, must come to the judge's tip.
"""

from __future__ import annotations

import argparse
from collections import Counter
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.common.dense import TIGHT
from bench.common.dense import judge_degree
from bench.common.dense import nearest
from bench.common.document import publish
from bench.common.document import table
from bench.common.places import SPEED
from bench.common.random_robots import helical_robot
from bench.common.random_robots import random_robot
from ctr_pvs import Equilibrium
from ctr_pvs import EquilibriumSolver
from ctr_pvs import Robot
from ctr_pvs.answer.degrees import settled
from ctr_pvs.answer.engine import Engine
from ctr_pvs.answer.state import State
from ctr_pvs.kernel.walk.step import OK
from ctr_pvs.solve.dense import DenseEnergy
from ctr_pvs.solve.equilibria import stationary
from ctr_pvs.solve.path import NO_LOADS

Array = NDArray[np.float64]

#: Polynomial degrees that the judge adds, and how far [rad] it may go from the answer.
MORE_DEGREES, ROOM = 12, 0.5
#: Distance [m] that the two judges may have.
AGREEMENT = 1e-9
NOWHERE = np.full(3, np.inf)


@dataclass(frozen=True)
class Verdict:
    """One judged scene: level chosen, unknowns, tolerance, error and estimate [m]; how far apart [m] two judges are."""

    fidelity: str
    unknowns: int
    tolerance: float
    error: float
    estimate: float
    apart: float


def random_scene(seed: int) -> tuple[Robot, Array, Array, float]:
    """Robot, alpha, D and tolerance."""
    rng = np.random.default_rng([seed, 5])
    tubes = int(rng.integers(2, 5))
    robot = random_robot(rng, tubes) if rng.random() < 0.5 else helical_robot(rng, tubes)
    lengths = np.array([tube.length for tube in robot.tubes])
    D = np.maximum.accumulate(rng.uniform(0.0, 0.6, tubes) * lengths.min())
    return robot, rng.uniform(-np.pi, np.pi, tubes), D, 10.0 ** rng.uniform(-9.0, -2.0)


def judge(seed: int) -> Verdict | None:
    """Solve and judge one scene; None where the solver gave no answer."""
    robot, alpha, D, tolerance = random_scene(seed)
    answer = EquilibriumSolver(robot, tolerance).solve(alpha, D)
    if not answer.success:
        return None
    tip, again = true_tips(robot, answer)
    error = float(np.linalg.norm(answer.tip.position - tip))
    apart = float(np.linalg.norm(again - tip)) if np.isfinite([tip, again]).all() else np.inf
    return Verdict(answer.fidelity, answer.degrees_of_freedom, tolerance, error, answer.error_estimate, apart)


def true_tips(robot: Robot, answer: Equilibrium) -> tuple[Array, Array]:
    """Tips (3,) [m] of the model that the answer's own converges to.

    First by plain Newton on the whole energy at many more degrees, infinite where that goes astray; then by the solver
    at its tightest tolerance from the same state, infinite where it finds no equilibrium there.
    """
    degrees = Engine(robot, answer.tolerance).elements(answer.state.vector)[:, 3]
    engine = Engine(robot, TIGHT)
    energy = DenseEnergy(engine, answer.D, judge_degree(degrees, MORE_DEGREES))
    near = nearest(energy, answer.shape, answer.alpha)
    found, _ = stationary(energy, answer.alpha, near, ROOM)
    if found is None:
        return NOWHERE, NOWHERE
    code, vector = settled(engine, energy.state(near, answer.alpha).vector, NO_LOADS, False)
    tip = State(vector, len(answer.D)).tip[:3] if code == OK else NOWHERE
    return energy.state(found, answer.alpha).tip[:3], tip


def summary(verdicts: list[Verdict]) -> str:
    """The report as a table."""
    error, estimate = (np.array([getattr(v, name) for v in verdicts]) for name in ("error", "estimate"))
    tolerance = np.array([v.tolerance for v in verdicts])
    within, told = np.mean(error <= tolerance), np.mean(estimate >= error)
    levels, unknowns = Counter(v.fidelity for v in verdicts), [v.unknowns for v in verdicts]
    ratio = estimate / np.maximum(error, 1e-16)
    marks = np.percentile(ratio, [0, 1, 10, 50, 90, 99])
    share = np.percentile(error / tolerance, [50, 90, 99, 100])
    agreed = np.mean([v.apart <= AGREEMENT for v in verdicts])
    rows = [
        ["tip error <= tolerance", f"{100 * within:.2f} % of {len(verdicts)} scenes"],
        ["estimate >= tip error", f"{100 * told:.2f} %"],
        ["estimate / error: least, 1, 10, 50, 90, 99 %", ", ".join(f"{mark:.2g}" for mark in marks)],
        ["error / tolerance: 50, 90, 99, 100 %", ", ".join(f"{mark:.2g}" for mark in share)],
        [f"the two judges within {AGREEMENT:.0e} m", f"{100 * agreed:.2f} %"],
        ["level chosen", ", ".join(f"{name} {count}" for name, count in sorted(levels.items()))],
        ["unknowns: median, most", f"{np.median(unknowns):.0f}, {max(unknowns)}"],
    ]
    return table(["", "measured"], rows)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=int, default=2000)
    parser.add_argument("--first", type=int, default=0)
    arguments = parser.parse_args()
    seeds = range(arguments.first, arguments.first + arguments.scenes)
    judged = [judge(seed) for seed in seeds]
    verdicts = [verdict for verdict in judged if verdict is not None]
    text = summary(verdicts)
    text += f"\n\n{len(judged) - len(verdicts)} scenes had no answer within tolerance, and their status says so."
    for seed, verdict in zip(seeds, judged, strict=True):
        if verdict and (verdict.error > min(verdict.tolerance, verdict.estimate) or verdict.apart > AGREEMENT):
            print("look at", seed, verdict)
    publish("effectivity", text, SPEED if arguments.scenes >= 2000 else None)


if __name__ == "__main__":
    main()
