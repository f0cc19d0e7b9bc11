"""Pictures of a stability scan, as PNG files.  matplotlib is needed only when drawing."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.cli.stability.scan import Scan
from ctr_pvs.cli.stability.scan import SweepSnap
from ctr_pvs.renda2021.figures import empty_figure
from ctr_pvs.renda2021.figures import make_folder

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis

Array = NDArray[np.float64]

STABLE, UNSTABLE, SNAP = "tab:blue", "0.55", "tab:red"
#: Steps of the angle axis [deg] that may be marked, and the most marks.
MARKS, MOST_MARKS = (1, 2, 5, 10, 15, 30, 45, 60, 90, 180, 360), 13
#: Room [deg] above and below the S-curve's window, and [pt] for its legend between the window and the title.
ROOM, LEGEND = 15.0, 28.0


def save_pictures(scan: Scan, folder: Path) -> list[Path]:
    """Draw stability.png, and map.png where there is a map, into ``folder``, made if missing.

    Raises ``PictureError`` where matplotlib is missing, ``OSError`` where the folder cannot be written.
    """
    make_folder(folder)
    paths = [folder / "stability.png"]
    _save_sweep(scan, paths[0])
    if scan.map is not None:
        paths.append(folder / "map.png")
        _save_map(scan, paths[1])
    return paths


def _save_sweep(scan: Scan, path: Path) -> None:
    """Above the branches of all equilibria, where there is a curve; below margin and reserve along the sweep."""
    curve = scan.curve
    figure = empty_figure((8.5, 8.0 if curve else 4.2))
    if curve:
        above, below = figure.subplots(2, 1, sharex=True, height_ratios=(1.6, 1.0))
        _draw_curve(scan, above)
        above.set_title(_title(scan), pad=LEGEND)
    else:
        below = figure.subplots()
        below.set_title(_title(scan))
    _draw_margin(scan, below)
    below.set_xlabel(f"rotation of the {_name(scan)} tube [deg]")
    _angle_axis(scan.sweep.angles, below)
    figure.tight_layout()
    figure.savefig(path)


def _draw_curve(scan: Scan, axes: Axes) -> None:
    curve = scan.curve
    assert curve is not None
    low, high = np.degrees([scan.sweep.angles.min(), scan.sweep.angles.max()])
    seen: list[Array] = []
    for stable, style in ((False, {"color": UNSTABLE, "linestyle": "--"}), (True, {"color": STABLE, "linewidth": 2.2})):
        label = "stable" if stable else "unstable"
        for branch in curve.branches:
            if branch.stable is stable:
                x, y = np.degrees(branch.angles), np.degrees(branch.theta_tip)
                axes.plot(x, y, label=label, **style)
                seen.append(y[(x >= low) & (x <= high)])
                label = "_" + label.lstrip("_")
    folds = [fold for fold in curve.folds if fold.ends_stable]
    if folds:
        x, y = (np.degrees([getattr(fold, name) for fold in folds]) for name in ("angle", "theta_tip"))
        axes.plot(x, y, "o", color=SNAP, markersize=6, label="fold where a stable branch ends", zorder=4)
    walked = np.degrees(_walked(scan))
    axes.plot(np.degrees(scan.sweep.angles), walked, ".", color="black", markersize=3.5, label="sweep", zorder=3)
    for cut, snap in _cuts(scan):
        if np.isfinite(walked[cut - 1 : cut + 1]).all():
            axes.annotate(
                "",
                xy=(np.degrees(snap.angle), walked[cut]),
                xytext=(np.degrees(snap.angle), walked[cut - 1]),
                arrowprops={"arrowstyle": "->", "color": SNAP, "linestyle": ":", "linewidth": 1.3},
            )
    shown = np.concatenate([*seen, walked[np.isfinite(walked)]])
    axes.set_ylim(shown.min() - ROOM, shown.max() + ROOM)
    _mark_angles(axes.yaxis, shown.min(), shown.max(), MOST_MARKS - 3)
    tubes = scan.scene.robot.tubes
    axes.set_ylabel(f"{tubes[curve.b].name} against {tubes[curve.a].name} tube\nat s = {1e3 * curve.end:.4g} mm [deg]")
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=4, frameon=False)
    axes.grid(alpha=0.3)


def _cuts(scan: Scan) -> list[tuple[int, SweepSnap]]:
    """The index of the first answer past each snap, one snap for each gap between answers."""
    sweep = scan.sweep
    order = np.sign(sweep.angles[-1] - sweep.angles[0])
    cuts: dict[int, SweepSnap] = {}
    for snap in sweep.snaps:
        cut = int(np.searchsorted(order * sweep.angles, order * snap.angle))
        if 0 < cut < len(sweep.angles):
            cuts.setdefault(cut, snap)
    return sorted(cuts.items())


def _walked(scan: Scan) -> Array:
    """(k,) theta_tip [rad] of the sweep's answers."""
    curve = scan.curve
    assert curve is not None
    walked = np.full(len(scan.sweep.answers), np.nan)
    for index, one in enumerate(scan.sweep.answers):
        if one.success:
            psi = one.shape.angle_at_boundaries[np.argmin(np.abs(one.shape.domain.boundaries - curve.end))]
            walked[index] = psi[curve.b] - psi[curve.a]
    return walked


