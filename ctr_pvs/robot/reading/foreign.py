"""Robot files of other codes, in the two shapes that are common, as tubes in our conventions.

``lists``: one mapping whose values are lists with an entry for each tube (a single number holds for all)::

    {OD: [1.1, 1.9], ID: [0.7, 1.4], E: 5.0e10, nu: 0.3, length: [431, 332], length_curved: [103, 113],
     curvature: [21.3, 13.1], units: [mm, Pa, 1/m], innermost_first: true}

``tubes``: a mapping for each tube, in a list or under names such as tube_0, alone or under the key `tubes`.

The names of the keys are those of ``KEYS``. Units come from `units`, or from whoever asks for the conversion. What the
file does not say is refused, not guessed.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from collections.abc import Mapping
from collections.abc import Sequence
from dataclasses import dataclass
from dataclasses import replace
from typing import Any

from ctr_pvs.errors import RobotFileError
from ctr_pvs.robot.reading.foreign_units import Units
from ctr_pvs.robot.strict_yaml import read_yaml

SHAPES = ("lists", "tubes")
#: What a quantity is called, in lower case.
KEYS = {
    "name": ("name", "names"),
    "length": ("length", "l", "total_length"),
    "straight": ("straight_length", "length_straight", "l_s", "ls"),
    "curved": ("curved_length", "length_curved", "l_c", "lc"),
    "outer_diameter": ("od", "outer_diameter", "diameter_outer"),
    "inner_diameter": ("id", "inner_diameter", "diameter_inner"),
    "youngs_modulus": ("e", "youngs_modulus", "young_modulus", "stiffness"),
    "shear_modulus": ("g", "shear_modulus", "torsional_stiffness"),
    "poissons_ratio": ("nu", "poissons_ratio", "poisson_ratio", "poisson"),
    "curvature": ("curvature", "kappa"),
    "radius": ("radius", "radius_of_curvature"),
    "u_x": ("u_x", "ux", "x_curvature"),
    "u_y": ("u_y", "uy", "y_curvature"),
    "beta": ("beta", "betas"),
    "theta": ("theta", "thetas", "alpha", "alphas"),
}
_QUANTITY = {name: quantity for quantity, names in KEYS.items() for name in names}
_TOP = ("units", "innermost_first", "robot")


@dataclass(frozen=True)
class ForeignTube:
    """A tube in SI units; kappa = kappa_y + i kappa_z [1/m] of its curved part. D [m] and alpha [rad] if the file has
    a command."""

    name: str
    straight: float
    curved: float
    kappa: complex
    inner_diameter: float
    outer_diameter: float
    youngs_modulus: float
    shear_modulus: float | None
    poissons_ratio: float | None
    D: float | None
    alpha: float | None


@dataclass(frozen=True)
class ForeignRobot:
    """Tubes, outermost first, and which way the file had them."""

    name: str | None
    tubes: tuple[ForeignTube, ...]
    innermost_first: bool


def read_foreign(file: str, shape: str | None, units: Sequence[str], innermost_first: bool | None) -> ForeignRobot:
    """The robot of another code's file.

    Args:
        file: YAML or JSON.
        shape: one of ``SHAPES``; None: by the look of it.
        units: words of ``foreign_units``; those of the file, if it has any, must not differ.
        innermost_first: the order of its tubes; None: as the file says, or as its diameters tell.

    Raises:
        RobotFileError: for what cannot be read, is not known, or contradicts itself.
    """
    content = read_yaml(file)
    if not isinstance(content, dict | list):
        raise RobotFileError(file, "", content, "a mapping, or a list of tubes")
    top = {key: content[key] for key in _TOP if key in content} if isinstance(content, dict) else {}
    rows = _rows(file, content, shape)
    known = Units(file, [*_words(file, top.get("units", [])), *units])
    tubes = [_tube(file, where, row, known) for where, row in rows]
    order = _order(file, tubes, top.get("innermost_first"), innermost_first)
    name = top.get("robot")
    count = len(tubes)
    ordered = tubes[::-1] if order else tubes
    names = {1: ["tube"], 2: ["outer", "inner"], 3: ["outer", "middle", "inner"]}.get(
        count, [f"tube_{index + 1}" for index in range(count)]
    )
    named = tuple(_named(tube, default) for tube, default in zip(ordered, names, strict=True))
    return ForeignRobot(name if isinstance(name, str) else None, named, order)


def _words(file: str, units: Any) -> list[str]:
    words = units if isinstance(units, list) else [units]
    if not all(isinstance(word, str) for word in words):
        raise RobotFileError(file, "units", units, "units such as [mm, Pa, 1/m, deg]")
    return words


def _rows(file: str, content: Any, shape: str | None) -> list[tuple[str, Mapping[str, Any]]]:
    """Where each tube stands, and its values by quantity, with the key as it was written."""
    body = content
    if isinstance(content, dict):
        rest = {key: value for key, value in content.items() if key not in _TOP}
        body = rest.pop("tubes", rest)
        if rest and body is not rest:
            key = next(iter(rest))
            raise RobotFileError(file, str(key), rest[key], f"beside tubes only {', '.join(_TOP)}", "remove it")
    entries = list(body.values()) if isinstance(body, dict) else body
    of_mappings = isinstance(entries, list) and bool(entries) and all(isinstance(one, dict) for one in entries)
    shape = shape or ("tubes" if of_mappings else "lists")
    if shape == "tubes":
        if not of_mappings:
            raise RobotFileError(file, "", body, "a mapping for each tube", "or is it --from lists?")
        named = enumerate(body) if isinstance(body, list) else body.items()
        return [(f"[{key}]" if isinstance(body, list) else str(key), one) for key, one in named]
    if not isinstance(body, dict) or not any(isinstance(value, list) for value in body.values()):
        raise RobotFileError(file, "", body, "a mapping of lists with an entry for each tube", "or is it --from tubes?")
    return _rows_of_lists(file, body)


def _rows_of_lists(file: str, lists: Mapping[str, Any]) -> list[tuple[str, Mapping[str, Any]]]:
    counts = {key: len(value) for key, value in lists.items() if isinstance(value, list)}
    first = next(iter(counts))
    for key, count in counts.items():
        if count != counts[first] or not count:
            raise RobotFileError(file, str(key), lists[key], f"as many entries as {first} has, {counts[first]}")
    return [
        (f"[{index}]", {key: value[index] if isinstance(value, list) else value for key, value in lists.items()})
        for index in range(counts[first])
    ]


class _Row:
    """The values of one tube, by quantity."""

    def __init__(self, file: str, where: str, row: Mapping[str, Any], units: Units) -> None:
        self.file, self.where, self.units = file, where, units
        self.values: dict[str, tuple[str, Any]] = {}
        for key, value in row.items():
            quantity = _QUANTITY.get(units.stripped(str(key)).lower())
            if quantity is None or quantity in self.values:
                keys = ", ".join(name for names in KEYS.values() for name in names)
                raise self.error(str(key), key, f"one of the keys {keys}, and each quantity once", "remove it")
            self.values[quantity] = str(key), value

    def __contains__(self, quantity: str) -> bool:
        return quantity in self.values

    def error(self, key: str, value: object, limit: str, remedy: str = "") -> RobotFileError:
        return RobotFileError(self.file, f"{self.where}.{key}", value, limit, remedy)

    def number(self, quantity: str, low: float = -math.inf, high: float = math.inf) -> float:
        """In SI units."""
        if quantity not in self:
            raise self.error(quantity, None, f"one of the keys {', '.join(KEYS[quantity])}", "add it")
        key, value = self.values[quantity]
        if isinstance(value, bool) or not isinstance(value, int | float) or math.isnan(value):
            raise self.error(key, value, "a number")
        scaled = self.units.scaled(self.where, quantity, key, float(value))
        if not low <= scaled <= high:
            raise self.error(key, value, f"what is {low:g} to {high:g} in SI units", "see --units")
        return scaled

    def numbers(self, quantities: Iterable[str]) -> list[float | None]:
        return [self.number(quantity) if quantity in self else None for quantity in quantities]


def _tube(file: str, where: str, values: Mapping[str, Any], units: Units) -> ForeignTube:
    row = _Row(file, where, values, units)
    straight, curved = _lengths(row)
    beta, theta = row.numbers(("beta", "theta"))
    if beta is not None and not -(straight + curved) <= beta <= 0.0:
        rule = f"-{straight + curved:g} to 0 m: z-forward codes count beta from the orifice back to the base"
        raise row.error(row.values["beta"][0], beta, rule, "D = -beta")
    if ("shear_modulus" in row) == ("poissons_ratio" in row):
        raise row.error("G", None, "a shear modulus G or Poisson's ratio nu, one of them")
    shear, ratio = row.numbers(("shear_modulus", "poissons_ratio"))
    name = row.values["name"][1] if "name" in row else where.strip("[]")
    inner, outer = row.number("inner_diameter", 0.0), row.number("outer_diameter", 0.0)
    kappa = _kappa(row) if curved else 0j
    D = None if beta is None else 0.0 - beta
    return ForeignTube(
        str(name), straight, curved, kappa, inner, outer, row.number("youngs_modulus"), shear, ratio, D, theta
    )


def _lengths(row: _Row) -> tuple[float, float]:
    """Straight and curved length [m]: two of straight, curved and their sum, or all three."""
    total, straight, curved = row.numbers(("length", "straight", "curved"))
    if curved is None and straight is not None and total is not None:
        curved = total - straight
    if straight is None and curved is not None and total is not None:
        straight = total - curved
    if straight is None or curved is None:
        rule = "two of length, straight_length and curved_length"
        raise row.error("curved_length", None, rule, "which part is curved cannot be known")
    straight, curved = (0.0 if abs(part) < 1e-9 else part for part in (straight, curved))
    if straight < 0.0 or curved < 0.0 or (total is not None and abs(straight + curved - total) > 1e-9):
        raise row.error("length", total, f"the sum of its straight ({straight:g} m) and curved ({curved:g} m) part")
    return straight, curved


def _kappa(row: _Row) -> complex:
    """Of the curved part: u_x and u_y of a z-forward code are kappa_y and kappa_z (docs/conventions.md)."""
    ways = [way for way in ("curvature", "radius") if way in row]
    ways += ["u_x"] if "u_x" in row or "u_y" in row else []
    if len(ways) != 1:
        raise row.error("curvature", ways or None, "one of curvature, radius, or u_x with u_y", "for the curved part")
    if ways == ["u_x"]:
        u_x, u_y = row.numbers(("u_x", "u_y"))
        return complex(u_x or 0.0, u_y or 0.0)
    if ways == ["curvature"]:
        return complex(row.number("curvature"))
    radius = row.number("radius")
    if radius == 0.0:
        raise row.error(row.values["radius"][0], 0, "a radius of curvature other than 0", "a straight tube has .inf")
    return complex(1.0 / radius)


def _order(file: str, tubes: list[ForeignTube], said: Any, asked: bool | None) -> bool:
    """Whether the innermost tube is first; where it is said twice, and by the diameters, all must agree."""
    if said is not None and not isinstance(said, bool):
        raise RobotFileError(file, "innermost_first", said, "true or false")
    outer = [tube.outer_diameter for tube in tubes]
    by_size = None if len(tubes) == 1 else outer[0] < outer[-1]
    answers = {answer for answer in (said, asked, by_size) if answer is not None}
    if len(answers) > 1:
        inwards = " to ".join(f"{1e3 * size:g} mm" for size in (outer[0], outer[-1]))
        raise RobotFileError(
            file, "innermost_first", said if asked is None else asked, f"the order of sizes, {inwards}"
        )
    return bool(answers and answers.pop())


def _named(tube: ForeignTube, default: str) -> ForeignTube:
    numbered = not tube.name or tube.name[-1].isdigit()
    return replace(tube, name=default) if numbered else tube
