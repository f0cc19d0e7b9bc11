"""What can be fitted: names, units, priors and bounds, and what the values make of a robot."""

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
from ctr_pvs.robot.robot import Robot
from ctr_pvs.robot.robot import Segment

Array = NDArray[np.float64]

REGISTRATION = ("rx", "ry", "rz", "x", "y", "z")
SENSOR = ("x", "y", "z")


@dataclass(frozen=True)
class Kind:
    """A group of parameters: unit, prior (mean, standard deviation; infinite is no prior), bounds, and words."""

    unit: str
    mean: float
    std: float
    low: float
    high: float
    words: str


KINDS = {
    "bending": Kind("", 1.0, 0.1, 0.3, 3.0, "bending stiffness of {}"),
    "torsion": Kind("", 1.0, 0.1, 0.3, 3.0, "torsional stiffness of {}"),
    "poisson": Kind("", 0.3, 0.05, 0.0, 0.5, "Poisson's ratio"),
    "curvature": Kind("", 1.0, 0.1, 0.2, 3.0, "curvature of {}"),
    "length": Kind("m", 0.0, 1e-3, -0.02, 0.02, "length of {}"),
    "alpha": Kind("rad", 0.0, 0.2, -math.pi, math.pi, "rotation offset of {}"),
    "D": Kind("m", 0.0, 2e-3, -0.05, 0.05, "translation offset of {}"),
    "play_alpha": Kind("rad", 0.0, 0.2, 0.0, 2.0, "rotary play of {}"),
    "play_D": Kind("m", 0.0, 2e-3, 0.0, 0.02, "linear play of {}"),
    "registration": Kind("", 0.0, math.inf, -math.inf, math.inf, "registration {}"),
    "sensor": Kind("m", 0.0, 5e-3, -0.05, 0.05, "sensor offset {}"),
}
#: Fitted unless told otherwise.
USUAL = ("bending", "curvature", "poisson", "alpha", "D", "registration")
#: What a value counts as one of, where there is no prior: [rad], [m].
TYPICAL = {"rad": 0.1, "m": 0.01}


@dataclass(frozen=True)
class Parameter:
    """One number to fit.

    name : its group and what it belongs to, such as "bending:inner".  tube, segment : from 0, -1 for none.
    mean, std : of its Gaussian prior, an infinite std is none.  low, high : bounds.
    """

    name: str
    kind: str
    tube: int
    segment: int
    unit: str
    mean: float
    std: float
    low: float
    high: float
    words: str

    @property
    def scale(self) -> float:
        """A change that counts as one."""
        return self.std if math.isfinite(self.std) else TYPICAL[self.unit]


def chosen(
    robot: Robot,
    fit: Iterable[str] = USUAL,
    priors: Mapping[str, Sequence[float]] | None = None,
    bounds: Mapping[str, Sequence[float]] | None = None,
) -> list[Parameter]:
    """The parameters that ``fit`` names, groups or single ones.

    In a group, the outermost tube's bending stiffness (only ratios shape an unloaded robot) and rotation offset (it is
    the registration's roll) are left out; name them to have them.  priors, bounds : (mean, std) and (low, high) by name
    or group.

    Raises ``FieldError`` for a name that means nothing here.
    """
    every = _every(robot)
    wanted = [name for word in fit for name in _named(word, every, robot, "fit", whole=False)]
    table = {name: every[name] for name in every if name in wanted}
    for what, changes in (("priors", priors or {}), ("bounds", bounds or {})):
        for word, pair in changes.items():
            for name in _named(word, every, robot, what, whole=True):
                if name in table:
                    table[name] = _with(table[name], what, word, pair)
    _check_poisson(robot, table)
    if not table:
        raise FieldError("fit", list(fit), "at least one parameter")
    return list(table.values())


