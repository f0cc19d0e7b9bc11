"""The figure of cost growth: tubes, sections, poses and batch size, each with what it grows like."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter
from matplotlib.ticker import NullLocator

from bench.growth.points import BACKBONE
from bench.growth.points import BATCH
from bench.growth.points import POSE_NUMBER
from bench.growth.points import SEGMENT_NUMBER
from bench.growth.points import SOLVE
from bench.growth.points import TIP
from bench.growth.points import TUBE_NUMBER
from bench.growth.points import Point
from bench.growth.points import fitted
from bench.growth.points import line
from bench.growth.points import power

#: Colour and marker of what was timed; after Okabe and Ito.
STYLES = {SOLVE: ("#0072b2", "s"), TIP: ("#d55e00", "o"), BACKBONE: ("#009e73", "^"), BATCH: ("#cc79a7", "D")}
GREY = "#777777"
LABELS = {
    TUBE_NUMBER: "nested tubes n, in 2 n - 1 sections",
    SEGMENT_NUMBER: "curved segments in each of two tubes",
    POSE_NUMBER: "poses along the backbone",
}


def draw(points: list[Point], stem: Path) -> None:
    """Write ``stem``.png and ``stem``.svg."""
    kinds = list(dict.fromkeys(point.grows for point in points))
    batches = [kind for kind in kinds if kind.startswith("commands")]
    figure = Figure(figsize=(13.0, 9.0), layout="constrained")
    panels = list(figure.subplots(2, 2).flat)
    u = float(np.median([point.time_us / point.time_u for point in points]))
    for panel, kind in zip(panels, [kind for kind in kinds if kind not in batches], strict=False):
        _panel(panel, kind, [point for point in points if point.grows == kind])
    if batches:
        _batches(panels[-1], [point for point in points if point.grows in batches])
    else:
        panels.pop().set_axis_off()
    for panel in panels:
        panel.secondary_yaxis("right", functions=(lambda x: x * u, lambda x: x / u)).set_ylabel("µs")
        for side in ("top", "right"):
            panel.spines[side].set_visible(False)
        panel.set_ylabel("time [u]")
    figure.suptitle(f"What more work costs; u = {u:.2f} µs, one np.sin of 8 doubles", fontsize=13)
    for suffix in (".png", ".svg"):
        figure.savefig(stem.with_suffix(suffix), dpi=110, metadata=None if suffix == ".png" else {"Date": None})


def _panel(panel: Axes, kind: str, points: list[Point]) -> None:
    linear = kind == SEGMENT_NUMBER
    for what in dict.fromkeys(point.what for point in points):
        chosen = [point for point in points if point.what == what]
        numbers = np.array([point.number for point in chosen])
        fit, told = _fit(kind, chosen, numbers)
        colour, marker = STYLES[what]
        panel.plot(numbers, fit, color=GREY, linewidth=1.0, linestyle="--", zorder=1)
        panel.plot(numbers, [point.time_u for point in chosen], marker, color=colour, label=f"{what}: {told}")
    _axes(panel, points, "linear" if linear else "log")
    panel.set_xlabel(LABELS[kind])
    panel.legend(frameon=False, fontsize=9, loc="upper left")
    bottom, top = panel.get_ylim()
    panel.set_ylim(0.0 if linear else bottom, top * 1.15 if linear else top * (top / bottom) ** 0.15)


def _fit(kind: str, points: list[Point], numbers: np.ndarray) -> tuple[np.ndarray, str]:
    if kind == TUBE_NUMBER:
        chosen = fitted(points)
        p = power(chosen)
        scale = np.exp(np.mean([np.log(point.time_u) - p * np.log(point.number) for point in chosen]))
        return scale * numbers**p, f"tubes$^{{{p:.2f}}}$"
    start, slope, r2 = line(points)
    return start + slope * numbers, f"{start:,.0f} u + {slope:,.{0 if slope > 99.0 else 1}f} u each, R² = {r2:.3f}"


def _batches(panel: Axes, points: list[Point]) -> None:
    for kind, marker in zip(dict.fromkeys(point.grows for point in points), ("D", "o"), strict=False):
        chosen = [point for point in points if point.grows == kind]
        colour = STYLES[BATCH][0] if marker == "D" else "#333333"
        panel.plot(*zip(*[(p.number, p.time_u) for p in chosen], strict=True), f"{marker}-", color=colour, label=kind)
    panel.set_xscale("log")
    panel.set_yscale("log")
    panel.grid(True, which="major", color="#dddddd", linewidth=0.6)
    panel.set_xlabel("commands in a batch: time of each, cold, with its tip")
    panel.legend(frameon=False, fontsize=9)


def _axes(panel: Axes, points: list[Point], scale: str) -> None:
    panel.set_xscale(scale)
    panel.set_yscale(scale)
    panel.grid(True, which="major", color="#dddddd", linewidth=0.6)
    numbers = sorted({point.number for point in points})
    shown = numbers if len(numbers) < 8 else [number for number in numbers if str(number)[0] == "1"]
    panel.set_xticks(shown, [str(number) for number in shown])
    panel.xaxis.set_minor_locator(NullLocator())
    panel.xaxis.set_minor_formatter(NullFormatter())
