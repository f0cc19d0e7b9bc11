"""A journey made as finely as it takes: at the lowest degrees that keep the branch up to the converged model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.answer.degrees import settled
from ctr_pvs.answer.engine import Engine
from ctr_pvs.answer.state import Snap
from ctr_pvs.answer.state import State
from ctr_pvs.answer.status import Status
from ctr_pvs.kernel.walk.step import OK
from ctr_pvs.model.packing import has_moments
from ctr_pvs.robot.loads import Loads
from ctr_pvs.solve.path import DEGREES
from ctr_pvs.solve.path import Followed
from ctr_pvs.solve.path import Leg
from ctr_pvs.solve.path import PathEnd
from ctr_pvs.solve.path import travel

Array = NDArray[np.float64]

#: With less margin than this an answer is at the edge of a fold: its path is looked at more closely.
DELICATE = 0.1
#: Index of the degree at which a delicate journey is believed even if it does not agree with the one before.
MOST_REPEATS = 4

_STATUS = {
    PathEnd.FOLD: Status.NO_STABLE_EQUILIBRIUM,
    PathEnd.TIMEOUT: Status.TIMEOUT,
    PathEnd.NO_LANDING: Status.NO_STABLE_EQUILIBRIUM,
    PathEnd.TOO_MANY_SNAPS: Status.NOT_CONVERGED,
}


class Command(NamedTuple):
    """What was asked for: alpha (N,) [rad], D (N,) [m], and what acts."""

    alpha: Array
    D: Array
    loads: Loads | None


@dataclass(frozen=True, eq=False)
class Arrival:
    """The state at the end of a journey, on the degrees that the tolerance asks for, and the snaps on the way; or why
    there is none."""

    state: State | None
    snaps: tuple[Snap, ...]
    iterations: int
    status: Status = Status.OK
    message: str = ""


def arrive(
    engine: Engine, origin: State, legs: Sequence[Leg], packed: Array, untwisted: bool, deadline: float,
    halts: bool = False,
) -> Arrival:  # fmt: skip
    """Travel from ``origin`` along ``legs`` at the lowest degree that keeps the branch up to the converged model, then
    settle under ``packed`` loads on the degrees that the tolerance asks for.

    Folds lie a little elsewhere at a low degree.  A journey through one, or to the edge of one, is therefore made again
    at the next degree, until two agree; one that ``halts`` ends at the first fold of any degree.
    """
    iterations, before, walked = 0, None, 0.0
    for index, degree in enumerate(DEGREES[:-1]):
        if index < MOST_REPEATS and degree <= walked:
            continue  # the tolerance has asked for more already: the same journey would agree with itself
        journey = travel(engine, origin, legs, degree, deadline, halts)
        walked = engine.elements(journey.state.vector)[:, 3].max(initial=0.0)
        iterations += journey.iterations
        if journey.end is PathEnd.NO_LANDING and index < len(DEGREES) - 2 and not has_moments(engine.robot, packed):
            continue  # a state at the edge of a fold may lie beyond the fold of a lower degree
        if journey.end is not PathEnd.REACHED:
            return Arrival(None, (), iterations, _STATUS[journey.end], stopped(journey))
        code, vector = settled(engine, journey.state.vector, packed, untwisted)
        if code != OK:
            continue
        delicate = bool(journey.snaps) or engine.margin(vector) < DELICATE
        if not delicate or index == MOST_REPEATS or (before is not None and journey.agrees_with(before)):
            return Arrival(State(vector, engine.robot.n_tubes), journey.snaps, iterations)
        before = journey
    message = "the refined model lost the branch that the coarse one followed: a fold is very near this command"
    return Arrival(None, (), iterations, Status.NOT_CONVERGED, message)


def stopped(journey: Followed) -> str:
    """Where a journey ended and why."""
    place = _place(journey.state.alpha, journey.state.D)
    return f"{journey.end.value}: stopped at {journey.t:.6g} of the path, {place}"


def snapped(snaps: tuple[Snap, ...]) -> str:
    """What happened on the way; ``Equilibrium.snaps`` has the states."""
    last = snaps[-1]
    many = "snapped" if len(snaps) == 1 else f"snapped {len(snaps)} times, the last time"
    released = sum(snap.energy_released for snap in snaps)
    energy = "" if np.isnan(released) else f", releasing {released:.3g} J in all"
    return (
        f"{many} at {last.t:.6g} of the path, {_place(last.alpha, last.D)}{energy}; "
        "the landing is a prediction, real snaps are dynamic"
    )


def _place(alpha: Array, D: Array) -> str:
    angles = ", ".join(f"{angle:.6g}" for angle in alpha)
    lengths = ", ".join(f"{length:.6g}" for length in D)
    return f"alpha = [{angles}] rad, D = [{lengths}] m"
