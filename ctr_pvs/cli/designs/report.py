"""What came of a design, in words and as JSON."""

from __future__ import annotations

import itertools
import json
import math
from typing import TYPE_CHECKING
from typing import Any

from ctr_pvs.cli.robots.sheet import clearance_entry
from ctr_pvs.cli.robots.sheet import tube_entry
from ctr_pvs.renda2021.columns import aligned
from ctr_pvs.robot.dimensions import clearance
from ctr_pvs.robot.dimensions import largest_strain
from ctr_pvs.robot.dimensions import tube_curvature
from ctr_pvs.robot.robot import Robot

if TYPE_CHECKING:
    from ctr_pvs.tasks.design.design import Design
    from ctr_pvs.tasks.design.design import Outcome
    from ctr_pvs.tasks.design.design import Reached

#: What tables show lengths in.
SHOWN = {"m": (1e3, "mm"), "1/m": (1.0, "1/m")}


def as_text(found: Design) -> str:
    """Targets, parameters, tubes before and after."""
    kept = f"limits: strain {found.limits.strain:g}, margin {found.limits.margin:g}; reached: within {found.within:g} m"
    stopped = "; stopped before the end" if found.stopped else ""
    lines = [
        f"{found.robot.name}: {_reached(found.after)}",
        f"before: {_reached(found.before)}",
        "",
        *_targets(found),
        "",
        *_parameters(found),
        "",
        *_tubes(found),
        "",
        f"{found.tried} designs tried on the way to this one, {found.seconds:.1f} s; {kept}{stopped}.",
    ]
    unknown = [tube.name for tube in found.robot.tubes if tube.outer_diameter is None]
    if unknown:
        lines.append(f"Strain is not known, and not limited, for want of diameters: {', '.join(unknown)}.")
    return "\n".join(lines)


def _reached(outcome: Outcome) -> str:
    count, total = outcome.reached, len(outcome.targets)
    off = f"worst {1e3 * outcome.worst:.6g} mm off, RMS {1e3 * outcome.rms:.6g} mm"
    return f"{count} of {total} targets reached, {off}"


def _targets(found: Design) -> list[str]:
    names = [tube.name for tube in found.robot.tubes]
    joints = [f"alpha {name} [rad]" for name in names] + [f"D {name} [mm]" for name in names]
    header = ["target", "x, y, z [mm]", "off [mm]", *joints, "margin", ""]
    rows = []
    for number, (place, target) in enumerate(zip(found.targets.position, found.after.targets, strict=True), start=1):
        blank = ["-"] * len(names)
        where = " ".join(f"{1e3 * value:.3f}" for value in place.tolist())
        rows.append([
            str(number), where, f"{1e3 * target.distance:.6f}",
            *([f"{angle:.4f}" for angle in target.alpha.tolist()] or blank),
            *([f"{1e3 * D:.3f}" for D in target.D.tolist()] or blank),
            f"{target.margin:.4f}", _word(target),
        ])  # fmt: skip
    return aligned(header, *rows)


def _word(target: Reached) -> str:
    if target.reached:
        return "reached" if target.way else "reached, no way without a snap is known"
    return "missed"


def _parameters(found: Design) -> list[str]:
    rows = [["parameter", "before", "after", "bounds", ""]]
    for p, value, bound in zip(found.parameters, found.values.tolist(), found.at_bound.tolist(), strict=True):
        factor, unit = SHOWN[p.unit]
        span = f"{factor * p.low:.5g} .. {factor * p.high:.5g} {unit}"
        rows.append([
            p.words, f"{factor * p.start:.5g}", f"{factor * value:.5g}", span, "at a bound or limit" if bound else "",
        ])  # fmt: skip
    return aligned(*rows)


def _tubes(found: Design) -> list[str]:
    rows = [["tube", "length [mm]", "inside [mm]", "outside [mm]", "curvature [1/m]", "strain [%]"]]
    for name, robot in (("before", found.start), ("after", found.robot)):
        for tube in robot.tubes:
            strain = largest_strain(tube)
            rows.append([
                f"{tube.name}, {name}", _mm(tube.length), _mm(tube.inner_diameter), _mm(tube.outer_diameter),
                f"{tube_curvature(tube):.4g}", "?" if strain is None else f"{100.0 * strain:.3f}",
            ])  # fmt: skip
    return [*aligned(*rows), *_clearances(found.robot)]


def _clearances(robot: Robot) -> list[str]:
    pairs = [(a.name, b.name, clearance(a, b)) for a, b in itertools.pairwise(robot.tubes)]
    return [f"Clearance of {b} in {a}, after: {_mm(gap)} mm in diameter" for a, b, gap in pairs if gap is not None]


def _mm(value: float | None) -> str:
    return "?" if value is None else f"{1e3 * value:.4g}"


def as_json(found: Design) -> str:
    """One object on one line, SI units; null for what is infinite or not known."""
    parameters = zip(found.parameters, found.values.tolist(), found.at_bound.tolist(), strict=True)
    content = {
        "robot": found.robot.name,
        "success": found.success,
        "stopped": found.stopped,
        "tried": found.tried,
        "seconds": found.seconds,
        "limits": vars(found.limits),
        "within": found.within,
        "parameters": [
            {"name": p.name, "unit": p.unit, "start": p.start, "value": value, "low": p.low, "high": p.high,
             "at_bound": bound}
            for p, value, bound in parameters
        ],
        "before": _outcome(found, found.before, found.start),
        "after": _outcome(found, found.after, found.robot),
    }  # fmt: skip
    return json.dumps(content, allow_nan=False)


def _outcome(found: Design, outcome: Outcome, robot: Robot) -> dict[str, Any]:
    return {
        "reached": outcome.reached,
        "worst": _known(outcome.worst),
        "rms": _known(outcome.rms),
        "targets": [
            {"position": place, "distance": _known(target.distance), "angle": target.angle,
             "alpha": target.alpha.tolist(), "D": target.D.tolist(), "stability_margin": _known(target.margin),
             "reached": target.reached, "way": target.way, "message": target.message}
            for place, target in zip(found.targets.position.tolist(), outcome.targets, strict=True)
        ],
        "tubes": [tube_entry(tube) for tube in robot.tubes],
        "clearances": [clearance_entry(outer, inner) for outer, inner in itertools.pairwise(robot.tubes)],
    }  # fmt: skip


def comments(found: Design, source: str, seed: int) -> list[str]:
    """What a new robot file should say of itself."""
    return [
        f"Designed for {source} by ctr-pvs design, seed {seed}: {_reached(found.after)}"
        f"{'; stopped before the end' if found.stopped else ''}.",
        f"Limits: strain {found.limits.strain:g}, stability margin {found.limits.margin:g}.",
    ]


def _known(value: float) -> float | None:
    return value if math.isfinite(value) else None
