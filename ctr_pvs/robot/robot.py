"""The robot: tubes, outermost first, each a chain of segments. Plain frozen values; no files, no solver.

Units are SI. Pre-curvature is carried as one complex number, kappa_y + i kappa_z, because turning a material frame by
psi about the tangent is then a product with exp(i psi).

The ranges below refuse what no concentric tube robot is, from a thousand times smaller than a surgical one to a
thousand times larger, and keep every later product far from overflow.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from numbers import Complex
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike
from numpy.typing import NDArray

from ctr_pvs.errors import RobotError
from ctr_pvs.robot.command import LARGEST_ALPHA
from ctr_pvs.robot.command import CommandBounds
from ctr_pvs.robot.command import Range
from ctr_pvs.robot.cross_section import annulus_area
from ctr_pvs.robot.play import NO_PLAY
from ctr_pvs.robot.play import PlayWidths

LENGTH_RANGE = (1e-7, 1e3)  # m, of a segment; the shortest is far above the slack within which boundaries coincide
DIAMETER_RANGE = (0.0, 10.0)  # m
AREA_RANGE = (0.0, 100.0)  # m^2
DENSITY_RANGE = (30.0, 3e4)  # kg/m^3; lighter than any foam to denser than osmium. Metals in g/cm^3 lie below
STIFFNESS_RANGE = (1e-18, 1e12)  # N m^2; a 2.4 mm nitinol tube has 0.05
MODULUS_RANGE = (1e3, 1e13)  # Pa; softer than any gel to stiffer than diamond
LARGEST_CURVATURE = 1e6  # 1/m
LARGEST_TURN = 1e5  # rad/m

_T = TypeVar("_T")

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
NAME_RULE = "a name of letters, digits and underscores that starts with a letter (it becomes part of ROS joint names)"


@dataclass(frozen=True)
class Segment:
    """A stretch of tube with constant stiffness and one law of pre-curvature.

    Args:
        length: m.
        bending_stiffness: K = E I, N m^2.
        torsional_stiffness: G J, N m^2.
        curvature: coefficients c_k, in 1/m, 1/m^2, ..., of
            kappa_y + i kappa_z = exp(i turn X) sum_k c_k X^k, with X the segment's own abscissa, 0 at its base side.
            Trailing zeros are dropped; empty means straight.
        turn: rad/m; with a constant curvature the rest shape is a helix.
        area: of the material's cross section, m^2, for its weight; None where the tube's diameters tell it.

    Raises:
        RobotError: for a value out of range.
    """

    length: float
    bending_stiffness: float
    torsional_stiffness: float
    curvature: tuple[complex, ...] = ()
    turn: float = 0.0
    area: float | None = None

    def __post_init__(self) -> None:
        _set(self, "length", number_in("length", self.length, *LENGTH_RANGE, "m"))
        for field in ("bending_stiffness", "torsional_stiffness"):
            _set(self, field, number_in(field, getattr(self, field), *STIFFNESS_RANGE, "N m^2"))
        _set(self, "turn", number_in("turn", self.turn, -LARGEST_TURN, LARGEST_TURN, "rad/m"))
        _set(self, "curvature", _coefficients(self.curvature, self.length))
        if self.area is not None:
            _set(self, "area", number_in("area", self.area, *AREA_RANGE, "m^2"))

    @property
    def is_straight(self) -> bool:
        return not self.curvature

    def pre_curvature(self, X: ArrayLike) -> NDArray[np.complex128]:
        """kappa_y + i kappa_z [1/m] at the abscissae X [m] of this segment; complex, in the shape of X."""
        X = np.asarray(X, dtype=np.float64)
        value = _polynomial(self.curvature, X)
        return value * np.exp(1j * self.turn * X) if self.turn else value

    def pre_curvature_rate(self, X: ArrayLike) -> NDArray[np.complex128]:
        """d/dX of `pre_curvature` [1/m^2]; complex, in the shape of X."""
        X = np.asarray(X, dtype=np.float64)
        rate = _polynomial(tuple(k * c for k, c in enumerate(self.curvature))[1:], X)
        if self.turn:
            rate = (rate + 1j * self.turn * _polynomial(self.curvature, X)) * np.exp(1j * self.turn * X)
        return rate


@dataclass(frozen=True)
class Tube:
    """Segments from the base to the tip.

    Args:
        name: unique in its robot.
        segments: at least one.
        inner_diameter, outer_diameter: m, both or neither; where they vary along the tube, the smallest bore and the
            largest outside. They serve to check that tubes fit, to draw them, and for the weight of segments without
            an area of their own: stiffness is the segments' own.
        density: of the material, kg/m^3, for its weight.

    Raises:
        RobotError: for a value out of range.
    """

    name: str
    segments: tuple[Segment, ...]
    inner_diameter: float | None = None
    outer_diameter: float | None = None
    density: float | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not _NAME.fullmatch(self.name):
            raise RobotError("name", self.name, NAME_RULE)
        _set(self, "segments", _tuple_of(Segment, "segments", self.segments))
        if (self.inner_diameter is None) != (self.outer_diameter is None):
            missing = "inner_diameter" if self.inner_diameter is None else "outer_diameter"
            raise RobotError(missing, None, "both diameters or neither", "a solid wire has inner_diameter 0")
        if self.inner_diameter is not None and self.outer_diameter is not None:
            inner, outer = check_diameters(self.inner_diameter, self.outer_diameter)
            _set(self, "inner_diameter", inner)
            _set(self, "outer_diameter", outer)
        if self.density is not None:
            _set(self, "density", number_in("density", self.density, *DENSITY_RANGE, "kg/m^3"))

    @cached_property
    def breaks(self) -> NDArray[np.float64]:
        """Abscissae of the segment boundaries [m], (len(segments) + 1,), from 0 to the length; read-only."""
        breaks = np.concatenate(([0.0], np.cumsum([segment.length for segment in self.segments])))
        breaks.flags.writeable = False
        return breaks

    @cached_property
    def length(self) -> float:
        """m; equal to the last break to the last bit."""
        return float(self.breaks[-1])

    @cached_property
    def areas(self) -> tuple[float | None, ...]:
        """Of the material's cross section in each segment [m^2]; None where it is not known."""
        areas = tuple(segment.area for segment in self.segments)
        if any(area is not None for area in areas) or self.inner_diameter is None or self.outer_diameter is None:
            return areas  # where segments have their own, the tube's diameters are a summary and tell no area
        return (annulus_area(self.inner_diameter, self.outer_diameter),) * len(areas)


