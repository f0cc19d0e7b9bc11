"""How compliant the tip is along a sweep: ellipsoids of where small forces move it, up to the fold."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from bench.common.scenes import PARTIAL_FOLD
from bench.common.scenes import PARTIAL_OVERLAP
from bench.common.scenes import SEED
from ctr_pvs import Equilibrium
from ctr_pvs import EquilibriumSolver
from ctr_pvs import Loads

Array = NDArray[np.float64]

MM = 1e3
#: Force [N] of the ellipsoids: where forces of this size in all directions move the tip, to first order.
SIZE = 0.2
#: Where ellipsoids are drawn [deg], and how finely the sweep is followed.
DRAWN, FINE = (0.0, 60.0, 120.0, 160.0, 190.0, 203.0), 1.0
CASES = (("no load", None, "#1f5fa8"), ("0.5 N along +y", Loads((0.0, 0.5, 0.0)), "#d55e00"))
NAMES = ("softest", "middle", "stiffest")
#: The last commands before a fold are this far from it [deg].
LAST = (1.0, 0.3, 0.1, 0.03, 0.01)
TOLERANCE = 1e-7


def draw_compliance(path: Path) -> None:
    """Shapes with their ellipsoids, from the side and from the front; and the axes' lengths along the sweep."""
    figure = Figure(figsize=(12.5, 4.6), dpi=110, layout="constrained")
    side, front, axes = figure.subplots(1, 3, width_ratios=(1.35, 0.8, 1.2))
    solver = EquilibriumSolver(SEED, TOLERANCE)
    for index, degrees in enumerate(DRAWN):
        answer = solver.solve(np.radians([0.0, degrees]), PARTIAL_OVERLAP)
        shade = str(0.75 - 0.75 * index / (len(DRAWN) - 1))
        for panel, plane in ((side, (0, 2)), (front, (1, 2))):
            _draw_ellipse(panel, answer, plane, shade, f"{degrees:g}°")
    side.set_xlabel("x [mm]")
    front.set_xlabel("y [mm]")
    for panel, name in ((side, "from the side"), (front, "against the insertion")):
        panel.set_aspect("equal")
        panel.margins(0.1)
        panel.set_ylabel("z [mm]")
        panel.set_title(f"{name}: tips under {SIZE:g} N", fontsize=10)
    _draw_axes(axes)
    for panel in (side, front, axes):
        panel.grid(True, color="#e5e5e5", linewidth=0.6)
        for edge in ("top", "right"):
            panel.spines[edge].set_visible(False)
    figure.savefig(path)


def _draw_ellipse(panel: Axes, answer: Equilibrium, plane: tuple[int, int], shade: str, name: str) -> None:
    """The shadow of the ellipsoid {C f : |f| = SIZE} on a plane of two base axes: that of C C^T."""
    line = MM * answer.backbone(60).position
    compliance = answer.compliance[:3, :3][list(plane)]
    values, vectors = np.linalg.eigh(compliance @ compliance.T)
    angle = np.linspace(0.0, 2.0 * np.pi, 90)
    circle = np.array([np.cos(angle), np.sin(angle)])
    rim = line[-1, list(plane), None] + MM * SIZE * vectors @ (np.sqrt(np.maximum(values, 0.0))[:, None] * circle)
    panel.plot(*line[:, list(plane)].T, color=shade, linewidth=1.6)
    panel.fill(*rim, color="#d55e00", alpha=0.25, linewidth=0.0)
    panel.plot(*rim, color="#d55e00", linewidth=1.1)
    panel.annotate(name, rim[:, 0], (3.0, 3.0), textcoords="offset points", fontsize=8)


def _draw_axes(panel: Axes) -> None:
    for name, loads, colour in CASES:
        solver = EquilibriumSolver(SEED, TOLERANCE)
        fold = _fold(loads)
        degrees = np.append(np.arange(0.0, fold - 1.0, FINE), fold - np.array(LAST))
        sizes = []
        for angle in degrees:
            answer = solver.solve(np.radians([0.0, angle]), PARTIAL_OVERLAP, loads=loads)
            sizes.append(np.linalg.svd(answer.compliance[:3, :3], compute_uv=False))
        for axis, style in zip(range(3), ("-", "--", ":"), strict=True):
            label = f"{name}, {NAMES[axis]}"
            panel.semilogy(degrees, MM * np.array(sizes)[:, axis], style, color=colour, linewidth=1.6, label=label)
        panel.axvline(fold, color=colour, linewidth=0.8, alpha=0.6)
    panel.set_xlabel("α₂ [deg]; upright lines: the branch ends")
    panel.set_ylabel("principal compliances of the tip [mm/N]")
    panel.legend(fontsize=8, frameon=False, loc="upper left")


def _fold(loads: Loads | None) -> float:
    """Where the branch ends [deg]."""
    if loads is None:
        return PARTIAL_FOLD
    solver = EquilibriumSolver(SEED, TOLERANCE)
    solver.solve([0.0, 0.0], PARTIAL_OVERLAP, loads=loads)
    return float(np.degrees(solver.follow([0.0, 1.4 * np.pi], PARTIAL_OVERLAP, loads=loads).snaps[0].alpha[1]))
