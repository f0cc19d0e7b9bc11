"""From targets to a robot: which lengths, curvatures and diameters bring the tip to all of them, within limits.

>>> from ctr_pvs import load_robot
>>> from ctr_pvs.tasks.design.design import design
>>> from ctr_pvs.tasks.design.room import DesignLimits
>>> from ctr_pvs.tasks.design.targets import Targets
>>> found = design(load_robot("renda2021"), Targets([[0.12, 0.03, 0.01], [0.1, -0.02, 0.03]]), ["curvature", "length"])
>>> found.after.worst, found.after.targets[0].D, found.robot

docs/design.md tells how.
"""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable
from collections.abc import Iterable
from collections.abc import Sequence
from concurrent.futures import Executor
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.answer.status import NoEquilibriumError
from ctr_pvs.errors import FieldError
from ctr_pvs.robot.robot import Robot
from ctr_pvs.tasks.calibration.robot_text import robot_text
from ctr_pvs.tasks.design.parameters import USUAL
from ctr_pvs.tasks.design.parameters import Parameter
from ctr_pvs.tasks.design.parameters import chosen
from ctr_pvs.tasks.design.reach import Made
from ctr_pvs.tasks.design.reach import Problem
from ctr_pvs.tasks.design.room import DesignLimits
from ctr_pvs.tasks.design.room import Room
from ctr_pvs.tasks.design.search import search
from ctr_pvs.tasks.design.stage import Draft
from ctr_pvs.tasks.design.stage import stage
from ctr_pvs.tasks.design.targets import Targets
from ctr_pvs.tasks.inverse import InverseResult
from ctr_pvs.tasks.inverse import Start
from ctr_pvs.tasks.solver import EquilibriumSolver

Array = NDArray[np.float64]

#: Designs to begin with.
STARTS = 8
#: A parameter is at a bound within this share of the range that limits leave it.
AT_BOUND = 1e-3
#: The search asks for this share of how near is there, so that what it has found is there for others, too.
STRICTER = 0.5
#: Stages at the end without a wish for less curvature, at most.
EXACT_STAGES = 4


@dataclass(frozen=True, eq=False)
class Reached:
    """What a robot does for one target: its command alpha (N,) [rad], D (N,) [m], how far the tip stays [m] and how far
    it is turned off [rad], the stability margin; empty and infinite where the robot half out has no equilibrium.

    reached : within what was asked; way : one without a snap, and with no margin below the floor, is known from a robot
    that is half out.  message : for people.
    """

    alpha: Array
    D: Array
    distance: float
    angle: float
    margin: float
    reached: bool
    way: bool
    message: str


@dataclass(frozen=True, eq=False)
class Outcome:
    """Of one robot, for all targets."""

    targets: tuple[Reached, ...]

    @property
    def distances(self) -> Array:
        """(M,) [m]."""
        return np.array([target.distance for target in self.targets])

    @property
    def worst(self) -> float:
        return float(self.distances.max())

    @property
    def rms(self) -> float:
        return float(np.sqrt(np.mean(self.distances**2)))

    @property
    def reached(self) -> int:
        return sum(target.reached for target in self.targets)


@dataclass(frozen=True, eq=False)
class Design:
    """What a search for a robot found.

    robot : the new one; start : the one to begin with.  within [m] : how near is there.  parameters, values (P,) : what
    varied, and came of it; at_bound (P,) : by a bound or a limit.  before, after : what both robots do.
    tried : designs on the way to this one.  stopped : the search did not come to its end.
    """

    robot: Robot
    start: Robot
    targets: Targets
    limits: DesignLimits
    within: float
    parameters: tuple[Parameter, ...]
    values: Array
    at_bound: NDArray[np.bool_]
    before: Outcome
    after: Outcome
    tried: int
    seconds: float
    stopped: bool

    @property
    def success(self) -> bool:
        """True if every target is reached."""
        return self.after.reached == len(self.after.targets)

    def robot_file(self, comments: Sequence[str] = ()) -> str:
        """The new robot as the text of a robot file, with ``comments`` before it."""
        return robot_text(self.robot, comments)


