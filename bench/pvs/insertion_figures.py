"""The figures of docs/insertion_forces.md."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from bench.pvs.command_loops import by_equation_41
from bench.pvs.command_loops import kinks
from bench.pvs.command_loops import travel
from bench.pvs.insertion_cases import TOLERANCE
from bench.pvs.insertion_cases import Case
from bench.pvs.smoothed_rod import smoothed_forces
from ctr_pvs import EquilibriumSolver
from ctr_pvs import Robot
from ctr_pvs.errors import FieldError
from ctr_pvs.solve.equilibria import folds

Array = NDArray[np.float64]

MM, MJ = 1e3, 1e3
OURS, SEED_MODEL, CHECK, QUIET = "#1f5fa8", "#c8502d", "#222222", "#8a8a8a"
PALE = ("#9cc3e6", "#4f8fcb")


def draw_forces(robot: Robot, path: Path) -> None:
    """Forces while the inner tube slides through three kinks, by both models and by differences of the energy."""
    alpha, start, end = np.radians([0.0, 100.0]), np.array([0.15, 0.165]), np.array([0.15, 0.29])
    solver = EquilibriumSolver(robot, TOLERANCE)
    cuts = kinks(robot, np.concatenate([alpha, start]), np.concatenate([alpha, end]))
    D2 = [start[1] + t * (end[1] - start[1]) for t in (0.0, *cuts, 1.0)]
    figure = Figure(figsize=(7.6, 5.6), dpi=110, layout="constrained")
    panels = figure.subplots(2, 1, sharex=True)
    for a, b in itertools.pairwise(D2):
        places = np.linspace(a + 1e-6, b - 1e-6, 60)
        answers = [solver.solve(alpha, [start[0], D]) for D in places]
        for tube, panel in enumerate(panels):
            panel.plot(MM * places, [answer.force[tube] for answer in answers], color=OURS, linewidth=2.0)
            try:
                printed = [by_equation_41(answer)[tube] for answer in answers]
            except FieldError:
                continue
            panel.plot(MM * places, printed, "--", color=SEED_MODEL, linewidth=2.0)
        _energy_differences(panels, solver, alpha, start[0], a, b)
    for D, what in zip(
        D2[1:-1],
        ("inner curve starts\nat the outer tip", "inner curve starts\nat the orifice", "tips level"),
        strict=True,
    ):
        _kink(panels, solver, alpha, np.array([start[0], D]), what)
    _force_legend(panels, MM * start[1], MM * end[1])
    figure.savefig(path)


def _energy_differences(panels: Array, solver: EquilibriumSolver, alpha: Array, D1: float, a: float, b: float) -> None:
    step, count = 1e-4, max(3, round((b - a) / 0.007))
    for D2 in a + (b - a) * (np.arange(count) + 0.5) / count:
        for tube, panel in enumerate(panels):
            shift = step * np.eye(2)[tube]
            high, low = (solver.solve(alpha, [D1, D2] + sign * shift).energy for sign in (1, -1))
            panel.plot(MM * D2, (high - low) / (2 * step), "o", color=CHECK, markersize=3.5)


def _kink(panels: Array, solver: EquilibriumSolver, alpha: Array, D: Array, what: str) -> None:
    answer = solver.solve(alpha, D)
    for panel, interval in zip(panels, answer.force_interval, strict=True):
        panel.axvline(MM * D[1], color=QUIET, linewidth=0.8, linestyle=":")
        panel.plot([MM * D[1]] * 2, interval, color=OURS, linewidth=5.0, alpha=0.35, solid_capstyle="butt")
    place = panels[0].get_xaxis_transform()
    panels[0].text(MM * D[1], 1.03, what, fontsize=9, color="#555555", ha="center", va="bottom", transform=place)


def _force_legend(panels: Array, low: float, high: float) -> None:
    for tube, panel in enumerate(panels):
        panel.set_ylabel(f"force on the {('outer', 'inner')[tube]} tube, +D [N]")
        panel.axhline(0.0, color=QUIET, linewidth=0.6)
        panel.set_xlim(low, high)
        panel.margins(y=0.12)
    panels[1].set_xlabel("D₂ [mm]: the inner tube is pulled back to the right")
    panels[0].plot([], [], color=OURS, linewidth=2.0, label="virtual work, dE/dD")
    panels[0].plot([], [], color=OURS, linewidth=5.0, alpha=0.35, label="between the one-sided values at a kink")
    panels[0].plot([], [], "o", color=CHECK, markersize=3.5, label="differences of the energy")
    panels[0].plot([], [], "--", color=SEED_MODEL, linewidth=2.0, label="eq. (41) on +D, where it applies")
    panels[0].legend(fontsize=8, loc="lower left", frameon=False, bbox_to_anchor=(0.45, 0.2))


def draw_smoothing(case: Case, seed: Robot, path: Path) -> None:
    """Axial force along tube 2 with smoothed jumps, and the seed's kink resolved."""
    figure = Figure(figsize=(9.6, 4.0), dpi=110, layout="constrained")
    along, across = figure.subplots(1, 2)
    _draw_axial_force(along, case)
    _draw_resolved_kink(across, seed)
    figure.savefig(path)


