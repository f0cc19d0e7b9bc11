"""Degrees raised until an answer meets its tolerance."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.answer.engine import Engine
from ctr_pvs.answer.state import State
from ctr_pvs.kernel.arrays import S_STEPS
from ctr_pvs.kernel.walk.alone import RAISES
from ctr_pvs.kernel.walk.step import NOT_PROVEN
from ctr_pvs.kernel.walk.step import OK

Array = NDArray[np.float64]

#: By how much the converged model may differ [rad] where there is little room: near a fold, and so on all paths.
TIGHT = 1e-9


def raised(engine: Engine, state: State, alpha: Array, D: Array, loads: Array) -> State | None:
    """``state``, of the first choice of degrees, solved again with higher ones until it meets the tolerance; none where
    a step is not proven."""
    steps = state.steps
    for more in RAISES[1:]:
        if not state.misses(engine.tolerance):
            break
        code, vector = engine.step(state.vector, alpha, D, loads, more)
        if code != OK:
            return None
        steps += int(vector[S_STEPS])
        vector[S_STEPS] = steps
        state = State(vector, len(alpha))
    return state


def settled(engine: Engine, vector: Array, loads: Array, untwisted: bool) -> tuple[int, Array]:
    """A state of any degrees at the smallest that meet the tolerance, under packed ``loads``: its own but for rows of
    zeros.  NOT_PROVEN if no degrees have a stable equilibrium there: it is too near a fold."""
    state = State(vector, engine.robot.n_tubes)
    alpha, D = state.alpha, state.D
    steps, found = 0.0, np.empty(0)
    for more in RAISES:
        code, out = engine.step(vector, alpha, D, loads, more, untwisted=untwisted and more == 0)
        if code == NOT_PROVEN:
            code, out = engine.step(vector, alpha, D, loads, more, slack=TIGHT)
        if code == OK:
            steps += out[S_STEPS]
            found = out
            if not State(out, len(alpha)).misses(engine.tolerance):
                break
    if not len(found):
        return NOT_PROVEN, vector
    found[S_STEPS] = steps
    return OK, found
