"""A robot as the text of a robot file: what `load_robot` reads from it is the same robot."""

from __future__ import annotations

import math
from collections.abc import Sequence

import yaml

from ctr_pvs.errors import RobotError
from ctr_pvs.robot.robot import Robot
from ctr_pvs.robot.robot import Segment
from ctr_pvs.robot.robot import Tube


def robot_text(robot: Robot, comments: Sequence[str] = ()) -> str:
    """YAML in SI units, every number to its last digit, with ``comments`` before it.

    Raises ``RobotError`` for a helix with complex coefficients, which a robot file cannot tell.
    """
    lines = [f"# {line}".rstrip() for comment in comments for line in comment.splitlines()]
    lines += [f"name: {_scalar(robot.name)}", "tubes: # outermost first"]
    for tube in robot.tubes:
        lines += _tube(tube)
    for key, parts in (("limits", robot.limits), ("play", robot.play)):
        kinds = {kind: _by_name(robot, getattr(parts, kind)) for kind in ("alpha", "D")}
        if any(kinds.values()):
            lines.append(f"{key}:")
            lines += [f"  {kind}: {{{', '.join(entries)}}}" for kind, entries in kinds.items() if entries]
    return "\n".join(lines) + "\n"


def _by_name(robot: Robot, values: Sequence[object]) -> list[str]:
    """``name: value`` of the tubes that have one."""
    pairs = zip(robot.tubes, values or [None] * robot.n_tubes, strict=True)
    return [f"{_scalar(tube.name)}: {_value(value)}" for tube, value in pairs if value]


def _value(value: object) -> str:
    return _list(value) if isinstance(value, tuple) else _number(value)


def _list(values: Sequence[object]) -> str:
    return f"[{', '.join(map(_number, values))}]"


def _number(value: object) -> str:
    """As YAML 1.1 reads it: an exponent needs a point before it."""
    text = repr(float(value))  # type: ignore[arg-type]
    return text if "e" not in text or "." in text else text.replace("e", ".0e")


def _scalar(text: str) -> str:
    return yaml.safe_dump(text, allow_unicode=True, width=10_000).splitlines()[0]


def _tube(tube: Tube) -> list[str]:
    lines = [f"  - name: {_scalar(tube.name)}"]
    for key in ("inner_diameter", "outer_diameter", "density"):
        if getattr(tube, key) is not None:
            lines.append(f"    {key}: {_number(getattr(tube, key))}")
    return [
        *lines,
        "    segments: # from the base to the tip",
        *(f"      - {_segment(tube, s)}" for s in tube.segments),
    ]


def _segment(tube: Tube, segment: Segment) -> str:
    parts = {
        "length": _number(segment.length),
        "bending_stiffness": _number(segment.bending_stiffness),
        "torsional_stiffness": _number(segment.torsional_stiffness),
    }
    if segment.turn and segment.curvature:
        if any(c.imag for c in segment.curvature):
            raise RobotError("curvature", segment.curvature, "real coefficients beside a turn, to be written in a file")
        parts |= {"curvature": _list([c.real for c in segment.curvature]), "turn": _number(segment.turn)}
    elif segment.curvature:
        for key, numbers in (
            ("curvature_y", [c.real for c in segment.curvature]),
            ("curvature_z", [c.imag for c in segment.curvature]),
        ):
            if any(numbers):
                parts[key] = _list(numbers)
    if segment.area is not None and tube.inner_diameter is not None:
        # Only the area counts, for weight: an outside that makes it around the tube's smallest bore.
        parts["inner_diameter"] = _number(tube.inner_diameter)
        parts["outer_diameter"] = _number(math.sqrt(tube.inner_diameter**2 + 4.0 * segment.area / math.pi))
    return "{" + ", ".join(f"{key}: {value}" for key, value in parts.items()) + "}"