def _draw_axial_force(panel: Axes, case: Case) -> None:
    answer = case.solve()
    tip_angle = float(np.diff(answer.twist(np.array([case.tip]))[0])[0])
    for width, style, colour in ((20e-3, ":", PALE[0]), (5e-3, "--", PALE[1]), (1e-4, "-", OURS)):
        found = smoothed_forces(case.robot, case.alpha, case.D, width, tip_angle)
        s = np.concatenate([[-0.02], found.s, [case.tip + 0.02]])
        axial = np.concatenate([found.axial[1, :1], found.axial[1], [0.0]])
        panel.plot(MM * s, axial, style, color=colour, linewidth=1.8, label=f"jumps over {MM * width:g} mm")
    panel.axhline(answer.force[1], color=CHECK, linewidth=1.0, linestyle=(0, (1, 2)))
    panel.text(100.0, answer.force[1] + 0.05, f"dE/dD₂ = {answer.force[1]:.3f} N", fontsize=9, color=CHECK, va="bottom")
    overlap = np.linspace(0.0, case.tip, 60)
    fine = smoothed_forces(case.robot, case.alpha, case.D, 1e-5, tip_angle)
    without_tip = np.interp(overlap, fine.s, fine.axial[1]) - np.interp(case.tip - 2e-5, fine.s, fine.axial[1])
    panel.plot(
        MM * overlap[1:-1], without_tip[1:-1], "--", color=SEED_MODEL, linewidth=1.8, label="what (41) integrates"
    )
    printed = by_equation_41(answer)[1]
    shown = f"−(41) = −{abs(printed):.3f} N"
    panel.annotate(
        shown, (0.0, printed), (35.0, printed), fontsize=9, color=SEED_MODEL, va="center",
        arrowprops={"arrowstyle": "-", "color": SEED_MODEL, "linewidth": 0.8},
    )  # fmt: skip
    panel.set_xlabel("s [mm] from the orifice")
    panel.set_ylabel("axial force in the inner tube [N]")
    panel.set_title("Table II f): orifice at 0, outer tip at 160 mm", fontsize=10)
    panel.legend(fontsize=8, loc="lower right", frameon=False)


def _draw_resolved_kink(panel: Axes, seed: Robot) -> None:
    alpha, D2, kink = np.radians([0.0, 100.0]), 0.2085, 0.0935
    solver = EquilibriumSolver(seed, TOLERANCE)
    reach = 1.5e-3
    for width, colour, style in ((1e-3, PALE[1], "--"), (1e-4, OURS, "-")):
        places = np.unique([*np.linspace(-reach, reach, 7), *np.linspace(-1.5 * width, 1.5 * width, 25)])
        forces = [_outer_force(solver, seed, alpha, np.array([kink + x, D2]), width) for x in places]
        panel.plot(MM * places, forces, style, color=colour, linewidth=1.8, label=f"jumps over {MM * width:g} mm")
    low, high = solver.solve(alpha, [kink, D2]).force_interval[0]
    panel.plot(
        [0.0, 0.0], [low, high], color=CHECK, linewidth=5.0, alpha=0.3, solid_capstyle="butt", label="force_interval"
    )
    panel.set_xlabel("D₁ − 93.5 mm [mm]")
    panel.set_ylabel("force on the outer tube, +D [N]")
    panel.set_title("Fig. 4, full overlap, 100°: the kink resolved", fontsize=10)
    panel.legend(fontsize=8, loc="upper left", frameon=False)


def _outer_force(solver: EquilibriumSolver, robot: Robot, alpha: Array, D: Array, width: float) -> float:
    answer = solver.solve(alpha, D)
    tip_angle = float(np.diff(answer.twist(np.array([robot.tubes[0].length - D[0]]))[0])[0])
    return float(smoothed_forces(robot, alpha, D, width, tip_angle).force[0])


