"""What the page shows, and what becomes of it when a slider moves: no browser, no server."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.answer.backbone import Pose
from ctr_pvs.answer.equilibrium import Equilibrium
from ctr_pvs.answer.status import NoEquilibriumError
from ctr_pvs.answer.status import Status
from ctr_pvs.cli.seeing.drawn import DrawnTube
from ctr_pvs.cli.seeing.drawn import drawn_tubes
from ctr_pvs.robot.loads import Loads
from ctr_pvs.robot.robot import Limits
from ctr_pvs.robot.robot import Robot
from ctr_pvs.solve.snap import snap_motion
from ctr_pvs.solve.solver import EquilibriumSolver

Array = NDArray[np.float64]

#: Poses of a tube; seconds that one answer may take, so that the page keeps up with the hand; tips that are remembered.
POSES, BUDGET, TRACE = 60, 0.5, 2000
#: Rotation of a tube without limits [rad], to either side.
TURN = 2.0 * math.pi
#: Beyond every limit of D [m]: to ask the robot for its limits.
FAR = 1e9
#: Shapes on the way of a snap, seconds that finding them again may take, and how many snaps of one move are shown: the
#: last ones.
FRAMES, FIND_AGAIN, MOST_SNAPS = 13, 0.2, 3


@dataclass(frozen=True)
class Frame:
    """One shape on the way of a snap.

    share : of the way that is behind it, 0 to 1; released : energy [J] that the whole snap sets free.
    """

    tubes: tuple[DrawnTube, ...]
    tip: Pose
    share: float
    released: float


@dataclass(frozen=True)
class Shown:
    """One answer.

    alpha (N,) [rad], D (N,) [m], tip_force (3,) [N]: the command that is shown.
    message : what came of the last command; good : whether it is the one that is shown.
    margin, reserve : see ``Equilibrium``; NaN where not known.  torque (N,) [N m], force (N,) [N].
    motion : of the snaps on the way here.
    """

    alpha: Array
    D: Array
    tip_force: Array
    message: str
    good: bool
    tubes: tuple[DrawnTube, ...]
    tip: Pose
    margin: float
    reserve: float
    torque: Array
    force: Array
    motion: tuple[Frame, ...] = ()


class LiveRobot:
    """One robot that follows commands, as actuators would: each answer sets out from the last.

    trace : tips [m] of the latest answers.
    """

    def __init__(self, robot: Robot, tolerance: float) -> None:
        self.robot, self.tolerance = robot, tolerance
        self.trace: deque[Array] = deque(maxlen=TRACE)
        self._solver = EquilibriumSolver(robot, tolerance)
        self.shown = self.reset()

    @property
    def limits(self) -> Limits:
        """From where to where each slider goes: alpha [rad], D [m]."""
        none, count = np.zeros(self.robot.n_tubes), self.robot.n_tubes
        low, high = (self.robot.clamp_command(none, np.full(count, end))[1] for end in (-FAR, FAR))
        turns = self.robot.limits.alpha or (None,) * count
        alpha = tuple(limit or (-TURN, TURN) for limit in turns)
        return Limits(alpha, tuple(zip(low.tolist(), high.tolist(), strict=True)))

    def reset(self) -> Shown:
        """Back to where it all began: no rotation, no force, all bases in the middle of their ranges."""
        self._solver.reset()
        self.trace.clear()
        middle = [0.5 * (low + high) for low, high in (limit or (0.0, 0.0) for limit in self.limits.D)]
        alpha, D, _ = self.robot.clamp_command(np.zeros(self.robot.n_tubes), middle)
        answer = self._solver.solve(alpha, D, "cold")
        if not answer.success:
            raise NoEquilibriumError(f"{self.robot.name} has no equilibrium to begin with: {answer.message}")
        self.shown = self._show(answer, np.zeros(3), answer.message)
        return self.shown

    def move(self, alpha: Array, D: Array, tip_force: Array) -> Shown:
        """Goes to a command, moved into the robot's limits where it is beyond; stays where no answer is found in time.

        alpha (N,) [rad], D (N,) [m], tip_force (3,) [N].
        """
        alpha, D, notes = self.robot.clamp_command(alpha, D)
        x, y, z = np.asarray(tip_force, dtype=float).tolist()
        loads = Loads(tip_force=(x, y, z)) if any((x, y, z)) else None
        answer = self._solver.solve(alpha, D, budget=BUDGET, loads=loads)
        if not answer.success:
            last = self.shown
            message = f"{answer.status.value}: {answer.message}; shown is the last command that was answered"
            self.shown = replace(last, message=message, good=False, motion=())
            return self.shown
        self.shown = self._show(answer, np.array((x, y, z)), "; ".join([_said(answer), *notes]))
        return self.shown

    def _show(self, answer: Equilibrium, tip_force: Array, message: str) -> Shown:
        self.trace.append(answer.tip.position)
        try:
            reserve = answer.snap_reserve
        except NoEquilibriumError:
            reserve = float("nan")
        return Shown(
            answer.alpha,
            answer.D,
            tip_force,
            message,
            True,
            drawn_tubes(self.robot, answer, POSES),
            answer.tip,
            answer.stability_margin,
            reserve,
            answer.torque,
            answer.force,
            self._motion(answer),
        )

    def _motion(self, answer: Equilibrium) -> tuple[Frame, ...]:
        return tuple(
            Frame(drawn_tubes(self.robot, shape, POSES), shape.tip, index / (FRAMES - 1), snap.energy_released)
            for snap in answer.snaps[-MOST_SNAPS:]
            for index, shape in enumerate(snap_motion(answer, snap, FRAMES, FIND_AGAIN))
        )

    def command(self) -> str:
        """The command that is shown, as YAML; numbers with all their digits."""
        shown = self.shown
        lines = [
            f"robot: {self.robot.name!r}",
            f"tubes: [{', '.join(tube.name for tube in self.robot.tubes)}]",
            f"alpha: {shown.alpha.tolist()} # rad",
            f"D: {shown.D.tolist()} # m",
            f"tip_force: {shown.tip_force.tolist()} # N, base axes",
            f"tip_position: {shown.tip.position.tolist()} # m",
            f"tip_orientation: {shown.tip.orientation.tolist()} # x, y, z, w",
        ]
        return "\n".join(lines) + "\n"


def _said(answer: Equilibrium) -> str:
    if answer.status is not Status.SNAP:
        return answer.message
    released = sum(snap.energy_released for snap in answer.snaps)
    return f"SNAP on the way, {1e3 * released:.3g} mJ released"
