"""Recompute the numbers of docs/stability.md that are not of the failure chart or about cost.

    scripts/in_env.sh python3 -m bench.stability.stability_numbers

Tables are printed, and written into the document between their markers.
"""

from __future__ import annotations

import time

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.optimize import minimize

from bench.common.dense import FixedDegree
from bench.common.dense import nearest
from bench.common.document import publish
from bench.common.document import table
from bench.common.places import STABILITY
from bench.common.scenes import FULL_OVERLAP
from bench.common.scenes import PARTIAL_OVERLAP
from bench.common.scenes import SEED
from bench.stability.robots_that_snap import pair
from ctr_pvs import EquilibriumSolver
from ctr_pvs.answer.engine import Engine
from ctr_pvs.answer.shape import TorsionShape
from ctr_pvs.answer.state import State
from ctr_pvs.model.shape import Shape
from ctr_pvs.oracles.two_tubes import TwoTubes
from ctr_pvs.oracles.two_tubes import stability_function
from ctr_pvs.solve.equilibria import equilibria
from ctr_pvs.solve.equilibria import folds
from ctr_pvs.solve.equilibria import stationary

Array = NDArray[np.float64]

TOLERANCE = 1e-8
SWEEPS = {
    "full overlap": (FULL_OVERLAP, (0, 40, 80, 120, 160, 200, 240, 260, 270, 280, 281, 281.8, 281.889)),
    "partial overlap": (PARTIAL_OVERLAP, (0, 40, 80, 120, 160, 180, 190, 200, 205, 205.9, 205.921)),
}
#: From weak to strong coupling of a pair.
LAMBDAS = (5.0, 10.0, 30.0, 100.0)
MM, MJ = 1e3, 1e3


def fig4() -> None:
    """Margin, reserve and distance to the snap along both sweeps of Fig. 4."""
    for name, (D, angles) in SWEEPS.items():
        solver, rows = EquilibriumSolver(SEED, TOLERANCE), []
        for degrees in angles:
            answer = solver.solve([0.0, np.radians(degrees)], D)
            left = np.degrees(solver.distance_to_snap()[1, 1])
            rows.append([f"{degrees:g}", f"{answer.stability_margin:.4f}", f"{answer.snap_reserve:.4f}", f"{left:.5f}"])
        publish(f"fig4 {name}", table(["α₂ [deg]", "margin", "reserve", "to the snap [deg]"], rows), STABILITY)


def snaps() -> None:
    """The folds of Fig. 4 as the solver meets them, and as integration from the tip finds them."""
    rows = []
    for name, (D, _) in SWEEPS.items():
        solver = EquilibriumSolver(SEED, TOLERANCE)
        solver.solve([0.0, 0.0], D)
        (snap,) = solver.follow([0.0, np.radians(300.0)], D).snaps
        exact = max(np.degrees(fold.alpha) for fold in folds(SEED, D) if fold.maximum and fold.ends_stable)
        end = np.array([SEED.tubes[0].length - D[0]])
        tips = [np.degrees(np.diff(_shape(state).angles_at(end))[0, 0]) for state in (snap.before, snap.after)]
        values = np.degrees(snap.alpha[1]), exact, *tips, MJ * snap.energy_released
        rows.append([name, *(f"{value:.{digits}f}" for value, digits in zip(values, (6, 6, 2, 2, 1), strict=True))])
    head = [
        "sweep", "snap at α₂ [deg]", "fold, from the tip [deg]", "θ(L₁) before [deg]", "after [deg]", "released [mJ]",
    ]  # fmt: skip
    publish("fig4 snaps", table(head, rows), STABILITY)


def _shape(state: State) -> TorsionShape:
    return TorsionShape(Engine(SEED, TOLERANCE), state)


def distances() -> None:
    """Every actuator, in both directions, seen from one command of Fig. 4."""
    solver = EquilibriumSolver(SEED, TOLERANCE)
    solver.solve([0.0, np.radians(240.0)], FULL_OVERLAP)
    distance = solver.distance_to_snap()
    rows = []
    for index, name in enumerate(("α₁", "α₂", "D₁", "D₂")):
        ways = np.degrees(distance[index]) if index < 2 else MM * distance[index]
        unit = "deg" if index < 2 else "mm"
        rows.append([name, *(f"{way:.3f} {unit}" if np.isfinite(way) else "none" for way in ways)])
    publish("distances", table(["actuator", "towards −", "towards +"], rows), STABILITY)


def ritz() -> None:
    """The critical lambda that polynomials of low degree see, at theta = pi, b = 0, where q = 0 is an equilibrium."""
    rows, exact = [], 0.25 * np.pi**2
    robot, D = pair(2.0, 0.0)
    for degree in range(4):
        energy = FixedDegree(robot, D, degree, fine=True)
        margin = energy.margin(np.zeros(energy.n), np.array([0.0, np.pi]))
        seen = 2.0 / (1.0 - margin)  # along this state the lowest eigenvalue falls linearly in lambda
        rows.append([str(degree), f"{seen:.6f}", f"{100.0 * (seen / exact - 1.0):.4f} %"])
    publish("ritz", table(["degree", "critical λ", "too high by"], rows), STABILITY)


