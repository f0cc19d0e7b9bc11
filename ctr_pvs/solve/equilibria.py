"""Every equilibrium of a command, stable or not: listed completely where only two tubes pull at each other.

With one relative angle the equilibria are the points where the curve of ``tip_curve`` meets the command; none is
missed.  With more, they come from ``multistart``, which proves nothing; the answer says so.

Either way a rule of Morse's theory can tell that some are missing: the energy grows without bound in all directions of
y, so the equilibria with an even number of unstable directions are one more than those with an odd number.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid

from ctr_pvs.answer.engine import Engine
from ctr_pvs.answer.equilibrium import Equilibrium
from ctr_pvs.answer.state import State
from ctr_pvs.answer.status import Status
from ctr_pvs.errors import FieldError
from ctr_pvs.kernel.arrays import S_ESTIMATE
from ctr_pvs.kernel.arrays import S_STEPS
from ctr_pvs.kernel.twist.newton import residual_limit
from ctr_pvs.model.packing import packed_loads
from ctr_pvs.oracles.tip_curve import DEPTH
from ctr_pvs.oracles.tip_curve import PairFold
from ctr_pvs.oracles.tip_curve import TipCurve
from ctr_pvs.oracles.tube_pair import TubePair
from ctr_pvs.oracles.tube_pair import materials_at
from ctr_pvs.oracles.tube_pair import tube_pair
from ctr_pvs.robot.loads import Loads
from ctr_pvs.robot.loads import check_loads
from ctr_pvs.robot.robot import Robot
from ctr_pvs.solve.dense import DenseEnergy
from ctr_pvs.solve.loaded_search import loaded_from
from ctr_pvs.solve.multistart import search

Array = NDArray[np.float64]
#: Unknowns (n,) next to an equilibrium, for an energy of any degree.
Guess: TypeAlias = Callable[[DenseEnergy], Array]

#: An exact equilibrium may lie no farther than this [rad] from its guess ..
ROOM = 0.3
#: .. and no farther than this share of the way to the next guess.
SHARE_OF_GAP = 0.4
NEWTON_STEPS = 12
#: Degrees of the twist rates at which equilibria are made exact, tried in turn; with the first one many starts are
#: tried.
DEGREES = (5, 7, 9, 12, 16, 21)
SEARCH_DEGREE = DEGREES[0]
#: Places of each section at which the twist of a guess is summed up.
SAMPLES = 401


@dataclass(frozen=True, eq=False)
class Equilibria:
    """The equilibria of one command, by energy; unstable ones have a negative ``stability_margin``, the status
    NO_STABLE_EQUILIBRIUM, and a shape and loads like all others.

    complete : True only if the method leaves none out.
    consistent : False if Morse's rule proves that some are missing.
    method : how they were found, and what that guarantees, in one line.
    """

    found: tuple[Equilibrium, ...]
    complete: bool
    consistent: bool
    method: str

    @property
    def stable(self) -> tuple[Equilibrium, ...]:
        return tuple(one for one in self.found if one.success)


def equilibria(
    robot: Robot, alpha: ArrayLike, D: ArrayLike, tolerance: float = 1e-5, *, loads: Loads | None = None
) -> Equilibria:
    """All equilibria at base rotations ``alpha`` (N,) [rad] and base positions ``D`` (N,) [m].

    tolerance : tip error [m] that each may have.  loads : under load, a search for stable ones only, never complete.

    Angles are not wrapped: psi is told against the alpha given, though a robot cannot tell whole turns of a base.

    Raises ``CommandError`` for a command that the robot cannot take, ``FieldError`` for a wrong tolerance.
    """
    if not 1e-10 <= tolerance <= 1.0:
        raise FieldError("tolerance", tolerance, "a length from 1e-10 to 1 m")
    alpha, D = robot.check_command(alpha, D)
    polish = _Polish(Engine(robot, float(tolerance)), alpha, D)
    if loads is not None and not loads.is_none:
        return _under_load(polish, loads)
    return _unloaded(polish)


def _under_load(polish: _Polish, loads: Loads) -> Equilibria:
    robot = polish.engine.robot
    check_loads(robot, polish.D, loads)
    states = [one.state for one in _unloaded(polish).stable]
    packed = packed_loads(robot, polish.D, loads)
    found = loaded_from(polish.engine, states, polish.alpha, polish.D, loads, packed)
    method = f"the loads put on {len(states)} stable unloaded equilibria, in proportion: not guaranteed complete"
    return Equilibria(tuple(found), False, True, method)


def _unloaded(polish: _Polish) -> Equilibria:
    robot, D = polish.engine.robot, polish.D
    materials = materials_at(robot, D)
    if not materials.coupled.any():
        found = polish.exact([lambda energy: np.zeros(energy.n)], np.array([ROOM]))
        return _sorted(found, 1, True, "no two curved tubes overlap, so no tube twists: there is exactly one")
    pair = tube_pair(materials)
    if pair is not None:
        return _of_pair(polish, pair)
    return _of_many(polish)


def tip_curve(robot: Robot, D: ArrayLike) -> TipCurve:
    """The curve of all equilibria at base positions ``D`` (N,) [m].

    Raises ``CommandError`` for a D that the robot cannot take, ``FieldError`` unless exactly two tubes are curved
    where they overlap.
    """
    pair = tube_pair(materials_at(robot, D))
    if pair is None:
        raise FieldError("D", np.asarray(D).tolist(), "base positions where exactly two pre-curved tubes overlap")
    return TipCurve(pair)


def folds(robot: Robot, D: ArrayLike) -> tuple[PairFold, ...]:
    """Where branches of equilibria end at ``D`` (N,) [m], over one period of the tip angle; raises like
    ``tip_curve``."""
    return tip_curve(robot, D).folds


def _of_pair(polish: _Polish, pair: TubePair) -> Equilibria:
    curve = TipCurve(pair)
    tips = curve.tips_at(float(polish.alpha[pair.b] - polish.alpha[pair.a]))
    gaps = np.diff(tips, prepend=-np.inf, append=np.inf)
    room = np.minimum(ROOM, SHARE_OF_GAP * np.minimum(gaps[:-1], gaps[1:]))
    found = polish.exact([_guess(curve, pair, tip, polish.alpha) for tip in tips], room)
    method = (
        "integration from the tip: all equilibria lie on one curve, and every crossing with the command was taken; "
        f"folds between which the curve goes back by less than {DEPTH:g} rad could be missed"
    )
    if not curve.resolved:
        method += "; not complete: the pair is so strong that its curve could not be resolved everywhere"
    return _sorted(found, len(tips), curve.resolved, method)


def _guess(curve: TipCurve, pair: TubePair, tip: float, alpha: Array) -> Guess:
    """The equilibrium with a relative angle ``tip`` [rad] at the far end, for the unknowns of any energy: its torques
    sum up to angles, and those tell what the torques must hold."""
    materials = pair.materials
    boundaries = materials.domain.boundaries

    def unknowns(energy: DenseEnergy) -> Array:
        places = [np.linspace(a, b, SAMPLES) for a, b in itertools.pairwise(boundaries)]
        psi = [
            np.asarray(alpha + materials.guide_compliance * curve.integral.torques(np.array([tip]), np.zeros(1))[0, 0])
        ]
        out = np.empty((len(energy.place), len(alpha)))
        for m, s in enumerate(places):
            torque = curve.integral.torques(np.array([tip]), s[1:-1])[0]
            torque = np.vstack([2.0 * torque[:1] - torque[1:2], torque, 2.0 * torque[-1:] - torque[-2:-1]])
            stiffness = np.where(materials.torsional[m] > 0.0, materials.torsional[m], np.inf)
            turned = psi[-1] + cumulative_trapezoid(torque / stiffness, x=s, axis=0, initial=0)
            inside = (energy.place > s[0]) & (energy.place < s[-1])
            for j in range(len(alpha)):
                out[inside, j] = np.interp(energy.place[inside], s, turned[:, j])
            psi.append(turned[-1])
        return energy.balanced(out)

    return unknowns


def _of_many(polish: _Polish) -> Equilibria:
    energy = polish.energy(SEARCH_DEGREE)
    result = search(energy, polish.alpha)
    found = polish.exact([energy.carrier(y) for y in result.found], np.full(len(result.found), ROOM))
    method = (
        f"search from {result.starts} starts, {result.converged} of which led to an equilibrium, to the rarest "
        f"{min(result.hits, default=0)} of them: not guaranteed complete"
    )
    return _sorted(found, len(result.found), False, method)


def _sorted(found: list[_Found], expected: int, complete: bool, method: str) -> Equilibria:
    consistent = sum((-1) ** one.unstable_directions for one in found) == 1
    if len(found) < expected:
        complete = False
        method += f"; not complete: {expected - len(found)} could not be made exact"
    if not consistent:
        complete = False
        method += "; some are missing or at a fold, as the numbers of their unstable directions prove"
    answers = sorted((one.answer for one in found), key=lambda answer: answer.energy)
    return Equilibria(tuple(answers), complete, consistent, method)


@dataclass(frozen=True, eq=False)
class _Found:
    answer: Equilibrium
    unstable_directions: int


class _Polish:
    """Turns guesses into exact equilibria of the energy at one command, of a degree that meets the tolerance."""

    def __init__(self, engine: Engine, alpha: Array, D: Array) -> None:
        self.engine, self.alpha, self.D = engine, alpha, D
        self._energies: dict[int, DenseEnergy] = {}

    def energy(self, degree: int) -> DenseEnergy:
        if degree not in self._energies:
            self._energies[degree] = DenseEnergy(self.engine, self.D, degree)
        return self._energies[degree]

    def exact(self, guesses: list[Guess], room: Array) -> list[_Found]:
        """The equilibria next to ``guesses``, none farther than ``room`` (m,) [rad]; those that fail are left out."""
        found = [self._one(guess, float(reach)) for guess, reach in zip(guesses, room, strict=True)]
        return [one for one in found if one is not None]

    def _one(self, guess: Guess, room: float) -> _Found | None:
        before, best, spent = None, None, 0
        for degree in DEGREES:
            # Each degree sets out from the guess: that of a lower one may lie beyond a fold which it sees elsewhere.
            energy = self.energy(degree)
            y, steps = stationary(energy, self.alpha, guess(energy), room)
            spent += steps
            if y is None:
                before = None
                continue
            state = energy.state(y, self.alpha)
            tip = state.tip[:3]
            if before is not None:
                vector = state.vector
                vector[S_ESTIMATE], vector[S_STEPS] = np.linalg.norm(tip - before), spent
                state = State(vector, len(self.alpha))
                best = self._told(energy, y, state)
                if state.estimate <= self.engine.tolerance:
                    break
            before = tip
        return best

    def _told(self, energy: DenseEnergy, y: Array, state: State) -> _Found:
        values = energy.eigenvalues(y, self.alpha)
        margin = min(1.0, float(values.min(initial=1.0)))
        status, message = Status.OK, "stable equilibrium"
        if not margin > 0.0:
            status, message = Status.NO_STABLE_EQUILIBRIUM, f"an unstable equilibrium, stability margin {margin:.3g}"
        elif state.estimate > self.engine.tolerance:
            status = Status.TOLERANCE_MISSED
            message = f"tip error about {state.estimate:.1e} m, {self.engine.tolerance:.1e} m were asked for"
        answer = Equilibrium(
            self.engine,
            self.alpha,
            self.D,
            status,
            message,
            "torsion",
            state=state,
            iterations=state.steps,
            margin=margin,
        )
        return _Found(answer, int((values < 0.0).sum()))


def stationary(energy: DenseEnergy, alpha: Array, y: Array, room: float) -> tuple[Array | None, int]:
    """The equilibrium, of any kind, that Newton reaches from ``y`` (n,), and the steps spent.

    None if it does not converge, or leaves ``y`` by more than ``room`` [rad].
    """
    start = y
    if energy.n == 0:
        return y, 0
    for steps in range(NEWTON_STEPS):
        gradient = energy.gradient(y, alpha)
        if energy.twist_size(gradient) <= residual_limit(alpha):
            return y, steps
        try:
            y = y - np.linalg.solve(energy.hessian(y, alpha), gradient)
        except np.linalg.LinAlgError:
            return None, steps
        if not energy.twist_size(y - start) <= room:
            return None, steps
    return None, NEWTON_STEPS