def design(
    robot: Robot,
    targets: Targets,
    vary: Iterable[str] = USUAL,
    limits: DesignLimits | None = None,
    *,
    within: float = 1e-6,
    within_angle: float = 1e-4,
    starts: int = STARTS,
    seed: int = 0,
    tolerance: float = 1e-7,
    executor: Executor | None = None,
    progress: Callable[[str], None] | None = None,
    stopped: Callable[[], bool] | None = None,
) -> Design:
    """The robot that brings its tip to all ``targets``; of robots that do, one of less curvature.

    vary : names of what may vary, with bounds if need be, see ``parameters.chosen``.  limits : kept by all designs.
    within [m], within_angle [rad] : how near is there.  starts : designs to begin with: ``robot`` and others anywhere
    in the room that bounds and limits leave; seed : of these.  tolerance : of the tips [m].
    executor : of any kind, for stages of the search; None for threads.  progress : called with a line from time to
    time; stopped : asked whether to end with the best so far.

    Raises ``FieldError`` for wrong options, ``TableError`` for targets that no tube within the bounds is long enough
    for.
    """
    began, report, ends = time.perf_counter(), progress or (lambda line: None), stopped or (lambda: False)
    limits = limits or DesignLimits()
    if starts < 1:
        raise FieldError("starts", starts, "at least one design to begin with")
    parameters = chosen(robot, vary)
    room = Room(robot, parameters, limits)
    targets.check_within(max(tube.length for tube in room.longest().tubes))
    asked = Problem(room, tuple(targets.aims(within, within_angle)), tolerance)
    problem = replace(asked, aims=tuple(targets.aims(STRICTER * within, STRICTER * within_angle)))
    before = outcome(asked, robot, None)
    report(f"before: {before.reached} of {len(targets)} targets reached, worst {1e3 * before.worst:.6f} mm off")
    pool = executor or ThreadPoolExecutor(os.cpu_count())
    try:
        best = search(problem, starts, seed, pool, report, ends)
    finally:
        if executor is None:  # stages that still run when it is stopped are not waited for
            pool.shutdown(wait=False, cancel_futures=True)
    if best is not None and best.worst > 0.0 and not ends():
        best = _exact(problem, best)
    shares = room.shares(np.array([p.start for p in parameters])) if best is None else best.shares
    new = room.robot_at(shares)
    at_bound = np.minimum(shares, 1.0 - shares) < AT_BOUND
    return Design(
        new, robot, targets, limits, within, tuple(parameters), room.values(shares), at_bound, before,
        outcome(asked, new, best), 0 if best is None else best.tried, time.perf_counter() - began, ends(),
    )  # fmt: skip


def _exact(problem: Problem, draft: Draft) -> Draft:
    """The same without a wish for less curvature, which costs some micrometres, if that comes nearer."""
    for _ in range(EXACT_STAGES):
        other = stage(problem, draft, wish=0.0)
        if float(other.off @ other.off) >= float(draft.off @ draft.off):
            break
        draft = other
    return draft


def outcome(problem: Problem, robot: Robot, draft: Draft | None) -> Outcome:
    """What a robot does for each target, by inverse kinematics from a robot that is half out, or else from the commands
    that the search has found."""
    solver, floor = EquilibriumSolver(robot, problem.tolerance), problem.room.limits.margin

    def tried(i: int, start: Start | None) -> InverseResult | None:
        aim = problem.aims[i]
        try:
            return solver.inverse(
                aim.position, aim.tangent, start=start, margin_floor=floor, within=aim.within,
                within_angle=aim.within_angle,
            )  # fmt: skip
        except NoEquilibriumError:
            return None

    D = None if draft is None else Made(problem, robot).travel.D(draft.commands.travel)
    told = []
    for i in range(len(problem.aims)):
        found = [tried(i, None)]
        if D is not None and draft is not None and draft.commands.known[i] and not (found[0] and found[0].success):
            found.append(tried(i, robot.clamp_command(draft.commands.alpha[i], D[i])[:2]))
        told.append(_better(found, floor))
    return Outcome(tuple(told))


def _better(found: list[InverseResult | None], floor: float) -> Reached:
    """The result that is reached, or else the nearest; the first of them had no other start than a robot half out."""
    known = [(number, one) for number, one in enumerate(found) if one is not None]
    if not known:
        return Reached(
            np.empty(0), np.empty(0), math.inf, 0.0, math.nan, False, False, "no equilibrium to set out from"
        )
    rows = []
    for number, one in known:
        margin = one.equilibrium.stability_margin
        reached = one.success and margin >= floor
        message = one.message if one.success == reached else f"{one.message}, but with a margin below the floor"
        way = reached and number == 0
        rows.append(Reached(one.alpha, one.D, one.distance, one.angle, margin, reached, way, message))
    return min(rows, key=lambda row: (not row.reached, row.distance))
