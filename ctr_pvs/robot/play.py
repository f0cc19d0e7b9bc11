"""Play (backlash) between actuators and tubes: what a tube does of a command depends on where it came from.

The classical play operator: a pin in a slot of some width.  Inside the slot the pin stays, at its ends it is pushed
along.  It knows no time, only the order of commands; the angle or place of a tube is never more than half a width from
what was commanded, and a width of zero is no play at all.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from numpy.typing import NDArray

from ctr_pvs.errors import RobotError

Array = NDArray[np.float64]

#: The widest play: half a turn [rad], and a tenth of a metre.
WIDEST = {"alpha": math.pi, "D": 0.1}


@dataclass(frozen=True)
class PlayWidths:
    """Width of the play of each joint, one number per tube; empty tuples stand for none.

    alpha : rad.  D : m.

    Raises ``RobotError`` for a width that is none.
    """

    alpha: tuple[float, ...] = ()
    D: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        for kind, widest in WIDEST.items():
            widths = getattr(self, kind)
            if not isinstance(widths, Sequence):
                raise RobotError(f"play.{kind}", widths, "a width per tube, or none")
            for index, width in enumerate(widths):
                if isinstance(width, bool) or not isinstance(width, int | float) or not 0.0 <= width <= widest:
                    raise RobotError(f"play.{kind}[{index}]", width, f"a width from 0 to {widest:g}")
            object.__setattr__(self, kind, tuple(float(width) for width in widths))

    def __bool__(self) -> bool:
        return any(self.alpha) or any(self.D)

    def of(self, tubes: int) -> Array:
        """(2 N,) widths of alpha [rad], then of D [m].

        Raises ``RobotError`` for widths of another number of tubes.
        """
        for kind in WIDEST:
            if len(getattr(self, kind)) not in (0, tubes):
                raise RobotError(
                    f"play.{kind}", getattr(self, kind), f"one width for each of the {tubes} tubes, or none"
                )
        return np.array([*(self.alpha or [0.0] * tubes), *(self.D or [0.0] * tubes)])


#: What a robot has unless its file says otherwise.
NO_PLAY = PlayWidths()


class Play:
    """The play operators of J joints of these ``widths`` (J,).

    at : (J,) where the far sides are, None before the first command, which finds each pin in the middle of its slot.
    """

    def __init__(self, widths: ArrayLike) -> None:
        self.half = 0.5 * np.asarray(widths, dtype=np.float64)
        self.at: Array | None = None

    def after(self, command: ArrayLike) -> Array:
        """(J,) where the far sides would be after ``command`` (J,); nothing is remembered."""
        command = np.array(command, dtype=np.float64)
        return command if self.at is None else np.clip(self.at, command - self.half, command + self.half)

    def update(self, command: ArrayLike) -> Array:
        """``after``, remembered."""
        self.at = self.after(command)
        return self.at.copy()

    def moved(self, at: Array | None) -> Play:
        """The same with its far sides at ``at`` (J,), or forgotten; who shares this one keeps it as it is."""
        other = copy(self)
        other.at = at
        return other

    def between(self, alpha: Array, D: Array, remembered: bool) -> tuple[Array, Array]:
        """What of a command alpha, D (N,) reaches the tubes; unless what came before is ``remembered``, all of it."""
        there = self.after(np.concatenate([alpha, D])) if remembered else np.concatenate([alpha, D])
        return there[: len(alpha)], there[len(alpha) :]
