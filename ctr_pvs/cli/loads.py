"""External loads on the command line: from words to `Loads`, and back to a line of text and to JSON.

Tubes are named, or counted from 1, outermost first.
"""

from __future__ import annotations

import argparse
from typing import Any

from ctr_pvs.cli.words import UsageError
from ctr_pvs.cli.words import number
from ctr_pvs.robot.loads import ZERO
from ctr_pvs.robot.loads import Loads
from ctr_pvs.robot.loads import PointForce
from ctr_pvs.robot.loads import Vector
from ctr_pvs.robot.robot import Robot

_OPTIONS = ("tip_force", "tip_moment", "point_force", "point_moment", "line_force", "gravity")


def declare_loads(parser: argparse.ArgumentParser) -> None:
    """Adds the options of external loads."""
    group = parser.add_argument_group(
        "external loads",
        "Dead loads: constant in the base frame, whose +x is the insertion direction. TUBE is a name or a number from "
        "1, the outermost. Points lie beyond the orifice; what is given more than once for one place adds up.",
    )
    for kind, letter, unit in (("force", "F", "N"), ("moment", "M", "N m")):
        axes = tuple(f"{letter}{axis}" for axis in "XYZ")
        group.add_argument(
            f"--tip-{kind}",
            nargs=3,
            type=number,
            metavar=axes,
            help=f"{kind} on the tip of the tube that reaches farthest [{unit}]",
        )
        group.add_argument(
            f"--point-{kind}",
            nargs=5,
            action="append",
            metavar=("TUBE", "X", *axes),
            help=f"{kind} on a point of a tube [{unit}], X from its base [m]; may be repeated",
        )
    group.add_argument(
        "--line-force",
        nargs=4,
        action="append",
        metavar=("TUBE", "FX", "FY", "FZ"),
        help="force per length along a tube beyond the orifice [N/m]; may be repeated",
    )
    group.add_argument(
        "--gravity",
        nargs=3,
        type=number,
        metavar=("GX", "GY", "GZ"),
        help="gravity [m/s^2]; tubes need a density in the robot file",
    )


def loads_in(arguments: argparse.Namespace, robot: Robot) -> Loads | None:
    """The loads that the words ask for; None without any.

    Raises ``UsageError`` for words that are no tube or no number, ``LoadError`` for numbers that are no loads.
    """
    if all(getattr(arguments, option) is None for option in _OPTIONS):
        return None
    wrenches: dict[tuple[int, float], tuple[Vector, Vector]] = {}
    for option in ("point_force", "point_moment"):
        for words in getattr(arguments, option) or ():
            tube, (X, *vector) = _tube_and_numbers(option, words, robot)
            force, moment = wrenches.get((tube, X), (ZERO, ZERO))
            if option == "point_force":
                wrenches[tube, X] = _sum(force, vector), moment
            else:
                wrenches[tube, X] = force, _sum(moment, vector)
    lines: dict[int, Vector] = {}
    for words in arguments.line_force or ():
        tube, vector = _tube_and_numbers("line_force", words, robot)
        lines[tube] = _sum(lines.get(tube, ZERO), vector)
    points = tuple(PointForce(tube, X, *wrench) for (tube, X), wrench in wrenches.items())
    tip_force, tip_moment, gravity = (
        ZERO if vector is None else vector for vector in (arguments.tip_force, arguments.tip_moment, arguments.gravity)
    )
    return Loads(tip_force, tip_moment, points, lines, gravity)


def _tube_and_numbers(option: str, words: list[str], robot: Robot) -> tuple[int, list[float]]:
    """The index of the tube, from 0, that the first of the words means; the other words as numbers."""
    place = f"argument --{option.replace('_', '-')}"
    try:
        numbers = [number(word) for word in words[1:]]
    except argparse.ArgumentTypeError as error:
        raise UsageError(f"{place}: {error} (see ctr-pvs solve --help)") from None
    return _tube(place, words[0].strip(), robot), numbers


def _tube(place: str, word: str, robot: Robot) -> int:
    names = [tube.name for tube in robot.tubes]
    if word in names:
        return names.index(word)
    if word.isascii() and word.isdecimal() and 1 <= int(word) <= len(names):
        return int(word) - 1
    known = f"{', '.join(names)}, or a number from 1 to {len(names)}"
    raise UsageError(f"{place}: expected a tube's name, {known}, got {word!r}")


def _sum(vector: Vector, other: list[float]) -> Vector:
    x, y, z = (a + b for a, b in zip(vector, other, strict=True))
    return x, y, z


def loads_as_json(robot: Robot, loads: Loads | None) -> dict[str, Any] | None:
    """What acts, in SI units; None if nothing does."""
    if loads is None or loads.is_none:
        return None
    return {
        "tip_force": list(loads.tip_force),
        "tip_moment": list(loads.tip_moment),
        "point_forces": [
            {**_named(robot, point.tube), "X": point.X, "force": list(point.force), "moment": list(point.moment)}
            for point in loads.point_forces
        ],
        "line_forces": [{**_named(robot, tube), "force": list(force)} for tube, force in loads.line_forces.items()],
        "gravity": list(loads.gravity),
    }


def _named(robot: Robot, tube: int) -> dict[str, Any]:
    return {"tube": tube + 1, "name": robot.tubes[tube].name}


def loads_as_line(robot: Robot, loads: Loads) -> str:
    """What acts, in one line."""
    parts = [_wrench("tip ", loads.tip_force, loads.tip_moment, "")]
    for point in loads.point_forces:
        place = f" on {robot.tubes[point.tube].name} at X {1e3 * point.X:.9g} mm"
        parts.append(_wrench("", point.force, point.moment, place))
    for tube, force in loads.line_forces.items():
        parts.append(f"{_vector(force)} N/m along {robot.tubes[tube].name}" if any(force) else "")
    parts.append(f"gravity {_vector(loads.gravity)} m/s^2" if any(loads.gravity) else "")
    return "; ".join(part for part in parts if part)


def _wrench(kind: str, force: Vector, moment: Vector, place: str) -> str:
    parts = [f"{kind}force {_vector(force)} N"] if any(force) else []
    parts += [f"{kind}moment {_vector(moment)} N m"] if any(moment) else []
    return " and ".join(parts) + place if parts else ""


def _vector(vector: Vector) -> str:
    return f"({', '.join(f'{value + 0.0:g}' for value in vector)})"
