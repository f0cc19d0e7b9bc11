"""The picture of what methods do at a fold under load: angles between the tubes, and outcomes command by command."""

from __future__ import annotations

from collections.abc import Mapping
from collections.abc import Sequence
from pathlib import Path
from typing import Protocol

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from bench.stability.judges import Outcome
from bench.stability.marks import COLOURS
from bench.stability.marks import PALE
from bench.stability.marks import SIGNS

Array = NDArray[np.float64]

#: Markers of the methods, in their order.
MARKERS = ("o", "x", "+", "1", "s", "D")


class Answer(Protocol):
    @property
    def alpha(self) -> float: ...
    @property
    def outcome(self) -> Outcome: ...
    @property
    def angle(self) -> float: ...


class Answers(Protocol):
    @property
    def answers(self) -> Mapping[str, Sequence[Answer]]: ...
    @property
    def branches(self) -> Sequence[tuple[Array, Array]]: ...


def draw(warm: Answers, cold: Answers, fold: float, path: Path) -> None:
    """Angles of the warm sweep above, outcomes of it and of cold starts below."""
    figure = Figure(figsize=(11.0, 9.0), dpi=110, layout="constrained")
    angles, strips, starts = figure.subplots(3, 1, sharex=True, height_ratios=(2.2, 1.0, 1.0))
    _angles(angles, warm)
    _strips(strips, warm)
    _strips(starts, cold)
    strips.set_title("warm: steps of 5° from the last success", fontsize=10, loc="left")
    starts.set_title("cold: from a straight robot", fontsize=10, loc="left")
    starts.set_xlabel("α₂ [deg]")
    starts.set_xlim(-4.0, max(told.alpha for answers in warm.answers.values() for told in answers) + 8.0)
    for panel in (angles, strips, starts):
        panel.axvline(fold, color="black", linewidth=1.0, linestyle="--")
    angles.text(fold - 1.5, angles.get_ylim()[0] + 8.0, f"fold, {fold:g}°", ha="right", fontsize=9)
    every = [told.outcome for group in (warm, cold) for answers in group.answers.values() for told in answers]
    handles = [
        Patch(facecolor=COLOURS[o], edgecolor="#666666", linewidth=0.5, label=f"{SIGNS[o]}  {o.value}".strip())
        for o in Outcome
        if o in every
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=4, frameon=False, fontsize=9)
    figure.savefig(path)


def _angles(panel: Axes, warm: Answers) -> None:
    for index, (alpha, angle) in enumerate(warm.branches):
        label = "stable branches, followed by the judge" if index == 0 else None
        panel.plot(alpha, angle, color="#9aa7b3", linewidth=5.0, alpha=0.5, label=label, solid_capstyle="round")
    for marker, (method, answers) in zip(MARKERS, warm.answers.items(), strict=True):
        known = [told for told in answers if np.isfinite(told.angle)]
        own = method == "this solver"
        panel.plot(
            [told.alpha for told in known],
            [told.angle for told in known],
            marker,
            color="#d55e00" if own else "#222222",
            markersize=8.0 if own else 5.0,
            markeredgewidth=0.9,
            label=method,
            zorder=4 if own else 3,
            markerfacecolor="none",
        )
    panel.set_ylabel("angle between the tubes' ends [deg]")
    panel.legend(fontsize=9, frameon=False, loc="upper left")
    panel.grid(True, color="#e5e5e5", linewidth=0.6)


def _strips(panel: Axes, group: Answers) -> None:
    for row, answers in enumerate(group.answers.values()):
        places = [told.alpha for told in answers]
        width = np.diff(places).min() if len(places) > 1 else 5.0
        for told in answers:
            panel.barh(row, width, left=told.alpha - 0.5 * width, height=0.9, color=COLOURS[told.outcome])
            colour = "white" if told.outcome in PALE else "#333333"
            panel.text(told.alpha, row, SIGNS[told.outcome], ha="center", va="center", fontsize=7, color=colour)
    panel.set_yticks(range(len(group.answers)), list(group.answers), fontsize=9)
    panel.invert_yaxis()
    panel.tick_params(axis="y", length=0)
    for side in ("top", "right", "left"):
        panel.spines[side].set_visible(False)