def draw_cusp(robot: Robot, loop: Sequence[Array], cusp: float, path: Path) -> None:
    """The loop round the cusp, which is at D_2 = ``cusp`` [m], in the plane of commands, and energy and work on it."""
    figure = Figure(figsize=(9.6, 4.2), dpi=110, layout="constrained")
    plane, along = figure.subplots(1, 2)
    _draw_plane(plane, robot, loop, cusp)
    _draw_work(along, robot, loop)
    figure.savefig(path)


def _draw_plane(panel: Axes, robot: Robot, commands: Sequence[Array], cusp: float) -> None:
    D2 = cusp + (0.19 - cusp) * np.linspace(0.05, 1.0, 60) ** 2
    sides = [np.mod([fold.alpha for fold in folds(robot, [commands[0][2], D])], 2.0 * np.pi) for D in D2]
    lines = np.degrees([[np.pi, np.pi], *(np.sort(side) for side in sides)])
    D2 = MM * np.array([cusp, *D2])
    panel.fill_betweenx(D2, *lines.T, color="#f0dfae", label="two stable equilibria")
    panel.plot(lines, D2, color="#a67c00", linewidth=1.2)
    panel.plot(180.0, D2[0], "o", color="#a67c00", markersize=4)
    panel.annotate("cusp", (180.0, D2[0]), (180.0, D2[0] - 5.0), ha="center", fontsize=9, color="#7a5c00")
    corners = np.array([[np.degrees(c[1]), MM * c[3]] for c in commands])
    for a, b in itertools.pairwise(corners):
        panel.plot(*np.transpose([a, b]), color=OURS, linewidth=2.0)
        panel.annotate("", 0.45 * a + 0.55 * b, 0.55 * a + 0.45 * b, arrowprops={"arrowstyle": "-|>", "color": OURS})
    panel.plot(*corners[0], "o", color=OURS, markersize=6)
    panel.annotate("start, end", corners[0], corners[0] + [0.0, 2.0], ha="center", fontsize=9, color=OURS)
    panel.set(xlabel="α₂ [deg]", ylabel="D₂ [mm]", xlim=(105, 255), ylim=(122, 190), xticks=range(120, 241, 30))
    panel.legend(fontsize=8, loc="lower left", frameon=False, bbox_to_anchor=(0.18, 0.13))
    panel.set_title("commands, D₁ = 90 mm", fontsize=10)


def _draw_work(panel: Axes, robot: Robot, commands: Sequence[Array]) -> None:
    parts = 8
    path = [commands[0]]
    for a, b in itertools.pairwise(commands):
        path += [a + (b - a) * i / parts for i in range(1, parts + 1)]
    trip = travel(EquilibriumSolver(robot, TOLERANCE), path)
    energy = MJ * (np.array([corner.energy for corner in trip.corners]) - trip.corners[0].energy)
    legs = np.arange(len(path)) / parts
    panel.plot(legs, energy, color=OURS, linewidth=2.0, label="E − E(start)")
    panel.plot(legs, MJ * trip.work, "o", color=CHECK, markersize=3.0, label="work of the actuators")
    panel.axhline(0.0, color=QUIET, linewidth=0.6)
    for leg in range(1, len(commands) - 1):
        panel.axvline(leg, color=QUIET, linewidth=0.6, linestyle=":")
    end = np.array([robot.tubes[0].length - commands[0][2]])
    for index, side in ((0, "left"), (-1, "right")):
        angle = np.degrees(np.diff(trip.corners[index].twist(end)[0])[0])
        shift = 0.1 if side == "left" else -0.1
        panel.text(legs[index] + shift, energy[index] + 4.0, f"θ_tip = {angle:.1f}°", fontsize=9, ha=side)
    panel.text(legs[-1] - 0.3, energy[-1] - 3.0, f"−{abs(energy[-1]):.2f} mJ", fontsize=9, ha="right")
    panel.set(xlabel="leg of the loop", ylabel="energy [mJ]", xlim=(0, len(commands) - 1), ylim=(-125, 22))
    panel.set_xticks(np.arange(5) + 0.5, ["α₂ →120°", "D₂ →130", "α₂ →240°", "D₂ →170.5", "α₂ →190°"], fontsize=8)
    panel.tick_params(axis="x", length=0)
    panel.legend(fontsize=8, loc="upper center", frameon=False)
    panel.set_title("energy and work along the loop", fontsize=10)
