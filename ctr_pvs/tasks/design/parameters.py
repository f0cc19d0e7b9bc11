"""What of a robot may vary: names, bounds, and the robot that values make."""

from __future__ import annotations

import math
from collections.abc import Iterable
from collections.abc import Mapping
from collections.abc import Sequence
from dataclasses import dataclass
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.errors import FieldError
from ctr_pvs.errors import check_choice
from ctr_pvs.robot.cross_section import annulus_area
from ctr_pvs.robot.cross_section import annulus_stiffness
from ctr_pvs.robot.dimensions import tube_curvature
from ctr_pvs.robot.robot import Robot
from ctr_pvs.robot.robot import Segment
from ctr_pvs.robot.robot import Tube
from ctr_pvs.tasks.calibration.parameters import scaled

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Kind:
    """A group of parameters: unit, words, and bounds as shares of the value that a robot begins with."""

    unit: str
    words: str
    low: float
    high: float


KINDS = {
    "length": Kind("m", "length of {}", 0.5, 2.0),
    "inner_diameter": Kind("m", "inner diameter of {}", 0.7, 1.4),
    "outer_diameter": Kind("m", "outer diameter of {}", 0.7, 1.4),
    "curvature": Kind("1/m", "curvature of {}", 0.5, 2.0),
}
#: What varies unless told otherwise.
USUAL = ("length", "curvature")


@dataclass(frozen=True)
class Parameter:
    """One number that may vary.

    name : such as "curvature:inner".  tube, segment : from 0, -1 for none.  start : its value in the robot to begin
    with; low, high : bounds.  A curvature is the largest of its tube at the lengths to begin with; all of the tube's
    pre-curvature goes with it.
    """

    name: str
    kind: str
    tube: int
    segment: int
    start: float
    low: float
    high: float
    unit: str
    words: str


def chosen(robot: Robot, vary: Iterable[str] = USUAL) -> list[Parameter]:
    """The parameters that ``vary`` names: groups (``length``), a tube's (``length:inner``) or single ones
    (``length:inner:2``), with bounds if need be: ``curvature:inner=5,20`` in SI units, ``=0.5x,2x`` in multiples of the
    value to begin with.  Of two words for one parameter the later holds.

    Raises ``FieldError`` for names that mean nothing here, bounds that leave nothing, and no names at all.
    """
    every, table = _every(robot), dict[str, Parameter]()
    for word in vary:
        name, equals, pair = word.partition("=")
        within = [one for one in every if one == name or one.startswith(f"{name}:")]
        if not within:
            check_choice(
                "vary", name, (*(kind for kind in KINDS if any(kind == p.kind for p in every.values())), *every)
            )
        for one in within:
            table[one] = _bounded(every[one], word, pair if equals else "")
    if not table:
        raise FieldError("vary", list(vary), "at least one parameter", "else there is nothing to design")
    return [table[name] for name in every if name in table]


def _every(robot: Robot) -> dict[str, Parameter]:
    """All that this robot has, by name, in the order in which limits settle them: see ``room``."""
    found: dict[str, Parameter] = {}

    def add(kind: str, of: str, words: str, tube: int, start: float, segment: int = -1) -> None:
        k, name = KINDS[kind], f"{kind}:{of}"
        low, high = k.low * start, k.high * start
        found[name] = Parameter(name, kind, tube, segment, start, low, high, k.unit, k.words.format(words))

    for j, tube in enumerate(robot.tubes):
        for i, segment in enumerate(tube.segments):
            add("length", f"{tube.name}:{i + 1}", f"segment {i + 1} of {tube.name}", j, segment.length, i)
    for kind in ("inner_diameter", "outer_diameter"):
        for j, tube in enumerate(robot.tubes):
            if getattr(tube, kind) is not None:
                add(kind, tube.name, tube.name, j, getattr(tube, kind))
    for j, tube in enumerate(robot.tubes):
        if tube_curvature(tube) > 0.0:
            add("curvature", tube.name, tube.name, j, tube_curvature(tube))
    return found


def _bounded(parameter: Parameter, word: str, pair: str) -> Parameter:
    """The parameter with the bounds of a word, its own without any."""
    rule = "a lower and a higher bound, such as 5,20 or 0.5x,2x"
    if pair:
        ends = [_bound(text, parameter.start) for text in pair.split(",")]
        if len(ends) != 2:
            raise FieldError("vary", word, rule)
        parameter = replace(parameter, low=ends[0], high=ends[1])
    if not 0.0 <= parameter.low < parameter.high < math.inf:  # NaN fails, too
        raise FieldError("vary", word, rule, f"{parameter.name} begins with {parameter.start:.6g} {parameter.unit}")
    return parameter


def _bound(text: str, start: float) -> float:
    number, times, rest = text.strip().partition("x")
    try:
        value = math.nan if rest else float(number)
    except ValueError:
        return math.nan
    return value * start if times else value


def robot_with(robot: Robot, parameters: Sequence[Parameter], values: Array) -> Robot:
    """The robot with the tubes that these ``values`` (P,) say; nothing else of it changes.

    Stiffnesses go with the second moment of the section that the diameters make: the material stays.
    """
    value = {p.name: float(v) for p, v in zip(parameters, values, strict=True)}
    return replace(robot, tubes=tuple(_tube_with(tube, value) for tube in robot.tubes))


def _tube_with(tube: Tube, value: Mapping[str, float]) -> Tube:
    factor = 1.0
    if (curvature := value.get(f"curvature:{tube.name}")) is not None:
        factor = curvature / tube_curvature(tube)
    inner = value.get(f"inner_diameter:{tube.name}", tube.inner_diameter)
    outer = value.get(f"outer_diameter:{tube.name}", tube.outer_diameter)
    stiffer = larger = 1.0
    if tube.inner_diameter is not None and tube.outer_diameter is not None and inner is not None and outer is not None:
        old = tube.inner_diameter, tube.outer_diameter
        stiffer = annulus_stiffness(1.0, 0.0, inner, outer)[0] / annulus_stiffness(1.0, 0.0, *old)[0]
        larger = annulus_area(inner, outer) / annulus_area(*old)

    def change(i: int, segment: Segment) -> Segment:
        return replace(
            segment,
            length=value.get(f"length:{tube.name}:{i + 1}", segment.length),
            bending_stiffness=segment.bending_stiffness * stiffer,
            torsional_stiffness=segment.torsional_stiffness * stiffer,
            curvature=scaled(segment, factor),
            area=None if segment.area is None else segment.area * larger,
        )

    segments = tuple(change(i, segment) for i, segment in enumerate(tube.segments))
    return replace(tube, segments=segments, inner_diameter=inner, outer_diameter=outer)


def stiffening(inner_diameter: float, outer_diameter: float) -> dict[str, float]:
    """Rates of log(K), and of log(GJ), of a round tube with its inner and outer diameter [1/m]."""
    power = outer_diameter**4 - inner_diameter**4
    return {"inner_diameter": -4.0 * inner_diameter**3 / power, "outer_diameter": 4.0 * outer_diameter**3 / power}
