"""What came of a calibration, in words and as JSON."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING
from typing import Any

if TYPE_CHECKING:
    from ctr_pvs.tasks.calibrate import Calibration
    from ctr_pvs.tasks.calibrate import Errors
    from ctr_pvs.tasks.calibrate import FittedParameter
    from ctr_pvs.tasks.calibrate import Spread

#: What the tables show lengths and angles in.
SHOWN = {"m": (1e3, "mm"), "rad": (180.0 / math.pi, "deg"), "": (1.0, "")}


def as_text(found: Calibration) -> str:
    """Errors, parameters with their standard errors, what the data cannot tell, and where the base is."""
    parts = [_errors(found), _parameters(found)]
    if found.untold:
        parts.append("\n".join(["The data tell less than the priors of:", *(f"  {line}" for line in found.untold)]))
    else:
        parts.append("The data tell more than the priors of every parameter.")
    ended = "" if found.converged else "; NOT converged"
    weight = f"{1e3 * found.position_std:.3g} mm weighed a measured coordinate against the priors"
    parts.append(f"{found.evaluations} solves of all rows in {found.seconds:.1f} s{ended}; {weight}.")
    return "\n\n".join(parts)


def as_json(found: Calibration) -> str:
    """One object on one line, SI units; null for what is infinite or not there."""
    content = {
        "converged": found.converged,
        "evaluations": found.evaluations,
        "seconds": found.seconds,
        "position_std": found.position_std,
        "before": _errors_as_dict(found.before),
        "after": _errors_as_dict(found.after),
        "parameters": [{key: _known(value) for key, value in vars(p).items()} for p in found.parameters],
        "untold": list(found.untold),
        "registration": {"rotation": found.rotation.tolist(), "translation": found.translation.tolist()},
        "sensor": found.sensor.tolist(),
    }
    return json.dumps(content)


def comments(found: Calibration, source: str) -> list[str]:
    """What a new robot file should say of itself: where its numbers come from, and what it cannot hold."""
    after = found.after.held_out or found.after.fitted
    which = "held out" if found.after.held_out else "fitted"
    lines = [
        f"Fitted to {source} by ctr-pvs calibrate: tips of {after.rows} rows {which} are off by "
        f"{1e3 * after.median:.2f} mm in the median, {1e3 * after.ninety:.2f} mm at 90 %.",
        *(f"  {_line(parameter)}" for parameter in found.parameters if parameter.name.split(":")[0] not in _PLACING),
    ]
    outside = [p for p in found.parameters if p.name.split(":")[0] in ("alpha", "D")]
    if outside:
        lines.append("A robot file holds no joint offsets: add these to every command.")
        lines += [f"  {p.name}: {p.value:.9g} {p.unit}" for p in outside]
    return lines


_PLACING = ("registration", "sensor", "alpha", "D")


def _errors(found: Calibration) -> str:
    rows = [["tips off by", "rows", "median", "90 %", "largest", "of the length: median", "90 %", "largest"]]
    for name, errors in (("before", found.before), ("after", found.after)):
        rows.append(_spread(f"{name}, fitted", errors.fitted))
        if errors.held_out is not None:
            rows.append(_spread(f"{name}, held out", errors.held_out))
    text = _aligned(rows)
    lost = found.after.fitted.lost + (found.after.held_out.lost if found.after.held_out else 0)
    return text + (f"\n{lost} rows have no equilibrium in the model and are left out." if lost else "")


def _spread(name: str, spread: Spread) -> list[str]:
    lengths = [f"{1e3 * x:.2f} mm" for x in (spread.median, spread.ninety, spread.largest)]
    shares = [f"{100 * x:.2f} %" for x in (spread.median_share, spread.ninety_share, spread.largest_share)]
    return [name, str(spread.rows), *lengths, *shares]


def _parameters(found: Calibration) -> str:
    rows = [["parameter", "value", "standard error", "prior", ""]]
    for p in found.parameters:
        factor, unit = SHOWN[p.unit]
        prior = "none" if math.isinf(p.std) else f"{factor * p.mean:.4g} +- {factor * p.std:.3g}"
        bound = "at its bound" if p.at_bound else ""
        rows.append([p.words, f"{factor * p.value:.5g} {unit}".rstrip(), f"{factor * p.error:.2g}", prior, bound])
    return _aligned(rows)


def _line(parameter: FittedParameter) -> str:
    factor, unit = SHOWN[parameter.unit]
    return f"{parameter.words}: {factor * parameter.value:.5g} +- {factor * parameter.error:.2g} {unit}".rstrip()


def _aligned(rows: list[list[str]]) -> str:
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = []
    for row in rows:
        first, *others = (cell.ljust(width) if i == 0 else cell.rjust(width) for i, (cell, width) in
                          enumerate(zip(row, widths, strict=True)))  # fmt: skip
        lines.append("  ".join([first, *others]).rstrip())
    return "\n".join(lines)


def _errors_as_dict(errors: Errors) -> dict[str, Any]:
    held = errors.held_out
    return {"fitted": vars(errors.fitted), "held_out": None if held is None else vars(held)}


def _known(value: object) -> object:
    return None if isinstance(value, float) and not math.isfinite(value) else value
