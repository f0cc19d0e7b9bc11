"""Random sweeps of loaded robots through folds, each judged by an independent fine-step tracker.

    scripts/in_env.sh python3 -m bench.loaded.random_loaded_sweeps [--sweeps 1000] [--first 0]

A sweep is a random robot of two or three tubes under random loads (a tip force up to bending it substantially,
sometimes a force on a point of a tube, a line force, a moment), a cold start at a random command, and one straight path
from there on which everything turns, every second slides, and most loads change.  The judge goes the same ways in small
steps (0.02 rad, 0.5 mm, 2 % of the change of load) with Newton's method on the dense virtual work: from the unloaded
cold start, which ``random_sweeps`` judges, it ramps the loads in; then it follows the path.  Counted are

    right          the judge reached the end, the answer is its state and is not flagged
    flagged snap   the judge's branch ended where the solver reports its first snap; from the last landing on, the judge
                   goes along to the answer.  On the ramp of a cold start: the branch ended and the answer is flagged
    honest failure the solver gave no answer, and says why
    WRONG BRANCH   an unflagged answer on another branch than the judge's, or a snap that the judge does not see
    UNSTABLE       an answer where the symmetric part of the tangent, at half as many degrees more, is not positive

and, apart from branches, the largest tip error of the answers.
"""

from __future__ import annotations

import argparse
import time
from collections import Counter
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from bench.common.random_robots import random_D
from bench.common.random_robots import random_robot
from bench.loaded.loaded_judge import DEGREE
from bench.loaded.loaded_judge import LoadedJudge
from bench.loaded.loaded_judge import LoadedPath
from bench.loaded.loaded_judge import Place
from ctr_pvs import Equilibrium
from ctr_pvs import EquilibriumSolver
from ctr_pvs import Robot
from ctr_pvs.answer.state import State
from ctr_pvs.robot.loads import Loads
from ctr_pvs.robot.loads import PointForce

Array = NDArray[np.float64]

TOLERANCE = 1e-6  # m, of the solver
#: States that agree within this [rad] are one.
SAME = 1e-4
#: A snap and the place where the judge's branch ends may be this many of the judge's steps apart.
NEAR = 3.0
#: Energy released [J] below this is rounding.
ROUNDING = -1e-12


@dataclass(frozen=True)
class Verdict:
    """On one sweep: what is counted, what to print of it, and the largest tip error [m] of its answers."""

    found: str
    remark: str = ""
    tip_error: float = 0.0


@dataclass(frozen=True, eq=False)
class Sweep:
    """A robot, and a path from a loaded command to another."""

    robot: Robot
    path: LoadedPath


def random_loads(rng: np.random.Generator, robot: Robot, D: Array, D_end: Array) -> tuple[Loads, Loads]:
    """Loads at both ends of a path, on the same points; sometimes the same, sometimes none at the start."""
    beyond = np.maximum(D, D_end)
    length = min(robot.length_beyond(D), robot.length_beyond(D_end))
    stiffness = robot.tubes[-1].segments[-1].bending_stiffness
    unit = stiffness / length**2  # N, what bends the innermost tube by about half a radian

    def vector(scale: float) -> tuple[float, float, float]:
        x, y, z = (scale * rng.uniform(0.0, 1.0) * _direction(rng)).tolist()
        return x, y, z

    with_point, with_line, with_moment = rng.random(3) < (0.4, 0.3, 0.25)
    tube = int(rng.integers(robot.n_tubes))
    X = float(beyond[tube] + rng.uniform(0.15, 1.0) * (robot.tubes[tube].length - beyond[tube]))

    def loads() -> Loads:
        return Loads(
            vector(2.0 * unit),
            vector(0.7 * unit * length) if with_moment else (0.0, 0.0, 0.0),
            (PointForce(tube, X, vector(2.0 * unit)),) if with_point else (),
            {int(rng.integers(robot.n_tubes)): vector(2.0 * unit / length)} if with_line else {},
        )

    first, last = loads(), loads()
    kind = rng.random()
    return (Loads(), last) if kind < 0.2 else (first, first) if kind < 0.45 else (first, last)


