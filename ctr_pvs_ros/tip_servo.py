"""From where the tip should be to the next command: one damped step a pose, within limits and rates."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ctr_pvs import NoEquilibriumError
from ctr_pvs import Robot
from ctr_pvs_ros.inputs.poses import PoseReason
from ctr_pvs_ros.inputs.poses import RejectedPose
from ctr_pvs_ros.inputs.poses import TipGoal

if TYPE_CHECKING:
    from ctr_pvs import Equilibrium
    from ctr_pvs_ros.stream import Tried

Array = NDArray[np.float64]

#: A pose moves the joints no farther than in this time [s], however long ago the last one was: the first pose after a
#: pause must not jump.
LONGEST_PERIOD = 0.1
#: Damping, as the tip's motion [m] for one unit of a joint below which that joint is not used for it.
LEAST_EFFECT = 1e-4
#: Steps that lead no nearer are shortened, so often and by this; nearer than this [m] nothing need be done.
TRIES, SHORTENED, THERE = 4, 0.3, 1e-12


class TipServo:
    """Steps towards poses, for one robot.

    Args:
        robot: with the limits that hold.
        rotation_rate, translation_rate: of the joints at most [rad/s, m/s]; 0: no limit.
    """

    def __init__(self, robot: Robot, rotation_rate: float, translation_rate: float) -> None:
        from ctr_pvs.tasks.bounds import Bounds  # brings scipy along, which takes longer than a refusal may

        self._bounds = Bounds(robot, None)
        N = robot.n_tubes
        rates = np.repeat([rotation_rate or np.inf, translation_rate or np.inf], N)
        self._rates = rates / self._bounds.scale
        self._last = -np.inf  # when the last pose came, on a steady clock [s]

    def step(self, answer: Equilibrium, goal: TipGoal, try_out: Callable[[Array, Array], Tried]) -> Tried:
        """What was tried that leads from an answer towards the goal; the answer's own command, where no step does: out
        of reach, rates foretell little.

        Args:
            try_out: solves for alpha (N,) [rad] and D (N,) [m].

        Raises:
            RejectedPose: the answer has no rates.
        """
        from ctr_pvs.tasks.aim import Aim
        from ctr_pvs.tasks.descent import DAMPING

        now = time.monotonic()
        period, self._last = min(now - self._last, LONGEST_PERIOD), now
        aim = Aim(*goal.parts)
        try:
            off, rates = aim.residual(answer), aim.jacobian(answer) * self._bounds.scale
        except NoEquilibriumError as error:
            raise RejectedPose(PoseReason.NO_RATES, f"{error}; expected a command on servo_jp") from error
        left = float(off @ off)
        # Far from the goal the rates say little of the way: damping grows with the distance, as in inverse kinematics.
        held = rates.T @ rates + (LEAST_EFFECT**2 + DAMPING * left) * np.eye(rates.shape[1])
        x = self._bounds.scaled(answer.alpha, answer.D)
        d = self._bounds.step(x, held, rates.T @ off)
        d = d / max(1.0, float((np.abs(d) / (self._rates * period)).max()))
        for _ in range(TRIES if left > THERE**2 else 0):
            command = self._bounds.command(x + d)
            tried = try_out(*command)
            there = tried.equilibrium
            if there.success and not there.snaps and float(np.sum(aim.residual(there) ** 2)) < left:
                return tried
            d = SHORTENED * d
        return try_out(answer.alpha, answer.D)
