"""The picture of a workspace: how many tips are where, from three sides, and the least margin over depth and radius.
matplotlib is needed only when drawing."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.renda2021.figures import MM
from ctr_pvs.renda2021.figures import empty_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ctr_pvs.tasks.sweep import Rows

Array = NDArray[np.float64]

BINS = 60  # along the longest side of the box


def save_workspace(name: str, rows: Rows, path: Path) -> None:
    """Draws into ``path``.  Raises ``PictureError`` without matplotlib, ``OSError`` where it cannot be written."""
    good = rows.success
    tips, margin = MM * rows["tip_position"][good], rows["stability_margin"][good, 0]
    figure = empty_figure((11.0, 8.6))
    panels = figure.subplots(2, 2)
    figure.suptitle(f"{name}: tips of {len(tips)} of {len(rows)} random commands")
    if len(tips):
        size = max(float(np.ptp(tips, axis=0).max()), 1e-3) / BINS
        for axes, (across, up) in zip(panels.flat, ((0, 2), (1, 2), (0, 1)), strict=False):
            _draw_density(axes, tips, across, up, size)
        _draw_margin(panels[1, 1], tips, margin, size)
    figure.tight_layout()
    figure.savefig(path)


def _edges(values: Array, size: float) -> Array:
    first = np.floor(values.min() / size)
    return size * np.arange(first, max(first + 2.0, np.floor(values.max() / size) + 2.0))


def _draw_density(axes: Axes, tips: Array, across: int, up: int, size: float) -> None:
    from matplotlib.colors import LogNorm

    x, y = tips[:, across], tips[:, up]
    counts, *edges = np.histogram2d(x, y, bins=(_edges(x, size), _edges(y, size)))
    shown = np.ma.masked_equal(counts.T, 0.0)
    mesh = axes.pcolormesh(*edges, shown, norm=LogNorm(1.0, max(float(counts.max()), 2.0)), cmap="viridis")
    axes.figure.colorbar(mesh, ax=axes, label=f"tips in {size:.2g} mm x {size:.2g} mm")
    axes.set_xlabel(f"{'xyz'[across]} [mm]")
    axes.set_ylabel(f"{'xyz'[up]} [mm]")
    axes.set_aspect("equal")


def _draw_margin(axes: Axes, tips: Array, margin: Array, size: float) -> None:
    """The least margin of all tips at one depth and distance from the axis."""
    depth, radius = tips[:, 0], np.hypot(tips[:, 1], tips[:, 2])
    x, y = _edges(depth, size), _edges(radius, size)
    least = np.full((len(x) - 1, len(y) - 1), np.inf)
    places = np.digitize(depth, x) - 1, np.digitize(radius, y) - 1
    np.minimum.at(least, places, margin)
    mesh = axes.pcolormesh(x, y, np.ma.masked_invalid(least.T), vmin=0.0, vmax=1.0, cmap="RdYlGn")
    axes.figure.colorbar(mesh, ax=axes, label="least stability margin there")
    axes.set_xlabel("x [mm]")
    axes.set_ylabel("distance from the x axis [mm]")
    axes.set_aspect("equal")
