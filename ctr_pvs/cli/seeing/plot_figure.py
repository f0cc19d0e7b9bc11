"""The picture of one equilibrium, PNG or SVG: three projections of one scale, and along s twist, curvature and the
moments in the tubes. matplotlib is needed only when drawing."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.cli.seeing.drawn import Drawn
from ctr_pvs.renda2021.figures import MM
from ctr_pvs.renda2021.figures import empty_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

#: Sizes [in]: of the longest side of a projection and the shortest of any, of the curves' height, and of the room left
#: of and below each panel, above all, and to the right.
LONGEST, SHORTEST, CURVES, LEFT, BELOW, ABOVE, RIGHT = 5.6, 1.3, 1.9, 0.85, 0.62, 0.95, 0.2
#: Room around the shape, as a share of its largest extent; length of the arrow of the tip's force, likewise.
ROOM, ARROW = 0.06, 0.18
POINTS = 72.0  # per inch
FORCE_COLOUR, TOGETHER = "black", "0.25"


@dataclass(frozen=True)
class _Scale:
    """low, high (3,) [mm] of the box that is shown; inches per mm."""

    low: Array
    high: Array
    inches: float

    @property
    def size(self) -> Array:
        """(3,) [in]."""
        return self.inches * (self.high - self.low)


def save_plot(drawn: Drawn, path: Path) -> None:
    """Draws into ``path``.  Raises ``PictureError`` without matplotlib, ``OSError`` where it cannot be written."""
    scale = _scale(drawn)
    x, y, z = scale.size
    width = max(2.0 * LEFT + x + y + RIGHT, 9.0)
    height = 4.0 * BELOW + y + z + 2.0 * CURVES + ABOVE
    figure = empty_figure((width, height))
    bottoms = (3.0 * BELOW + 2.0 * CURVES, 4.0 * BELOW + 2.0 * CURVES + y)
    for (across, up), left, bottom in (
        ((0, 2), LEFT, bottoms[1]),
        ((0, 1), LEFT, bottoms[0]),
        ((1, 2), 2.0 * LEFT + x, bottoms[1]),
    ):
        place = (left / width, bottom / height, scale.size[across] / width, scale.size[up] / height)
        _draw_projection(figure.add_axes(place), drawn, scale, across, up)
    half = (width - 2.0 * LEFT - RIGHT) / 2.0
    panels = [
        figure.add_axes((left / width, bottom / height, half / width, CURVES / height))
        for bottom in (2.0 * BELOW + CURVES, BELOW)
        for left in (LEFT, 2.0 * LEFT + half)
    ]
    _draw_twist(panels[0], drawn)
    _draw_curvature(panels[1], drawn)
    _draw_moments(panels[2], drawn, drawn.moments.bending, drawn.moments.all_bending, "bending moment")
    _draw_moments(panels[3], drawn, drawn.moments.twisting, drawn.moments.all_twisting, "twisting moment")
    _write(figure, drawn, (2.0 * LEFT + x) / width, (bottoms[0] + y) / height)
    figure.savefig(path)


def _scale(drawn: Drawn) -> _Scale:
    points = MM * np.concatenate([np.zeros((1, 3)), drawn.tip[None], *(tube.position for tube in drawn.tubes)])
    widest = MM * max(tube.diameter for tube in drawn.tubes)
    low, high = points.min(axis=0) - 0.5 * widest, points.max(axis=0) + 0.5 * widest
    largest = float((high - low).max())
    arrow = ARROW if drawn.tip_force.any() else 0.0
    room = (ROOM + arrow) * largest
    low, high = low - room, high + room
    inches = LONGEST / float((high - low).max())
    missing = np.maximum(SHORTEST / inches - (high - low), 0.0)
    return _Scale(low - 0.5 * missing, high + 0.5 * missing, inches)


def _draw_projection(axes: Axes, drawn: Drawn, scale: _Scale, across: int, up: int) -> None:
    """Lines as wide as the tubes; all panels have one scale, so that a width in points means a width in mm."""
    axes.set_xlim(scale.low[across], scale.high[across])
    axes.set_ylim(scale.low[up], scale.high[up])
    for tube in drawn.tubes:
        axes.plot(
            MM * tube.position[:, across],
            MM * tube.position[:, up],
            color=_share(tube.colour),
            linewidth=POINTS * scale.inches * MM * tube.diameter,
            solid_capstyle="butt",
            solid_joinstyle="round",
        )
    if drawn.tip_force.any():
        end, along = MM * drawn.tip, drawn.tip_force / np.linalg.norm(drawn.tip_force)
        start = end - ARROW * float((scale.high - scale.low).max()) * along
        arrow = {"arrowstyle": "->", "color": FORCE_COLOUR, "shrinkA": 0.0, "shrinkB": 0.0, "linewidth": 1.4}
        axes.annotate("", xy=(end[across], end[up]), xytext=(start[across], start[up]), arrowprops=arrow)
    axes.set_xlabel(f"{'xyz'[across]} [mm]")
    axes.set_ylabel(f"{'xyz'[up]} [mm]")
    axes.grid(alpha=0.3)


def _draw_twist(axes: Axes, drawn: Drawn) -> None:
    for tube, psi in zip(drawn.tubes, drawn.twist.T, strict=True):
        axes.plot(MM * drawn.s, np.degrees(psi), color=_share(tube.colour))
    _name_axes(axes, "twist ψ [deg]")


def _draw_curvature(axes: Axes, drawn: Drawn) -> None:
    axes.stairs(drawn.curvature, MM * drawn.s, baseline=None, color=TOGETHER)
    axes.set_ylim(bottom=0.0)
    _name_axes(axes, "curvature [1/m]")


def _draw_moments(axes: Axes, drawn: Drawn, each: Array, together: Array, name: str) -> None:
    for tube, moment in zip(drawn.tubes, each.T, strict=True):
        axes.stairs(MM * moment, MM * drawn.s, baseline=None, color=_share(tube.colour))
    axes.stairs(MM * together, MM * drawn.s, baseline=None, color=TOGETHER, linestyle="--")
    _name_axes(axes, f"{name} [N mm]")


def _name_axes(axes: Axes, name: str) -> None:
    axes.set_xlabel("s [mm]")
    axes.set_ylabel(name)
    axes.grid(alpha=0.3)


def _write(figure: Figure, drawn: Drawn, left: float, top: float) -> None:
    """Title and what is told above; the tubes' names where the fourth projection would be."""
    from matplotlib.lines import Line2D

    height = figure.get_size_inches()[1]
    figure.text(0.02, 1.0 - 0.12 / height, drawn.title, va="top", fontsize=11, wrap=True)
    figure.text(0.02, 1.0 - 0.36 / height, "\n".join(drawn.told), va="top", fontsize=8.5)
    handles = [
        Line2D([], [], color=_share(tube.colour), linewidth=4.0, label=_name(tube.name, tube.diameter))
        for tube in drawn.tubes
    ]
    handles.append(Line2D([], [], color=TOGETHER, linestyle="--", label="all tubes, moments"))
    if drawn.tip_force.any():
        handles.append(Line2D([], [], color=FORCE_COLOUR, marker=r"$\rightarrow$", markersize=12, linestyle="none",
                              label="force on the tip"))  # fmt: skip
    figure.legend(handles=handles, loc="upper left", bbox_to_anchor=(left, top), frameon=False)


def _share(colour: tuple[int, int, int]) -> tuple[float, float, float]:
    """Red, green, blue from 0 to 1, as matplotlib takes them."""
    red, green, blue = colour
    return red / 255.0, green / 255.0, blue / 255.0


def _name(name: str, diameter: float) -> str:
    return f"{name}, {MM * diameter:.3g} mm"
