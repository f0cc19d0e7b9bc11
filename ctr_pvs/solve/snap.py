"""What happens where the stable branch ends: a snap, where it lands, and the shapes that it goes through on the way.

The landing is that of the gradient flow of the energy in the torsional metric, from the last stable state, at the
command just past the fold.  Real snaps are dynamic: a landing is a prediction, and of several basins inertia may
choose another.  The shapes are those of the same flow, the way down the energy and not the dynamics, and tell no time.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.answer.engine import Engine
from ctr_pvs.answer.equilibrium import Equilibrium
from ctr_pvs.answer.state import Snap
from ctr_pvs.answer.state import State
from ctr_pvs.answer.status import Status
from ctr_pvs.kernel.arrays import S_FLOOR
from ctr_pvs.kernel.arrays import S_TIP
from ctr_pvs.kernel.walk.step import MORE
from ctr_pvs.kernel.walk.step import OK

Array = NDArray[np.float64]

#: How far past the fold [fraction of the path] the command of the landing lies, tried in turn: past a fold the first
#: does; past a bifurcation the old state must have become unstable enough to be left.
PAST_FOLD = (1e-9, 1e-7, 1e-5, 1e-3)
#: Steps of the flow between two looks at the clock; and most looks under load, where the flow of a dead moment need not
#: come to rest anywhere.
STEPS, MOST_LOOKS = 20, 100
#: A flow that lands farther than this [m] from where the snap did is another one.
SAME_LANDING = 1e-6


def land(
    engine: Engine,
    command_at: Callable[[float], Array],
    lost: State,
    t: float,
    degree: int,
    deadline: float,
) -> Snap | bool:
    """With ``command_at`` (2 N + L,) alpha, D and packed loads: the snap from ``lost``, the end of a stable branch at
    the fraction ``t`` of a path; if no landing was found, whether it was for lack of time."""
    for past in PAST_FOLD:
        there = min(1.0, t + past)
        command, clock = command_at(there), np.zeros(5)
        code, out, looks = MORE, np.empty(0), 0
        while code == MORE:
            looks += 1
            if looks > MOST_LOOKS and len(command) > 2 * engine.robot.n_tubes:
                return False
            if time.monotonic() > deadline:
                return True
            code, out = engine.land(lost.vector, command, clock, degree, STEPS, out)
        if code == OK:
            before, after = (State(engine.describe(vector), engine.robot.n_tubes) for vector in (lost.vector, out))
            return Snap(there, lost.alpha, lost.D, before, after, float(clock[3] - clock[4]))
    return False


def snap_motion(answer: Equilibrium, snap: Snap, count: int, budget: float) -> tuple[Equilibrium, ...]:
    """``count`` >= 2 shapes on the way of one of ``answer.snaps``, from its fold to its landing, at equal steps of the
    way; none where the flow does not find its way again within ``budget`` [s].

    The way is measured in the unknowns, whose squares are energies of torsion.  All shapes have the command at which
    the robot snaps; the last one is an equilibrium of it, those before are none.
    """
    engine = answer._engine
    states = _flow(engine, snap, time.monotonic() + budget)
    if not states or _apart(engine, states[-1], snap.after) > SAME_LANDING:
        return ()
    way = np.array([state.unknowns for state in states])
    lengths = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(way, axis=0), axis=1)))
    shapes = []
    for place in np.linspace(0.0, lengths[-1], count).tolist():
        after = max(1, int(np.searchsorted(lengths, place)))
        share = (place - lengths[after - 1]) / (lengths[after] - lengths[after - 1])
        state = State(states[0].vector.copy(), engine.robot.n_tubes)
        state.unknowns[:] = way[after - 1] + share * (way[after] - way[after - 1])
        shapes.append(_shape(engine, state))
    return tuple(shapes)


def _shape(engine: Engine, state: State) -> Equilibrium:
    described = State(engine.describe(state.vector), engine.robot.n_tubes)
    message = "no equilibrium: on the way of a snap"
    return Equilibrium(engine, state.alpha, state.D, Status.NO_STABLE_EQUILIBRIUM, message, "torsion", state=described)


def _apart(engine: Engine, state: State, landing: State) -> float:
    """How far [m] the tips are from one another."""
    return float(np.linalg.norm(engine.describe(state.vector)[S_TIP : S_TIP + 3] - landing.tip[:3]))


def _flow(engine: Engine, snap: Snap, deadline: float) -> list[State]:
    """Where the flow is after each of its steps; empty if it does not land in time."""
    landing, floor = snap.after, int(snap.before.vector[S_FLOOR])
    command, clock = np.concatenate([landing.alpha, landing.D, landing.loads]), np.zeros(5)
    tubes = engine.robot.n_tubes
    states: list[State] = []
    code, out, steps = MORE, np.empty(0), 0
    while code == MORE and time.monotonic() < deadline:
        code, out = engine.land(snap.before.vector, command, clock, floor, steps, out)
        state = State(out.copy(), tubes)
        if not states or (state.unknowns != states[-1].unknowns).any():  # else the step was too long and is tried anew
            states.append(state)
        steps = 1
    return states if code == OK else []
