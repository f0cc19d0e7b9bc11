"""The designs that limits of strain, wall and clearance leave, as a cube all of whose points keep them.

Parameters are settled one after the other: lengths, diameters from the innermost bore outwards, curvatures.  Each has a
range that those before it leave, and a share from 0 to 1 of that range.
"""

from __future__ import annotations

from collections.abc import Callable
from collections.abc import Sequence
from dataclasses import dataclass
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.errors import FieldError
from ctr_pvs.robot.dimensions import clearance
from ctr_pvs.robot.dimensions import tube_curvature
from ctr_pvs.robot.robot import Robot
from ctr_pvs.tasks.design.parameters import Parameter
from ctr_pvs.tasks.design.parameters import robot_with

Array = NDArray[np.float64]

#: Of a wall's thickness and of a diametral clearance, where none is asked for: so much, or as little as there is [m].
USUAL_GAP = 50e-6
#: What of a share differences are taken of.
STEP = 1e-7
ROUNDING = 1e-12

#: (place of a parameter, its lowest, its highest value) -> its value.
Pick = Callable[[int, float, float], float]


@dataclass(frozen=True)
class DesignLimits:
    """strain : largest of any tube's wall, straightened (``robot.dimensions``); not known of tubes without diameters.
    margin : least stability margin at a target.  clearance, wall [m] : least diametral clearance of two tubes and least
    thickness of a wall; None for 50 um, or what the robot has where that is less.

    Raises ``FieldError`` for values that are none.
    """

    strain: float = 0.05
    margin: float = 0.1
    clearance: float | None = None
    wall: float | None = None

    def __post_init__(self) -> None:
        if not 0.0 < self.strain < 1.0:
            raise FieldError("strain", self.strain, "a number above 0, below 1", "2 % is 0.02")
        if not 0.0 <= self.margin < 1.0:
            raise FieldError("margin_floor", self.margin, "a number from 0 to below 1")
        for name in ("clearance", "wall"):
            value = getattr(self, name)
            if value is not None and not 0.0 <= value < 1.0:
                raise FieldError(name, value, "a length [m], 0 or more, below 1 m")


@dataclass(frozen=True)
class _Diameter:
    """One of the chain from the innermost bore outwards: its parameter's place or -1, its range, and how much more than
    the one before it it is at least [m]."""

    place: int
    low: float
    high: float
    gap: float
    tube: int
    outer: bool


