"""The figures of the failure chart: maps over (lambda, b) for pairs, shares of answers for robots of three tubes."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from bench.stability.judges import Outcome
from bench.stability.marks import COLOURS
from bench.stability.marks import PALE
from bench.stability.marks import SIGNS
from bench.stability.methods import METHODS
from bench.stability.rows import Row
from ctr_pvs.oracles.two_tubes import critical_lambda

WARM, COLD = "warm", ("cold before the fold", "cold past the fold")


def draw_pairs(rows: list[Row], path: Path) -> None:
    """Each method's worst answer at every (lambda, b), in a warm sweep and from cold starts."""
    lambdas, guides = sorted({row.lam for row in rows}), sorted({row.b for row in rows})
    figure = Figure(figsize=(15.0, 6.0), dpi=110, layout="constrained")
    panels = figure.subplots(2, len(METHODS), sharex=True, sharey=True)
    for column, method in enumerate(METHODS):
        for line, starts in enumerate(((WARM,), COLD)):
            worst: dict[tuple[float, float], Outcome] = {}
            for row in rows:
                if row.method == method and row.start in starts:
                    cell = (row.lam, row.b)
                    worst[cell] = max(row.worst, worst.get(cell, Outcome.RIGHT), key=list(Outcome).index)
            _map(panels[line, column], worst, lambdas, guides)
        panels[0, column].set_title(method, fontsize=11, fontweight="bold" if column == 0 else "normal")
        panels[1, column].set_xlabel("λ")
    panels[0, 0].set_ylabel("warm sweeps\n\nb")
    panels[1, 0].set_ylabel("cold starts\n\nb")
    _legend(figure, rows, "worst answer of a method at each λ and b")
    figure.savefig(path)


def _map(panel: Axes, worst: dict[tuple[float, float], Outcome], lambdas: list[float], guides: list[float]) -> None:
    for (lam, b), outcome in worst.items():
        x, y = lambdas.index(lam), guides.index(b)
        panel.fill_between([x - 0.5, x + 0.5], y - 0.5, y + 0.5, color=COLOURS[outcome], linewidth=0.0)
        colour = "white" if outcome in PALE else "#333333"
        panel.text(x, y, SIGNS[outcome], ha="center", va="center", fontsize=8, color=colour)
    # Where pairs can snap at all: right of the critical lambda of each b.
    places = [float(np.interp(critical_lambda(b), lambdas, np.arange(len(lambdas)), left=-0.5)) for b in guides]
    edges = [np.ceil(place) - 0.5 for place in places]
    panel.step([*edges, edges[-1]], np.arange(len(guides) + 1) - 0.5, where="pre", color="black", linewidth=1.4)
    panel.set_xticks(range(len(lambdas)), [f"{lam:g}" for lam in lambdas], fontsize=8)
    panel.set_yticks(range(len(guides)), [f"{b:g}" for b in guides], fontsize=8)
    panel.set_xlim(-0.5, len(lambdas) - 0.5)
    panel.set_ylim(-0.5, len(guides) - 0.5)
    panel.tick_params(length=0)
    for side in panel.spines.values():
        side.set_visible(False)


def draw_robots(rows: list[Row], path: Path) -> None:
    """Shares of all answers of each method to robots of three tubes."""
    figure = Figure(figsize=(11.0, 4.6), dpi=110, layout="constrained")
    panels = figure.subplots(1, 3, sharey=True)
    for panel, start in zip(panels, (WARM, *COLD), strict=True):
        chosen = [row for row in rows if row.start == start]
        for place, method in enumerate(METHODS):
            total = sum((row.answers for row in chosen if row.method == method), Counter())
            count, left = total.total(), 0.0
            panel.text(101.0, place, str(count), va="center", fontsize=8, color="#555555")
            for outcome in Outcome:
                share = 100.0 * total[outcome] / max(count, 1)
                panel.barh(place, share, left=left, color=COLOURS[outcome], height=0.72)
                if share > 6.0:
                    colour = "white" if outcome in PALE else "#333333"
                    panel.text(
                        left + 0.5 * share, place, f"{share:.0f}", ha="center", va="center", color=colour, fontsize=8
                    )
                left += share
        panel.set_title(start, fontsize=10)
        panel.set_xlabel("% of answers (their number at the right)")
        panel.set_xlim(0.0, 100.0)
        panel.set_yticks(range(len(METHODS)), list(METHODS))
        panel.tick_params(axis="y", length=0)
        for side in ("top", "right", "left"):
            panel.spines[side].set_visible(False)
    panels[0].invert_yaxis()
    _legend(figure, rows, "")
    figure.savefig(path)


def _legend(figure: Figure, rows: list[Row], title: str) -> None:
    outcomes = [outcome for outcome in Outcome if any(row.answers[outcome] for row in rows)]
    names = [f"{SIGNS[outcome]}  {outcome.value}".strip() for outcome in outcomes]
    handles: list[Artist] = [
        Patch(facecolor=COLOURS[outcome], edgecolor="#666666", linewidth=0.5, label=name)
        for outcome, name in zip(outcomes, names, strict=True)
    ]
    if title:
        handles.append(Line2D([], [], color="black", linewidth=1.4, label="left of it no pair snaps"))
    figure.legend(handles=handles, loc="outside lower center", ncols=5, frameon=False, fontsize=9, title=title or None)
