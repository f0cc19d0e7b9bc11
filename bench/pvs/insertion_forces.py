"""Recompute every number and figure of docs/insertion_forces.md.

    scripts/in_env.sh python3 -m bench.pvs.insertion_forces

Tables are printed, and written into the document between their markers; figures go to docs/figures.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from bench.common.document import publish
from bench.common.document import table
from bench.common.places import DOCS
from bench.pvs import insertion_figures
from bench.pvs.command_loops import by_equation_41
from bench.pvs.command_loops import by_virtual_work
from bench.pvs.command_loops import travel
from bench.pvs.insertion_cases import CUSP_LOOP
from bench.pvs.insertion_cases import SEED
from bench.pvs.insertion_cases import TOLERANCE
from bench.pvs.insertion_cases import Case
from bench.pvs.insertion_cases import jump_case
from bench.pvs.insertion_cases import table_2_cases
from bench.pvs.smoothed_rod import smoothed_forces
from ctr_pvs import EquilibriumSolver
from ctr_pvs.oracles.two_tubes import two_tube_parameters
from ctr_pvs.solve.equilibria import folds

Array = NDArray[np.float64]

DOCUMENT = DOCS / "insertion_forces.md"
WIDTHS = (1e-3, 1e-4, 1e-5)
MM, MJ = 1e3, 1e3


def identity_table() -> str:
    """Eq. (41), what it leaves out at the orifice and at tube 1's tip, and dE/dD_2."""
    rows = []
    for case in table_2_cases():
        answer = case.solve()
        K2 = case.robot.tubes[1].segments[0].bending_stiffness
        at_orifice, before_tip = (abs(answer.shape.curvature(0, np.array([x]))[0]) for x in (0.0, 1.0))
        own = abs(case.robot.tubes[1].segments[0].pre_curvature(case.tip + case.D[1]))
        mouth, tip = 0.5 * K2 * at_orifice**2, 0.5 * K2 * (own**2 - before_tip**2)
        along = by_equation_41(answer)[1]
        total, force = along + mouth + tip, answer.force[1]
        forces = (f"{value:.5f}" for value in (-along, along, mouth, tip, total, force))
        rows.append([case.name, case.printed, *forces, _small(total - force, "1e-8")])
    heads = ["row", "τ_D2 printed", "(41) as it stands", "−(41)", "orifice", "tip of tube 1", "sum", "dE/dD₂"]
    return table([*heads, "difference"], rows)


def smoothing_table() -> str:
    """Newton's law with the jumps smoothed, against dE/dD."""
    rows = []
    for case in [*table_2_cases(), jump_case()]:
        answer = case.solve()
        tip_angle = float(np.diff(answer.twist(np.array([case.tip]))[0])[0])
        forces = [smoothed_forces(case.robot, case.alpha, case.D, width, tip_angle).force for width in WIDTHS]
        for tube in (0, 1):
            found = [f"{force[tube]:.5f}" for force in forces]
            rows.append([case.name, f"{tube + 1}", *found, f"{answer.force[tube]:.5f}"])
    return table(["row", "tube", *(f"w = {MM * width:g} mm" for width in WIDTHS), "dE/dD"], rows)


def kink_table() -> str:
    """The seed's own kinks: where tube 1 is curved from just past the orifice on."""
    rows = []
    for name, D2 in (("full overlap", 0.2085), ("partial overlap", 0.1705)):
        answer = EquilibriumSolver(SEED, TOLERANCE).solve(np.radians([0.0, 100.0]), [0.0935, D2])
        for tube, (low, high) in enumerate(answer.force_interval):
            rows.append([name, f"{tube + 1}", f"{low:.4f}", f"{high:.4f}", f"{high - low:.4f}"])
    return table(["command", "tube", "towards −D [N]", "towards +D [N]", "jump [N]"], rows)


def rectangle(case: Case, sides: dict[int, float]) -> list[Array]:
    """A closed path of commands: out along one side, out along the other, back, back.  sides : index -> length."""
    (i, a), (j, b) = sides.items()
    steps = np.zeros((5, 4))
    steps[1:3, i], steps[2:4, j] = a, b
    return list(np.concatenate([case.alpha, case.D]) + steps)


