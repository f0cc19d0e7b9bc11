"""Following the stable equilibrium along a straight command path, through folds where it has to.

Each step predicts along the tangent (``sensitivity``) and corrects by Newton.  A step is taken only if the energy is
convex on a box that holds the old state and the new one (``convexity``): then both are on one branch.  Otherwise it
is halved. Where steps vanish, the stable branch has ended, and the robot snaps (``snap``).
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError

from ctr_pvs.convexity import convex_between
from ctr_pvs.energy import TorsionEnergy
from ctr_pvs.models import Models
from ctr_pvs.sensitivity import Sensitivity
from ctr_pvs.serving import LARGEST_TURN
from ctr_pvs.shape import TorsionShape
from ctr_pvs.solve import newton
from ctr_pvs.stability import stability_margin
from ctr_pvs.twist import TorqueField

Array = NDArray[np.float64]

#: Polynomial degrees of the twist rates at which paths are followed, tried in turn.
DEGREES = (5, 7, 9, 12, 16, 21, 28)
#: A step along the path shorter than this fraction of it is none: the branch ends here.
SHORTEST_STEP = 1e-13
#: A state with less margin that cannot be left by a step is at the branch's end: at a fold the margin falls with the
#: square root of what is left, so this is about 1e-10 rad before it.
AT_THE_FOLD = 1e-5
#: Largest slide in one step, as a share of the longest tube: the tubes could couple more in between than at either end.
LARGEST_SLIDE = 0.05


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


class CommandPath:
    """The straight line from a command (alpha, D) to another, all (N,)."""

    def __init__(self, alpha: Array, D: Array, alpha_end: Array, D_end: Array) -> None:
        self.begin, self.end = (alpha, D), (alpha_end, D_end)
        self.alpha_rate, self.D_rate = alpha_end - alpha, D_end - D

    def at(self, t: float) -> tuple[Array, Array]:
        """The command at the fraction ``t``; the ends are exact."""
        if t == 1.0:
            return self.end
        return self.begin[0] + t * self.alpha_rate, self.begin[1] + t * self.D_rate


def follow(
    models: Models, path: CommandPath, start: State, degree: int, deadline: float, begin: float = 0.0
) -> Followed:
    """Follow the equilibrium along ``path`` from ``start``, which is its state at the fraction ``begin``.

    degree : of the twist rates; deadline : a ``time.monotonic()`` value.
    """
    state, t, iterations, step = start, begin, 0, 1.0
    slide = float(np.abs(path.D_rate).max())
    longest = LARGEST_SLIDE * max(tube.length for tube in models.robot.tubes) / max(slide, 1e-300)
    while t < 1.0:
        torques, rate, speed = _tangent(models, state, path, degree)
        step = min(step, 1.0 - t, longest, LARGEST_TURN / max(speed, 1e-300))
        reached = None
        while reached is None:
            if time.monotonic() > deadline:
                return Followed(PathEnd.TIMEOUT, state, t, iterations)
            target = 1.0 if step >= 1.0 - t else t + step
            reached, spent = _step(models, path, target, state, torques.moved(rate, target - t), degree)
            iterations += spent
            step = 2.0 * step if reached is not None else 0.5 * step
            if reached is None and (step < SHORTEST_STEP or _softest(models, state, degree) < AT_THE_FOLD):
                return Followed(PathEnd.FOLD, state, t, iterations)
        state, t = reached, target
    return Followed(PathEnd.REACHED, state, 1.0, iterations)


def _tangent(models: Models, state: State, path: CommandPath, degree: int) -> tuple[TorqueField, TorqueField, float]:
    """The torque field at this degree, its rate along the path, and how fast [rad] tubes turn against each other."""
    energy = models.energy(state.D, degree)
    q = energy.space.coordinates(state.torques)
    directions = path.alpha_rate[:, None], path.D_rate[:, None]
    try:
        rates = Sensitivity(energy, state.alpha, q, *directions)
    except LinAlgError:  # cut down to this degree the state is just past its fold: set out without a tangent
        rates = Sensitivity(energy, state.alpha, q, *directions, twists=False)
    turning = energy.angle_map @ rates.q_rate[:, 0] + path.alpha_rate
    speed = float(np.ptp(turning, axis=1).max(initial=0.0)) if turning.size else 0.0
    return rates.torques, rates.field_rate(), speed


def _softest(models: Models, state: State, degree: int) -> float:
    """Stability margin of ``state`` at this degree."""
    energy = models.energy(state.D, degree)
    return stability_margin(energy, energy.space.coordinates(state.torques), state.alpha)


def _step(
    models: Models, path: CommandPath, t: float, state: State, guess: TorqueField, degree: int
) -> tuple[State | None, int]:
    """The equilibrium at ``t`` on the branch of ``state``, found from ``guess``, or None; and the iterations spent."""
    alpha, D = path.at(t)
    energy = models.energy(D, degree)
    result = newton(energy, alpha, energy.space.coordinates(guess))
    if not result.converged:
        return None, result.iterations
    reached = State(alpha, D, energy.space.field(result.q))
    bases = [D] if np.array_equal(D, state.D) else [D, state.D]
    if not all(_convex_between(models, state, reached, base, degree) for base in bases):
        return None, result.iterations
    return reached, result.iterations


def _convex_between(models: Models, state: State, other: State, D: Array, degree: int) -> bool:
    """True if the energy at ``D`` is certainly convex around the twist angles of both states."""
    energy = models.energy(D, degree)
    angles = [_angles(models, which, energy) for which in (state, other)]
    return convex_between(models.pairs(energy), *angles)


def _angles(models: Models, state: State, energy: TorsionEnergy) -> Array:
    """psi (G, N) [rad] of ``state`` at the nodes of ``energy``: at equal x in equal sections, else at equal s."""
    own = models.energy(state.D, energy.space.degree)
    q = own.space.coordinates(state.torques)
    if own.space.layout == energy.space.layout:
        return own.angles(q, state.alpha)
    shape = TorsionShape(own.space, state.alpha, q)
    if own.materials.domain.topology == energy.materials.domain.topology:  # only the panels differ
        return np.concatenate([shape.angle(node.section, node.rule.x) for node in energy.nodes])
    if not own.materials.domain.n_sections:
        return np.repeat(shape.angle_at_boundaries, len(energy.coupling), axis=0)
    s = np.concatenate([np.zeros(0), *(node.s for node in energy.nodes)])
    return shape.angles_held(np.minimum(s, own.materials.domain.length))
