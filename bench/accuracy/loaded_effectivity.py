"""Is the error estimate true under loads?  Random loaded scenes, judged by the tightest tolerance and by another model.

    scripts/in_env.sh python3 -m bench.accuracy.loaded_effectivity [--scenes 2000] [--first 0]

A scene is a random robot of two to four tubes (straight, polynomial and helical pre-curvatures), a random command, a
random tip force up to bending it substantially, sometimes a force on a point of a tube, a line force, a moment on the
tip; a cold start, and a random tolerance between 1e-2 and 1e-9 m.  The truth is another cold start of the solver at its
tightest tolerance, 1e-10 m.  A second judge, which shares no element with it (the dense virtual work of
``bench.loaded.loaded_galerkin``, all degrees at ``DEGREE``) and polishes the answer itself, must come to the
same tip.
"""

from __future__ import annotations

import argparse
import time
from collections import Counter
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.accuracy.effectivity import AGREEMENT
from bench.accuracy.effectivity import NOWHERE
from bench.common.dense import TIGHT
from bench.common.document import publish
from bench.common.document import table
from bench.common.places import LOADS
from bench.common.random_robots import helical_robot
from bench.common.random_robots import random_robot
from bench.loaded.loaded_judge import LoadedJudge
from bench.loaded.random_loaded_sweeps import place_of
from bench.loaded.random_loaded_sweeps import random_loads
from ctr_pvs import Equilibrium
from ctr_pvs import EquilibriumSolver
from ctr_pvs import Loads
from ctr_pvs import Robot

Array = NDArray[np.float64]

#: Polynomial degree of the second judge in every piece of at most 60 mm.
DEGREE = 12
SCENES = 2000


@dataclass(frozen=True, eq=False)
class Scene:
    """A command under loads and the tolerance [m] it is solved to."""

    robot: Robot
    alpha: Array
    D: Array
    loads: Loads
    tolerance: float


@dataclass(frozen=True)
class Verdict:
    """One judged scene.

    status : the answer's own; snaps : on the way there.  error, estimate : of the tip [m]; apart : distance [m] of the
    two judges, infinite where one finds nothing; what follows is NaN where there is no answer.
    """

    seed: int
    tubes: int
    status: str
    snaps: int
    tolerance: float
    unknowns: int = 0
    error: float = np.nan
    estimate: float = np.nan
    apart: float = np.nan
    margin: float = np.nan

    @property
    def answered(self) -> bool:
        return self.status in ("ok", "snap")

    @property
    def within(self) -> bool:
        return self.error <= self.tolerance

    @property
    def told(self) -> bool:
        return self.estimate >= self.error

    @property
    def cause(self) -> str:
        """Why this scene is an exception, as far as its numbers tell."""
        if not np.isfinite(self.error):
            return "the solver has no answer at 1e-10 m"
        if self.apart >= 0.5 * self.error:
            return f"the judges themselves are {self.apart:.1e} m apart"
        if not self.within:
            return "degrees chosen too low" if self.told else "degrees chosen too low, and the estimate did not see it"
        return "the estimate is too small, the tip within tolerance"


def random_scene(seed: int) -> Scene:
    rng = np.random.default_rng([seed, 12])
    tubes = int(rng.integers(2, 5))
    robot = random_robot(rng, tubes) if rng.random() < 0.5 else helical_robot(rng, tubes)
    shortest = min(tube.length for tube in robot.tubes)
    D = np.maximum.accumulate(rng.uniform(0.0, 0.6, tubes) * shortest)
    _, loads = random_loads(rng, robot, D, D)
    return Scene(robot, rng.uniform(-np.pi, np.pi, tubes), D, loads, 10.0 ** rng.uniform(-9.0, -2.0))