def _draw_margin(scan: Scan, axes: Axes) -> None:
    sweep = scan.sweep
    x = np.degrees(sweep.angles)
    cuts = _cuts(scan)
    for name, colour, label in (
        ("stability_margin", STABLE, "stability margin"),
        ("snap_reserve", "tab:green", "reserve"),
    ):
        # Both are 0 where a branch ends; the gap keeps the line from joining what a snap parts.
        at = [cut for cut, _ in cuts for _ in range(2)]
        ends = [place for _, snap in cuts for place in (np.degrees(snap.angle), np.nan)]
        zeros = [0.0, np.nan] * len(cuts)
        axes.plot(np.insert(x, at, ends), np.insert(sweep.values(name), at, zeros), "-", color=colour, label=label)
    for index, snap in enumerate(sweep.snaps):
        label = f"snap at {np.degrees(snap.angle):.2f}°" if index < 3 else "_more"
        axes.axvline(np.degrees(snap.angle), color=SNAP, linestyle=":", label=label)
    axes.axhline(0.0, color="black", linewidth=0.8)
    axes.set_ylabel("margin, reserve")
    axes.set_ylim(-0.05, 1.05)
    axes.legend(loc="best")
    axes.grid(alpha=0.3)


def _save_map(scan: Scan, path: Path) -> None:
    """The margin in colour, the line where the branch ends, and hatching past it."""
    chart = scan.map
    assert chart is not None
    figure = empty_figure((8.5, 5.6))
    axes = figure.subplots()
    x, y = np.degrees(chart.angles), 1e3 * chart.D
    axes.set_facecolor("0.92")
    axes.patch.set_hatch("///")
    axes.patch.set_edgecolor("0.75")
    mesh = axes.pcolormesh(x, y, chart.margin, shading="nearest", vmin=0.0, vmax=1.0, cmap="viridis")
    axes.plot(np.degrees(chart.snap), y, "o-", color=SNAP, markersize=3, label="the branch ends: snap")
    if np.isfinite(chart.snap).any():
        axes.legend(loc="best")
    figure.colorbar(mesh, ax=axes, label="stability margin", pad=0.02)
    axes.set_xlim(min(x[0], x[-1]), max(x[0], x[-1]))
    axes.set_xlabel(f"rotation of the {_name(scan)} tube, swept from {x[0]:g}° [deg]")
    axes.set_ylabel(f"D of the {_name(scan)} tube [mm]")
    axes.set_title(f"{scan.scene.robot.name}: margin of the branch at {x[0]:g}°, hatched past its end")
    _angle_axis(chart.angles, axes)
    figure.tight_layout()
    figure.savefig(path)


def _angle_axis(angles: Array, axes: Axes) -> None:
    low, high = np.degrees([angles.min(), angles.max()])
    axes.set_xlim(low, high)
    _mark_angles(axes.xaxis, low, high, MOST_MARKS)


def _mark_angles(axis: Axis, low: float, high: float, most: int) -> None:
    """Marks at round angles [deg], ``most`` of them at most; the axis's own choice where none would do."""
    from matplotlib.ticker import MultipleLocator

    steps = [step for step in MARKS if 2.0 <= (high - low) / step <= most]
    if steps:
        axis.set_major_locator(MultipleLocator(steps[0]))


def _name(scan: Scan) -> str:
    return scan.scene.robot.tubes[scan.scene.tube].name


def _title(scan: Scan) -> str:
    D = ", ".join(f"{1e3 * base:.4g}" for base in scan.scene.D)
    return f"{scan.scene.robot.name}, D = {D} mm"
