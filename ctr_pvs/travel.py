"""From one command to the next, through as many snaps as lie between; and how far each actuator may go without one."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.continuation import CommandPath
from ctr_pvs.continuation import PathEnd
from ctr_pvs.continuation import State
from ctr_pvs.continuation import follow
from ctr_pvs.models import Models
from ctr_pvs.snap import Snap
from ctr_pvs.snap import land

Array = NDArray[np.float64]

#: A path with more snaps than this (a rotation by many turns) is given up.
MOST_SNAPS = 100


#: Folds of two journeys closer than this [rad], [m] are one.
SAME_FOLD = 1e-7


class TravelEnd(Enum):
    """How a journey ended; the value is a reason for people."""

    REACHED = "reached"
    TIMEOUT = "out of time"
    NO_LANDING = "no stable equilibrium was found past the fold where the branch ends"
    TOO_MANY_SNAPS = f"more than {MOST_SNAPS} snaps on the path"


@dataclass(frozen=True, eq=False)
class Travelled:
    """Where a journey ended: its last stable state, at the fraction ``t`` of the path, and the snaps on the way."""

    end: TravelEnd
    state: State
    t: float
    snaps: tuple[Snap, ...]
    iterations: int

    def agrees_with(self, other: Travelled) -> bool:
        """True if both snapped at the same places of the path."""
        if len(self.snaps) != len(other.snaps):
            return False
        return all(
            max(np.abs(a.alpha - b.alpha).max(), np.abs(a.D - b.D).max()) < SAME_FOLD
            for a, b in zip(self.snaps, other.snaps, strict=True)
        )


def travel(models: Models, start: State, alpha: Array, D: Array, degree: int, deadline: float) -> Travelled:
    """Go from ``start`` to (alpha, D), (N,) each, along the straight path; at a fold, snap and go on from the
    landing."""
    path = CommandPath(start.alpha, start.D, alpha, D)
    state, t, iterations = start, 0.0, 0
    snaps: list[Snap] = []
    while t < 1.0:
        followed = follow(models, path, state, degree, deadline, t)
        state, t = followed.state, followed.t
        iterations += followed.iterations
        if followed.end is PathEnd.TIMEOUT:
            return Travelled(TravelEnd.TIMEOUT, state, t, tuple(snaps), iterations)
        if followed.end is PathEnd.FOLD:
            if len(snaps) == MOST_SNAPS:
                return Travelled(TravelEnd.TOO_MANY_SNAPS, state, t, tuple(snaps), iterations)
            snap = land(models, path, followed, degree, deadline)
            if snap is None:
                return Travelled(TravelEnd.NO_LANDING, state, t, tuple(snaps), iterations)
            snaps.append(snap)
            state, t = snap.after, snap.t
    return Travelled(TravelEnd.REACHED, state, t, tuple(snaps), iterations)


def distance_to_snap(models: Models, state: State, bounds: tuple[Array, Array], degree: int, deadline: float) -> Array:
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
            followed = follow(models, path, state, degree, deadline)
            if followed.end is PathEnd.FOLD:
                distance[index, side] = followed.t * abs(reach)
            elif followed.end is PathEnd.TIMEOUT:
                distance[index, side] = np.nan
    return distance
