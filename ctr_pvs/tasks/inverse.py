"""Inverse kinematics: the command that brings the tip where it should be, with a way there on which nothing snaps."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from dataclasses import replace
from enum import Enum

import numpy as np
from numpy.typing import ArrayLike
from numpy.typing import NDArray

from ctr_pvs.answer.equilibrium import Equilibrium
from ctr_pvs.answer.status import NoEquilibriumError
from ctr_pvs.robot.loads import Loads
from ctr_pvs.robot.robot import Limits
from ctr_pvs.solve.solver import EquilibriumSolver
from ctr_pvs.tasks.aim import Aim
from ctr_pvs.tasks.bounds import Bounds
from ctr_pvs.tasks.descent import HASTY
from ctr_pvs.tasks.descent import Descent
from ctr_pvs.tasks.descent import End
from ctr_pvs.tasks.descent import descend
from ctr_pvs.tasks.descent import turned_to_aim
from ctr_pvs.tasks.table import Table
from ctr_pvs.tasks.walk import Refusal
from ctr_pvs.tasks.walk import Step
from ctr_pvs.tasks.walk import Walker
from ctr_pvs.tasks.walk import left

Array = NDArray[np.float64]
Start = Equilibrium | tuple[ArrayLike, ArrayLike]

#: Steps of a descent; starts from the table; for ``all``.
STEPS, STARTS, STARTS_FOR_ALL = 60, 12, 32
#: So many hasty descents that end as near as each other, to this share of the distance, have found the closest point;
#: those that come within ``NEARLY`` times the least distance are gone on with, so many at most.
AGREEING, SAME_PLACE, NEARLY, MOST_POLISHED = 6, 3e-2, 1.1, 6
#: Solutions nearer to each other than this, in units of ``Bounds.scaled``, are one: what is free moves them.
DISTINCT = 0.5


class InverseStatus(Enum):
    """Outcome of a search; the value is its name in messages and files."""

    REACHED = "reached"
    CLOSEST = "closest"
    LIMITS = "limits"
    MARGIN_FLOOR = "margin_floor"
    SNAP = "snap"
    NOT_CONVERGED = "not_converged"
    TIMEOUT = "timeout"


@dataclass(frozen=True, eq=False)
class InverseResult:
    """What a search for a command found.

    status, message : the outcome: "reached"; "closest", where no command within lengths and order comes nearer;
        "limits", where those of the actuators keep it; "margin_floor", where coming nearer takes a margin below the
        floor; "snap", where it takes a snap, or where the target is met at ``alpha``, ``D`` and no way without one was
        found; "not_converged"; "timeout".  ``success`` is true for "reached" only.
    alpha, D : (N,) the command found [rad], [m]; equilibrium : there.
    distance : [m] of its tip from the position; angle : [rad] from the tangent or orientation, 0 where none was asked.
    iterations : steps tried, of all starts.
    way : commands from the start to this one, each followed from the one before without a snap; empty if none is known.
    others : with ``all``, the other solutions, by falling margin.
    """

    status: InverseStatus
    message: str
    alpha: Array
    D: Array
    equilibrium: Equilibrium
    distance: float
    angle: float
    iterations: int
    way: tuple[Step, ...]
    others: tuple[InverseResult, ...] = ()

    @property
    def success(self) -> bool:
        return self.status is InverseStatus.REACHED


class InverseSearch:
    """Searches of one solver under the same limits: they share the table of starts, which is made as far as it is
    needed.
    """

    def __init__(self, solver: EquilibriumSolver, limits: Limits | None = None) -> None:
        self.solver, self.bounds = solver, Bounds(solver.robot, limits)
        self._table = Table(solver, self.bounds)

    def walker(self, start: Start | None, loads: Loads | None, floor: float, deadline: float) -> Walker:
        """At the start, under ``loads``; raises ``NoEquilibriumError`` where there is no equilibrium without a snap."""
        other = self.solver.fork(start if isinstance(start, Equilibrium) else None)
        alpha, D = (start.alpha, start.D) if isinstance(start, Equilibrium) else start or self.bounds.centre()
        answer = other.solve(alpha, D, loads=loads, budget=left(deadline))
        if not answer.success or (answer.snaps and isinstance(start, Equilibrium)):
            raise NoEquilibriumError(f"no equilibrium to set out from: {answer.message}")
        return Walker(self.solver, answer, floor, deadline)

    def starts(self, aim: Aim, count: int, deadline: float) -> list[tuple[Array, Array]]:
        """See ``Table.starts``; the table is filled first, as far as it goes until the deadline."""
        self._table.fill(deadline)
        return self._table.starts(aim, count)

    def search(self, aim: Aim, walker: Walker, every: bool = False) -> InverseResult:
        """From where ``walker`` stands, then from other starts that it can come to; see
        ``tasks.solver.EquilibriumSolver.inverse``."""
        first = walker.branch()
        turned_to_aim(first, aim, self.bounds)
        found = [descend(first, aim, self.bounds, STEPS, HASTY)]
        cut_off: list[tuple[Array, Array]] = []
        if found[0].end is not End.TIMEOUT and (every or found[0].end is not End.MET):
            for start in self.starts(aim, STARTS_FOR_ALL if every else STARTS, walker.deadline):
                descent = self._by_way_of(start, aim, walker)
                if descent is None:
                    cut_off.append(start)
                    continue
                found.append(descent)
                if descent.end is End.TIMEOUT or (not every and _settled(found)):
                    break
        iterations = sum(descent.iterations for descent in found)
        if every and any(descent.end is End.MET for descent in found):
            return self._all(aim, found, iterations, walker.late)
        best = self._polished(aim, found)
        if best.end not in (End.MET, End.TIMEOUT):
            beyond = self._beyond_snaps(aim, walker, cut_off)
            if beyond is not None:
                return replace(beyond, iterations=iterations + beyond.iterations)
        return self._told(aim, best, iterations)

    def _polished(self, aim: Aim, found: list[Descent]) -> Descent:
        """The best of the descents, those that came nearly as near gone on with to their ends."""
        least = min(descent.left for descent in found)
        if any(descent.end in (End.MET, End.TIMEOUT) for descent in found):
            return min(found, key=lambda descent: descent.left)
        near = sorted((one for one in found if one.left <= NEARLY**2 * least), key=lambda one: one.left)
        ends = [descend(descent.walker, aim, self.bounds, STEPS) for descent in near[:MOST_POLISHED]]
        return min(ends, key=lambda descent: descent.left)

    def _by_way_of(self, start: tuple[Array, Array], aim: Aim, walker: Walker) -> Descent | None:
        """A descent from a start of the table; None if no way to it is known that does not snap."""
        for route in self._routes(walker.answer.alpha, walker.answer.D, *start):
            other = walker.branch()
            refusal = other.along(route)
            if refusal is None:
                return descend(other, aim, self.bounds, STEPS, HASTY)
            if refusal is Refusal.TIMEOUT:
                return None
        return None

    def _routes(self, alpha: Array, D: Array, alpha_end: Array, D_end: Array) -> Iterator[list[tuple[Array, Array]]]:
        """Ways to a command worth a try: straight; turned back, slid, and turned; and by way of the retracted robot,
        where nothing is coupled."""
        yield [(alpha_end, D_end)]
        level = self.bounds.clamped(np.full_like(alpha, alpha[0]), D)[0]
        level_end = self.bounds.clamped(np.full_like(alpha, alpha_end[0]), D)[0]
        yield [(level, D), (level_end, D_end), (alpha_end, D_end)]
        back = self.bounds.high[self.bounds.tubes :]
        yield [(alpha, back), (alpha_end, back), (alpha_end, D_end)]

    def _beyond_snaps(self, aim: Aim, walker: Walker, starts: list[tuple[Array, Array]]) -> InverseResult | None:
        """A solution that no way without a snap was found to, from cold starts."""
        for start in starts:
            if walker.late:
                break
            try:
                other = self.walker(start, walker.loads, walker.floor, walker.deadline)
            except NoEquilibriumError:
                continue
            descent = descend(other, aim, self.bounds, STEPS)
            if descent.end is End.MET:
                message = "a command that meets the target, but no way to it without a snap or too small a margin"
                result = self._told(aim, descent, descent.iterations)
                return replace(result, status=InverseStatus.SNAP, message=f"{message} was found", way=())
        return None

    def _all(self, aim: Aim, found: list[Descent], iterations: int, late: bool) -> InverseResult:
        """The solution of largest margin, with the others that are not its neighbours."""
        met = [descent for descent in found if descent.end is End.MET]
        distinct: list[Descent] = []
        for descent in sorted(met, key=lambda descent: -descent.walker.way[-1].margin):
            if all(self._apart(descent, other) > DISTINCT for other in distinct):
                distinct.append(descent)
        told = [self._told(aim, descent, iterations) for descent in distinct]
        message = told[0].message + ("; out of time, there may be more solutions" if late else "")
        return replace(told[0], message=message, others=tuple(told[1:]))

    def _apart(self, one: Descent, other: Descent) -> float:
        """The largest difference of two commands, whole turns of a tube left out."""
        a, b = one.walker.answer, other.walker.answer
        turn = (a.alpha - b.alpha + np.pi) % (2.0 * np.pi) - np.pi
        return float(np.abs(self.bounds.scaled(turn, a.D - b.D)).max())

    def _told(self, aim: Aim, descent: Descent, iterations: int) -> InverseResult:
        answer = descent.walker.answer
        distance, angle = aim.distance(answer), aim.angle(answer)
        status, why = outcome(self.bounds, descent)
        off = f"tip {1e3 * distance:.6g} mm off" + (f", {angle:.3g} rad turned" if aim.turns else "")
        return InverseResult(
            status, f"{off}: {why}", answer.alpha, answer.D, answer, distance, angle, iterations,
            tuple(descent.walker.way),
        )  # fmt: skip


def outcome(bounds: Bounds, descent: Descent) -> tuple[InverseStatus, str]:
    """What came of a descent, and why, for people."""
    answer = descent.walker.answer
    if descent.end is End.MET:
        return InverseStatus.REACHED, f"reached in {len(descent.walker.way) - 1} steps without a snap"
    if descent.end is End.TIMEOUT:
        return InverseStatus.TIMEOUT, "out of time"
    if descent.end is End.STEPS or (descent.end is End.REFUSED and descent.refusal is Refusal.FAILED):
        return InverseStatus.NOT_CONVERGED, f"not settled after {descent.iterations} steps"
    if descent.end is End.REFUSED and descent.refusal is not None:
        status = InverseStatus.MARGIN_FLOOR if descent.refusal is Refusal.MARGIN else InverseStatus.SNAP
        return status, f"nearer to the target {descent.refusal.value}"
    by_limits, names = bounds.pressing(bounds.scaled(answer.alpha, answer.D), descent.gradient)
    held = f", held by {', '.join(names)}" if names else ""
    return InverseStatus.LIMITS if by_limits else InverseStatus.CLOSEST, f"the closest that was found{held}"


def _settled(found: list[Descent]) -> bool:
    """True once the aim is met, or several descents came to rest in the same, best place."""
    if found[-1].end is End.MET:
        return True
    best = min(descent.left for descent in found)
    agree = [d for d in found if d.end is End.LEVEL and d.left <= best * (1.0 + SAME_PLACE) ** 2]
    return len(agree) >= AGREEING
