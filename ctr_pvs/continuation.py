"""Following the stable equilibrium along a straight command path.

Each step predicts along the tangent (``sensitivity``) and corrects by Newton.  A step is taken only if Newton
contracts from the prediction to a stable equilibrium close to it; otherwise it is halved.  Where steps vanish, the
stable branch has ended: a fold.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.models import Models
from ctr_pvs.sensitivity import Sensitivity
from ctr_pvs.solve import newton
from ctr_pvs.twist import TorqueField

Array = NDArray[np.float64]

#: Largest predicted change [rad] of the angle between two tubes in one step.
LARGEST_TURN = 0.6
#: Largest first Newton step [rad] after the prediction: the tangent must have been about right.
LARGEST_CORRECTION = 0.1
#: A step along the path shorter than this fraction of it is none.
SHORTEST_STEP = 1e-10


@dataclass(frozen=True, eq=False)
class State:
    """A stable equilibrium: alpha (N,) [rad], D (N,) [m] and the torque field there."""

    alpha: Array
    D: Array
    torques: TorqueField


class PathEnd(Enum):
    """How following a path ended."""

    REACHED = "reached"
    FOLD = "fold"
    TIMEOUT = "timeout"


@dataclass(frozen=True, eq=False)
class Followed:
    """The last stable state on the path, at the fraction ``t`` of it, and the Newton iterations spent."""

    end: PathEnd
    state: State
    t: float
    iterations: int


def follow(models: Models, start: State, alpha: Array, D: Array, degree: int, deadline: float) -> Followed:
    """Follow the equilibrium from ``start`` to (alpha, D), all (N,), along the straight line between the commands.

    ``deadline`` is a ``time.monotonic()`` value; twist rates have polynomial ``degree``.
    """
    path = _Path(start, alpha, D)
    state, t, iterations, step = start, 0.0, 0, 1.0
    while t < 1.0:
        torques, rate, speed = _tangent(models, state, path, degree)
        step = min(step, 1.0 - t, LARGEST_TURN / max(speed, 1e-300))
        reached = None
        while reached is None:
            if time.monotonic() > deadline:
                return Followed(PathEnd.TIMEOUT, state, t, iterations)
            target = 1.0 if step >= 1.0 - t else t + step
            reached, spent = _step(models, path, target, torques.moved(rate, target - t), degree)
            iterations += spent
            if reached is None:
                step *= 0.5
                if step < SHORTEST_STEP:
                    return Followed(PathEnd.FOLD, state, t, iterations)
        state, t, step = reached, target, 2.0 * step
    return Followed(PathEnd.REACHED, state, 1.0, iterations)


class _Path:
    """The straight line from a state's command to (alpha, D)."""

    def __init__(self, start: State, alpha: Array, D: Array) -> None:
        self.start = start
        self.end = alpha, D
        self.alpha_rate, self.D_rate = alpha - start.alpha, D - start.D

    def at(self, t: float) -> tuple[Array, Array]:
        if t == 1.0:
            return self.end
        return self.start.alpha + t * self.alpha_rate, self.start.D + t * self.D_rate


def _tangent(models: Models, state: State, path: _Path, degree: int) -> tuple[TorqueField, TorqueField, float]:
    """The torque field at this degree, its rate along the path, and how fast [rad] tubes turn against each other."""
    energy = models.energy(state.D, degree)
    q = energy.space.coordinates(state.torques)
    rates = Sensitivity(energy, state.alpha, q, path.alpha_rate[:, None], path.D_rate[:, None])
    turning = energy.angle_map @ rates.q_rate[:, 0] + path.alpha_rate
    speed = float(np.ptp(turning, axis=1).max(initial=0.0)) if turning.size else 0.0
    return rates.torques, rates.field_rate(), speed


def _step(models: Models, path: _Path, t: float, guess: TorqueField, degree: int) -> tuple[State | None, int]:
    """The stable equilibrium at ``t`` next to ``guess``, or None; and the Newton iterations spent."""
    alpha, D = path.at(t)
    energy = models.energy(D, degree)
    result = newton(energy, alpha, energy.space.coordinates(guess))
    if not result.converged or result.first_step > LARGEST_CORRECTION:
        return None, result.iterations
    return State(alpha, D, energy.space.field(result.q)), result.iterations
