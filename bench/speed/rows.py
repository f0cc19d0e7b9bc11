"""What speed against accuracy measures: a method with a setting, warm or cold, on a scene with converged tips."""

from __future__ import annotations

import csv
import dataclasses
import warnings
from collections.abc import Iterable
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bench.common.clock import Stopwatch
from bench.common.scenes import Scene
from bench.speed.fixed_levels import reference_tips
from bench.speed.methods import BRANCHLESS
from bench.speed.methods import BVP_NODES
from bench.speed.methods import METHODS
from bench.speed.methods import AtLevel
from bench.speed.methods import Make
from bench.speed.methods import Method
from ctr_pvs import EquilibriumSolver
from ctr_pvs.oracles.standard_model import solve_standard_bvp

Array = NDArray[np.float64]

#: An answer this far [m] from the reference is on another branch: no discretisation here errs so much, and at the last
#: command before the fold the unstable branch is 1.1e-3 m away.
ELSEWHERE = 1e-3
#: Seconds that a method with one setting and one start may take on a scene, and the answers it gives in any case.
BUDGET, FEWEST = 0.25, 4
#: Share of a level's own error that integrating its tip may add.
INTEGRATION = 0.1
#: Distance [m] that the references may have to solve_bvp at its tightest.
AGREEMENT = 1e-11
WARM, COLD = "warm", "cold"


@dataclass(frozen=True)
class Row:
    """One method with one setting on one scene, warm or cold; times and errors are of the answers on the branch.

    commands : asked for; answered : of them, with the method's own success; elsewhere : of those, on another branch.
    """

    scene: str
    method: str
    setting: str
    start: str
    unknowns: int
    commands: int
    answered: int
    elsewhere: int
    time_us: float
    time_u: float
    error_median_m: float
    error_largest_m: float
    u_us: float

    @property
    def right(self) -> int:
        return self.answered - self.elsewhere

    @property
    def label(self) -> str:
        return f"{self.method} {self.setting}".strip()


class Course:
    """A scene with its converged tips."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        flat = [alpha for run in scene.commands for alpha in run]
        tips = iter(reference_tips(scene.robot, scene.D, flat))
        self.runs = [[(alpha, next(tips)) for alpha in run] for run in scene.commands]

    def confirm(self) -> float:
        """Distance [m] of a converged tip to that of the boundary-value model, started on the same branch."""
        (alpha, tip), scene = self.runs[-1][-1], self.scene
        near = EquilibriumSolver(scene.robot).solve(alpha, scene.D)
        found = solve_standard_bvp(scene.robot, alpha, scene.D, 1e-10, near.shape, BVP_NODES)
        return float(np.linalg.norm(found.tip - tip))

    def warm(self, method: Method) -> Iterator[tuple[Array, Array]]:
        """Commands 1 deg from the one before, which the method has answered; and their tips."""
        for (first, _), *rest in self.runs:
            method.approach(first)
            yield from rest

    def cold(self) -> list[tuple[Array, Array]]:
        """A command and its tip from every run in turn, so that few already see all of the sweep."""
        return [pair for together in zip(*self.runs, strict=True) for pair in together]


def measure(course: Course, name: str, setting: str, make: Make, start: str, budget: float = BUDGET) -> Row:
    """Time one method with one setting."""
    method = make(course.scene)
    if isinstance(method, AtLevel):
        _tune(course, make, method)
    watch, errors, answered = Stopwatch(), [], []
    pairs: Iterable[tuple[Array, Array]] = course.warm(method) if start == WARM else course.cold()
    solve = method.warm if start == WARM else method.cold
    solve(method.last)  # what is made at the first call does not count
    for alpha, tip in pairs:
        found = watch.time(partial(solve, alpha))
        answered.append(found is not None)
        errors.append(np.inf if found is None else float(np.linalg.norm(found - tip)))
        if watch.spent > budget and len(errors) >= FEWEST:
            break
    return _row(course.scene.name, name, setting, start, method.unknowns, watch, np.array(errors), sum(answered))


def _row(
    scene: str, name: str, setting: str, start: str, unknowns: int, watch: Stopwatch, errors: Array, answered: int
) -> Row:
    right = np.isfinite(errors) if name in BRANCHLESS else errors < ELSEWHERE
    seconds, units = np.array(watch.seconds), np.array(watch.units)
    if not right.any():
        numbers = (np.nan,) * 4
    else:
        chosen = errors[right]
        numbers = (1e6 * np.median(seconds[right]), np.median(units[right]), np.median(chosen), chosen.max())
    elsewhere = answered - int(right.sum())
    u = 1e6 * float(np.median(seconds / units))
    return Row(scene, name, setting, start, unknowns, len(errors), answered, elsewhere, *map(float, numbers), u)


def _tune(course: Course, make: Make, method: AtLevel) -> None:
    """Let the tip be integrated as coarsely as the level's own error allows."""
    trial = make(course.scene)
    found = [(trial.warm(alpha), tip) for alpha, tip in course.warm(trial)]
    errors = [float(np.linalg.norm(own - tip)) for own, tip in found if own is not None]
    worst = max(errors, default=0.0)
    method.level.integration = float(np.clip(INTEGRATION * worst, 1e-12, 1e-3))


def sweep(courses: list[Course], family: str, quick: bool = False) -> Iterator[Row]:
    """Every row of a family on every scene; ``quick`` keeps to its first and its last setting."""
    settings = list(METHODS[family].items())
    chosen = settings[:: max(1, len(settings) - 1)] if quick else settings
    for course in courses:
        for setting, make in chosen:
            for start in (WARM, COLD):
                yield measure(course, family, setting, make, start, 0.0 if quick else BUDGET)


def quickest(rounds: list[list[Row]]) -> list[Row]:
    """Row by row the quicker of the rounds; where one has more answers on the branch, that one."""
    return [min(rows, key=lambda row: (-row.right / row.commands, row.time_u)) for rows in zip(*rounds, strict=True)]


def write(rows: list[Row], path: Path) -> None:
    """The rows as CSV; empty where nothing was answered."""
    with path.open("w", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow([field.name for field in dataclasses.fields(Row)])
        for row in rows:
            writer.writerow([_cell(value) for value in dataclasses.astuple(row)])


def _cell(value: object) -> object:
    if not isinstance(value, float):
        return value
    return "" if np.isnan(value) else f"{value:.4g}"


def quiet() -> None:
    """A diverging trial overflows on its way to a reported failure: not this bench's business."""
    np.seterr(all="ignore")
    warnings.simplefilter("ignore", RuntimeWarning)
