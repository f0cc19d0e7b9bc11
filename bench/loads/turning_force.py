"""A robot whose tip is pulled to one side after the other."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from bench.common.scenes import PARTIAL_OVERLAP
from bench.common.scenes import SEED
from ctr_pvs import EquilibriumSolver
from ctr_pvs import Loads

Array = NDArray[np.float64]

MM = 1e3
#: The command, the size of the drawn shapes' force and of all whose tips are drawn [N].
ALPHA, SHOWN, SIZES = np.radians([0.0, 60.0]), 1.0, (0.25, 0.5, 1.0)
#: Shapes, and tips of one turn; length of an arrow [mm].
SHAPES, TIPS, ARROW = 12, 72, 12.0
COLOURS = colormaps["twilight_shifted"]
TOLERANCE = 1e-6


def force_at(angle: float, size: float) -> Loads:
    """Across the insertion direction."""
    return Loads((0.0, size * float(np.cos(angle)), size * float(np.sin(angle))))


def draw_turning(path: Path) -> None:
    """Shapes in space, and tips seen against the insertion direction."""
    figure = Figure(figsize=(11.5, 5.0), dpi=110)
    space = figure.add_axes((0.0, 0.02, 0.5, 0.9), projection="3d")
    front = figure.add_axes((0.6, 0.12, 0.38, 0.78))
    _draw_shapes(space)
    _draw_tips(front)
    figure.savefig(path)


def _draw_shapes(space: Axes) -> None:
    solver = EquilibriumSolver(SEED, TOLERANCE)
    for index in range(SHAPES):
        angle = 2.0 * np.pi * index / SHAPES
        answer = solver.solve(ALPHA, PARTIAL_OVERLAP, loads=force_at(angle, SHOWN))
        line, colour = MM * answer.backbone(60).position, COLOURS(index / SHAPES)
        space.plot(*line.T, color=colour, linewidth=1.8)
        arrow = ARROW * np.array(answer.applied_loads.tip_force)
        space.quiver(*line[-1], *arrow, color=colour, linewidth=1.2, arrow_length_ratio=0.3)
    bare = MM * solver.solve(ALPHA, PARTIAL_OVERLAP).backbone(60).position
    space.plot(*bare.T, color="black", linewidth=2.6)
    outer = MM * solver.solve(ALPHA, PARTIAL_OVERLAP).tube_backbone(0, 40).position
    space.plot(*outer.T, color="black", linewidth=5.0, alpha=0.25)
    space.set_xticks(range(0, 101, 25))
    space.set_yticks(range(-10, 41, 25))
    space.set_zticks(range(-75, 1, 25))  # type: ignore[attr-defined]
    space.set_xlabel("x [mm]")  # type: ignore[attr-defined]
    space.set_ylabel("y [mm]")
    space.set_zlabel("z [mm]")  # type: ignore[attr-defined]
    space.set_aspect("equal")
    space.view_init(elev=18.0, azim=-62.0)  # type: ignore[attr-defined]
    space.set_title(f"{SHOWN:g} N across the tip, turning; black: no load", fontsize=11)


def _draw_tips(front: Axes) -> None:
    solver = EquilibriumSolver(SEED, TOLERANCE)
    for size in SIZES:
        tips = []
        for index in range(TIPS + 1):
            answer = solver.solve(ALPHA, PARTIAL_OVERLAP, loads=force_at(2.0 * np.pi * index / TIPS, size))
            tips.append(MM * answer.tip.position)
        track = np.array(tips)
        front.plot(track[:, 1], track[:, 2], color="#555555", linewidth=1.0, zorder=1)
        colours = [COLOURS(index / TIPS) for index in range(TIPS + 1)]
        front.scatter(track[:, 1], track[:, 2], c=colours, s=14, zorder=2)
    bare = MM * solver.solve(ALPHA, PARTIAL_OVERLAP).tip.position
    front.plot(*bare[1:], "o", color="black", markersize=6)
    front.set_aspect("equal")
    front.margins(0.1)
    front.set_xlabel("y of the tip [mm]")
    front.set_ylabel("z of the tip [mm]")
    front.grid(True, color="#e5e5e5", linewidth=0.6)
    sizes = ", ".join(f"{size:g}" for size in SIZES)
    front.set_title(f"where the tip goes in one turn of {sizes} N", fontsize=11)
    for side in ("top", "right"):
        front.spines[side].set_visible(False)
