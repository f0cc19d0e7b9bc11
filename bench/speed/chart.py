"""The figure of speed against accuracy: one panel a scene, one line a method, warm filled and cold open."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke

from bench.speed.rows import Row

#: Colour, marker and size of each method; after Okabe and Ito, told apart by marker too.
STYLES = {
    "auto": ("#d55e00", "o", 7.0),
    "torsion": ("#0072b2", "s", 5.0),
    "torsionless": ("#009e73", "P", 7.0),
    "full": ("#56b4e9", "^", 5.5),
    "seed's way": ("#cc79a7", "D", 5.0),
    "solve_bvp": ("#e69f00", "v", 6.0),
    "shooting": ("#333333", "X", 5.5),
}
TELL = {
    "auto": "auto: this solver, tolerance 1e-2 to 1e-9 m",
    "torsion": "torsion, degree 1 to 8, plain numpy",
    "torsionless": "torsionless, closed form",
    "full": "full, degree 1 to 6",
    "seed's way": "seed's way: monomials of degree 1 to 4, hybr, differences",
    "solve_bvp": "boundary-value model, solve_bvp, tol 1e-2 to 1e-10",
    "shooting": "boundary-value model, shooting, rtol 1e-3 to 1e-12",
}
#: Errors below this [m] are drawn there: the converged tips themselves are not known better.
FLOOR = 1e-14


def draw(rows: list[Row], stem: Path) -> None:
    """Write ``stem``.png and ``stem``.svg."""
    scenes = list(dict.fromkeys(row.scene for row in rows))
    figure = Figure(figsize=(13.0, 5.0 * int(np.ceil(len(scenes) / 2)) + 1.0), layout="constrained")
    panels = figure.subplots(-1 + (len(scenes) + 3) // 2, 2, squeeze=False, sharex=True, sharey=True)
    u = float(np.median([row.u_us for row in rows]))
    for panel, scene in zip(panels.flat, scenes, strict=False):
        _panel(panel, [row for row in rows if row.scene == scene])
        panel.set_title(scene, fontsize=12)
    for panel in panels[:, -1]:
        panel.secondary_yaxis("right", functions=(lambda x: x * u, lambda x: x / u)).set_ylabel("µs")
    for panel in panels[-1]:
        panel.set_xlabel("largest tip error along the sweep [m]")
    for panel in panels[:, 0]:
        panel.set_ylabel("time per solve with tip [u]")
    figure.legend(handles=_legend(), loc="outside lower center", ncols=3, frameon=False, fontsize=10)
    figure.suptitle(f"Time of one solve with its tip; u = {u:.2f} µs, one np.sin of 8 doubles", fontsize=13)
    for suffix in (".png", ".svg"):
        figure.savefig(stem.with_suffix(suffix), dpi=110, metadata=None if suffix == ".png" else {"Date": None})


def _panel(panel: Axes, rows: list[Row]) -> None:
    panel.set_xscale("log")
    panel.set_yscale("log")
    panel.grid(True, which="major", color="#dddddd", linewidth=0.6)
    panel.axvspan(0.3 * FLOOR, 1e-13, color="#f2f2f2", zorder=0)
    panel.set_xlim(0.3 * FLOOR, 0.2)
    for method, (colour, marker, size) in STYLES.items():
        for start in ("cold", "warm"):
            chosen = [row for row in rows if row.method == method and row.start == start and row.right]
            if not chosen:
                continue
            errors = np.maximum([row.error_largest_m for row in chosen], FLOOR)
            times = np.array([row.time_u for row in chosen])
            warm = start == "warm"
            panel.plot(errors, times, color=colour, linewidth=1.2 if warm else 0.7, linestyle="-" if warm else ":")
            panel.plot(
                errors,
                times,
                marker,
                color=colour,
                markersize=size,
                markerfacecolor=colour if warm else "white",
                markeredgewidth=1.0,
                zorder=3 if method != "auto" else 4,
            )
            partly = np.array([row.right < row.commands for row in chosen])
            panel.plot(
                errors[partly], times[partly], "|", color="black", markersize=13.0, markeredgewidth=0.9, zorder=5
            )
    _label_tolerances(panel, [row for row in rows if (row.method, row.start) == ("auto", "warm")])
    lost = [
        method for method in STYLES if not any(row.right for row in rows if (row.method, row.start) == (method, "cold"))
    ]
    if lost:
        text = "cold, never on the branch: " + ", ".join(lost)
        panel.text(0.99, 0.98, text, transform=panel.transAxes, ha="right", va="top", fontsize=9, color="#555555")
    for side in ("top", "right"):
        panel.spines[side].set_visible(False)


def _label_tolerances(panel: Axes, rows: list[Row]) -> None:
    """The tightest and the loosest tolerance beside their points."""
    for row in rows[:: max(1, len(rows) - 1)]:
        panel.annotate(
            f"{float(row.setting):.0e} m".replace("e-0", "e-"),
            (max(row.error_largest_m, FLOOR), row.time_u),
            (0.0, 8.0),
            textcoords="offset points",
            ha="center",
            fontsize=9,
            color=STYLES["auto"][0],
            path_effects=[withStroke(linewidth=2.5, foreground="white")],
            zorder=6,
        )


def _legend() -> list[Artist]:
    handles: list[Artist] = [
        Line2D([], [], color=colour, marker=marker, markersize=size + 1.0, linewidth=1.2, label=TELL[method])
        for method, (colour, marker, size) in STYLES.items()
    ]
    grey = {"color": "#555555", "linewidth": 1.0, "markersize": 7.0, "marker": "o"}
    handles.append(Line2D([], [], label="filled: warm, 1° from the last answer", **grey))
    handles.append(Line2D([], [], label="open: cold", linestyle=":", **{**grey, "markerfacecolor": "white"}))
    bar = {"color": "black", "linestyle": "", "marker": "|", "markersize": 13.0}
    handles.append(Line2D([], [], label="some commands failed or on another branch", **bar))
    handles.append(Patch(facecolor="#f2f2f2", label="errors that the references cannot tell"))
    return handles
