"""From a JointState's names and positions to (alpha, D): matched by name, checked, and refused with a reason."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from dataclasses import replace
from enum import StrEnum

import numpy as np
from numpy.typing import ArrayLike
from numpy.typing import NDArray

from ctr_pvs import CommandError
from ctr_pvs import Robot
from ctr_pvs.robot.robot import Limits


class Reason(StrEnum):
    """Why a command was refused."""

    RAGGED = "ragged"
    NAMELESS = "nameless"
    DUPLICATE_JOINT = "duplicate_joint"
    UNKNOWN_JOINT = "unknown_joint"
    MISSING_JOINT = "missing_joint"
    NON_FINITE = "non_finite"
    OUT_OF_LIMITS = "out_of_limits"
    STOPPED = "stopped"


class RejectedCommand(ValueError):
    """A command that changes nothing. The message is one line: what came, what was expected, what to do."""

    def __init__(self, reason: Reason, message: str) -> None:
        super().__init__(message)
        self.reason = reason


@dataclass(frozen=True)
class Command:
    """Base rotations alpha (N,) [rad] and base distances D (N,) [m], outermost first; notes say what was clamped."""

    alpha: NDArray[np.float64]
    D: NDArray[np.float64]
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Leniency:
    """What is accepted beyond a complete, named command within limits; all off by default."""

    merge_partial: bool = False
    clamp_to_limits: bool = False
    accept_nameless: bool = False


STRICT = Leniency()


def joint_names(robot: Robot) -> tuple[str, ...]:
    """`<tube>_rotation` and `<tube>_translation` of each tube in turn, outermost first (2N,)."""
    return tuple(f"{tube.name}_{kind}" for tube in robot.tubes for kind in ("rotation", "translation"))


def joint_positions(alpha: NDArray[np.float64], D: NDArray[np.float64]) -> list[float]:
    """Positions (2N,) [rad and m] in the order of `joint_names`."""
    positions = [0.0] * (2 * len(alpha))
    positions[0::2], positions[1::2] = alpha.tolist(), D.tolist()
    return positions


def narrowed(robot: Robot, rotation_limits: Sequence[float], translation_limits: Sequence[float]) -> Robot:
    """The robot with limits inside its own: low and high of each tube in turn, outermost first; empty: no change.

    Args:
        rotation_limits: rad.
        translation_limits: m.

    Raises:
        ValueError: a wrong count, or limits that leave no command.
    """
    alpha = _inside("rotation_limits", robot.limits.alpha, rotation_limits)
    D = _inside("translation_limits", robot.limits.D, translation_limits)
    return replace(robot, limits=Limits(alpha, D)) if rotation_limits or translation_limits else robot


def _inside(
    name: str, own: Sequence[tuple[float, float] | None], pairs: Sequence[float]
) -> tuple[tuple[float, float] | None, ...]:
    if not pairs:
        return tuple(own)
    if len(pairs) != 2 * len(own):
        rule = f"a low and a high limit for each of {len(own)} tubes"
        raise ValueError(f"{name}: expected {rule}, got {len(pairs)} numbers")
    both = [own_pair or (-math.inf, math.inf) for own_pair in own]
    return tuple(
        (max(low, own_low), min(high, own_high))
        for low, high, (own_low, own_high) in zip(pairs[0::2], pairs[1::2], both, strict=True)
    )


class CommandReader:
    """Reads commands for one robot."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self.names = joint_names(robot)

    def read(
        self,
        names: Sequence[str],
        positions: Sequence[float],
        leniency: Leniency = STRICT,
        last: Command | None = None,
    ) -> Command:
        """Match positions [rad and m] to joints by name.

        Args:
            names: joint names in any order; may be empty where `leniency` accepts it.
            positions: one number per name.
            leniency: what to accept beyond a complete command within limits.
            last: the last accepted command, which completes a partial one where `leniency` says so.

        Raises:
            RejectedCommand: nothing of the command may be used.
        """
        named = self._by_name(names, positions, leniency)
        self._check_names(named)
        complete = self._completed(named, leniency, last)
        values = np.array([complete[name] for name in self.names])
        return self._within_limits(values[0::2], values[1::2], leniency)

    def check(self, alpha: ArrayLike, D: ArrayLike) -> Command:
        """Rotations [rad] and translations [m], outermost first, as a command; raises RejectedCommand."""
        try:
            return Command(*self._robot.check_command(alpha, D))
        except CommandError as error:
            raise RejectedCommand(Reason.OUT_OF_LIMITS, str(error)) from error

    def _by_name(self, names: Sequence[str], positions: Sequence[float], leniency: Leniency) -> dict[str, float]:
        if not names and len(positions) > 0:
            if not leniency.accept_nameless:
                raise RejectedCommand(Reason.NAMELESS, "no joint names; name the joints, or set accept_nameless")
            names = self.names
        if len(names) != len(positions):
            raise RejectedCommand(Reason.RAGGED, f"expected {len(names)} positions, one per name, got {len(positions)}")
        if len(set(names)) < len(names):
            twice = [name for name, count in Counter(names).items() if count > 1]
            raise RejectedCommand(Reason.DUPLICATE_JOINT, f"named more than once: {_shown(twice)}")
        return dict(zip(names, positions, strict=True))

    def _check_names(self, named: dict[str, float]) -> None:
        unknown = [name for name in named if name not in self.names]
        if unknown:
            raise RejectedCommand(
                Reason.UNKNOWN_JOINT, f"unknown joints: {_shown(unknown)}; this robot has {', '.join(self.names)}"
            )
        for name, value in named.items():
            if not math.isfinite(value):
                raise RejectedCommand(Reason.NON_FINITE, f"{name}: expected a finite number, got {value}")

    def _completed(self, named: dict[str, float], leniency: Leniency, last: Command | None) -> dict[str, float]:
        missing = [name for name in self.names if name not in named]
        if not missing:
            return named
        if not named or not leniency.merge_partial:
            raise RejectedCommand(Reason.MISSING_JOINT, f"missing joints: {_shown(missing)}")
        if last is None:
            raise RejectedCommand(
                Reason.MISSING_JOINT, f"missing joints: {_shown(missing)}, and no earlier command to take them from"
            )
        return dict(zip(self.names, joint_positions(last.alpha, last.D), strict=True)) | named

    def _within_limits(self, alpha: NDArray[np.float64], D: NDArray[np.float64], leniency: Leniency) -> Command:
        if leniency.clamp_to_limits:
            alpha, D, notes = self._robot.clamp_command(alpha, D)
            return Command(alpha, D, tuple(notes))
        return self.check(alpha, D)


def _shown(names: Sequence[str], most: int = 4) -> str:
    """Up to `most` names on one line, each of bounded length; commands may carry anything."""
    shown = ", ".join(repr(name[:40]) for name in names[:most])
    return shown if len(names) <= most else f"{shown} and {len(names) - most} more"