def judge(seed: int) -> Verdict:
    """Solve and judge one scene."""
    scene = random_scene(seed)
    answer = EquilibriumSolver(scene.robot, scene.tolerance).solve(scene.alpha, scene.D, "cold", loads=scene.loads)
    told = seed, scene.robot.n_tubes, answer.status.value, len(answer.snaps), scene.tolerance
    if not answer.success:
        return Verdict(*told)
    tip, again = true_tips(scene, answer)
    error = float(np.linalg.norm(answer.tip.position - tip)) if np.isfinite(tip).all() else np.inf
    apart = float(np.linalg.norm(again - tip)) if np.isfinite([tip, again]).all() else np.inf
    return Verdict(*told, answer.degrees_of_freedom, error, answer.error_estimate, apart, answer.stability_margin)


def true_tips(scene: Scene, answer: Equilibrium) -> tuple[Array, Array]:
    """Tips (3,) [m] by both judges; infinite where one finds no equilibrium."""
    fine = EquilibriumSolver(scene.robot, TIGHT).solve(scene.alpha, scene.D, "cold", loads=scene.loads)
    place = place_of(LoadedJudge(scene.robot, DEGREE), answer, scene.alpha, scene.D, scene.loads)
    return fine.tip.position if fine.success else NOWHERE, NOWHERE if place is None else place.tip


def summary(verdicts: list[Verdict]) -> str:
    """The report as a table."""
    judged = [v for v in verdicts if v.answered]
    error, estimate, tolerance = (np.array([getattr(v, n) for v in judged]) for n in ("error", "estimate", "tolerance"))
    ratio = estimate / np.maximum(error, 1e-16)
    marks = np.percentile(ratio, [0, 1, 10, 50, 90, 99])
    share = np.percentile(error / tolerance, [50, 90, 99, 100], method="nearest")
    unknowns = [v.unknowns for v in judged]
    both = np.mean([v.within and v.told for v in judged])
    rows = [
        ["scenes, answered", f"{len(verdicts)}, {len(judged)}"],
        ["tip error <= tolerance", f"{100 * np.mean(error <= tolerance):.2f} %"],
        ["estimate >= tip error", f"{100 * np.mean(estimate >= error):.2f} %"],
        ["both (aim: 99.9 %)", f"{100 * both:.2f} %"],
        ["estimate / error: least, 1, 10, 50, 90, 99 %", ", ".join(f"{mark:.2g}" for mark in marks)],
        ["error / tolerance: 50, 90, 99, 100 %", ", ".join(f"{mark:.2g}" for mark in share)],
        [f"the two judges within {AGREEMENT:.0e} m", f"{100 * np.mean([v.apart <= AGREEMENT for v in judged]):.2f} %"],
        ["answers reached through a snap, told", str(sum(v.snaps > 0 for v in judged))],
        ["unknowns: median, most", f"{np.median(unknowns):.0f}, {max(unknowns)}"],
    ]
    return table(["", "measured"], rows)


def exceptions(verdicts: list[Verdict]) -> str:
    """Every scene that is not as it should be, with its cause; and those without an answer, by their status."""
    wrong = [v for v in verdicts if v.answered and not (v.within and v.told)]
    parts = ["No exception."]
    if wrong:
        head = ["scene", "tubes", "tolerance [m]", "tip error [m]", "estimate [m]", "cause"]
        rows = [
            [str(v.seed), str(v.tubes), *(f"{x:.2e}" for x in (v.tolerance, v.error, v.estimate)), v.cause]
            for v in wrong
        ]
        parts = [table(head, rows)]
    failed = Counter(v.status for v in verdicts if not v.answered)
    if failed:
        parts.append("Without an answer: " + ", ".join(f"`{status}` {count}" for status, count in failed.items()) + ".")
    return "\n\n".join(parts)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=int, default=SCENES)
    parser.add_argument("--first", type=int, default=0)
    arguments = parser.parse_args()
    begin = time.perf_counter()
    verdicts = []
    for seed in range(arguments.first, arguments.first + arguments.scenes):
        verdicts.append(judge(seed))
        if not verdicts[-1].answered or verdicts[-1].apart > AGREEMENT:
            print("look at", verdicts[-1], flush=True)
    document = LOADS if arguments.scenes >= SCENES else None
    publish("loaded effectivity", f"{summary(verdicts)}\n\n{exceptions(verdicts)}", document)
    print(f"{time.perf_counter() - begin:.0f} s")


if __name__ == "__main__":
    main()
