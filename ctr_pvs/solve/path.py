"""From one command to the next along the straight path, through as many snaps as lie between; and how far each actuator
may go without one."""

from __future__ import annotations

import time
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.answer.engine import Engine
from ctr_pvs.answer.state import Snap
from ctr_pvs.answer.state import State
from ctr_pvs.kernel.walk.step import FOLD
from ctr_pvs.kernel.walk.step import LARGEST_TURN
from ctr_pvs.kernel.walk.step import MORE
from ctr_pvs.solve.snap import land

Array = NDArray[np.float64]

#: Least polynomial degrees at which paths are followed, tried in turn.
DEGREES = (3, 5, 7, 9, 12, 16, 21)
#: A path with more snaps than this (a rotation by many turns) is given up.
MOST_SNAPS = 100
#: Folds of two journeys closer than this [rad], [m] are one.
SAME_FOLD = 1e-7
#: A snap that releases less than this share of the next one's energy, nearer to it than this [rad], [m], is its
#: beginning: in a strong pair a kink of the twist drifts along all but flat energy before it leaves.
FAINT, NEAR = 1e-6, 1e-5
#: Tries of a step between two looks at the clock.
TRIES = 20


class CommandPath:
    """The straight line from a command (alpha, D) to another, all (N,)."""

    def __init__(self, alpha: Array, D: Array, alpha_end: Array, D_end: Array) -> None:
        self.begin, self.end = np.concatenate([alpha, D]), np.concatenate([alpha_end, D_end])
        self.rate = self.end - self.begin
        self.alpha_rate, self.D_rate = np.split(self.rate, 2)

    def at(self, t: float) -> tuple[Array, Array]:
        """The command at the fraction ``t``; the ends are exact."""
        alpha, D = np.split(self.end if t == 1.0 else self.begin + t * self.rate, 2)
        return alpha.copy(), D.copy()


class PathEnd(Enum):
    """How following a path ended; the value is a reason for people."""

    REACHED = "reached"
    FOLD = "the stable branch ends"
    TIMEOUT = "out of time"
    NO_LANDING = "no stable equilibrium was found past the fold where the branch ends"
    TOO_MANY_SNAPS = f"more than {MOST_SNAPS} snaps on the path"


@dataclass(frozen=True, eq=False)
class Followed:
    """The last stable state on a path, at the fraction ``t`` of it, the snaps on the way, and the Newton steps
    spent."""

    end: PathEnd
    state: State
    t: float
    snaps: tuple[Snap, ...]
    iterations: int

    def agrees_with(self, other: Followed) -> bool:
        """True if both snapped at the same places of the path."""
        if len(self.snaps) != len(other.snaps):
            return False
        return all(
            max(np.abs(a.alpha - b.alpha).max(), np.abs(a.D - b.D).max()) < SAME_FOLD
            for a, b in zip(self.snaps, other.snaps, strict=True)
        )


def follow(
    engine: Engine, path: CommandPath, start: State, degree: int, deadline: float, begin: float = 0.0
) -> Followed:
    """Follow the equilibrium along ``path`` from ``start``, which is its state at the fraction ``begin``, to the end or
    to the first fold.

    degree : the least; deadline : a ``time.monotonic()`` value.
    """
    turn = float(np.ptp(path.alpha_rate))
    clock = np.array([begin, min(1.0, LARGEST_TURN / max(turn, 1e-300)), 0.0])
    code, vector = MORE, start.vector
    while code == MORE and time.monotonic() <= deadline:
        code, vector = engine.follow(path.begin, path.end, clock, degree, TRIES, vector)
    end = {FOLD: PathEnd.FOLD, MORE: PathEnd.TIMEOUT}.get(code, PathEnd.REACHED)
    return Followed(end, State(vector, engine.robot.n_tubes), float(clock[0]), (), int(clock[2]))


def travel(engine: Engine, start: State, alpha: Array, D: Array, degree: int, deadline: float) -> Followed:
    """Go from ``start`` to (alpha, D), (N,) each, along the straight path; at a fold, snap and go on from the
    landing."""
    path = CommandPath(start.alpha, start.D, alpha, D)
    state, t, iterations = start, 0.0, 0
    snaps: list[Snap] = []
    while True:
        followed = follow(engine, path, state, degree, deadline, t)
        state, t, end = followed.state, followed.t, followed.end
        iterations += followed.iterations
        if end is PathEnd.FOLD:
            if len(snaps) == MOST_SNAPS:
                end = PathEnd.TOO_MANY_SNAPS
            else:
                landed = land(engine, path.at, state, t, degree, deadline)
                if isinstance(landed, Snap):
                    snaps = joined(snaps, landed)
                    state, t = landed.after, landed.t
                    continue
                end = PathEnd.TIMEOUT if landed else PathEnd.NO_LANDING
        return Followed(end, state, t, tuple(snaps), iterations)


def joined(snaps: list[Snap], last: Snap) -> list[Snap]:
    """``snaps`` and ``last``, with what was only its beginning made part of it."""
    snaps = snaps.copy()
    while snaps:
        faint = snaps[-1]
        moved = max(np.abs(last.alpha - faint.alpha).max(), np.abs(last.D - faint.D).max())
        if moved > NEAR or faint.energy_released > FAINT * last.energy_released:
            break
        released = faint.energy_released + last.energy_released
        last = Snap(faint.t, faint.alpha, faint.D, faint.before, last.after, released)
        snaps.pop()
    return [*snaps, last]


def distance_to_snap(engine: Engine, state: State, bounds: tuple[Array, Array], deadline: float) -> Array:
    """(2 N, 2) how far each of alpha_1 .. alpha_N [rad], D_1 .. D_N [m] can go towards - and + before the branch ends.

    bounds : least and largest command (2 N,) to look at; infinite where no snap lies before its bound.  An actuator
    that has no way left to its bound has NaN where time ran out before an answer, infinity otherwise.
    """
    command = np.concatenate([state.alpha, state.D])
    distance = np.full((len(command), 2), np.inf)
    for index in range(len(command)):
        for side, bound in enumerate(bounds):
            reach = bound[index] - command[index]
            if reach == 0.0:
                continue
            target = command.copy()
            target[index] = bound[index]
            path = CommandPath(state.alpha, state.D, *np.split(target, 2))
            followed = follow(engine, path, state, DEGREES[2], deadline)
            if followed.end is PathEnd.FOLD:
                distance[index, side] = followed.t * abs(reach)
            elif followed.end is PathEnd.TIMEOUT:
                distance[index, side] = np.nan
    return distance
