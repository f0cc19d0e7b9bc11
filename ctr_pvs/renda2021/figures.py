"""Pictures like Fig. 2 and Fig. 4 of the seed paper, as PNG files.  Only here is matplotlib needed, and only when
drawing."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.renda2021.shapes import Branch
from ctr_pvs.renda2021.shapes import Sweep

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

MM = 1e3  # mm per m
ROOM = 5.0  # mm around the curves
DPI = 150
VIEW = {"elev": 22.0, "azim": -65.0}

#: Colour and line of each equilibrium; dashes let a curve show through the one over it.
STYLES: dict[str, tuple[str, Any]] = {
    "first": ("tab:blue", "-"),
    "mirrored": ("tab:green", (0.0, (3.0, 1.5))),
    "planar": ("tab:red", "--"),
}
MARK: dict[str, Any] = {"marker": "o", "color": "black", "markerfacecolor": "none", "markersize": 5.0}
#: Points of a backbone from one mark of the linear basis to the next.
MARK_EVERY = 10
#: Fig. 2: width of the panels, and the room left of, below and above them [in].
PANEL_WIDTH, LEFT, BOTTOM, TOP, BETWEEN = 7.0, 0.8, 0.7, 0.5, 0.3
#: From left to right, as in the paper.
FIG4_PANELS = ("partial", "full")


class PictureError(RuntimeError):
    """A picture that cannot be drawn. The message is one line."""


def save_fig2(branches: dict[str, Branch], path: Path) -> None:
    """The equilibria of Fig. 2 from the side and from above, on one scale: converged as lines, thick where both tubes
    are, the linear basis as marks."""
    points = MM * np.concatenate([branch.converged for branch in branches.values()])
    low, high = points.min(axis=0) - ROOM, points.max(axis=0) + ROOM
    heights = PANEL_WIDTH * (high - low) / (high[0] - low[0])
    width, height = LEFT + PANEL_WIDTH + TOP, BOTTOM + heights[1] + BETWEEN + heights[2] + TOP
    figure = empty_figure((width, height))
    for row, bottom in ((1, BOTTOM), (2, BOTTOM + heights[1] + BETWEEN)):
        place = (LEFT / width, bottom / height, PANEL_WIDTH / width, heights[row] / height)
        axes = figure.add_axes(place, xlim=(low[0], high[0]), ylim=(low[row], high[row]))
        _draw_branches(axes, branches, row)
        axes.set_ylabel(f"{'xyz'[row]} [mm]")
        axes.grid(alpha=0.3)
        if row == 1:
            axes.set_xlabel("x [mm], insertion direction")
            axes.legend(loc="upper left", handlelength=3.0)
        else:
            axes.tick_params(labelbottom=False)
            axes.set_title("Fig. 2: equilibria with the inner tube rotated by 180°, from the side and from above")
    figure.savefig(path)


def _draw_branches(axes: Axes, branches: dict[str, Branch], row: int) -> None:
    for name, branch in branches.items():
        colour, line = STYLES[name]
        x, y = MM * branch.converged[:, 0], MM * branch.converged[:, row]
        overlap, beyond = slice(0, branch.joint + 1), slice(branch.joint, None)
        label = f"θ₂(L₁) = {branch.theta:.2f}°, {'stable' if branch.stable else 'unstable'}"
        axes.plot(x[overlap], y[overlap], linestyle=line, color=colour, linewidth=4.0, label=label)
        axes.plot(x[beyond], y[beyond], linestyle=line, color=colour, linewidth=1.8)
        marks = MM * branch.linear[::MARK_EVERY]
        axes.plot(marks[:, 0], marks[:, row], linestyle="none", **MARK)
    axes.plot([], [], linestyle="none", label="the same in the linear basis, eq. (34)", **MARK)
    axes.plot([], [], color="gray", linewidth=1.8, label="thin: the inner tube alone")


def save_fig4(sweeps: dict[str, Sweep], path: Path) -> None:
    """The sweeps of Fig. 4: backbones in the quadratic basis, coloured by rotation, and converged tips as dots."""
    figure = empty_figure((13.0, 5.0))
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    colours, scale = colormaps["viridis"], Normalize(0.0, max(max(sweep.angles) for sweep in sweeps.values()))
    points = MM * np.concatenate([sweep.backbones.reshape(-1, 3) for sweep in sweeps.values()])
    figure.subplots_adjust(left=0.0, right=0.9, bottom=0.0, top=0.96, wspace=0.02)
    for index, name in enumerate(FIG4_PANELS):
        sweep = sweeps[name]
        axes: Any = figure.add_subplot(1, len(FIG4_PANELS), index + 1, projection="3d", **VIEW)
        for angle, backbone in zip(sweep.angles, sweep.backbones, strict=True):
            axes.plot(*(MM * backbone.T), color=colours(scale(angle)), linewidth=2.0)
        axes.plot(*(MM * sweep.converged_tips.T), "o", color="black", markersize=3.5, label="converged tips")
        _set_box(axes, points.min(axis=0) - ROOM, points.max(axis=0) + ROOM)
        axes.set_title(f"{name} overlap, 0° to {sweep.angles[-1]}°, quadratic basis", y=0.97)
    figure.legend(*axes.get_legend_handles_labels(), loc="upper center")
    bar = figure.add_axes((0.93, 0.2, 0.012, 0.6))
    figure.colorbar(ScalarMappable(scale, colours), cax=bar, label="rotation of the inner tube α₂ [deg]")
    figure.savefig(path)


def _set_box(axes: Any, low: Array, high: Array) -> None:
    """Same limits in every panel, and the same length of a millimetre along all axes."""
    from matplotlib.ticker import MultipleLocator

    for axis, start, end in zip("xyz", low, high, strict=True):
        getattr(axes, f"set_{axis}lim")(start, end)
        getattr(axes, f"set_{axis}label")(f"{axis} [mm]")
        getattr(axes, f"{axis}axis").set_major_locator(MultipleLocator(20.0))
    axes.set_box_aspect(high - low, zoom=1.1)


def make_folder(folder: Path) -> None:
    """The folder for pictures, made if missing; raises ``PictureError`` where none can be drawn, and makes none."""
    empty_figure((1.0, 1.0))
    folder.mkdir(parents=True, exist_ok=True)


def empty_figure(size: tuple[float, float]) -> Figure:
    """An empty figure of ``size`` [in] that needs no display."""
    try:
        from matplotlib.figure import Figure
    except ImportError as error:
        raise PictureError("pictures need matplotlib (pip install 'ctr_pvs[plot]')") from error
    return Figure(figsize=size, dpi=DPI)