def _every(robot: Robot) -> dict[str, Parameter]:
    """All that this robot can have, by name, in order."""
    found: dict[str, Parameter] = {}

    def add(kind: str, of: str, words: str, tube: int = -1, segment: int = -1, unit: str | None = None) -> None:
        k, name = KINDS[kind], f"{kind}:{of}" if of else kind
        unit = k.unit if unit is None else unit
        told = k.words.format(words)
        found[name] = Parameter(name, kind, tube, segment, unit, k.mean, k.std, k.low, k.high, told)

    for kind in KINDS:
        for j, tube in enumerate(robot.tubes):
            if kind in ("bending", "torsion", "alpha", "D", "play_alpha", "play_D") or (
                kind == "curvature" and any(segment.curvature for segment in tube.segments)
            ):
                add(kind, tube.name, tube.name, j)
            elif kind == "length":
                for i in range(len(tube.segments)):
                    add(kind, f"{tube.name}:{i + 1}", f"segment {i + 1} of {tube.name}", j, i)
        if kind == "poisson":
            add(kind, "", "")
        for i, axis in enumerate(REGISTRATION if kind == "registration" else SENSOR if kind == "sensor" else ()):
            unit = "rad" if kind == "registration" and i < 3 else "m"
            add(kind, axis, axis, segment=i, unit=unit)
    return found


def _named(word: str, every: Mapping[str, Parameter], robot: Robot, what: str, whole: bool) -> list[str]:
    """The names that ``word`` stands for."""
    if word in every:
        return [word]
    outermost = robot.tubes[0].name
    within = [name for name, parameter in every.items() if parameter.kind == word or name.startswith(f"{word}:")]
    if not whole and len(robot.tubes) > 1:
        within = [name for name in within if name not in (f"bending:{outermost}", f"alpha:{outermost}")]
    if not within:
        check_choice(what, word, (*KINDS, *every))
    return within


def _with(parameter: Parameter, what: str, word: str, pair: Sequence[float]) -> Parameter:
    rule = "a mean and a standard deviation above 0" if what == "priors" else "a lower and an upper bound"
    try:
        first, second = (float(value) for value in pair)
    except (TypeError, ValueError):
        raise FieldError(f"{what}[{word}]", pair, rule) from None
    if not (second > 0.0 if what == "priors" else first < second) or math.isnan(first):
        raise FieldError(f"{what}[{word}]", pair, rule)
    if what == "priors":
        return replace(parameter, mean=first, std=second)
    return replace(parameter, low=first, high=second)


def _check_poisson(robot: Robot, table: Mapping[str, Parameter]) -> None:
    if "poisson" not in table:
        return
    if any(parameter.kind == "torsion" for parameter in table.values()):
        raise FieldError("fit", "poisson and torsion", "one of them: both set the torsional stiffness")
    for tube in robot.tubes:
        ratios = [segment.bending_stiffness / segment.torsional_stiffness for segment in tube.segments]
        if max(ratios) > 1.001 * min(ratios):
            remedy = "segments differ in K / GJ, as patterned ones do; fit torsion instead"
            raise FieldError("fit", f"poisson, tube {tube.name!r}", "tubes of one Poisson's ratio", remedy)


def robot_with(robot: Robot, parameters: Sequence[Parameter], values: Array) -> Robot:
    """The robot with the tubes that these ``values`` (P,) say; nothing else of it changes.

    A factor of bending stiffness is one of Young's modulus: GJ goes with K.  Poisson's ratio sets GJ = K / (1 + nu).
    """
    value = {p.name: float(v) for p, v in zip(parameters, values, strict=True)}
    tubes = []
    for tube in robot.tubes:
        bending, torsion, curvature = (value.get(f"{k}:{tube.name}", 1.0) for k in ("bending", "torsion", "curvature"))
        segments = []
        for i, segment in enumerate(tube.segments):
            K, GJ = segment.bending_stiffness * bending, segment.torsional_stiffness * bending * torsion
            segments.append(
                replace(
                    segment,
                    length=segment.length + value.get(f"length:{tube.name}:{i + 1}", 0.0),
                    bending_stiffness=K,
                    torsional_stiffness=K / (1.0 + value["poisson"]) if "poisson" in value else GJ,
                    curvature=scaled(segment, curvature),
                )
            )
        tubes.append(replace(tube, segments=tuple(segments)))
    return replace(robot, tubes=tuple(tubes))


def scaled(segment: Segment, factor: float) -> tuple[complex, ...]:
    """The segment's pre-curvature times a factor."""
    return tuple(factor * c for c in segment.curvature)
