"""External loads on a robot: dead, that is constant in the base frame whatever the shape.

Forces and moments act at material points or along tubes; tubes count from 0 here, as they do in arrays.  What acts
behind the orifice is taken by the guide: line forces and weight count beyond it only, and a point there is refused.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from collections.abc import Sequence
from dataclasses import dataclass
from dataclasses import field
from types import MappingProxyType
from typing import Any
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.errors import LoadError
from ctr_pvs.robot.command import GEOMETRIC_SLACK
from ctr_pvs.robot.robot import Robot

Vector: TypeAlias = tuple[float, float, float]

ZERO: Vector = (0.0, 0.0, 0.0)

# Beyond anything that acts on such a robot; they only keep products far from overflow.
LARGEST_FORCE = 1e9  # N, and N/m
LARGEST_MOMENT = 1e9  # N m
LARGEST_GRAVITY = 1e6  # m/s^2

TUBE_REMEDY = "tubes count from 0, outermost first"
X_REMEDY = "X is the distance from the tube's base, in metres"


@dataclass(frozen=True)
class PointForce:
    """A force and a moment on one material point.

    Args:
        tube: from 0, outermost first.
        X: distance from the tube's base, m.
        force: N, in the base frame.
        moment: N m, likewise.

    Raises:
        LoadError: for values that are no such numbers.
    """

    tube: int
    X: float
    force: Vector = ZERO
    moment: Vector = ZERO

    def __post_init__(self) -> None:
        _set(self, "tube", _tube("tube", self.tube))
        real = int | float | np.integer | np.floating
        if not isinstance(self.X, real) or isinstance(self.X, bool) or not 0.0 <= self.X < math.inf:
            raise LoadError("X", self.X, "a number of at least 0 m", X_REMEDY)
        _set(self, "X", float(self.X))
        _set(self, "force", _vector("force", self.force, LARGEST_FORCE, "N"))
        _set(self, "moment", _vector("moment", self.moment, LARGEST_MOMENT, "N m"))

    def scaled(self, factor: float) -> PointForce:
        """``factor`` times this load, on the same point."""
        return PointForce(self.tube, self.X, _times(factor, self.force), _times(factor, self.moment))


@dataclass(frozen=True)
class Loads:
    """Everything external that acts on a robot; nothing by default.  Values: equal and hashed by content.

    Args:
        tip_force: N, on the end of the tube that reaches farthest (of equals the innermost), in the base frame.
        tip_moment: N m, likewise.
        point_forces: on points of tubes, in any order; those on one point add up.
        line_forces: N/m, in the base frame, along all of a tube that is beyond the orifice; by tube, from 0.
        gravity: m/s^2, in the base frame; the weight of a tube needs its density and its diameters.

    Raises:
        LoadError: for values that are no such numbers.
    """

    tip_force: Vector = ZERO
    tip_moment: Vector = ZERO
    point_forces: tuple[PointForce, ...] = ()
    line_forces: Mapping[int, Vector] = field(default_factory=dict)
    gravity: Vector = ZERO

    def __post_init__(self) -> None:
        _set(self, "tip_force", _vector("tip_force", self.tip_force, LARGEST_FORCE, "N"))
        _set(self, "tip_moment", _vector("tip_moment", self.tip_moment, LARGEST_MOMENT, "N m"))
        _set(self, "point_forces", _points(self.point_forces))
        _set(self, "line_forces", MappingProxyType(_lines(self.line_forces)))
        _set(self, "gravity", _vector("gravity", self.gravity, LARGEST_GRAVITY, "m/s^2"))

    def __hash__(self) -> int:
        lines = tuple(self.line_forces.items())
        return hash((self.tip_force, self.tip_moment, self.point_forces, lines, self.gravity))

    def __reduce__(self) -> tuple[Any, ...]:
        # A read-only mapping does not pickle.
        lines = dict(self.line_forces)
        return Loads, (self.tip_force, self.tip_moment, self.point_forces, lines, self.gravity)

    @property
    def is_none(self) -> bool:
        """True if nothing acts: every force, every moment and gravity are 0."""
        vectors = [self.tip_force, self.tip_moment, self.gravity, *self.line_forces.values()]
        vectors += [vector for point in self.point_forces for vector in (point.force, point.moment)]
        return not any(map(any, vectors))

    @property
    def has_moments(self) -> bool:
        """True if a moment acts: dead moments have no potential."""
        return any(self.tip_moment) or any(any(point.moment) for point in self.point_forces)

    def scaled(self, factor: float) -> Loads:
        """``factor`` times these loads, on the same points."""
        return Loads(
            _times(factor, self.tip_force),
            _times(factor, self.tip_moment),
            tuple(point.scaled(factor) for point in self.point_forces),
            {tube: _times(factor, force) for tube, force in self.line_forces.items()},
            _times(factor, self.gravity),
        )


def check_loads(robot: Robot, D: NDArray[np.float64], loads: Loads) -> None:
    """Whether ``loads`` can act on ``robot`` at base positions ``D`` (N,) [m], already checked.

    Raises:
        LoadError: for a tube that is not there, a point off its tube or behind the orifice, and gravity on a tube
            beyond the orifice whose weight is not known.
    """
    names = ", ".join(tube.name for tube in robot.tubes)
    known = f"a tube from 0 to {robot.n_tubes - 1} ({names})"
    for tube in loads.line_forces:
        if tube >= robot.n_tubes:
            raise LoadError("line_forces", tube, known, TUBE_REMEDY)
    for index, point in enumerate(loads.point_forces):
        if point.tube >= robot.n_tubes:
            raise LoadError(f"point_forces[{index}].tube", point.tube, known, TUBE_REMEDY)
        _check_place(f"point_forces[{index}].X", robot, float(D[point.tube]), point)
    if any(loads.gravity):
        _check_weights(robot, D)


def _check_place(name: str, robot: Robot, D: float, point: PointForce) -> None:
    tube = robot.tubes[point.tube]
    if point.X - tube.length > GEOMETRIC_SLACK:
        rule = f"0 <= X <= {tube.length:.9g} m on tube {tube.name!r}, its length"
        raise LoadError(name, point.X, rule, X_REMEDY)
    if D - point.X > GEOMETRIC_SLACK:
        rule = f"X >= D = {D:.9g} m on tube {tube.name!r}"
        raise LoadError(name, point.X, rule, "the point lies behind the orifice, where the guide takes all loads")


def _check_weights(robot: Robot, D: NDArray[np.float64]) -> None:
    for index, (tube, depth) in enumerate(zip(robot.tubes, D.tolist(), strict=True)):
        beyond = (tube.breaks[1:] - depth > GEOMETRIC_SLACK).tolist()
        if not any(beyond):
            continue
        why = f"of tube {tube.name!r}, which gravity acts on"
        if tube.density is None:
            raise LoadError(f"tubes[{index}].density", None, f"the density {why}", "add density [kg/m^3] to the tube")
        for segment, (area, out) in enumerate(zip(tube.areas, beyond, strict=True)):
            if out and area is None:
                rule = f"the diameters of segment {segment} {why}"
                raise LoadError(f"tubes[{index}].outer_diameter", None, rule, "its weight needs both diameters")


def _points(points: object) -> tuple[PointForce, ...]:
    if not isinstance(points, Sequence):
        raise LoadError("point_forces", points, "a list or tuple of PointForce")
    for index, point in enumerate(points):
        if not isinstance(point, PointForce):
            raise LoadError(f"point_forces[{index}]", point, "a PointForce")
    return tuple(points)


def _lines(forces: object) -> dict[int, Vector]:
    """By tube, in order of the tubes."""
    if not isinstance(forces, Mapping):
        raise LoadError("line_forces", forces, "a mapping from tubes, from 0, to 3 numbers [N/m]")
    checked = {
        _tube("line_forces", tube): _vector(f"line_forces[{tube}]", force, LARGEST_FORCE, "N/m")
        for tube, force in forces.items()
    }
    return dict(sorted(checked.items()))


def _tube(name: str, value: object) -> int:
    if not isinstance(value, int | np.integer) or isinstance(value, bool) or value < 0:
        raise LoadError(name, value, "a tube's index, a whole number from 0", TUBE_REMEDY)
    return int(value)


def _vector(name: str, value: object, largest: float, unit: str) -> Vector:
    if value is ZERO:
        return ZERO
    if type(value) is tuple and len(value) == 3:  # what nearly all are; arrays take several times as long
        x, y, z = value
        if type(x) is type(y) is type(z) is float and abs(x) <= largest and abs(y) <= largest and abs(z) <= largest:
            return value
    rule = f"3 numbers from {-largest:g} to {largest:g} {unit}"
    try:
        array = np.asarray(value)
    except ValueError:  # lists of unequal lengths
        raise LoadError(name, value, rule) from None
    # A NaN fails the comparison.
    if array.shape != (3,) or array.dtype.kind not in "iuf" or not (np.abs(array) <= largest).all():
        raise LoadError(name, value, rule)
    x, y, z = array.astype(np.float64).tolist()
    return x, y, z


def _times(factor: float, vector: Vector) -> Vector:
    if not math.isfinite(factor):
        raise LoadError("factor", factor, "a finite number")
    x, y, z = vector
    return factor * x, factor * y, factor * z


def _set(instance: object, name: str, value: object) -> None:
    """Stores a checked value in a frozen dataclass, from its own __post_init__."""
    object.__setattr__(instance, name, value)
