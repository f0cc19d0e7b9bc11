"""What stability costs: margin, reserve, path following and landing, in units of one small numpy call.

    scripts/in_env.sh python3 -m bench.stability.stability_cost

u is the time of np.sin of 8 doubles, measured in the same run (see ``common.clock``).  The table is printed, and
written into docs/stability.md between its markers.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from bench.common.clock import Task
from bench.common.clock import repeated
from bench.common.clock import unit
from bench.common.dense import FixedDegree
from bench.common.dense import nearest
from bench.common.document import publish
from bench.common.document import table
from bench.common.places import STABILITY
from bench.common.scenes import FULL_OVERLAP
from bench.common.scenes import SEED
from ctr_pvs import EquilibriumSolver
from ctr_pvs.answer.engine import Engine
from ctr_pvs.answer.equilibrium import RELAXED_DEGREE
from ctr_pvs.solve.equilibria import stationary
from ctr_pvs.solve.path import DEGREES
from ctr_pvs.solve.path import NO_LOADS
from ctr_pvs.solve.path import CommandPath
from ctr_pvs.solve.path import follow
from ctr_pvs.solve.snap import land

Array = NDArray[np.float64]

D, D_NEAR = FULL_OVERLAP, FULL_OVERLAP + np.array([0.0, 1e-4])
TOLERANCE = 1e-5  # m
#: Before the margin leaves 1, and where it has.
FAR, NEAR = np.radians([0.0, 100.0]), np.radians([0.0, 270.0])
STEP = np.radians([0.0, 0.1])
REPEATS = 200


def answers(alpha: Array, slide: bool) -> Task:
    """Warm answers there and back again by one small step."""
    solver = EquilibriumSolver(SEED, TOLERANCE)
    solver.solve(alpha, D)
    commands = _back_and_forth((alpha, D), (alpha if slide else alpha + STEP, D_NEAR if slide else D))
    return lambda: solver.solve(*next(commands))


def _back_and_forth(here: tuple[Array, Array], there: tuple[Array, Array]) -> Iterator[tuple[Array, Array]]:
    while True:
        yield there
        yield here


def tasks(alpha: Array) -> dict[str, Task]:
    """An answer near ``alpha``, and its parts, each by itself at the degree where paths are followed."""
    answer = EquilibriumSolver(SEED, TOLERANCE).solve(alpha, D)
    engine, state, degree = Engine(SEED, TOLERANCE), answer.state, DEGREES[0]
    energy = FixedDegree(SEED, D, degree)
    y, _ = stationary(energy, alpha, nearest(energy, answer.shape, alpha), np.inf)
    assert y is not None
    rotation, slide = (CommandPath(alpha, D, *end) for end in ((alpha + STEP, D), (alpha, D_NEAR)))

    def reserve() -> float:
        gain = Engine(SEED, TOLERANCE).relaxed_gain(D, RELAXED_DEGREE)
        return gain / float(np.linalg.det(engine.rates(state.vector)[2]))

    return {
        "warm answer, 0.1° further": answers(alpha, False),
        "warm answer, 0.1 mm further": answers(alpha, True),
        "plain Newton in numpy, 0.1° further": lambda: stationary(energy, alpha + STEP, y, np.inf),
        "of the warm answer the proven step": lambda: engine.step(
            state.vector, alpha + STEP, D, NO_LOADS, untwisted=True
        ),
        "following the path, 0.1° further": lambda: follow(engine, rotation, state, degree, np.inf),
        "following the path, 0.1 mm further": lambda: follow(engine, slide, state, degree, np.inf),
        "margin": lambda: engine.margin(state.vector),
        "margin by all eigenvalues, in numpy": lambda: energy.margin(y, alpha),
        "reserve, the first at a D": reserve,
        "of it the relaxed state": lambda: engine.relaxed(D, RELAXED_DEGREE),
    }


def landing() -> tuple[Task, Task]:
    """Finding the fold from 270 deg, and the landing from there."""
    engine, degree = Engine(SEED, TOLERANCE), DEGREES[0]
    state = EquilibriumSolver(SEED, TOLERANCE).solve(NEAR, D).state
    path = CommandPath(NEAR, D, NEAR + np.radians([0.0, 20.0]), D)
    lost = follow(engine, path, state, degree, np.inf)
    return (
        lambda: follow(engine, path, state, degree, np.inf),
        lambda: land(engine, path.command, lost.state, lost.t, degree, np.inf),
    )


def cost_table(repeats: int) -> str:
    far, near = tasks(FAR), tasks(NEAR)
    rows = [[name, *(f"{repeated(task[name], repeats).units:.0f}" for task in (far, near))] for name in far]
    fold, land_there = landing()
    few = max(1, repeats // 10)
    rows.append(["from 270° to the fold, to 1e-13 of the path", "", f"{repeated(fold, few).units:.0f}"])
    rows.append(["landing", "", f"{repeated(land_there, few).units:.0f}"])
    return table([f"time in u (u = {1e6 * unit():.2f} µs)", "at 100°", "at 270°"], rows)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--quick", action="store_true", help="few calls, printed only")
    options = parser.parse_args()
    publish("cost", cost_table(2 if options.quick else REPEATS), None if options.quick else STABILITY)


if __name__ == "__main__":
    main()
