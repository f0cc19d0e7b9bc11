"""What stability costs: margin, reserve, path following and landing, in units of one small numpy call.

    OPENBLAS_NUM_THREADS=1 python bench/stability_cost.py

u is the time of np.sin of 8 doubles, measured in the same run.  The table is printed, and written into
docs/stability.md between its markers.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy is loaded: all matrices are small

import time
from collections.abc import Callable
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from document import STABILITY
from document import publish
from document import table
from numpy.typing import NDArray

from ctr_pvs import EquilibriumSolver
from ctr_pvs import load_robot
from ctr_pvs.continuation import DEGREES
from ctr_pvs.continuation import CommandPath
from ctr_pvs.continuation import State
from ctr_pvs.continuation import follow
from ctr_pvs.convexity import convex_between
from ctr_pvs.models import Models
from ctr_pvs.relaxed import relaxed_state
from ctr_pvs.snap import land
from ctr_pvs.solve import newton
from ctr_pvs.stability import rechecked_margin
from ctr_pvs.stability import relaxed_gain
from ctr_pvs.stability import snap_reserve
from ctr_pvs.stability import stability_margin

Array = NDArray[np.float64]
Task = Callable[[], object]

SEED = load_robot(Path(__file__).resolve().parents[1] / "config" / "renda2021.yaml")
D, D_NEAR = np.array([0.0935, 0.2085]), np.array([0.0935, 0.2086])
#: Before the margin leaves 1, and where it has.
FAR, NEAR = np.radians([0.0, 100.0]), np.radians([0.0, 270.0])
STEP = np.radians([0.0, 0.1])
REPEATS = 200


def seconds(task: Task, repeats: int = REPEATS) -> float:
    """Median time [s] of one call."""
    task()
    times = []
    for _ in range(repeats):
        begin = time.perf_counter()
        task()
        times.append(time.perf_counter() - begin)
    return float(np.median(times))


def unit() -> float:
    """u [s]: np.sin of 8 doubles."""
    x = np.linspace(0.1, 1.0, 8)

    def thousand() -> None:
        for _ in range(1000):
            np.sin(x)

    return seconds(thousand, 51) / 1000.0


def answers(alpha: Array, slide: bool) -> Task:
    """Warm answers there and back again by one small step."""
    solver = EquilibriumSolver(SEED, 1e-5)
    solver.solve(alpha, D)
    commands = _back_and_forth((alpha, D), (alpha if slide else alpha + STEP, D_NEAR if slide else D))
    return lambda: solver.solve(*next(commands))


def _back_and_forth(here: tuple[Array, Array], there: tuple[Array, Array]) -> Iterator[tuple[Array, Array]]:
    while True:
        yield there
        yield here


def tasks(alpha: Array) -> dict[str, Task]:
    """The parts of an answer near ``alpha``, each by itself, at the degree where paths are followed."""
    solver = EquilibriumSolver(SEED, 1e-5)
    models, degree = Models(SEED), DEGREES[0]
    state = State(alpha, D, solver.solve(alpha, D).shape.torques)
    energy = models.energy(D, degree)
    q = newton(energy, alpha, energy.space.coordinates(state.torques)).q
    rotation, slide = (CommandPath(alpha, D, *end) for end in ((alpha + STEP, D), (alpha, D_NEAR)))
    pairs, psi, other = models.pairs(energy), energy.angles(q, alpha), energy.angles(q, alpha + STEP)
    return {
        "warm answer, 0.1° further": answers(alpha, False),
        "warm answer, 0.1 mm further": answers(alpha, True),
        "plain Newton, 0.1° further": lambda: newton(energy, alpha + STEP, q),
        "following the path, 0.1° further": lambda: follow(models, rotation, state, degree, np.inf),
        "following the path, 0.1 mm further": lambda: follow(models, slide, state, degree, np.inf),
        "of it the certificate, once": lambda: convex_between(pairs, psi, other),
        "margin": lambda: stability_margin(energy, q, alpha),
        "margin with recheck": lambda: rechecked_margin(energy, q, alpha),
        "reserve, the first at a D": lambda: snap_reserve(energy, q, alpha, relaxed_gain(energy)),
        "of it the relaxed state": lambda: relaxed_state(energy),
    }


def landing() -> tuple[Task, Task]:
    """Finding the fold from 270 deg, and the landing from there."""
    solver = EquilibriumSolver(SEED, 1e-5)
    models, degree = Models(SEED), DEGREES[0]
    state = State(NEAR, D, solver.solve(NEAR, D).shape.torques)
    path = CommandPath(NEAR, D, NEAR + np.radians([0.0, 20.0]), D)
    lost = follow(models, path, state, degree, np.inf)
    return lambda: follow(models, path, state, degree, np.inf), lambda: land(models, path, lost, degree, np.inf)


def main() -> None:
    u = unit()
    far, near = tasks(FAR), tasks(NEAR)
    rows = [[name, f"{seconds(far[name]) / u:.0f}", f"{seconds(near[name]) / u:.0f}"] for name in far]
    fold, land_there = landing()
    rows.append(["from 270° to the fold, to 1e-13 of the path", "", f"{seconds(fold, 20) / u:.0f}"])
    rows.append(["landing", "", f"{seconds(land_there, 20) / u:.0f}"])
    head = [f"time in u (u = {1e6 * u:.2f} µs)", "at 100°", "at 270°"]
    publish("cost", table(head, rows), STABILITY)


if __name__ == "__main__":
    main()
