"""What happens where the stable branch ends: a snap, and where it lands.

The landing is that of the gradient flow of the energy in the torsional metric, from the last stable state, at the
command just past the fold.  Real snaps are dynamic: a landing is a prediction, and of several basins inertia may
choose another.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.answer.engine import Engine
from ctr_pvs.answer.state import Snap
from ctr_pvs.answer.state import State
from ctr_pvs.kernel.walk.step import MORE
from ctr_pvs.kernel.walk.step import OK

Array = NDArray[np.float64]

#: How far past the fold [fraction of the path] the command of the landing lies, tried in turn: past a fold the first
#: does; past a bifurcation the old state must have become unstable enough to be left.
PAST_FOLD = (1e-9, 1e-7, 1e-5, 1e-3)
#: Steps of the flow between two looks at the clock; and most looks under load, where the flow of a dead moment need not
#: come to rest anywhere.
STEPS, MOST_LOOKS = 20, 100


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
