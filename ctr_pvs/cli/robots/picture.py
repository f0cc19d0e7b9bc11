"""A picture of a robot's tubes, each by itself at rest.  matplotlib is needed only when drawing."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.renda2021.figures import empty_figure
from ctr_pvs.robot.robot import Robot
from ctr_pvs.robot.robot import Tube
from ctr_pvs.solve.solver import EquilibriumSolver

if TYPE_CHECKING:
    from matplotlib.axes import Axes

POSES = 201
#: Widths of lines [pt], from the innermost tube to the outermost.
THIN, THICK = 1.5, 6.0
VIEWS = (("y", 1), ("z", 2))


def save_picture(robot: Robot, path: Path) -> None:
    """Draw the tubes from above (x, y) and from the side (x, z), at alpha = 0, wholly out.

    Raises ``PictureError`` where matplotlib is missing, ``OSError`` where the file cannot be written.
    """
    figure = empty_figure((8.5, 6.0))
    widths = np.linspace(THICK, THIN, robot.n_tubes).tolist()
    for axes, (name, axis) in zip(figure.subplots(2, 1, sharex=True), VIEWS, strict=True):
        for number, (tube, width) in enumerate(zip(robot.tubes, widths, strict=True)):
            _draw(axes, tube, axis, f"C{number}", width)
        axes.set_ylabel(f"{name} [mm]")
        axes.set_aspect("equal", adjustable="datalim")
        axes.grid(alpha=0.3)
    axes.set_xlabel("x [mm]")
    figure.axes[0].set_title(f"{robot.name}: each tube by itself; a mark is where a segment ends")
    figure.axes[0].legend(loc="upper left")
    figure.tight_layout()
    figure.savefig(path)


def _draw(axes: Axes, tube: Tube, axis: int, colour: str, width: float) -> None:
    positions = 1e3 * at_rest(tube)
    axes.plot(positions[:, 0], positions[:, axis], color=colour, linewidth=width, label=tube.name, alpha=0.8)
    places = np.linspace(0.0, tube.length, POSES)
    ends = [np.interp(tube.breaks[1:], places, positions[:, column]) for column in (0, axis)]
    axes.plot(*ends, "|", color="black", markersize=8.0)


def at_rest(tube: Tube) -> NDArray[np.float64]:
    """(POSES, 3) positions [m] of a tube by itself at equal steps of its length, base at 0 along +x."""
    answer = EquilibriumSolver(Robot(tube.name, (tube,)), tolerance=1e-5).solve([0.0], [0.0])
    return np.asarray(answer.backbone(POSES).position)
