"""How far a design stays from its targets, and how that changes with the design.

For every target inverse kinematics finds the command that brings the tip nearest, within limits and above the floor of
the margin.  The distance d that is left is a smooth function of the design where it is not 0, and its rate is that of a
least (the envelope theorem): what the design does to the tip at the held command, along the unit vector n from target
to tip,

    d d / d p = n . d tip / d p - mu d margin / d p,

with held shares of the tubes' travel, so that bounds of commands take part.  The second term is for targets that the
floor of the margin keeps from: mu >= 0 is what the floor holds against, n . d tip / d q = mu d margin / d q.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.answer.equilibrium import Equilibrium
from ctr_pvs.answer.shape import TorsionShape
from ctr_pvs.answer.status import NoEquilibriumError
from ctr_pvs.robot.robot import Robot
from ctr_pvs.solve.solver import EquilibriumSolver
from ctr_pvs.tasks.aim import Aim
from ctr_pvs.tasks.calibration.rates import TubeRates
from ctr_pvs.tasks.calibration.rates import tube_rates
from ctr_pvs.tasks.descent import HASTY
from ctr_pvs.tasks.descent import Descent
from ctr_pvs.tasks.descent import End
from ctr_pvs.tasks.descent import descend
from ctr_pvs.tasks.design.parameters import Parameter
from ctr_pvs.tasks.design.parameters import stiffening
from ctr_pvs.tasks.design.room import Room
from ctr_pvs.tasks.design.travel import Travel
from ctr_pvs.tasks.inverse import InverseSearch
from ctr_pvs.tasks.walk import Refusal

Array = NDArray[np.float64]

#: Steps of a descent, and how near a target it is gone on with to its end [m].
STEPS, NEAR = 40, 5e-3
#: For a target that is missed, starts from the table of tips.
STARTS = 3
#: Of a target that no command was found for [m].
LOST = 0.1
#: Step of differences of the margin, in shares and radians.
STEP = 1e-4


@dataclass(frozen=True, eq=False)
class Problem:
    """Designs in ``room`` for tips at ``aims``.  tolerance : of the tips [m]."""

    room: Room
    aims: tuple[Aim, ...]
    tolerance: float


@dataclass(frozen=True, eq=False)
class Commands:
    """For each target alpha (M, N) [rad] and shares of the tubes' travel (M, N); known (M,) : whether there is one."""

    alpha: Array
    travel: Array
    known: NDArray[np.bool_]


class Made:
    """The robot of one design, and what it does at each target.

    found : a descent for each target, None where no command was found; off (M,) [m] : how far the tips stay, tangents
    counted, 0 for those that are there.
    """

    def __init__(self, problem: Problem, robot: Robot) -> None:
        self.robot, self.aims, self.floor = robot, problem.aims, problem.room.limits.margin
        self.solver, self.travel = EquilibriumSolver(robot, problem.tolerance, "torsion"), Travel(robot)
        self._search = InverseSearch(self.solver)
        self.found: list[Descent | None] = [None] * len(self.aims)

    @property
    def off(self) -> Array:
        return np.array([_left(descent) for descent in self.found])

    @property
    def commands(self) -> Commands:
        none = np.zeros(self.robot.n_tubes)
        answers = [None if descent is None else descent.walker.answer for descent in self.found]
        alpha = np.array([none if answer is None else answer.alpha for answer in answers])
        D = np.array([none if answer is None else answer.D for answer in answers])
        return Commands(alpha, self.travel.shares(D), np.array([answer is not None for answer in answers]))

    def go_on(self, commands: Commands) -> None:
        """From the commands of another design."""
        starts = zip(commands.alpha, self.travel.D(commands.travel), commands.known.tolist(), strict=True)
        for i, (alpha, D, known) in enumerate(starts):
            self.found[i] = self._descent(i, (alpha, D)) if known else None
            if self.found[i] is None:
                self.look(i)

    def look(self, i: int) -> None:
        """For a better command for one target, from a few of a table."""
        for start in self._search.starts(self.aims[i], STARTS, math.inf):
            if _left(self.found[i]) == 0.0:
                break
            descent = self._descent(i, start)
            if _left(descent) < _left(self.found[i]):
                self.found[i] = descent

    def settle(self) -> None:
        """The nearest commands more exactly: rates are those of a least."""
        for i, descent in enumerate(self.found):
            if descent is not None:
                self.found[i] = self._settled(i, descent)

    def _settled(self, i: int, descent: Descent) -> Descent:
        if descent.end not in (End.LEVEL, End.STEPS):
            return descent
        return descend(descent.walker, self.aims[i], self._search.bounds, STEPS)

    def _descent(self, i: int, start: tuple[Array, Array]) -> Descent | None:
        """None where the start has no equilibrium above the floor."""
        start = self.robot.clamp_command(*start)[:2]
        try:
            walker = self._search.walker(start, None, self.floor, math.inf)
        except NoEquilibriumError:
            return None
        if walker.answer.stability_margin < self.floor:
            return None
        hasty = descend(walker, self.aims[i], self._search.bounds, STEPS, HASTY)
        return self._settled(i, hasty) if hasty.left < NEAR**2 else hasty


