"""From one command to the next in one step, at the smallest model that meets the tolerance.

This is the way nearly every command of a stream goes.  It is taken only where a check of the prepared model proves that
the step stays on its branch; everything else (long ways, folds, new overlaps) is for ``travel``, which ``settle`` then
brings to the same degrees.
"""

from __future__ import annotations

from collections import OrderedDict

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.blas import daxpy
from scipy.linalg.blas import idamax

from ctr_pvs.continuation import DEGREES
from ctr_pvs.continuation import LARGEST_SLIDE
from ctr_pvs.continuation import State
from ctr_pvs.convexity import REACH
from ctr_pvs.energy import TorsionEnergy
from ctr_pvs.fidelity import RAISES
from ctr_pvs.fidelity import first_degrees
from ctr_pvs.fidelity import raised_degrees
from ctr_pvs.lazy import lazy
from ctr_pvs.materials import Materials
from ctr_pvs.relaxed import Relaxed
from ctr_pvs.relaxed import relaxed_state
from ctr_pvs.robot.robot import Robot
from ctr_pvs.sections import piecewise_domain
from ctr_pvs.serving import Served
from ctr_pvs.serving import ServingModel
from ctr_pvs.serving import raised
from ctr_pvs.solution import ServedSolution
from ctr_pvs.solution import TorsionlessSolution

Array = NDArray[np.float64]

#: How far the next finer model may differ [rad], as a multiple of tolerance over length, and within which bounds.
SLACK, LEAST_SLACK, MOST_SLACK = 100.0, 1e-6, 0.05
#: The same at the edge of a fold, where a margin is left only within less.
AT_A_FOLD = 1e-9
#: Base positions whose models are kept.
KEPT = 8


class Rungs:
    """The prepared models of one D, of rising degrees, made when first asked for."""

    def __init__(self, robot: Robot, D: Array, tolerance: float) -> None:
        self.materials = Materials(robot, piecewise_domain(robot, D))
        self.first = first_degrees(self.materials, tolerance)
        length = max(self.materials.domain.length, tolerance)
        self.slack = min(max(LEAST_SLACK, SLACK * tolerance / length), MOST_SLACK)
        self._models: list[ServingModel] = []

    @lazy
    def relaxed(self) -> Relaxed | None:
        """Where a cold start sets out."""
        return relaxed_state(TorsionEnergy(self.materials, DEGREES[0]))

    def __getitem__(self, index: int) -> ServingModel:
        while len(self._models) <= index:
            degree = raised_degrees(self.first, RAISES[len(self._models)])
            self._models.append(ServingModel(TorsionEnergy(self.materials, raised(degree)), degree))
        return self._models[index]


class Position:
    """A stable equilibrium at (alpha, D): what was solved on each rung, the last one being the answer.

    twists : false where the untwisted state is near enough.
    """

    __slots__ = ("D", "alpha", "iterations", "served", "trail", "twists")

    def __init__(self, alpha: Array, D: Array, trail: list[Served], twists: bool = True) -> None:
        self.alpha, self.D, self.trail, self.twists = alpha, D, trail, twists
        self.served = trail[-1]
        self.iterations = self.served.iterations if len(trail) == 1 else sum(served.iterations for served in trail)

    @property
    def level(self) -> str:
        return "torsion" if self.twists else "torsionless"

    @property
    def solution(self) -> ServedSolution:
        return ServedSolution(self.served) if self.twists else TorsionlessSolution(self.served)

    @property
    def estimate(self) -> float:
        """Of the tip error by discretisation [m]."""
        return self.served.tip_estimate

    @property
    def reason(self) -> str:
        """Why this level and these degrees."""
        model = self.served.model
        if model.n == 0:
            return f"{self.level}: no two curved tubes overlap, so nothing twists"
        if not self.twists:
            return f"torsionless: twist would move no point of the backbone by more than {self.served.bound:.1e} m"
        degrees = "/".join(str(degree) for degree in model.degree if degree)
        finer = f"two more would move no point of the backbone by more than {self.served.bound:.1e} m"
        return f"torsion: {model.n} unknowns, polynomials of degree {degrees} where curved tubes overlap; {finer}"

    @property
    def margin(self) -> float:
        return self.served.model.margin(self.served)

    @property
    def coupled(self) -> bool:
        """True if the tubes can twist each other: otherwise nothing is remembered."""
        return self.served.model.n > 0

    @property
    def state(self) -> State:
        """For those who follow paths."""
        return State(self.alpha, self.D, self.served.model.energy.space.field(self.served.q))


