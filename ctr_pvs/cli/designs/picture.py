"""A picture of a design: the new robot at its targets, and what is left, before and after."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ctr_pvs.renda2021.figures import empty_figure
from ctr_pvs.solve.solver import EquilibriumSolver

if TYPE_CHECKING:
    from ctr_pvs.tasks.design.design import Design

POSES = 61
VIEWS = (("y", 1), ("z", 2))
#: Below this [mm] a distance is drawn as this: there is nothing left of it.
LEAST = 1e-6


def save_picture(found: Design, path: Path) -> None:
    """Backbones at all targets from above (x, y) and from the side (x, z), where targets are missed a red line to the
    tip; beside them the distances before and after.

    Raises ``PictureError`` without matplotlib, ``OSError`` where the file cannot be written.
    """
    figure = empty_figure((11.0, 5.5))
    grid = figure.add_gridspec(2, 2, width_ratios=(1.6, 1.0))
    views = [figure.add_subplot(grid[row, 0]) for row in range(2)]
    solver = EquilibriumSolver(found.robot, tolerance=1e-5)
    for place, target in zip(1e3 * found.targets.position, found.after.targets, strict=True):
        if not len(target.alpha):
            continue
        line = 1e3 * solver.solve(target.alpha, target.D, start="cold").backbone(POSES).position
        for axes, (_, axis) in zip(views, VIEWS, strict=True):
            axes.plot(line[:, 0], line[:, axis], color="tab:blue", linewidth=0.8, alpha=0.6)
            if not target.reached:
                axes.plot([line[-1, 0], place[0]], [line[-1, axis], place[axis]], color="tab:red", linewidth=1.5)
    for axes, (name, axis) in zip(views, VIEWS, strict=True):
        axes.plot(1e3 * found.targets.position[:, 0], 1e3 * found.targets.position[:, axis], "k.", label="targets")
        axes.set(ylabel=f"{name} [mm]", aspect="equal", adjustable="datalim")
        axes.grid(alpha=0.3)
    views[0].set_title(f"{found.robot.name}: {found.after.reached} of {len(found.targets)} targets reached")
    views[0].legend(loc="upper left")
    views[1].set_xlabel("x [mm]")
    left = figure.add_subplot(grid[:, 1])
    numbers = np.arange(1, len(found.targets) + 1)
    for name, outcome, mark in (("before", found.before, "o"), ("after", found.after, "s")):
        distance = np.clip(1e3 * outcome.distances, LEAST, None)
        left.semilogy(numbers, np.where(np.isfinite(distance), distance, np.nan), mark, label=name, markersize=4.0)
    left.axhline(1e3 * found.within, color="0.4", linestyle="--", linewidth=1.0, label="near enough")
    left.set(xlabel="target", ylabel="tip off by [mm]", title="what is left")
    left.legend(loc="center right")
    left.grid(alpha=0.3)
    figure.tight_layout()
    figure.savefig(path)