def _left(descent: Descent | None) -> float:
    if descent is None:
        return LOST
    return 0.0 if descent.end is End.MET else min(math.sqrt(descent.left), LOST)


def rates(problem: Problem, shares: Array, made: Made) -> Array:
    """(M, P) of ``made.off``, settled, with the ``shares`` (P,) of the design; zeros for targets that are reached, or
    lost."""
    made.settle()
    room, N = problem.room, made.robot.n_tubes
    design, values, travel = room.rates(shares), room.values(shares), made.commands.travel
    by_length, out = made.travel.rates(travel), np.zeros((len(made.found), len(shares)))
    segments = [(j, i) for j, tube in enumerate(made.robot.tubes) for i in range(len(tube.segments))]
    lengths = np.array([[float((p.tube, p.segment) == segment) for p in room.parameters] for segment in segments])
    margins = _Margins(problem, shares, made)
    for i, descent in enumerate(made.found):
        if descent is None or descent.end is End.MET:
            continue
        aim, answer = problem.aims[i], descent.walker.answer
        off = aim.residual(answer)
        n = off / np.linalg.norm(off)
        joints = n @ aim.jacobian(answer)
        tubes = n @ aim.moved(answer, tube_columns(answer, room.parameters, values))
        out[i] = (tubes + joints[N:] @ by_length[i] @ lengths) @ design
        if descent.refusal is Refusal.MARGIN:
            by_joints, by_design = margins.rates(answer.alpha, answer.D, travel[i])
            square = float(by_joints @ by_joints)
            if square > 0.0:
                out[i] -= max(float(joints @ by_joints) / square, 0.0) * by_design
    return out


class _Margins:
    """Rates of the margin, by differences: of it no others are known."""

    def __init__(self, problem: Problem, shares: Array, made: Made) -> None:
        self._problem, self._shares, self._made = problem, shares, made
        self._others: list[tuple[float, Made]] = []

    def rates(self, alpha: Array, D: Array, travel: Array) -> tuple[Array, Array]:
        """(2 N,) with alpha and D, (P,) with the shares of the design at a held share of the tubes' ``travel`` (N,)."""
        made, N = self._made, len(alpha)
        here, by_joints = _margin(made, alpha, D), np.zeros(2 * N)
        scale = np.concatenate([np.ones(N), made.travel.high])
        for k in range(2 * N):
            for step in (STEP, -STEP):
                there = np.concatenate([alpha, D])
                there[k] += step * scale[k]
                moved = np.concatenate(made.robot.clamp_command(there[:N], there[N:])[:2])
                if np.allclose(moved, there, rtol=0.0, atol=1e-12):
                    by_joints[k] = (_margin(made, there[:N], there[N:]) - here) / (step * scale[k])
                    break
        by_design = [
            (_margin(other, alpha, other.travel.D(travel[None])[0]) - here) / step for step, other in self._neighbours()
        ]
        return by_joints, np.array(by_design)

    def _neighbours(self) -> list[tuple[float, Made]]:
        """Designs with one share a step away."""
        if not self._others:
            for k, share in enumerate(self._shares.tolist()):
                there, step = self._shares.copy(), STEP if share < 0.5 else -STEP
                there[k] += step
                self._others.append((step, Made(self._problem, self._problem.room.robot_at(there))))
        return self._others


def _margin(made: Made, alpha: Array, D: Array) -> float:
    alpha, D, _ = made.robot.clamp_command(alpha, D)
    answer = made.solver.solve(alpha, D, start="cold")
    return answer.stability_margin if answer.success else 0.0


def tube_columns(answer: Equilibrium, parameters: Sequence[Parameter], values: Array) -> Array:
    """(6, P) rates of the tip with the parameters' ``values`` (P,), at a held command."""
    shape = answer.shape
    assert isinstance(shape, TorsionShape)
    found = tube_rates(shape, any(p.kind == "length" for p in parameters))
    tubes = shape.engine.robot.tubes
    columns = [
        _column(found, p, value, tubes[p.tube].inner_diameter, tubes[p.tube].outer_diameter)
        for p, value in zip(parameters, values.tolist(), strict=True)
    ]
    return np.column_stack(columns)


def _column(found: TubeRates, p: Parameter, value: float, inner: float | None, outer: float | None) -> Array:
    """(6,) with one parameter at its ``value``."""
    if p.kind == "length":
        return found.length[p.tube][:, p.segment]
    if p.kind == "curvature":
        return np.asarray(found.curvature[:, p.tube] / value)
    assert inner is not None and outer is not None
    stiffer = stiffening(inner, outer)[p.kind]
    return np.asarray(stiffer * (found.bending[:, p.tube] + found.torsion[:, p.tube]))
