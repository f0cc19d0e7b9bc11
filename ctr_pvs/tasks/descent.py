"""Down to the aim in damped least-squares steps, each of them followed: none snaps, none leaves the bounds."""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.answer.equilibrium import Equilibrium
from ctr_pvs.tasks.aim import Aim
from ctr_pvs.tasks.bounds import Bounds
from ctr_pvs.tasks.walk import Refusal
from ctr_pvs.tasks.walk import Walker

Array = NDArray[np.float64]

#: Damping is this times the squared distance from the aim, [m^2] as J^T J: steps are no longer than half its inverse
#: root, and it vanishes at the target.  Steps that do as foretold divide it, others multiply it.
DAMPING, LEAST_DAMPING, EASED, RAISED = 0.02, 1e-6, 4.0, 5.0
#: Damping beside it, as a share of J^T J: what no target needs stays where it is.
RIDGE = 1e-9
#: The longest step, in units of ``Bounds.scaled``, and what is left of one that was refused.
LONGEST, SHORTENED = 1.0, 0.3
#: Tries to shorten a step that is refused or leads no nearer.
TRIES = 9
#: What keeps a step to a kink, as a share of J^T J.
STIFF = 1e4
#: A step that is to bring the tip nearer by less than this share, squared, is none.
LEVEL = 1e-9
#: What is free beside the aim goes from bounds and from strain: how far in a step, the margin below which strain
#: counts, and the distance from the aim [m] up to which there is no more of it.
INWARD, RELAXING, STRAINED, LAST = 0.004, 0.2, 0.5, 1e-3


class Patience(NamedTuple):
    """A descent is over after so many steps that each bring less than this share of the squared distance; whether it
    tries to slide along kinks where no other way is downhill."""

    share: float
    steps: int
    slides: bool


#: To the closest point; to see whether there is much to hope for.
PATIENT, HASTY = Patience(1e-4, 4, True), Patience(5e-2, 3, False)


class End(Enum):
    """How a descent ended."""

    MET = "the target is met"
    LEVEL = "no way is downhill"
    REFUSED = "every step on is refused"
    STEPS = "out of steps"
    TIMEOUT = "out of time"


class Descent(NamedTuple):
    """Where a descent ended, the last reason why a step was refused, the squared distance left [m^2] and its gradient
    (2 N,) in units of ``Bounds.scaled``."""

    walker: Walker
    end: End
    refusal: Refusal | None
    left: float
    gradient: Array
    iterations: int


def descend(walker: Walker, aim: Aim, bounds: Bounds, steps: int, patience: Patience = PATIENT) -> Descent:
    """Moves ``walker`` towards the aim in about ``steps`` steps at most."""
    way = _Way(walker, aim, bounds, patience.slides)
    slow = 0
    while True:
        before = way.left
        end = way.advance()
        if end is None:
            slow = slow + 1 if way.left > (1.0 - patience.share) * before else 0
            if slow == patience.steps and not aim.met(walker.answer):
                end = End.LEVEL
            elif way.tried >= steps and not aim.met(walker.answer):
                end = End.STEPS
        if end is not None:
            return Descent(walker, end, way.refusal, way.left, way.gradient, way.tried)