@dataclass(frozen=True)
class Limits:
    """What the actuators can reach beyond what geometry already asks: (low, high) for each tube, or None for no limit.

    Empty tuples stand for no limits at all.

    Args:
        alpha: rad.
        D: m.
    """

    alpha: tuple[Range | None, ...] = ()
    D: tuple[Range | None, ...] = ()


@dataclass(frozen=True)
class Robot:
    """Concentric tubes, outermost first; `limits` of the actuators, and their `play`, none unless given.

    Raises:
        RobotError: for tubes that share a name or do not fit into each other, and limits that allow no command.
    """

    name: str
    tubes: tuple[Tube, ...]
    limits: Limits = Limits()
    play: PlayWidths = NO_PLAY

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not self.name.strip() or not self.name.isprintable():
            raise RobotError("name", self.name, "a name on one line")
        _set(self, "tubes", _tuple_of(Tube, "tubes", self.tubes))
        _check_names(self.tubes)
        _check_fit(self.tubes)
        _set(self, "limits", _complete_limits(self.limits, self.tubes))
        _ = self.play.of(self.n_tubes)  # raises for another number of tubes
        _ = self._bounds  # raises now, not at the first command, when the limits leave no command

    @property
    def n_tubes(self) -> int:
        return len(self.tubes)

    def length_beyond(self, D: NDArray[np.float64]) -> float:
        """Arc length [m] from the orifice to the farthest tip at base positions ``D`` (N,) [m]."""
        return max(0.0, max([tube.length - d for tube, d in zip(self.tubes, D.tolist(), strict=True)]))

    @cached_property
    def _bounds(self) -> CommandBounds:
        names, lengths = zip(*((tube.name, tube.length) for tube in self.tubes), strict=True)
        return CommandBounds(names, lengths, self.limits.alpha, self.limits.D)

    def check_command(self, alpha: ArrayLike, D: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The command as fresh float64 arrays (n_tubes,), alpha in rad and D in m.

        D a rounding error (1e-12 m) outside its bounds or order is moved onto them; nothing else changes.

        Raises:
            CommandError: for a wrong count, a value that is not a finite real number, ``|alpha|`` above 1e6 rad,
                D_j outside [0, L_j], D_j < D_{j-1}, or a value beyond the robot's limits.
        """
        return self._bounds.check(alpha, D)

    def clamp_command(
        self, alpha: ArrayLike, D: ArrayLike
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], list[str]]:
        """The command moved into bounds, limits and order, and one sentence for every value that moved.

        Each value first goes to the nearest end of its range; a D that is then still smaller than that of the next
        outer tube is raised to it.

        Raises:
            CommandError: for what clamping cannot mend: a wrong count, a value that is not a finite real number.
        """
        return self._bounds.clamp(alpha, D)


def number_in(field: str, value: object, low: float, high: float, unit: str = "") -> float:
    """`value` as a float, or a RobotError unless it is a real number (not a boolean) in [low, high]."""
    # A NaN fails the comparison; an integer too large for a float passes through it exactly.
    real = int | float | np.integer | np.floating
    if not isinstance(value, real) or isinstance(value, bool) or not low <= value <= high:
        raise RobotError(field, value, f"a number from {low:g} to {high:g} {unit}".rstrip())
    return float(value)


def check_diameters(inner_diameter: object, outer_diameter: object) -> tuple[float, float]:
    """Both diameters as floats [m], or a RobotError."""
    inner = number_in("inner_diameter", inner_diameter, *DIAMETER_RANGE, "m")
    outer = number_in("outer_diameter", outer_diameter, *DIAMETER_RANGE, "m")
    if not outer > inner:
        raise RobotError("outer_diameter", outer, f"more than inner_diameter ({inner:g} m)")
    return inner, outer


def _set(instance: object, field: str, value: object) -> None:
    """Stores a checked value in a frozen dataclass, from its own __post_init__."""
    object.__setattr__(instance, field, value)


def _tuple_of(kind: type[_T], field: str, values: object) -> tuple[_T, ...]:
    rule = f"at least one {kind.__name__}, in a list or tuple"
    if not isinstance(values, Sequence) or len(values) == 0:
        raise RobotError(field, values, rule)
    for index, value in enumerate(values):
        if not isinstance(value, kind):
            raise RobotError(f"{field}[{index}]", value, f"a {kind.__name__}")
    return tuple(values)


def _coefficients(curvature: object, length: float) -> tuple[complex, ...]:
    if not isinstance(curvature, Sequence | np.ndarray):
        raise RobotError("curvature", curvature, "a sequence of coefficients", "write (c,) for a constant curvature")
    coefficients: list[complex] = []
    largest, power = 0.0, 1.0
    for index, value in enumerate(curvature):
        if isinstance(value, bool) or not isinstance(value, Complex):
            raise RobotError(f"curvature[{index}]", value, f"a number, in 1/m^{index + 1}")
        coefficient = complex(value)
        largest += math.hypot(coefficient.real, coefficient.imag) * power
        power *= length
        if not largest <= LARGEST_CURVATURE:
            rule = f"pre-curvature of at most {LARGEST_CURVATURE:g} 1/m along the segment"
            raise RobotError(f"curvature[{index}]", value, rule)
        coefficients.append(coefficient)
    while coefficients and coefficients[-1] == 0.0:
        coefficients.pop()
    return tuple(coefficients)


def _polynomial(coefficients: tuple[complex, ...], X: NDArray[np.float64]) -> NDArray[np.complex128]:
    """sum_k c_k X^k by Horner's rule, in the shape of X."""
    value = np.full(X.shape, coefficients[-1] if coefficients else 0.0, dtype=np.complex128)
    for coefficient in coefficients[-2::-1]:
        value = value * X + coefficient
    return value


def _check_names(tubes: tuple[Tube, ...]) -> None:
    seen: set[str] = set()
    for index, tube in enumerate(tubes):
        if tube.name in seen:
            raise RobotError(f"tubes[{index}].name", tube.name, "a name that no other tube has")
        seen.add(tube.name)


def _check_fit(tubes: tuple[Tube, ...]) -> None:
    bore, bore_of = math.inf, ""  # the narrowest so far; tubes without diameters are taken to fit
    for index, tube in enumerate(tubes):
        if tube.inner_diameter is None or tube.outer_diameter is None:
            continue
        if tube.outer_diameter > bore:
            rule = f"at most the bore of the tube {bore_of!r} around it ({bore:g} m)"
            remedy = "list the tubes outermost first"
            raise RobotError(f"tubes[{index}].outer_diameter", tube.outer_diameter, rule, remedy)
        bore, bore_of = tube.inner_diameter, tube.name


def _complete_limits(limits: object, tubes: tuple[Tube, ...]) -> Limits:
    """The limits with one checked entry per tube."""
    if not isinstance(limits, Limits):
        raise RobotError("limits", limits, "Limits")
    complete = {}
    for kind in ("alpha", "D"):
        entries = getattr(limits, kind)
        if not isinstance(entries, Sequence) or len(entries) not in (0, len(tubes)):
            raise RobotError(f"limits.{kind}", entries, f"one entry for each of the {len(tubes)} tubes, or none")
        complete[kind] = tuple(
            None if entry is None else _range(f"limits.{kind}.{tube.name}", entry)
            for entry, tube in zip(entries or [None] * len(tubes), tubes, strict=True)
        )
    return Limits(**complete)


def _range(field: str, entry: object) -> Range:
    if isinstance(entry, Sequence) and not isinstance(entry, str) and len(entry) == 2:
        low, high = (
            number_in(f"{field}[{index}]", value, -LARGEST_ALPHA, LARGEST_ALPHA) for index, value in enumerate(entry)
        )
        if low <= high:
            return low, high
    raise RobotError(field, entry, "two numbers, the lower and the upper limit")
