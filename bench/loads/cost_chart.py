"""The chart of time against error under a tip force: one panel a scene, open what was measured elsewhere."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Protocol

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bench.loads.oracle_steps import BVP
from bench.loads.oracle_steps import SHOOTING
from bench.loads.rivals import CANNULA
from bench.loads.rivals import FCP
from bench.loads.rivals import SHARPENED
from bench.loads.rivals import TIM

#: Colour, marker and size of each method; after Okabe and Ito, told apart by marker too.
STYLES = {
    "this solver": ("#d55e00", "o", 7.0),
    SHOOTING: ("#333333", "X", 6.5),
    BVP: ("#e69f00", "v", 7.0),
    CANNULA: ("#0072b2", "s", 7.0),
    TIM: ("#009e73", "P", 8.0),
    FCP: ("#cc79a7", "D", 6.5),
}
#: Where the axis begins [u].
LOWEST = 60.0


class Point(Protocol):
    """What is drawn of a row."""

    @property
    def scene(self) -> str: ...
    @property
    def method(self) -> str: ...
    @property
    def setting(self) -> str: ...
    @property
    def time_u(self) -> float: ...
    @property
    def error_m(self) -> float: ...
    @property
    def where(self) -> str: ...


def draw(rows: Sequence[Point], stem: Path) -> None:
    """Write ``stem``.png and ``stem``.svg."""
    scenes = list(dict.fromkeys(row.scene for row in rows))
    figure = Figure(figsize=(12.0, 5.6), layout="constrained")
    panels = figure.subplots(1, len(scenes), squeeze=False, sharex=True, sharey=True)
    for panel, scene in zip(panels[0], scenes, strict=True):
        _panel(panel, [row for row in rows if row.scene == scene])
        panel.set_title(f"{scene}, 0.5 N across the tip", fontsize=12)
        panel.set_xlabel("largest tip error along the sweep [m]")
    panels[0, 0].set_ylabel("time of a warm step of 1° with its tip [u]")
    handles = [
        panels[0, 0].plot([], [], marker, color=colour, markersize=size, markerfacecolor=_face(method, colour))[0]
        for method, (colour, marker, size) in STYLES.items()
    ]
    here = {row.method for row in rows if row.where == "this run"}
    labels = [name if name in here else f"{name}, elsewhere" for name in STYLES]
    figure.legend(handles, labels, loc="outside lower center", ncols=3, frameon=False, fontsize=10)
    for suffix in (".png", ".svg"):
        figure.savefig(stem.with_suffix(suffix), dpi=110, metadata=None if suffix == ".png" else {"Date": None})


def _face(method: str, colour: str) -> str:
    return "white" if method in (CANNULA, TIM, FCP) else colour


def _panel(panel: Axes, rows: list[Point]) -> None:
    panel.set_xscale("log")
    panel.set_yscale("log")
    panel.grid(True, which="major", color="#dddddd", linewidth=0.6)
    for method, (colour, marker, size) in STYLES.items():
        own = [row for row in rows if row.method == method]
        if not own:
            continue
        errors, times = np.array([row.error_m for row in own]), np.array([row.time_u for row in own])
        if own[0].where == "this run":
            panel.plot(errors, times, color=colour, linewidth=1.2)
        panel.plot(errors, times, marker, color=colour, markersize=size, markerfacecolor=_face(method, colour))
        if method == "this solver":
            for row in (own[0], own[-1]):
                _annotate(panel, row, f"{float(row.setting):.0e} m".replace("e-0", "e-"), (0.0, -15.0), colour)
        for row in own:
            if row.setting == SHARPENED:
                _annotate(panel, row, SHARPENED, (0.0, 9.0), colour)
    panel.set_ylim(bottom=LOWEST)
    for side in ("top", "right"):
        panel.spines[side].set_visible(False)


def _annotate(panel: Axes, row: Point, text: str, offset: tuple[float, float], colour: str) -> None:
    panel.annotate(
        text, (row.error_m, row.time_u), offset, textcoords="offset points", ha="center", fontsize=8, color=colour
    )