class _Way:
    """A descent on its way: the residual where the walker stands, its square ``left`` [m^2], its gradient (2 N,), what
    was refused last, how many steps were ``tried``, the damping and the longest step to try."""

    def __init__(self, walker: Walker, aim: Aim, bounds: Bounds, slides: bool) -> None:
        self._walker, self._aim, self._bounds, self._slides = walker, aim, bounds, slides
        self._damping, self._longest = DAMPING, LONGEST
        self._residual = aim.residual(walker.answer)
        self.left = float(self._residual @ self._residual)
        self.gradient = np.zeros(2 * bounds.tubes)
        self.refusal: Refusal | None = None
        self.tried = 0
        self._kink: int | None = None

    def advance(self) -> End | None:
        """A step that leads nearer; else why there is none."""
        answer = self._walker.answer
        if self._aim.met(answer):
            return End.MET
        rates = self._aim.jacobian(answer) * self._bounds.scale
        self.gradient, square = rates.T @ self._residual, rates.T @ rates
        free = _preferred(self._walker, self._bounds, self.left)
        x = self._bounds.scaled(answer.alpha, answer.D)
        ends = []
        for kink in self._ways(x):
            ends.append(self._down(x, square, free, kink))
            if ends[-1] not in (End.LEVEL, End.REFUSED):
                self._kink = kink
                return ends[-1]
            self._damping = min(self._damping, DAMPING)
        return ends[0]

    def _ways(self, x: Array) -> list[int | None]:
        """What to try from x, one after the other: as the last step was taken, freely, and along the kinks near by."""
        near = self._bounds.kinks.near(x) if self._slides else []
        return list(dict.fromkeys([self._kink, None, *near]))

    def _down(self, x: Array, square: Array, free: Array, kink: int | None) -> End | None:
        """A step that leads nearer, one that keeps to a ``kink`` if one is named; else why there is none."""
        answer = self._walker.answer
        for _ in range(TRIES):
            d = self._step(x, square, free, kink)
            foretold = -float(d @ (2.0 * self.gradient + square @ d))
            if foretold <= LEVEL * self.left:
                return End.LEVEL
            self.tried += 1
            refusal = self._walker.go(*self._bounds.command(x + d))
            if refusal is Refusal.TIMEOUT:
                return End.TIMEOUT
            if refusal is not None:
                self.refusal, self._longest = refusal, SHORTENED * float(np.abs(d).max())
            elif self._nearer(foretold):
                return None
            else:
                self._walker.back_to(answer)
                self._damping *= RAISED
        return End.REFUSED if self.refusal is not None else End.LEVEL

    def _step(self, x: Array, square: Array, free: Array, kink: int | None) -> Array:
        """(2 N,) the damped step from x, J^T J being ``square``; ``free`` is where damping pulls it to, and a ``kink``
        where it ends."""
        damping = self._damping * self.left + RIDGE * float(np.trace(square))
        held, gradient, kinks = square + damping * np.eye(len(x)), self.gradient - damping * free, self._bounds.kinks
        if kink is not None:
            row = STIFF * float(np.trace(square)) * kinks.rows[kink]
            held, gradient = held + np.outer(row, kinks.rows[kink]), gradient + row * kinks.off(x, kink)
        d = self._bounds.step(x, held, gradient)
        d = d * min(1.0, self._longest / max(float(np.abs(d).max()), 1e-300))
        return np.asarray(d if kink is None else kinks.onto(x + d, kink) - x)

    def _nearer(self, foretold: float) -> bool:
        """Whether the step taken leads nearer: then it is kept, and the next one may be longer if this one did as
        ``foretold`` [m^2]."""
        residual = self._aim.residual(self._walker.answer)
        left = float(residual @ residual)
        gain = self.left - left
        if not gain > 0.0:
            return False
        if gain > 0.5 * foretold:
            self._damping = max(self._damping / EASED, LEAST_DAMPING)
        elif gain < 0.2 * foretold:
            self._damping *= RAISED
        self._longest = min(2.0 * self._longest, LONGEST)
        self._residual, self.left = residual, left
        return True


def _preferred(walker: Walker, bounds: Bounds, left: float) -> Array:
    """(2 N,) where to go with what the aim leaves free: from bounds that are near, and, where the margin is small,
    down the elastic energy."""
    answer = walker.answer
    wish = INWARD * bounds.inward(bounds.scaled(answer.alpha, answer.D))
    margin = walker.way[-1].margin
    if margin < STRAINED:
        downhill = -np.concatenate([answer.torque, answer.force]) * bounds.scale
        size = float(np.linalg.norm(downhill))
        wish = wish + RELAXING * (1.0 - margin / STRAINED) * downhill / max(size, 1e-300)
    return np.asarray(wish * min(1.0, np.sqrt(left) / LAST))


def turned_to_aim(walker: Walker, aim: Aim, bounds: Bounds) -> None:
    """Without loads, all tubes turned together bring the tip into the target's half plane, and strain nothing."""
    if walker.loads is not None and not walker.loads.is_none:
        return
    answer: Equilibrium = walker.answer
    turn = bounds.turn_within(answer.alpha, float(aim.turn_from(answer.tip.position)))
    if abs(turn) > 1e-3:
        walker.go(*bounds.clamped(answer.alpha + turn, answer.D))
