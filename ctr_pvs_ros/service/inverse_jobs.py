"""Inverse kinematics as a job: what is asked, and what was found."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ctr_pvs import Loads
from ctr_pvs import NoEquilibriumError
from ctr_pvs import Pose
from ctr_pvs.robot.robot import Limits
from ctr_pvs_ros.inputs.commands import Command
from ctr_pvs_ros.inputs.poses import TipGoal
from ctr_pvs_ros.service.jobs import Job
from ctr_pvs_ros.service.jobs import Solved

if TYPE_CHECKING:
    from ctr_pvs import Equilibrium
    from ctr_pvs import EquilibriumSolver
    from ctr_pvs import InverseResult
    from ctr_pvs.tasks.inverse import Start

#: What of the time the search may take; the rest is for a last step that was begun, and for telling of it.
SEARCHING = 0.9


@dataclass(frozen=True, eq=False, kw_only=True)
class InverseJob(Job):
    """A place to look for a command to.

    Attributes:
        start: an answer, or a command to be solved for from a cold start; None: tubes half out.
        within, within_angle: how near is there [m], [rad].
        margin_floor: least stability margin of the way.
        every: whether all solutions are looked for.
    """

    goal: TipGoal
    start: Equilibrium | Command | None
    loads: Loads
    limits: Limits
    within: float
    within_angle: float
    margin_floor: float
    every: bool

    def done_by(self, solver: EquilibriumSolver, budget: float) -> Solved:
        began = time.monotonic()
        try:
            result = solver.inverse(
                *self.goal.parts,
                start=self._start(solver),
                loads=self.loads,
                limits=self.limits,
                margin_floor=self.margin_floor,
                budget=SEARCHING * budget,
                all=self.every,
                within=self.within,
                within_angle=self.within_angle,
            )
        except NoEquilibriumError as error:
            took = time.monotonic() - began
            status = "not_converged" if took < SEARCHING * budget else "timeout"
            return Solved(self.number, status, str(error), took)
        found = Found(tuple(map(solution_of, (result, *result.others))), result.iterations)
        return Solved(self.number, result.status.value, result.message, time.monotonic() - began, found)

    def _start(self, solver: EquilibriumSolver) -> Start:
        """Never what the solver has answered last."""
        if self.start is None:
            from ctr_pvs.tasks.bounds import Bounds

            return Bounds(solver.robot, self.limits).centre()
        return (self.start.alpha, self.start.D) if isinstance(self.start, Command) else self.start


@dataclass(frozen=True, eq=False)
class Solution:
    """One command that was found; way (K, 2 N): alpha, D of each command that leads there."""

    alpha: NDArray[Any]
    D: NDArray[Any]
    torque: NDArray[Any]
    force: NDArray[Any]
    tip: Pose
    distance: float
    angle: float
    stability_margin: float
    way: NDArray[Any]
    way_stability_margin: NDArray[Any]


@dataclass(frozen=True, eq=False)
class Found:
    """What a search has found, the best first, and the steps it tried."""

    solutions: tuple[Solution, ...]
    iterations: int


def solution_of(result: InverseResult) -> Solution:
    """What a response tells of it."""
    equilibrium = result.equilibrium
    way = [np.concatenate([step.alpha, step.D]) for step in result.way]
    return Solution(
        result.alpha,
        result.D,
        equilibrium.torque,
        equilibrium.force,
        equilibrium.tip,
        result.distance,
        result.angle,
        float(equilibrium.stability_margin),
        np.array(way).reshape(len(way), 2 * len(result.alpha)),
        np.array([step.margin for step in result.way]),
    )
