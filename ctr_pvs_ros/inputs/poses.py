"""From a PoseStamped's frame and numbers to where the tip should be: checked, and refused with a reason."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from ctr_pvs import Equilibrium

Array = NDArray[np.float64]

GOALS = ("position", "tangent", "orientation")
#: How far a quaternion's norm may be from 1; senders round.
ABOUT_ONE = 1e-3
FARTHEST = 10.0  # m


class PoseReason(StrEnum):
    """Why a pose was refused."""

    UNKNOWN_FRAME = "unknown_frame"
    NON_FINITE = "non_finite"
    OUT_OF_LIMITS = "out_of_limits"
    NO_START = "no_start"
    NO_RATES = "no_rates"


class RejectedPose(ValueError):
    """A pose that changes nothing. The message is one line: what came, what was expected."""

    def __init__(self, reason: PoseReason, message: str) -> None:
        super().__init__(message)
        self.reason = reason


@dataclass(frozen=True, eq=False)
class TipGoal:
    """Where the tip should be: position (3,) [m]; and its orientation (4,) xyzw, of which only the tangent counts, the
    x axis, unless it is ``whole``. None: none of it does."""

    position: Array
    orientation: Array | None = None
    whole: bool = False

    @property
    def parts(self) -> tuple[Array, Array | None, Array | None]:
        """Position, tangent and orientation, those None that do not count: what inverse kinematics asks for."""
        if self.orientation is None or self.whole:
            return self.position, None, self.orientation
        from ctr_pvs.tasks.aim import tangent_of  # brings scipy along, which takes longer than a refusal may

        return self.position, tangent_of(self.orientation), None

    def distance(self, answer: Equilibrium) -> float:
        """[m] from an answer's tip to the position."""
        return float(np.linalg.norm(answer.tip.position - self.position))


def read_pose(
    frame: str, position: tuple[float, ...], orientation: tuple[float, ...], frame_id: str, goal: str
) -> TipGoal:
    """What of a pose counts for `goal`, one of GOALS; raises RejectedPose.

    Args:
        frame: of the pose; empty stands for `frame_id`, the only one that is taken.
        position, orientation: m, quaternion xyzw, which is read only where it counts.
    """
    if frame not in ("", frame_id):
        rule = f"header.frame_id: expected {frame_id!r} or nothing, got {frame!r}"
        raise RejectedPose(PoseReason.UNKNOWN_FRAME, rule)
    if not all(map(math.isfinite, position)):
        raise RejectedPose(PoseReason.NON_FINITE, f"position: expected finite numbers, got {position}")
    if math.hypot(*position) > FARTHEST:
        rule = f"at most {FARTHEST:g} m from the orifice"
        raise RejectedPose(PoseReason.OUT_OF_LIMITS, f"position: expected {rule}, got {math.hypot(*position):g} m")
    place = np.array(position)
    if goal == "position":
        return TipGoal(place)
    if not all(map(math.isfinite, orientation)):
        raise RejectedPose(PoseReason.NON_FINITE, f"orientation: expected finite numbers, got {orientation}")
    size = math.hypot(*orientation)
    if abs(size - 1.0) > ABOUT_ONE:
        raise RejectedPose(PoseReason.OUT_OF_LIMITS, f"orientation: expected a unit quaternion, got norm {size:g}")
    return TipGoal(place, np.array(orientation) / size, whole=goal == "orientation")