def recheck() -> None:
    """What the margin close to the fold of Fig. 4 looks like at each degree, the state solved at that degree."""
    solver = EquilibriumSolver(SEED, TOLERANCE)
    near = solver.solve([0.0, np.radians(281.8)], FULL_OVERLAP)
    rows = []
    for degree in (3, 4, 5, 6, 7, 9, 12):
        energy = FixedDegree(SEED, FULL_OVERLAP, degree, fine=True)
        margins = []
        for degrees in (281.0, 281.8):
            alpha = np.array([0.0, np.radians(degrees)])
            found, _ = stationary(energy, alpha, nearest(energy, near.shape, near.alpha), np.inf)
            margins.append("no equilibrium" if found is None else f"{energy.margin(found, alpha):.6f}")
        rows.append([str(degree), *margins])
    publish("recheck", table(["degree", "margin at 281°", "margin at 281.8°"], rows), STABILITY)


def from_zero_twist() -> None:
    """Descent from zero twist against the path from the relaxed robot, on Fig. 4."""
    rows = []
    energy = FixedDegree(SEED, FULL_OVERLAP, 9)
    unit = float(np.sqrt(SEED.tubes[0].segments[0].torsional_stiffness / SEED.tubes[0].length))
    for degrees in (100, 140, 170, 175, 179, 181, 200, 240, 280):
        alpha = np.array([0.0, np.radians(degrees)])
        found = minimize(
            lambda x, alpha=alpha: energy.value(unit * x, alpha) / unit**2,
            np.zeros(energy.n),
            jac=lambda x, alpha=alpha: energy.gradient(unit * x, alpha) / unit,
            hess=lambda x, alpha=alpha: energy.hessian(unit * x, alpha),
            method="trust-exact",
            options={"gtol": 1e-10},
        )
        answer = EquilibriumSolver(SEED, TOLERANCE).solve(alpha, FULL_OVERLAP, "cold")
        here = min(
            equilibria(SEED, alpha, FULL_OVERLAP, TOLERANCE).stable,
            key=lambda one: _apart(one.shape, energy.shape(unit * found.x, alpha)),
        )
        end = np.array([SEED.tubes[0].length - FULL_OVERLAP[0]])
        tips = [np.degrees(np.diff(one.twist(end))[0, 0]) for one in (answer, here)]
        off = MM * float(np.linalg.norm(here.tip.position - answer.tip.position))
        rows.append([f"{degrees:g}", *(f"{tip:.2f}" for tip in tips), f"{off:.2f}"])
    head = ["α₂ [deg]", "path: θ(L₁) [deg]", "descent: θ(L₁) [deg]", "tips apart [mm]"]
    publish("zero twist", table(head, rows), STABILITY)


def _apart(one: Shape, other: Shape) -> float:
    s = np.linspace(0.0, 0.09, 10)
    return float(np.abs(one.angles_at(s) - other.angles_at(s)).max())


def pitchfork() -> None:
    """A pair held antialigned and pushed out: where the symmetric state is left."""
    robot, _ = pair(4.0, 0.0)
    solver = EquilibriumSolver(robot, TOLERANCE)
    alpha, length = [0.0, np.pi], robot.tubes[0].length
    solver.solve(alpha, [length - 0.02] * 2)
    answer = solver.follow(alpha, [0.0, 0.0])
    (snap,) = answer.snaps
    # Out by x: lambda = 4 (x / L)^2 and b = (L - x) / x.
    exact = brentq(lambda x: stability_function(4.0 * (x / length) ** 2, (length - x) / x), 0.2 * length, 0.99 * length)
    tip = np.degrees(np.diff(answer.twist(np.array([length])))[0, 0])
    values = MM * (length - snap.D[0]), MM * exact, snap.energy_released, tip
    rows = [[format(value, form) for value, form in zip(values, (".4f", ".4f", ".1e", ".2f"), strict=True)]]
    head = ["left at overlap [mm]", "stability function 0 at [mm]", "released there [J]", "θ(tip) when out [deg]"]
    publish("pitchfork", table(head, rows), STABILITY)


def strong(lambdas: tuple[float, ...] = LAMBDAS) -> None:
    """Strong coupling: a little more than one turn, and what it takes; the strongest should snap once, within a
    second."""
    rows = []
    for lam in lambdas:
        robot, D = pair(lam, 0.1)
        solver, begin = EquilibriumSolver(robot, 1e-6), time.perf_counter()
        answer = solver.solve([0.0, 2.2 * np.pi], D, "cold")
        spent = time.perf_counter() - begin
        exact = TwoTubes(lam, 0.1).snap
        if exact is None or not answer.snaps:
            raise RuntimeError(f"lambda = {lam}: expected a snap, got {answer.message}")
        panels = max(answer.shape.panels(m) for m in range(answer.shape.domain.n_sections))
        first = answer.snaps[0]
        released = [snap.energy_released for snap in answer.snaps]
        smallest = min(released) / sum(released)
        values = panels, answer.degrees_of_freedom, first.alpha[1], exact.alpha, len(released), smallest, spent
        rows.append([f"{lam:g}", *(f"{v:.6f}" if i in (2, 3) else f"{v:.2g}" for i, v in enumerate(values))])
    places = ["first snap [rad]", "closed form [rad]"]
    head = ["λ", "panels", "unknowns", *places, "snaps", "smallest [of the energy]", "time [s]"]
    publish("strong", table(head, rows), STABILITY)


if __name__ == "__main__":
    for part in (fig4, snaps, distances, ritz, recheck, pitchfork, from_zero_twist, strong):
        part()
