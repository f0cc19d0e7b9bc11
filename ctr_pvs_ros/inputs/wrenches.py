"""From a WrenchStamped's frame and vectors to a load on the tip: checked, turned once, and refused with a reason."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from ctr_pvs import Loads
from ctr_pvs.robot.loads import Vector

# Far beyond what such robots carry. The solver takes more, but cuts a robot under such loads into so many elements that
# a single step lasts longer than a budget.
LARGEST_FORCE = 1e3  # N
LARGEST_MOMENT = 1e2  # N m


class WrenchReason(StrEnum):
    """Why a wrench was refused."""

    UNKNOWN_FRAME = "unknown_frame"
    NON_FINITE = "non_finite"
    OUT_OF_LIMITS = "out_of_limits"


class RejectedWrench(ValueError):
    """A wrench that changes nothing. The message is one line: what came, what was expected."""

    def __init__(self, reason: WrenchReason, message: str) -> None:
        super().__init__(message)
        self.reason = reason


@dataclass(frozen=True)
class TipWrench:
    """force [N] and moment [N m] on the tip, along the axes of the base or, `in_tip_frame`, of the tip."""

    force: Vector
    moment: Vector
    in_tip_frame: bool

    def loads(self, orientation: NDArray[np.float64] | None) -> Loads | None:
        """The load in base axes, dead from now on; None where it takes the tip's `orientation`, a unit quaternion (4,)
        xyzw, and there is none."""
        if not self.in_tip_frame:
            return Loads(self.force, self.moment)
        if orientation is None:
            return None
        return Loads(turned(self.force, orientation), turned(self.moment, orientation))


def check_wrench(force: Vector, moment: Vector) -> None:
    """Whether a force [N] and a moment [N m] can be solved for, whatever their axes; raises RejectedWrench."""
    for name, unit, vector, most in (("force", "N", force, LARGEST_FORCE), ("torque", "N m", moment, LARGEST_MOMENT)):
        if not all(map(math.isfinite, vector)):
            raise RejectedWrench(WrenchReason.NON_FINITE, f"{name}: expected finite numbers, got {vector}")
        if math.hypot(*vector) > most:
            rule = f"at most {most:g} {unit} in all"
            raise RejectedWrench(WrenchReason.OUT_OF_LIMITS, f"{name}: expected {rule}, got {vector}")


def turned(vector: Vector, quaternion: NDArray[np.float64]) -> Vector:
    """`vector` turned by a unit quaternion (4,) xyzw: v + 2 w (u x v) + 2 u x (u x v), u its vector part."""
    u, w = quaternion[:3], quaternion[3]
    across = np.cross(u, vector)
    x, y, z = (vector + 2.0 * (w * across + np.cross(u, across))).tolist()
    return x, y, z


class WrenchReader:
    """Reads wrenches in two frames.

    Args:
        base_frame: the node's `frame_id`; a wrench without a frame counts as in it.
        tip_frame: that of the tip.
    """

    def __init__(self, base_frame: str, tip_frame: str) -> None:
        self._in_tip_frame = {"": False, base_frame: False, tip_frame: True}
        self._expected = f"{base_frame!r} (base axes) or {tip_frame!r} (the tip's)"

    def read(self, frame_id: str, force: Vector, moment: Vector) -> TipWrench:
        """Check force [N] and moment [N m] given along the axes of `frame_id`; raises RejectedWrench."""
        if frame_id not in self._in_tip_frame:
            raise RejectedWrench(
                WrenchReason.UNKNOWN_FRAME, f"frame_id: expected {self._expected}, got {frame_id[:40]!r}"
            )
        check_wrench(force, moment)
        return TipWrench(force, moment, self._in_tip_frame[frame_id])
