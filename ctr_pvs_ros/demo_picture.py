"""The demo's picture: the backbones of each sweep, as in Fig. 4 of Renda et al. 2021."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

MM = 1e3  # mm per m
ROOM = 5.0  # mm around the curves
VIEW = {"elev": 20.0, "azim": -60.0}


@dataclass(frozen=True)
class Curves:
    """The backbones of one sweep: angle [deg], positions (n, 3) [m] each, and the reference tips (rows, 3) [m]."""

    title: str
    angles: Sequence[float]
    positions: Sequence[NDArray[np.float64]]
    reference_tips: NDArray[np.float64]


def save_picture(sweeps: Sequence[Curves], path: Path) -> None:
    """Draw one panel per sweep, all on the same scale, and save a PNG."""
    figure = Figure(figsize=(13.0, 5.2), dpi=120)
    figure.subplots_adjust(left=0.0, right=0.9, bottom=0.02, top=0.98, wspace=0.05)
    colours = mpl.colormaps["viridis"]
    scale = mpl.colors.Normalize(0.0, max(max(sweep.angles) for sweep in sweeps))
    points = MM * np.concatenate([position for sweep in sweeps for position in sweep.positions])
    axes = []
    for index, sweep in enumerate(sweeps):
        panel = figure.add_subplot(1, len(sweeps), index + 1, projection="3d", **VIEW)
        axes.append(panel)
        for angle, position in zip(sweep.angles, sweep.positions, strict=True):
            panel.plot(*(MM * position.T), color=colours(scale(angle)), linewidth=2.0)
        panel.plot(*(MM * sweep.reference_tips.T), "o", color="black", markersize=3.5, label="reference tip")
        _label(panel, sweep.title, points.min(axis=0), points.max(axis=0))
    figure.legend(*axes[0].get_legend_handles_labels(), loc="upper center")
    bar = figure.add_axes((0.93, 0.2, 0.012, 0.6))
    figure.colorbar(mpl.cm.ScalarMappable(scale, colours), cax=bar, label="rotation of the inner tube [deg]")
    figure.savefig(path)


def _label(panel: mpl.axes.Axes, title: str, low: NDArray[np.float64], high: NDArray[np.float64]) -> None:
    """Same limits in both panels, and the same length of a millimetre along all axes."""
    low, high = low - ROOM, high + ROOM
    for axis, start, end in zip("xyz", low, high, strict=True):
        getattr(panel, f"set_{axis}lim")(start, end)
        getattr(panel, f"set_{axis}label")(f"{axis} [mm]")
        getattr(panel, f"{axis}axis").set_major_locator(mpl.ticker.MultipleLocator(20.0))
    panel.set_box_aspect(high - low)  # type: ignore[arg-type]  # three lengths in 3-D
    panel.set_title(title, y=0.94)
