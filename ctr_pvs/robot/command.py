"""Which commands (alpha, D) a robot can take: checking them, and clamping them for those who ask for it.

Geometry asks for 0 <= D_j <= L_j and D_1 <= D_2 <= ... <= D_N; actuator limits may ask for more. Order lets the bounds
of one tube tighten those of its neighbours, so what each tube can reach is worked out once, at construction.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike
from numpy.typing import NDArray

from ctr_pvs.errors import CommandError
from ctr_pvs.errors import RobotError

GEOMETRIC_SLACK = 1e-12  # m; less than this apart is the same place
FLOAT = np.dtype(np.float64)  # numpy has one such object for all arrays of floats in the machine's byte order
LARGEST_ALPHA = 1e6  # rad; beyond it the spacing of floating-point numbers shows in the tip

Range: TypeAlias = tuple[float, float]


class CommandBounds:
    """The commands one robot can take.

    Args:
        names: of the tubes, outermost first.
        lengths: L_j, m.
        alpha_limits: rad, one (low, high) or None per tube.
        D_limits: m, likewise.

    Raises:
        RobotError: when the limits leave no command.
    """

    def __init__(
        self,
        names: Sequence[str],
        lengths: Sequence[float],
        alpha_limits: Sequence[Range | None],
        D_limits: Sequence[Range | None],
    ) -> None:
        self._names = tuple(names)
        self._shape = (len(names),)
        self._lengths = tuple(lengths)
        self._alpha_limits, self._D_limits = tuple(alpha_limits), tuple(D_limits)
        whole = (-LARGEST_ALPHA, LARGEST_ALPHA)
        self._alpha_ranges = [whole if limit is None else limit for limit in alpha_limits]
        self._D_ranges = [
            (0.0, length) if limit is None else (max(limit[0], 0.0), min(limit[1], length))
            for length, limit in zip(lengths, D_limits, strict=True)
        ]
        # Of each tube side by side, as nearly every command is checked: that takes three fifths of the time.
        self._ranges = [(*a, *d) for a, d in zip(self._alpha_ranges, self._D_ranges, strict=True)]
        self._check_that_a_command_exists()
        # With D in order, tube j is held up by the lower bounds of the tubes before it and down by the upper bounds of
        # the tubes after it. These ranges rise from tube to tube, so clipping to them keeps the order.
        self._reach_low = np.maximum.accumulate([low for low, _ in self._D_ranges])
        self._reach_high = np.minimum.accumulate([high for _, high in self._D_ranges][::-1])[::-1]

    def check(self, alpha: ArrayLike, D: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """See `Robot.check_command`."""
        if isinstance(alpha, np.ndarray) and isinstance(D, np.ndarray) and self._plainly_good(alpha, D):
            return alpha.copy(), D.copy()
        alpha, D = self._array("alpha", alpha), self._array("D", D)
        previous = -np.inf
        settled = True  # nothing rests on the slack
        for index, (angle, depth) in enumerate(zip(alpha.tolist(), D.tolist(), strict=True)):
            low, high = self._alpha_ranges[index]
            if not low <= angle <= high:
                raise self._alpha_error(index, angle)
            low, high = self._D_ranges[index]
            if not (low <= depth <= high and previous <= depth):
                slack = GEOMETRIC_SLACK
                if not (low - slack <= depth <= high + slack and previous - slack <= depth):
                    raise self._D_error(index, depth, previous)
                settled = False
            previous = depth
        return alpha, D if settled else self._into_reach(D)

    def _plainly_good(self, alpha: NDArray[np.float64], D: NDArray[np.float64]) -> bool:
        """True for what nearly every command is: arrays of floats, all well within the bounds."""
        if alpha.dtype is not FLOAT or D.dtype is not FLOAT or alpha.shape != self._shape or D.shape != self._shape:
            return False
        previous = 0.0
        for angle, depth, (lowest, highest, low, high) in zip(alpha.tolist(), D.tolist(), self._ranges, strict=True):
            if not (lowest <= angle <= highest and low <= depth <= high and previous <= depth):
                return False
            previous = depth
        return True

    def clamp(self, alpha: ArrayLike, D: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64], list[str]]:
        """See `Robot.clamp_command`."""
        asked_alpha, asked_D = self._array("alpha", alpha), self._array("D", D)
        low, high = np.array(self._alpha_ranges).T
        alpha, D = np.clip(asked_alpha, low, high), self._into_reach(asked_D)
        notes = []
        for symbol, unit, asked, given, slack in (
            ("alpha", "rad", asked_alpha, alpha, 0.0),
            ("D", "m", asked_D, D, GEOMETRIC_SLACK),
        ):
            for index in np.flatnonzero(np.abs(given - asked) > slack).tolist():
                notes.append(f"{self._label(symbol, index)} moved from {asked[index]:g} to {given[index]:g} {unit}")
        return alpha, D, notes

    def _into_reach(self, D: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.maximum.accumulate(np.clip(D, self._reach_low, self._reach_high))

    def _array(self, symbol: str, values: ArrayLike) -> NDArray[np.float64]:
        """A float64 copy (N,), all finite."""
        count = len(self._names)
        rule = f"{count} real numbers, one per tube, outermost first"
        try:
            array = np.asarray(values)
        except ValueError:  # lists of unequal lengths
            raise CommandError(symbol, values, rule) from None
        if array.shape != (count,) or array.dtype.kind not in "iuf":
            raise CommandError(symbol, values, rule)
        array = array.astype(np.float64)
        if not np.isfinite(array).all():
            index = int(np.flatnonzero(~np.isfinite(array))[0])
            raise CommandError(f"{symbol}[{index}]", array[index].item(), f"a finite number{self._of(index)}")
        return array

    def _alpha_error(self, index: int, value: float) -> CommandError:
        low, high = self._alpha_ranges[index]
        why = f"{self._of(index)}, the robot's limits" if self._alpha_limits[index] else self._of(index)
        return CommandError(f"alpha[{index}]", value, f"{low:.9g} <= alpha <= {high:.9g} rad{why}")

    def _D_error(self, index: int, value: float, previous: float) -> CommandError:
        low, high = self._D_ranges[index]
        length = self._lengths[index]
        field = f"D[{index}]"
        if not -GEOMETRIC_SLACK <= value <= length + GEOMETRIC_SLACK:
            remedy = "D is the distance from the tube's base to the orifice, in metres"
            return CommandError(field, value, f"0 <= D <= {length:.9g} m{self._of(index)}, its length", remedy)
        if not low - GEOMETRIC_SLACK <= value <= high + GEOMETRIC_SLACK:
            return CommandError(field, value, f"{low:.9g} <= D <= {high:.9g} m{self._of(index)}, the robot's limits")
        rule = f"D >= {previous:.9g} m{self._of(index)}, as for tube {self._names[index - 1]!r} around it"
        return CommandError(field, value, rule, "inner bases lie behind outer ones")

    def _check_that_a_command_exists(self) -> None:
        highest, highest_of = 0.0, ""
        for index, (low, high) in enumerate(self._D_ranges):
            field, limit = f"limits.D.{self._names[index]}", self._D_limits[index]
            if low > high:
                length = self._lengths[index]
                raise RobotError(field, limit, f"limits that meet 0 <= D <= {length:.9g} m, the tube's length")
            if highest > high:
                rule = f"an upper limit of at least {highest:.9g} m, where the limits of tube {highest_of!r} start"
                remedy = "D must not fall from outer to inner tubes"
                raise RobotError(field, limit or (0.0, high), rule, remedy)
            if low > highest:
                highest, highest_of = low, self._names[index]

    def _of(self, index: int) -> str:
        return f" for tube {self._names[index]!r}"

    def _label(self, symbol: str, index: int) -> str:
        return f"{symbol}[{index}]{self._of(index)}"