def _direction(rng: np.random.Generator) -> Array:
    v = rng.normal(size=3)
    return np.asarray(v / np.linalg.norm(v))


def random_sweep(seed: int) -> Sweep:
    rng = np.random.default_rng([seed, 2025])
    robot = random_robot(rng, 2 + seed % 2)
    D, alpha = random_D(rng, robot), rng.uniform(-1, 1, robot.n_tubes)
    alpha_end = alpha + rng.uniform(-5, 5, robot.n_tubes)
    D_end = random_D(rng, robot) if rng.random() < 0.5 else D
    loads, loads_end = random_loads(rng, robot, D, D_end)
    return Sweep(robot, LoadedPath(alpha, D, loads, alpha_end, D_end, loads_end))


# The solver that takes loads, and its answers, are known here by what is read of them: twist, backbone_at, tip, snaps.


def place_of(judge: LoadedJudge, answer: Any, alpha: Array, D: Array, loads: Loads) -> Place | None:
    """An answer, polished; None where that leads away from it."""

    def frames(s: Array) -> Array:
        leader = answer.twist(s)[:, judge.model(D, loads).leader]
        back = Rotation.from_rotvec(np.outer(-leader, [1.0, 0.0, 0.0]))
        return np.asarray((Rotation.from_quat(answer.backbone_at(s).orientation) * back).as_matrix())

    return judge.placed(alpha, D, loads, answer.twist, frames)


def told(answer: Any, state: State) -> Equilibrium:
    """A state from an answer's way, with everything that an answer tells."""
    return Equilibrium(
        answer._engine, state.alpha, state.D, answer.status, answer.message, answer.fidelity, state=state
    )