class Server:
    """Serves ``robot`` within ``tolerance`` [m]; untwisted : whether twist may be neglected where it is too small."""

    def __init__(self, robot: Robot, tolerance: float, untwisted: bool) -> None:
        self.robot, self.tolerance, self.untwisted = robot, tolerance, untwisted
        self.goal = tolerance  # for a bound that is at least twice the largest error measured on random scenes
        self._longest_slide = LARGEST_SLIDE * max(tube.length for tube in robot.tubes)
        self._kept: OrderedDict[bytes, Rungs] = OrderedDict()

    def rungs(self, D: Array) -> Rungs:
        key = D.tobytes()
        rungs = self._kept.get(key)
        if rungs is None:
            rungs = self._kept[key] = Rungs(self.robot, D, self.tolerance)
            if len(self._kept) > KEPT:
                self._kept.popitem(last=False)
        return rungs

    def advance(self, last: Position, alpha: Array, D: Array) -> Position | None:
        """The equilibrium at (alpha, D) on the branch of ``last``; None if one step cannot be proven to lead there."""
        rungs = self.rungs(D)
        moved = rungs[0] is not last.trail[0].model
        if moved and not self._near(rungs, last, D):
            return None
        if self._may_be_untwisted(rungs, alpha):
            flat = self._untwisted(rungs, alpha, last.state)
            if flat is not None:
                return flat
        trail: list[Served] = []
        while not trail or (trail[-1].bound > self.goal and len(trail) < len(RAISES)):
            model = rungs[len(trail)]
            z, before = _guess(model, trail, last, alpha)
            served = model.solve(z, before, rungs.slack)
            if served is None or (moved and not trail and not _convex_behind(last.served, served, before)):
                return None
            trail.append(served)
        return Position(alpha, D, trail)

    def settle(self, state: State) -> Position | None:
        """``state``, of any degree, at the degrees of this server; None if no model has a stable equilibrium there."""
        rungs = self.rungs(state.D)
        if self._may_be_untwisted(rungs, state.alpha):
            flat = self._untwisted(rungs, state.alpha, state)
            if flat is not None:
                return flat
        trail: list[Served] = []
        for index in range(len(RAISES)):
            model = rungs[index]
            guess = _converted(model, state)[0]
            served = model.solve(guess.copy(), None, rungs.slack) or model.solve(guess, None, AT_A_FOLD)
            if served is None:
                continue  # so near a fold that this degree does not have the branch
            trail.append(served)
            if served.bound <= self.goal:
                break
        return Position(state.alpha, state.D, trail) if trail else None

    def untwisted_at(self, alpha: Array, D: Array) -> Position | None:
        """The untwisted state; None where it is not stable."""
        rungs = self.rungs(D)
        flat = rungs[0].untwisted(alpha, None, LEAST_SLACK)
        return None if flat is None else Position(alpha, D, [flat], False)

    def _may_be_untwisted(self, rungs: Rungs, alpha: Array) -> bool:
        return self.untwisted and rungs[0].may_be_untwisted(alpha, self.goal)

    def _untwisted(self, rungs: Rungs, alpha: Array, last: State) -> Position | None:
        """The untwisted state, if it is near enough and on the branch of ``last``."""
        flat = rungs[0].untwisted(alpha, _converted(rungs[0], last)[1], rungs.slack)
        if flat is None or flat.bound > self.goal:
            return None
        return Position(alpha, rungs.materials.domain.D, [flat], False)

    def _near(self, rungs: Rungs, last: Position, D: Array) -> bool:
        """True if a step from ``last`` to ``D`` changes no overlap and is short."""
        before = last.served.model.energy.materials.domain
        short = bool(np.abs(D - last.D).max() <= self._longest_slide)
        return short and before.topology == rungs.materials.domain.topology


def _guess(model: ServingModel, trail: list[Served], last: Position, alpha: Array) -> tuple[Array, Array]:
    """Where Newton sets out, along the tangent where there is one; the angles of the state whose branch it keeps."""
    for known in last.trail:
        if known.model is model:
            z = known.z.copy()
            daxpy((alpha - last.alpha).dot(known.answers), z, model.n, -1.0)
            z[model.n : -1] = alpha
            return z, known.angles
    source = trail[-1] if trail else last.served
    z = model.start(model.energy.space.carried(source.q, source.model.energy.space), source.alpha)
    before = model.waves.dot(z)
    z[model.n : -1] = alpha
    return z, before


def _converted(model: ServingModel, state: State) -> tuple[Array, Array]:
    """z and angles of ``model`` for the torques of ``state`` under its own base angles."""
    z = model.start(model.energy.space.coordinates(state.torques), state.alpha)
    return z, model.waves.dot(z)


def _convex_behind(last: Served, served: Served, before: Array) -> bool:
    """True if the energy at the D of ``last``, too, is convex as far as the step went."""
    moved = served.angles - before
    return last.model.convex_around(last.angles, REACH * abs(moved.item(idamax(moved))))
