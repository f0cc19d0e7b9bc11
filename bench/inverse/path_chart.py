"""A tip that traces a circle, and one that goes along a needle's path: shapes, joints, margin and deviation."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from bench.inverse.scenes import FLOOR
from bench.inverse.scenes import TOLERANCE
from bench.inverse.scenes import scenes
from ctr_pvs import EquilibriumSolver
from ctr_pvs import Robot
from ctr_pvs.tasks.motion import Motion

Array = NDArray[np.float64]

MM = 1e3
#: How near the tip keeps to a path, and the path's corners to the curve they stand for [m].
KEPT = 1e-4
#: Radius of the circle; radius, length and beginning of the needle's path [m].
CIRCLE, ARC, LENGTH, BEGIN = 0.010, 0.2, 0.09, 0.02
#: Shapes drawn; places of a body.
SHAPES, PLACES = 9, 80
COLOURS = ("#4053d3", "#b51d14", "#00916e")
GREY = "#9a9a9a"


def circle(middle: Array) -> Array:
    """(M, 3) [m] across the insertion direction, once around."""
    turn = np.linspace(0.0, 2.0 * np.pi, 181)
    return middle + CIRCLE * np.column_stack([np.zeros_like(turn), np.cos(turn), np.sin(turn)])


def needle_path() -> Array:
    """(M, 3) [m] an arc that begins on the insertion axis, along it."""
    turn = np.linspace(0.0, LENGTH / ARC, 91)
    return np.column_stack([BEGIN + ARC * np.sin(turn), ARC * (1.0 - np.cos(turn)), np.zeros_like(turn)])


def draw_circle(path: Path) -> None:
    """The three-tube robot, from half out."""
    scene = next(scene for scene in scenes() if scene.name == "three_tubes")
    solver = EquilibriumSolver(scene.robot, TOLERANCE)
    start = solver.solve(*scene.start)
    line = circle(start.tip.position)
    _draw(path, scene.robot, _moved(solver, line, start.alpha, start.D), line, (0, 1), (1, 2), "a circle")


def draw_needle(path: Path) -> None:
    """The same robot, from a little way out; the body strays from the tip's track by what is told."""
    scene = next(scene for scene in scenes() if scene.name == "three_tubes")
    solver = EquilibriumSolver(scene.robot, TOLERANCE)
    line = needle_path()
    motion = _moved(solver, line, *scene.start)
    stray = MM * solver.follow_the_leader(motion.alpha, motion.D).worst
    what = f"a needle's path; the body strays from the track by up to {stray:.1f} mm"
    _draw(path, scene.robot, motion, line, (0, 1), (0, 2), what)


def _moved(solver: EquilibriumSolver, line: Array, alpha: Array, D: Array) -> Motion:
    motion = solver.motion(line, tolerance=KEPT, start=(alpha, D))
    assert motion.success, motion.message
    return motion


def _draw(
    path: Path, robot: Robot, motion: Motion, line: Array, first: tuple[int, int], second: tuple[int, int], what: str
) -> None:
    figure = Figure(figsize=(11.5, 6.2), dpi=110)
    views = figure.add_axes((0.07, 0.56, 0.38, 0.36)), figure.add_axes((0.07, 0.09, 0.38, 0.36))
    for view, axes in zip(views, (first, second), strict=True):
        _draw_shapes(view, robot, motion, line, axes)
    curves = [figure.add_axes((0.56, 0.74 - 0.2175 * row, 0.4, 0.18)) for row in range(4)]
    _draw_curves(curves, robot, motion)
    figure.suptitle(f"{robot.name} along {what}", fontsize=12)
    figure.savefig(path)


def _draw_shapes(view: Axes, robot: Robot, motion: Motion, line: Array, axes: tuple[int, int]) -> None:
    solver = EquilibriumSolver(robot, TOLERANCE)
    for index in np.linspace(0, len(motion.time) - 1, SHAPES).astype(int):
        shape = MM * solver.solve(motion.alpha[index], motion.D[index]).backbone(PLACES).position
        view.plot(*shape[:, axes].T, color=GREY, linewidth=1.2)
        view.plot(*shape[-1, axes], "o", color="#333333", markersize=3.5)
    view.plot(*(MM * line[:, axes]).T, color="#e08a00", linewidth=2.2, alpha=0.8)
    view.set_aspect("equal", adjustable="datalim")
    view.set_xlabel(f"{'xyz'[axes[0]]} [mm]")
    view.set_ylabel(f"{'xyz'[axes[1]]} [mm]")
    view.grid(True, color="#e5e5e5", linewidth=0.6)


def _draw_curves(curves: list[Axes], robot: Robot, motion: Motion) -> None:
    """Joints, margin and deviation along the path."""
    along = MM * motion.progress
    for axes, values in zip(curves, (np.degrees(motion.alpha - motion.alpha[0]), MM * motion.D), strict=False):
        for tube, column, colour in zip(robot.tubes, values.T, COLOURS, strict=False):
            axes.plot(along, column, color=colour, linewidth=1.5, label=tube.name)
    curves[0].legend(fontsize=8, frameon=False, ncols=3, loc="best")
    curves[2].plot(along, motion.margin, color="black", linewidth=1.5)
    curves[2].axhline(FLOOR, color="#b51d14", linewidth=1.0, linestyle="--")
    curves[2].set_ylim(0.0, 1.05)
    curves[3].semilogy(along, np.maximum(1e6 * motion.deviation, 1e-3), color="black", linewidth=1.0)
    curves[3].axhline(1e6 * KEPT, color="#b51d14", linewidth=1.0, linestyle="--")
    labels = ("turned [deg]", "D [mm]", "margin", "off the path [µm]")
    for axes, label in zip(curves, labels, strict=True):
        axes.set_ylabel(label, fontsize=9)
        axes.tick_params(labelsize=8)
        axes.grid(True, color="#e5e5e5", linewidth=0.6)
        if axes is not curves[-1]:
            axes.set_xticklabels([])
    curves[-1].set_xlabel("along the path [mm]", fontsize=9)