def loop_table() -> str:
    """Work round closed loops."""
    b, _, _, _, f = table_2_cases()
    quarter = np.pi / 2
    loops = [
        (b, {2: 0.04, 3: 0.04}, "D₁ 50 → 90 mm, D₂ 200 → 240 mm"),
        (f, {2: -0.03, 3: 0.04}, "D₁ 70 → 40 mm, D₂ 80 → 120 mm"),
        (f, {1: -quarter, 2: -0.03}, "α₂ 90 → 0°, D₁ 70 → 40 mm"),
        (f, {1: -quarter, 3: 0.04}, "α₂ 90 → 0°, D₂ 80 → 120 mm"),
    ]
    rows = []
    for case, sides, name in loops:
        solver = EquilibriumSolver(case.robot, TOLERANCE)
        path = rectangle(case, sides)
        work = [travel(solver, path, forces).work[-1] for forces in (by_virtual_work, by_equation_41)]
        rows.append([case.name, name, *(_small(MJ * value, "1e-6", "{:.3f}") for value in work)])
    return table(["row", "loop", "virtual work [mJ]", "by (41) [mJ]"], rows)


def cusp_table() -> str:
    """The loop round the cusp, corner by corner."""
    trip = travel(EquilibriumSolver(SEED, TOLERANCE), CUSP_LOOP)
    end = SEED.tubes[0].length - CUSP_LOOP[0][2]
    rows = []
    for command, corner, work in zip(CUSP_LOOP, trip.corners, trip.work, strict=True):
        tip_angle = np.degrees(np.diff(corner.twist(np.array([end]))[0])[0])
        change = corner.energy - trip.corners[0].energy
        numbers = (f"{tip_angle:.2f}", f"{corner.stability_margin:.3f}", f"{corner.energy:.5f}", f"{change:.5f}")
        rows.append([f"{np.degrees(command[1]):.0f}", f"{MM * command[3]:.1f}", *numbers, f"{work:.5f}"])
    return table(["α₂ [deg]", "D₂ [mm]", "θ_tip [deg]", "margin", "E [J]", "E − E(start) [J]", "work [J]"], rows)


def cusp_D2() -> float:
    """D_2 [m] of the cusp of the seed's tubes at D_1 = 90 mm: a half turn of tube 1's tip turns from stable to not."""

    def slope(D2: float) -> float:
        return float(two_tube_parameters(SEED, [CUSP_LOOP[0][2], D2]).slope(np.pi))

    return float(brentq(slope, 0.13, 0.17))


def fold_table() -> str:
    """Where the folds of the seed's tubes lie at D_1 = 90 mm."""
    D1, D2 = CUSP_LOOP[0][2:]
    at = np.degrees(np.mod([fold.alpha for fold in folds(SEED, [D1, D2])], 2.0 * np.pi))
    rows = [
        ["cusp", f"{MM * cusp_D2():.2f}", "180"],
        ["folds", f"{MM * D2:.1f}", ", ".join(f"{angle:.3f}" for angle in np.sort(at))],
    ]
    return table(["", "D₂ [mm]", "α₂ [deg]"], rows)


TABLES = {
    "identity": identity_table,
    "smoothing": smoothing_table,
    "kinks": kink_table,
    "loops": loop_table,
    "cusp": cusp_table,
    "folds": fold_table,
}


def _small(value: float, limit: str, form: str = "{:.1e}") -> str:
    return f"below {limit}" if abs(value) < float(limit) else form.format(value)


def main() -> None:
    for name, make in TABLES.items():
        publish(name, make(), DOCUMENT)
    figures = DOCS / "figures"
    insertion_figures.draw_forces(SEED, figures / "insertion_forces_kinks.png")
    insertion_figures.draw_smoothing(table_2_cases()[-1], SEED, figures / "insertion_forces_smoothed.png")
    insertion_figures.draw_cusp(SEED, CUSP_LOOP, cusp_D2(), figures / "insertion_forces_cusp.png")


if __name__ == "__main__":
    main()
