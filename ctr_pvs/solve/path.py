"""From one command to the next along a straight path, or several, through as many snaps as lie between; and how far
each actuator, or the loads, may go without one."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from dataclasses import replace
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.answer.degrees import TIGHT
from ctr_pvs.answer.engine import Engine
from ctr_pvs.answer.state import Snap
from ctr_pvs.answer.state import State
from ctr_pvs.errors import FieldError
from ctr_pvs.kernel.arrays import S_STEPS
from ctr_pvs.kernel.walk.step import LARGEST_SLIDE
from ctr_pvs.kernel.walk.step import LARGEST_TURN
from ctr_pvs.kernel.walk.step import OK
from ctr_pvs.model.packing import POINT_WIDTH
from ctr_pvs.model.packing import line_floats
from ctr_pvs.model.packing import on_common_points
from ctr_pvs.solve.snap import land

Array = NDArray[np.float64]

NO_LOADS = np.empty(0)
#: Least polynomial degrees at which paths are followed, tried in turn.
DEGREES = (3, 5, 7, 9, 12, 16, 21)
#: A path with more snaps than this (a rotation by many turns) is given up.
MOST_SNAPS = 100
#: Folds of two journeys closer than this [rad], [m] are one.
SAME_FOLD = 1e-7
#: A snap that releases less than this share of the next one's energy, nearer to it than this [rad], [m], is its
#: beginning: in a strong pair a kink of the twist drifts along all but flat energy before it leaves.
FAINT, NEAR = 1e-6, 1e-5
#: A step along the path shorter than this fraction of it is none: the branch ends here.
SHORTEST_STEP = 1e-13
#: A state with less margin that cannot be left by a step is at the branch's end: at a fold the margin falls with the
#: square root of what is left, so this is about 1e-10 rad before it.  Loads in a plane of symmetry lose stability where
#: the margin falls in proportion to them.
AT_THE_FOLD, AT_THE_LOADED_FOLD = 1e-5, 1e-6
#: Who is to halt before a fold need not know where it is.
NEAR_A_FOLD = 1e-2
#: Shorter steps than this are a reason to look at the margin.
SHORT_STEP = 1e-3


class CommandPath:
    """The straight line from a command (alpha, D) to another, all (N,), and from packed loads (L,) to others on the
    same points."""

    def __init__(
        self,
        alpha: Array,
        D: Array,
        alpha_end: Array,
        D_end: Array,
        loads: Array = NO_LOADS,
        loads_end: Array = NO_LOADS,
    ) -> None:
        self.begin, self.end = np.concatenate([alpha, D, loads]), np.concatenate([alpha_end, D_end, loads_end])
        self.rate = self.end - self.begin
        self.tubes = len(alpha)
        self.alpha_rate, self.D_rate = np.split(self.rate[: 2 * self.tubes], 2)

    def command(self, t: float) -> Array:
        """alpha, D and packed loads (2 N + L,) at the fraction ``t``; the ends are exact."""
        return self.end.copy() if t == 1.0 else np.asarray(self.begin + t * self.rate)

    def at(self, t: float) -> tuple[Array, Array]:
        """The command at the fraction ``t``; the ends are exact."""
        alpha, D = np.split(self.command(t)[: 2 * self.tubes], 2)
        return alpha.copy(), D.copy()


@dataclass(frozen=True, eq=False)
class Leg:
    """A straight part of a journey, and the fractions of the whole at which it begins and ends."""

    path: CommandPath
    begin: float = 0.0
    end: float = 1.0

    def fraction(self, t: float) -> float:
        """Of the whole, at the fraction ``t`` of this part."""
        return self.begin + t * (self.end - self.begin)


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
            len(a.command) == len(b.command) and np.abs(a.command - b.command).max() < SAME_FOLD
            for a, b in zip(self.snaps, other.snaps, strict=True)
        )


def follow(
    engine: Engine, path: CommandPath, start: State, degree: int, deadline: float, begin: float = 0.0,
    halts: bool = False,
) -> Followed:  # fmt: skip
    """Follow the equilibrium along ``path`` from ``start``, which is its state at the fraction ``begin``, to the end or
    to the first fold.

    A step is taken only if a check says that it keeps its branch; otherwise it is halved.  Where steps vanish, or the
    margin has, the stable branch has ended.  degree : the least; deadline : a ``time.monotonic()`` value.
    """
    N, t, vector, iterations = path.tubes, begin, start.vector, 0
    longest = longest_step(engine, path)
    length, failed = min(1.0, LARGEST_TURN / max(float(np.ptp(path.alpha_rate)), 1e-300)), False
    end, lost = PathEnd.REACHED, AT_THE_LOADED_FOLD if len(path.end) > 2 * N else AT_THE_FOLD
    lost = NEAR_A_FOLD if halts else lost
    while t < 1.0:
        if time.monotonic() > deadline:
            end = PathEnd.TIMEOUT
            break
        length = min(length, longest, 1.0 - t)
        target = 1.0 if length >= 1.0 - t else t + length
        command = path.command(target)
        code, ahead = engine.step(
            vector, command[:N], command[N : 2 * N], command[2 * N :], floor=degree, slack=TIGHT, tip=False
        )
        if code == OK:
            t, vector = target, ahead
            iterations += int(ahead[S_STEPS])
            if not failed:  # else the end of the branch may be near, and twice the step was too long
                length *= 2.0
            failed = False
            continue
        length *= 0.5
        failed = True
        if length < SHORTEST_STEP or (length < SHORT_STEP and engine.margin(vector) < lost):
            end = PathEnd.FOLD
            break
    return Followed(end, State(vector, N), t, (), iterations)


def longest_step(engine: Engine, path: CommandPath) -> float:
    """The longest step that may be worth a try, as a fraction of ``path``, for how far tubes may slide in one."""
    slide = float(np.abs(path.D_rate).max())
    return LARGEST_SLIDE * max(tube.length for tube in engine.robot.tubes) / max(slide, 1e-300)


def travel(
    engine: Engine, start: State, legs: Sequence[Leg], degree: int, deadline: float, halts: bool = False
) -> Followed:
    """Go from ``start`` along ``legs``; at a fold, snap and go on from the landing, or end there if it ``halts``."""
    state, iterations, t = start, 0, 0.0
    snaps: list[Snap] = []
    for leg in legs:
        t = 0.0
        while True:
            followed = follow(engine, leg.path, state, degree, deadline, t, halts)
            state, t, end = followed.state, followed.t, followed.end
            iterations += followed.iterations
            if end is not PathEnd.FOLD or halts:
                break
            if len(snaps) == MOST_SNAPS:
                end = PathEnd.TOO_MANY_SNAPS
                break
            landed = land(engine, leg.path.command, state, t, degree, deadline)
            if not isinstance(landed, Snap):
                end = PathEnd.TIMEOUT if landed else PathEnd.NO_LANDING
                break
            state, t = landed.after, landed.t
            snaps = joined(snaps, replace(landed, t=leg.fraction(landed.t)))
        if end is not PathEnd.REACHED:
            break
    return Followed(end, state, leg.fraction(t), tuple(snaps), iterations)


def joined(snaps: list[Snap], last: Snap) -> list[Snap]:
    """``snaps`` and ``last``, with what was only its beginning made part of it."""
    snaps = snaps.copy()
    while snaps:
        faint = snaps[-1]
        same = len(last.command) == len(faint.command) and np.abs(last.command - faint.command).max() <= NEAR
        if not same or not faint.energy_released <= FAINT * last.energy_released:
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
            alpha, D = np.split(target, 2)
            path = CommandPath(state.alpha, state.D, alpha, D, state.loads, state.loads)
            followed = follow(engine, path, state, DEGREES[2], deadline)
            if followed.end is PathEnd.FOLD:
                distance[index, side] = followed.t * abs(reach)
            elif followed.end is PathEnd.TIMEOUT:
                distance[index, side] = np.nan
    return distance


def load_to_snap(engine: Engine, state: State, loads: Array, most: float, deadline: float) -> float:
    """How many times the packed ``loads``, up to ``most``, can act beside those of ``state`` before the branch ends:
    infinite if it does not; NaN where time ran out."""
    before, more = on_common_points(engine.robot, state.loads, loads)
    kept = np.ones(len(more), dtype=bool)  # what is added up; tubes and abscissae of the points are not
    for start in range(line_floats(engine.robot), len(more), POINT_WIDTH):
        kept[start : start + 2] = False
    after = np.where(kept, before + most * more, before)
    path = CommandPath(state.alpha, state.D, state.alpha, state.D, before, after)
    followed = follow(engine, path, state, DEGREES[2], deadline)
    if followed.end is PathEnd.FOLD:
        return followed.t * most
    return np.nan if followed.end is PathEnd.TIMEOUT else np.inf


def deadline_of(budget: float | None) -> float:
    """``time.monotonic()`` value after which to give up."""
    if budget is not None and not budget > 0.0:
        raise FieldError("budget", budget, "seconds above 0, or None")
    return np.inf if budget is None else time.monotonic() + budget
