"""Is the error estimate of ``fidelity="auto"`` true?  Random scenes, judged by a much finer model.

    scripts/in_env.sh python3 bench/effectivity.py [--scenes 2000] [--first 0]

A scene is a random robot of two to four tubes (straight, polynomial and helical pre-curvatures, weak to strong
coupling), a random command, cold, and a random tolerance between 1e-2 and 1e-9 m.  The judge takes the answer's torques
to twelve polynomial degrees more, polishes them by plain Newton, and integrates the backbone to 1e-13 m.  Scenes where
that is not the branch of the answer (a fold between the two models) count as wrong.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy is loaded: all matrices are small

import argparse
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from document import publish
from document import table
from random_sweeps import random_robot as planar_or_not

from ctr_pvs import Equilibrium
from ctr_pvs import EquilibriumSolver
from ctr_pvs import Robot
from ctr_pvs import Segment
from ctr_pvs import Tube
from ctr_pvs.energy import TorsionEnergy
from ctr_pvs.refine import tip_position
from ctr_pvs.shape import TorsionShape
from ctr_pvs.solve import newton

#: Polynomial degrees that the judge adds, and the backbone integration [m] that it asks for.
MORE_DEGREES = 12
FINE = 1e-13
DOCUMENT = Path(__file__).resolve().parents[1] / "docs" / "speed_accuracy.md"


@dataclass(frozen=True)
class Verdict:
    """One judged scene: level chosen, unknowns, error and estimate [m], both over the tolerance [m]."""

    fidelity: str
    unknowns: int
    tolerance: float
    error: float
    estimate: float


def random_scene(seed: int) -> tuple[Robot, np.ndarray, np.ndarray, float]:
    """Robot, alpha, D and tolerance."""
    rng = np.random.default_rng([seed, 5])
    tubes = int(rng.integers(2, 5))
    robot = planar_or_not(rng, tubes) if rng.random() < 0.5 else _helical(rng, tubes)
    lengths = np.array([tube.length for tube in robot.tubes])
    D = np.maximum.accumulate(rng.uniform(0.0, 0.6, tubes) * lengths.min())
    return robot, rng.uniform(-np.pi, np.pi, tubes), D, 10.0 ** rng.uniform(-9.0, -2.0)


def _helical(rng: np.random.Generator, tubes: int) -> Robot:
    parts = []
    for index in range(tubes):
        K = 0.04 * rng.uniform(0.3, 1.0)
        kappa = rng.uniform(2, 14) * np.exp(1j * rng.uniform(-np.pi, np.pi))
        coefficients = kappa * np.array([1.0, rng.uniform(-6, 6), rng.uniform(-30, 30)])[: rng.integers(1, 4)]
        bent = Segment(rng.uniform(0.05, 0.15), K, K / rng.uniform(1.0, 1.6), tuple(coefficients), rng.uniform(-15, 15))
        parts.append(Tube(f"t{index}", (Segment(0.02 + 0.03 * index, K, K / 1.3), bent)))
    return Robot("helical", tuple(parts))


def judge(seed: int) -> Verdict | None:
    """Solve and judge one scene; None where the solver gave no answer."""
    robot, alpha, D, tolerance = random_scene(seed)
    answer = EquilibriumSolver(robot, tolerance).solve(alpha, D)
    if not answer.success:
        return None
    error = float(np.linalg.norm(answer.tip.position - true_tip(answer)))
    return Verdict(answer.fidelity, answer.degrees_of_freedom, tolerance, error, answer.error_estimate)


def true_tip(answer: Equilibrium) -> np.ndarray:
    """Tip (3,) [m] of the model that the answer's own converges to."""
    materials = answer.shape.materials
    degree = max(basis.degree for basis in answer.state.torques.bases) if materials.coupled.any() else 0
    energy = TorsionEnergy(materials, degree + MORE_DEGREES)
    found = newton(energy, answer.alpha, energy.space.coordinates(answer.state.torques), 40)
    if not found.converged:
        return np.full(3, np.inf)
    return tip_position(TorsionShape(energy.space, answer.alpha, found.q), FINE)


def summary(verdicts: list[Verdict]) -> str:
    """The report as a table."""
    error, estimate = (np.array([getattr(v, name) for v in verdicts]) for name in ("error", "estimate"))
    tolerance = np.array([v.tolerance for v in verdicts])
    within, told = np.mean(error <= tolerance), np.mean(estimate >= error)
    levels, unknowns = Counter(v.fidelity for v in verdicts), [v.unknowns for v in verdicts]
    ratio = estimate / np.maximum(error, 1e-16)
    marks = np.percentile(ratio, [0, 1, 10, 50, 90, 99])
    share = np.percentile(error / tolerance, [50, 90, 99, 100])
    rows = [
        ["tip error <= tolerance", f"{100 * within:.2f} % of {len(verdicts)} scenes"],
        ["estimate >= tip error", f"{100 * told:.2f} %"],
        ["estimate / error: least, 1, 10, 50, 90, 99 %", ", ".join(f"{mark:.2g}" for mark in marks)],
        ["error / tolerance: 50, 90, 99, 100 %", ", ".join(f"{mark:.2g}" for mark in share)],
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
        if verdict and (verdict.error > verdict.tolerance or verdict.estimate < verdict.error):
            print("look at", seed, verdict)
    publish("effectivity", text, DOCUMENT if arguments.scenes >= 2000 else None)


if __name__ == "__main__":
    main()
