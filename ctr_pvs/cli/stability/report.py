"""A stability scan as text: a summary for people, strict JSON for scripts."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np

from ctr_pvs.cli.stability.scan import Scan
from ctr_pvs.oracles.two_tubes import critical_lambda
from ctr_pvs.renda2021.columns import aligned
from ctr_pvs.robot.plausibility import implausible

#: Rows of the sweep that the text shows at most; JSON has all.
SHOWN = 25
MARGIN_NOTE = (
    "Margin: 1 where nothing pulls the tubes off, 0 where the branch ends, below 0 unstable. Reserve: falls smoothly\n"
    "from 1 at the relaxed robot to 0 there, long before the margin moves."
)


def scan_as_text(scan: Scan, degrees: bool) -> str:
    """The sweep as a table of at most ``SHOWN`` rows, then what happened on it; angles in degrees or radians."""
    angle = _Angle(degrees)
    scene, sweep = scan.scene, scan.sweep
    name = scene.robot.tubes[scene.tube].name
    others = "  ".join(
        f"{tube.name} {angle.of(alpha)}"
        for index, (tube, alpha) in enumerate(zip(scene.robot.tubes, scene.alpha, strict=True))
        if index != scene.tube
    )
    span = f"{angle.of(sweep.angles[0])} to {angle.of(sweep.angles[-1])} {angle.unit}, {len(sweep.angles)} steps"
    lines = [
        f"{scene.robot.name}: {name} rotated from {span}",
        f"D = {' '.join(f'{base:g}' for base in scene.D)} m"
        + (f"; other rotations [{angle.unit}]: {others}" if others else ""),
        "",
        *_table(scan, angle),
        MARGIN_NOTE,
        "",
        *_outcome(scan, angle, name),
        *_folds(scan, angle, name),
        *_closed_form(scan),
        *_map(scan, angle),
    ]
    return "\n".join(lines)


def _table(scan: Scan, angle: _Angle) -> list[str]:
    sweep = scan.sweep
    every = math.ceil(len(sweep.answers) / SHOWN)
    rows = []
    for value, one in list(zip(sweep.angles, sweep.answers, strict=True))[::every]:
        numbers = ["", "", ""]
        if one.success:
            numbers = [f"{one.stability_margin:.4f}", f"{one.snap_reserve:.4f}", f"{one.energy:.6f}"]
        rows.append([angle.of(value), *numbers, one.status.value])
    table = aligned([f"alpha [{angle.unit}]", "margin", "reserve", "energy [J]", "status"], *rows)
    return table if every == 1 else [*table, f"(one step in {every}; --json has all)"]


def _outcome(scan: Scan, angle: _Angle, name: str) -> list[str]:
    sweep = scan.sweep
    lines = []
    if sweep.worst is not None:
        place = angle.of(sweep.worst.alpha[scan.scene.tube])
        lines.append(f"Smallest margin {sweep.worst.stability_margin:.4f}, at {name} {place} {angle.unit}.")
    if sweep.snaps_before:
        times = "once" if sweep.snaps_before == 1 else f"{sweep.snaps_before} times"
        lines.append(f"The cold start snapped {times} on its way to the first angle.")
    for snap in sweep.snaps:
        lines.append(f"Snap at {name} {angle.of(snap.angle)} {angle.unit}, releasing {snap.energy_released:.4g} J.")
    failed = [one for one in sweep.answers if not one.success]
    if failed:
        lines.append(f"No answer at {len(failed)} of {len(sweep.answers)} steps; the first: {failed[0].message}.")
    elif not sweep.snaps:
        lines.append("No snap on the way.")
    return lines


def _folds(scan: Scan, angle: _Angle, name: str) -> list[str]:
    curve = scan.curve
    if curve is None:
        return ["Not exactly two pre-curved tubes overlap here with this one: folds are told by the sweep only."]
    tubes = scan.scene.robot.tubes
    tip = f"{tubes[curve.b].name} against {tubes[curve.a].name} at s = {1e3 * curve.end:g} mm"
    if not curve.folds:
        return [f"No folds in this range: every rotation in it has as many equilibria ({tip})."]
    lines = [f"Folds in this range, of all branches (theta: {tip}):"]
    for fold in curve.folds:
        ends = "grows" if fold.as_it_grows else "falls"
        kind = "a stable branch" if fold.ends_stable else "unstable branches"
        verb = "ends" if fold.ends_stable else "end"
        place = f"{name} {angle.fine(fold.angle)}, theta {angle.fine(fold.theta_tip)} {angle.unit}"
        lines.append(f"  {place}: {kind} {verb} as the angle {ends}")
    return lines if curve.resolved else [*lines, "  There may be more: the coupling is too strong to resolve them all."]


def _closed_form(scan: Scan) -> list[str]:
    two = scan.closed_form
    if two is None:
        return []
    verdict = "never snaps" if two.snap_free else "can snap"
    return [f"Two tubes of constant curvature: lambda {two.lam:.6g}, b {two.b:.6g}; critical lambda "
            f"{critical_lambda(two.b):.6g}: this pair {verdict}."]  # fmt: skip


def _map(scan: Scan, angle: _Angle) -> list[str]:
    chart = scan.map
    if chart is None:
        return []
    first, last = 1e3 * chart.D[0], 1e3 * chart.D[-1]
    lines = [f"Map of D from {first:g} to {last:g} mm: the branch of the first angle ends on the way in "
             f"{int(np.isfinite(chart.snap).sum())} of {len(chart.D)} rows."]  # fmt: skip
    if np.isfinite(chart.snap).any():
        row = int(np.nanargmin(np.abs(chart.snap - chart.angles[0])))
        lines[0] += f" It ends soonest, at {angle.of(chart.snap[row])} {angle.unit}, for D = {1e3 * chart.D[row]:g} mm."
    return lines


class _Angle:
    """Angles [rad] as text, in the unit the user chose."""

    def __init__(self, degrees: bool) -> None:
        self.unit, self.factor = ("deg", 180.0 / math.pi) if degrees else ("rad", 1.0)

    def of(self, value: float) -> str:
        return f"{round(self.factor * float(value), 6 - 2 * (self.unit == 'deg')) + 0.0:g}"

    def fine(self, value: float) -> str:
        return (
            f"{round(self.factor * float(value), 7 - 2 * (self.unit == 'deg')) + 0.0:.{7 - 2 * (self.unit == 'deg')}f}"
        )


def scan_as_json(scan: Scan) -> str:
    """One line of strict JSON in SI units, with null for what is not known or was not asked for."""
    scene, sweep = scan.scene, scan.sweep
    answer = {
        "robot": scene.robot.name,
        "tube": scene.robot.tubes[scene.tube].name,
        "alpha": [None if index == scene.tube else angle for index, angle in enumerate(scene.alpha.tolist())],
        "D": scene.D.tolist(),
        "sweep": {
            "alpha": sweep.angles.tolist(),
            "status": [one.status.value for one in sweep.answers],
            "stability_margin": _numbers(sweep.values("stability_margin")),
            "snap_reserve": _numbers(sweep.values("snap_reserve")),
            "energy": _numbers(sweep.values("energy")),
        },
        "snaps": [{"alpha": snap.angle, "energy_released": snap.energy_released} for snap in sweep.snaps],
        "snaps_before": sweep.snaps_before,
        "curve": _curve(scan),
        "two_tubes": _two_tubes(scan),
        "map": _map_parts(scan),
        "warnings": implausible(scene.robot),
    }
    return json.dumps(answer, allow_nan=False)


def _curve(scan: Scan) -> dict[str, Any] | None:
    curve = scan.curve
    if curve is None:
        return None
    names = [scan.scene.robot.tubes[index].name for index in (curve.a, curve.b)]
    return {
        "tubes": names,
        "s": curve.end,
        "resolved": curve.resolved,
        "folds": [
            {
                "alpha": fold.angle,
                "theta_tip": fold.theta_tip,
                "ends_as_alpha": "grows" if fold.as_it_grows else "falls",
                "ends_stable": fold.ends_stable,
            }
            for fold in curve.folds
        ],
        "branches": [
            {"stable": branch.stable, "alpha": branch.angles.tolist(), "theta_tip": branch.theta_tip.tolist()}
            for branch in curve.branches
        ],
    }


def _two_tubes(scan: Scan) -> dict[str, Any] | None:
    two = scan.closed_form
    if two is None:
        return None
    critical = critical_lambda(two.b)
    return {"lambda": two.lam, "b": two.b, "critical_lambda": critical, "snap_free": two.snap_free}


def _map_parts(scan: Scan) -> dict[str, Any] | None:
    chart = scan.map
    if chart is None:
        return None
    margin = [_numbers(row) for row in chart.margin]
    return {
        "D": chart.D.tolist(),
        "alpha": chart.angles.tolist(),
        "stability_margin": margin,
        "snap": _numbers(chart.snap),
    }


def _numbers(values: Any) -> list[float | None]:
    """Plain numbers, with None where there is none."""
    return [float(value) if math.isfinite(value) else None for value in values]
