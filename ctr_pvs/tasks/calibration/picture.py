"""A picture of what is left between told and measured tips; only here is matplotlib needed."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from ctr_pvs.tasks.calibrate import Calibration


class CalibrationPictureError(RuntimeError):
    """A picture that cannot be drawn. The message is one line."""


def save_picture(found: Calibration, path: Path) -> None:
    """The distances along the rows, before and after, held-out rows shaded; beside them their distributions.

    Raises ``CalibrationPictureError`` without matplotlib, ``OSError`` where the file cannot be written.
    """
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError:
        raise CalibrationPictureError("matplotlib is needed for the picture: pip install 'ctr_pvs[plot]'") from None
    figure = Figure(figsize=(10.0, 4.0), layout="constrained")
    FigureCanvasAgg(figure)
    along, shares = figure.subplots(1, 2, width_ratios=(2.2, 1.0), sharey=True)
    rows = np.arange(len(found.off))
    for name, off, colour in (("before", found.off_before, "0.6"), ("after", found.off, "tab:blue")):
        distance = 1e3 * np.linalg.norm(off, axis=1)
        along.plot(rows, distance, color=colour, linewidth=0.8, label=name)
        for held, style in ((False, "-"), (True, "--")):
            known = np.sort(distance[(found.held_out == held) & np.isfinite(distance)])
            if len(known):
                told = f"{name}, {'held out' if held else 'fitted'}"
                shares.plot((np.arange(len(known)) + 0.5) / len(known), known, style, color=colour, label=told)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], found.held_out.astype(int), [0]])))
    for start, end in edges.reshape(-1, 2):
        along.axvspan(start, end, color="0.93", zorder=0)
    along.set(xlabel="row (shaded: held out)", ylabel="tip off by [mm]", xlim=(0, len(rows)), ylim=(0, None))
    shares.set(xlabel="share of rows", xlim=(0, 1))
    along.legend()
    shares.legend(fontsize="small")
    for axes in (along, shares):
        axes.grid(alpha=0.3)
    figure.savefig(path, dpi=150)