def unstable(robot: Robot, answer: Any, alpha: Array, D: Array, loads: Loads) -> bool:
    """Whether no stable state is next to an answer, at half as many degrees more than the judge's."""
    place = place_of(LoadedJudge(robot, DEGREE + DEGREE // 2), answer, alpha, D, loads)
    return place is None or not place.stable


def judged(sweep: Sweep, solver: Any, unloaded: Any) -> Verdict:
    """The verdict on ``solver``, which takes loads; ``unloaded`` is another one of the same robot."""
    judge, path = LoadedJudge(sweep.robot), sweep.path
    first = solver.solve(path.alpha, path.D, loads=path.loads)
    if not first.success:
        return Verdict("honest failure", f"cold: {first.status.value}: {first.message}")
    if unstable(sweep.robot, first, path.alpha, path.D, path.loads):
        return Verdict("UNSTABLE", "cold start")
    begin = place_of(judge, first, path.alpha, path.D, path.loads)
    if begin is None:
        return Verdict("WRONG BRANCH", "the start is no equilibrium")
    ramp = cold_ramp(judge, path, begin, first, unloaded)
    if ramp.found not in ("right", "flagged snap"):
        return ramp
    answer = solver.follow(path.alpha_end, path.D_end, loads=path.loads_end)
    if not answer.success:
        return Verdict("honest failure", f"{answer.status.value}: {answer.message}")
    if unstable(sweep.robot, answer, path.alpha_end, path.D_end, path.loads_end) or answer.stability_margin <= 0.0:
        return Verdict("UNSTABLE", answer.status.value)
    verdict = followed(judge, path, begin, answer)
    if verdict.found == "right" and ramp.found == "flagged snap":
        return Verdict("flagged snap", ramp.remark, max(verdict.tip_error, ramp.tip_error))
    return Verdict(verdict.found, verdict.remark, max(verdict.tip_error, ramp.tip_error))


def cold_ramp(judge: LoadedJudge, path: LoadedPath, begin: Place, first: Any, unloaded: Any) -> Verdict:
    """What the judge says to a cold start, by loading the unloaded one."""
    tip_error = float(np.linalg.norm(begin.tip - first.tip.position))
    bare = unloaded.solve(path.alpha, path.D)
    if not bare.success:
        return Verdict("honest failure", f"cold, unloaded: {bare.status.value}: {bare.message}")
    place = place_of(judge, bare, path.alpha, path.D, Loads())
    if place is None:
        return Verdict("WRONG BRANCH", "the unloaded start is no equilibrium")
    reached, t = judge.go(LoadedPath(path.alpha, path.D, Loads(), path.alpha, path.D, path.loads), place)
    if t < 1.0:
        if first.snaps:
            return Verdict("flagged snap", f"the loads of the cold start snap at {t:.4f}", tip_error)
        return Verdict("WRONG BRANCH", f"cold: no snap told, judge ended at {t:.4f} of the loads")
    if len(first.snaps) > len(bare.snaps):
        return Verdict("WRONG BRANCH", "cold: a snap on loading that the judge does not see")
    apart = reached.apart(begin)
    return Verdict("right", "", tip_error) if apart < SAME else Verdict("WRONG BRANCH", f"cold: apart {apart:.3g}")


def followed(judge: LoadedJudge, path: LoadedPath, begin: Place, answer: Any) -> Verdict:
    """What the judge says to the answer at the path's end."""
    end = place_of(judge, answer, path.alpha_end, path.D_end, path.loads_end)
    if end is None:
        return Verdict("WRONG BRANCH", "the end is no equilibrium")
    tip_error = float(np.linalg.norm(end.tip - answer.tip.position))
    reached, t = judge.go(path, begin)
    if not answer.snaps:
        if t == 1.0 and reached.apart(end) < SAME:
            return Verdict("right", "", tip_error)
        apart = reached.apart(end) if t == 1.0 else np.nan
        return Verdict("WRONG BRANCH", f"judge ended at {t:.4f}, apart {apart:.3g}")
    snap, last = answer.snaps[0], answer.snaps[-1]
    if t == 1.0 or abs(t - snap.t) > NEAR / path.steps:
        return Verdict("WRONG BRANCH", f"snap at {snap.t:.4f}, judge ended at {t:.4f}")
    if min(snap.energy_released for snap in answer.snaps) < ROUNDING:  # NaN under dead moments: no energy
        return Verdict("WRONG BRANCH", "a snap gains energy")
    landed = place_of(judge, told(answer, last.after), *path.at(last.t))
    if landed is None:
        return Verdict("WRONG BRANCH", f"the landing at {last.t:.4f} is no equilibrium")
    reached, t = judge.go(path, landed, last.t)
    if t == 1.0 and reached.apart(end) < SAME:
        return Verdict("flagged snap", "", tip_error)
    return Verdict("WRONG BRANCH", f"after the landing at {last.t:.4f} the judge ended at {t:.4f}")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sweeps", type=int, default=1000)
    parser.add_argument("--first", type=int, default=0, help="seed of the first sweep")
    arguments = parser.parse_args()
    verdicts: Counter[str] = Counter()
    began, worst = time.perf_counter(), 0.0
    for seed in range(arguments.first, arguments.first + arguments.sweeps):
        sweep = random_sweep(seed)
        solvers = (EquilibriumSolver(sweep.robot, TOLERANCE) for _ in range(2))
        verdict = judged(sweep, *solvers)
        verdicts[verdict.found] += 1
        worst = max(worst, verdict.tip_error)
        if verdict.remark:
            print(f"sweep {seed}: {verdict.found}: {verdict.remark}", flush=True)
    print(dict(verdicts), f"largest tip error {worst:.1e} m (tolerance {TOLERANCE:g}),", end=" ")
    print(f"{time.perf_counter() - began:.0f} s")
    return int(verdicts["WRONG BRANCH"] + verdicts["UNSTABLE"] > 0)


if __name__ == "__main__":
    raise SystemExit(main())
