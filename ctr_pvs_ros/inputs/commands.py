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
from ctr_pvs_ros.inputs.joints import Joints

Array = NDArray[np.float64]

#: More than this [m] in front of the orifice a base is not by a sensor's noise.
NOISE = 1e-3
TURN = 2.0 * math.pi
#: A rotation that jumps to within this [rad] of whole turns away looks like a wrapped angle.
NEARLY = 0.35
#: What the robot's own messages call limits, whoever set them.
ROBOTS_LIMITS = "the robot's limits"


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
    """Base rotations alpha (N,) [rad] and base distances D (N,) [m], outermost first.

    notes say what was clamped, hints what looks like a mistake of who sent it.
    """

    alpha: Array
    D: Array
    notes: tuple[str, ...] = ()
    hints: tuple[str, ...] = ()


@dataclass(frozen=True)
class Leniency:
    """What is accepted beyond a complete, named command within limits; all off by default."""

    merge_partial: bool = False
    clamp_to_limits: bool = False
    accept_nameless: bool = False
    ignore_unknown_joints: bool = False
    unwrap_rotations: bool = False


STRICT = Leniency()


class CommandReader:
    """Reads commands for one robot.

    Args:
        robot: with the limits of its file.
        joints: what they are called; None: `Joints.of` the robot.
        rotation_limits, translation_limits: joint positions within those limits [rad, m]: low and high of each tube in
            turn, outermost first; empty: the robot's alone.

    Raises:
        ValueError: limits of a wrong count, or that leave no command.
    """

    def __init__(
        self,
        robot: Robot,
        joints: Joints | None = None,
        rotation_limits: Sequence[float] = (),
        translation_limits: Sequence[float] = (),
    ) -> None:
        self.joints = joints or Joints.of(robot)
        self._file_robot = robot
        for name, pairs in (("rotation_limits", rotation_limits), ("translation_limits", translation_limits)):
            if len(pairs) not in (0, 2 * len(robot.tubes)):
                rule = f"a low and a high limit for each of {len(robot.tubes)} tubes"
                raise ValueError(f"{name}: expected {rule}, got {len(pairs)} numbers")
        alpha = _inside(robot.limits.alpha, rotation_limits)
        D = _inside(robot.limits.D, self.joints.pairs_along(translation_limits))
        self._robot = replace(robot, limits=Limits(alpha, D)) if rotation_limits or translation_limits else robot
        self._known = frozenset(self.joints.names)

    @property
    def robot(self) -> Robot:
        """With the limits that hold."""
        return self._robot

    def is_for_others(self, names: Sequence[str], leniency: Leniency) -> bool:
        """Whether a message is none of this robot's business: one on a shared topic, with joints of others only."""
        return leniency.ignore_unknown_joints and len(names) > 0 and self._known.isdisjoint(names)

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
            last: the last accepted command, which completes a partial one and unwraps rotations where `leniency` says
                so.

        Raises:
            RejectedCommand: nothing of the command may be used.
        """
        named = self._by_name(names, positions, leniency)
        self._check_names(named)
        complete = self._completed(named, leniency, last)
        alpha, D = self.joints.apart([complete[name] for name in self.joints.names])
        hints: tuple[str, ...] = ()
        if last is not None:
            if leniency.unwrap_rotations:
                alpha = alpha - TURN * np.round((alpha - last.alpha) / TURN)
            hints = tuple(self._jumps(alpha - last.alpha))
        return replace(self._within_limits(alpha, D, leniency), hints=hints)

    def check(self, alpha: ArrayLike, D: ArrayLike) -> Command:
        """Rotations [rad] and translations D [m], outermost first, as a command; raises RejectedCommand."""
        try:
            return Command(*self._robot.check_command(alpha, D))
        except CommandError as error:
            raise RejectedCommand(Reason.OUT_OF_LIMITS, self._explained(error, alpha, D)) from error

    def read_in_turn(self, positions: Sequence[float]) -> Command:
        """All rotations [rad], then all translations [m], outermost first; raises RejectedCommand."""
        alpha, translations = np.split(np.array(positions, dtype=np.float64), 2)
        return self.check(alpha, self.joints.along(translations))

    def _by_name(self, names: Sequence[str], positions: Sequence[float], leniency: Leniency) -> dict[str, float]:
        if not names and len(positions) > 0:
            if not leniency.accept_nameless:
                raise RejectedCommand(Reason.NAMELESS, "no joint names; name the joints, or set accept_nameless")
            names = self.joints.names
        if len(names) != len(positions):
            raise RejectedCommand(Reason.RAGGED, f"expected {len(names)} positions, one per name, got {len(positions)}")
        pairs = list(zip(names, positions, strict=True))
        if leniency.ignore_unknown_joints:
            pairs = [pair for pair in pairs if pair[0] in self._known]
        named = dict(pairs)
        if len(named) < len(pairs):
            twice = [name for name, count in Counter(name for name, _ in pairs).items() if count > 1]
            raise RejectedCommand(Reason.DUPLICATE_JOINT, f"named more than once: {_shown(twice)}")
        return named

    def _check_names(self, named: dict[str, float]) -> None:
        unknown = [name for name in named if name not in self._known]
        if unknown:
            raise RejectedCommand(
                Reason.UNKNOWN_JOINT,
                f"unknown joints: {_shown(unknown)}; this robot has {', '.join(self.joints.names)}; joints of others "
                "are passed over where ignore_unknown_joints is set",
            )
        for name, value in named.items():
            if not math.isfinite(value):
                raise RejectedCommand(Reason.NON_FINITE, f"{name}: expected a finite number, got {value}")

    def _completed(self, named: dict[str, float], leniency: Leniency, last: Command | None) -> dict[str, float]:
        missing = [name for name in self.joints.names if name not in named]
        if not missing:
            return named
        if not named or not leniency.merge_partial:
            raise RejectedCommand(Reason.MISSING_JOINT, f"missing joints: {_shown(missing)}")
        if last is None:
            raise RejectedCommand(
                Reason.MISSING_JOINT, f"missing joints: {_shown(missing)}, and no earlier command to take them from"
            )
        return dict(zip(self.joints.names, self.joints.in_turn(last.alpha, last.D), strict=True)) | named

    def _within_limits(self, alpha: Array, D: Array, leniency: Leniency) -> Command:
        if not leniency.clamp_to_limits or (D < -NOISE).any():  # which, clamped, would insert a tube all the way
            return self.check(alpha, D)
        given_alpha, given_D, moved = self._robot.clamp_command(alpha, D)
        return Command(given_alpha, given_D, tuple(self._moves(alpha, D, given_alpha, given_D)) if moved else ())

    def _moves(self, alpha: Array, D: Array, given_alpha: Array, given_D: Array) -> list[str]:
        """What clamping did, joint by joint."""
        asked, given = self.joints.in_turn(alpha, D), self.joints.in_turn(given_alpha, given_D)
        notes = []
        for index, (name, before, after) in enumerate(zip(self.joints.names, asked, given, strict=True)):
            if before != after:
                note = f"{name} moved from {before:g} to {after:g} {'m' if index % 2 else 'rad'}"
                further = D[index // 2] - given_D[index // 2]
                notes.append(f"{note}, {further:.3g} m FURTHER IN" if index % 2 and further > 0.0 else note)
        return notes

    def _explained(self, error: CommandError, alpha: ArrayLike, D: ArrayLike) -> str:
        """A broken rule with the joint's name, and with whose limits they are."""
        symbol, _, index = error.field.rstrip("]").partition("[")
        if not index:
            return str(error)
        joint = self.joints.names[2 * int(index) + (symbol == "D")]
        try:
            self._file_robot.check_command(alpha, D)
        except CommandError:
            whose = "limits of the robot file"
        else:
            whose = f"the parameter {'translation_limits' if symbol == 'D' else 'rotation_limits'}"
        came = f"{symbol} = {error.value:.9g}" if isinstance(error.value, float) else str(error.value)
        line = f"{joint}: expected {error.limit.replace(ROBOTS_LIMITS, whose)}, got {came}"
        remedy = error.remedy
        if symbol == "D":
            if self.joints.translation_sign < 0:
                line += " (the position is -D: translation_sign is -1)"
            elif isinstance(error.value, float) and error.value < 0.0:
                remedy += "; if your positions are beta = -D, set translation_sign to -1"
        return f"{line}; {remedy}" if remedy else line

    def _jumps(self, changes: Array) -> list[str]:
        """Of rotations [rad] that changed by nearly whole turns."""
        if np.abs(changes).max() < TURN - NEARLY:
            return []
        return [
            f"{self.joints.names[2 * tube]} jumped by {math.degrees(change):.0f} deg, nearly a turn or several: a "
            "wrapped angle? unwrap_rotations goes on from the last command"
            for tube, change in enumerate(changes.tolist())
            if abs(change) > math.pi and abs(math.remainder(change, TURN)) < NEARLY
        ]


def _inside(
    own: Sequence[tuple[float, float] | None], pairs: Sequence[float]
) -> tuple[tuple[float, float] | None, ...]:
    """Limits within a robot's own; no pairs: just these."""
    if not pairs:
        return tuple(own)
    both = [own_pair or (-math.inf, math.inf) for own_pair in own]
    return tuple(
        (max(low, own_low), min(high, own_high))
        for low, high, (own_low, own_high) in zip(pairs[0::2], pairs[1::2], both, strict=True)
    )


def _shown(names: Sequence[str], most: int = 4) -> str:
    """Up to `most` names on one line, each of bounded length; commands may carry anything."""
    shown = ", ".join(repr(name[:40]) for name in names[:most])
    return shown if len(names) <= most else f"{shown} and {len(names) - most} more"