class Room:
    """Designs of ``robot`` with ``parameters`` (P,) under ``limits``.

    Raises ``FieldError`` where limits and bounds leave none.
    """

    def __init__(self, robot: Robot, parameters: Sequence[Parameter], limits: DesignLimits) -> None:
        self.robot, self.parameters, self.limits = robot, list(parameters), limits
        self._lengths = [i for i, p in enumerate(self.parameters) if p.kind == "length"]
        self._curvatures = {p.tube: i for i, p in enumerate(self.parameters) if p.kind == "curvature"}
        self._chain = _chain(robot, self.parameters, limits)
        for lengths in (0.0, 1.0):
            self._check(self._long(_at(lengths)))

    def values(self, shares: Array) -> Array:
        """(P,) of the design at ``shares`` (P,), each from 0 to 1."""
        return self._settled(lambda i, low, high: low + float(shares[i]) * (high - low))

    def shares(self, values: Array) -> Array:
        """(P,) of the design nearest to ``values`` (P,), one parameter after the other."""
        shares = np.zeros(len(self.parameters))

        def pick(i: int, low: float, high: float) -> float:
            value = min(max(float(values[i]), low), high)
            shares[i] = (value - low) / (high - low) if high > low else 0.0
            return value

        self._settled(pick)
        return shares

    def rates(self, shares: Array) -> Array:
        """(P, P) of ``values`` with the shares."""
        here, columns = self.values(shares), []
        for i, share in enumerate(shares.tolist()):
            step = STEP if share < 0.5 else -STEP
            there = shares.copy()
            there[i] += step
            columns.append((self.values(there) - here) / step)
        return np.column_stack(columns)

    def robot_at(self, shares: Array) -> Robot:
        return robot_with(self.robot, self.parameters, self.values(shares))

    def longest(self) -> Robot:
        """The robot with all lengths at their most."""
        return self._long(_at(1.0))

    def _settled(self, pick: Pick) -> Array:
        values = np.array([parameter.start for parameter in self.parameters])
        longer = self._long(pick, values)
        below = -np.inf
        outside = [tube.outer_diameter for tube in self.robot.tubes]
        for one, top in zip(self._chain, self._tops(longer), strict=True):
            low = max(one.low, below + one.gap) if one.place >= 0 else one.low
            below = pick(one.place, low, max(low, top)) if one.place >= 0 else low
            if one.place >= 0:
                values[one.place] = below
            if one.outer:
                outside[one.tube] = below
        for tube, i in self._curvatures.items():
            low, high = self.parameters[i].low, self.parameters[i].high
            diameter = outside[tube]
            if diameter is not None:
                high = max(low, min(high, 2.0 * self.limits.strain / diameter * self._per_unit(longer, tube)))
            values[i] = pick(i, low, high)
        return values

    def _long(self, pick: Pick, values: Array | None = None) -> Robot:
        """The robot with its lengths settled, and nothing else."""
        lengths = [self.parameters[i] for i in self._lengths]
        settled = np.array([pick(i, p.low, p.high) for i, p in zip(self._lengths, lengths, strict=True)])
        if values is not None:
            values[self._lengths] = settled
        return robot_with(self.robot, lengths, settled)

    def _per_unit(self, longer: Robot, tube: int) -> float:
        """What a parameter of curvature is where the tube's largest one is 1: a curvature that changes along a segment
        ends at another value where that is longer."""
        return tube_curvature(self.robot.tubes[tube]) / tube_curvature(longer.tubes[tube])

    def _tops(self, longer: Robot) -> list[float]:
        """The largest that each diameter of the chain can be, those around it and its curvature counted."""
        tops, above = list[float](), np.inf
        for one in reversed(self._chain):
            high = one.high
            if one.outer and one.place >= 0 and (least := self._least_curvature(longer, one.tube)) > 0.0:
                high = min(high, 2.0 * self.limits.strain / least)
            tops.append(min(high, above))
            above = tops[-1] - one.gap
        return tops[::-1]

    def _least_curvature(self, longer: Robot, tube: int) -> float:
        """[1/m] of a tube's most curved place."""
        if tube in self._curvatures:
            return self.parameters[self._curvatures[tube]].low / self._per_unit(longer, tube)
        return tube_curvature(longer.tubes[tube])

    def _check(self, longer: Robot) -> None:
        below = -np.inf
        for one, top in zip(self._chain, self._tops(longer), strict=True):
            name = self.robot.tubes[one.tube].name
            least = 0.5 * one.low * self._least_curvature(longer, one.tube) if one.outer else 0.0
            if least > self.limits.strain * (1.0 + ROUNDING):
                rule = f"at least {least:.4g}, the least strain of tube {name!r} within the bounds"
                raise FieldError("strain", self.limits.strain, rule, "vary its curvature or diameter in wider bounds")
            below = max(one.low, below + one.gap)
            if below > top + ROUNDING:
                which = "outer" if one.outer else "inner"
                rule = f"no more than the {top:.6g} m that the tubes around it leave"
                remedy = "ask for less --wall and --clearance, or vary more diameters"
                raise FieldError(f"{which}_diameter:{name}", below, rule, remedy)


def _chain(robot: Robot, parameters: Sequence[Parameter], limits: DesignLimits) -> list[_Diameter]:
    """Diameters from the innermost bore to the outermost outside, of the tubes that have them."""
    place = {p.name: i for i, p in enumerate(parameters)}
    chain: list[_Diameter] = []
    within = None
    for j in reversed(range(robot.n_tubes)):
        tube = robot.tubes[j]
        if tube.inner_diameter is None or tube.outer_diameter is None:
            continue
        gap = 0.0 if within is None else clearance(tube, within) or 0.0
        gaps = (
            _asked(limits.clearance, gap),
            2.0 * _asked(limits.wall, 0.5 * (tube.outer_diameter - tube.inner_diameter)),
        )
        for kind, least in zip(("inner_diameter", "outer_diameter"), gaps, strict=True):
            i = place.get(f"{kind}:{tube.name}", -1)
            value = getattr(tube, kind)
            low, high = (value, value) if i < 0 else (parameters[i].low, parameters[i].high)
            chain.append(_Diameter(i, low, high, least, j, kind == "outer_diameter"))
        within = tube
    return [replace(chain[0], gap=0.0), *chain[1:]] if chain else []


def _asked(limit: float | None, there: float) -> float:
    return min(USUAL_GAP, there) if limit is None else limit


def _at(share: float) -> Pick:
    """The same share of every range."""
    return lambda i, low, high: low + share * (high - low)
