"""Stable equilibria of a command under load: those that the unloaded ones lead to as the loads are put on.

No rule says how many there are: this is a search.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.answer.engine import Engine
from ctr_pvs.answer.equilibrium import Equilibrium
from ctr_pvs.answer.state import State
from ctr_pvs.answer.status import Status
from ctr_pvs.robot.loads import Loads
from ctr_pvs.solve.journey import arrive
from ctr_pvs.solve.legs import load_leg

Array = NDArray[np.float64]

#: Two answers whose tube ends are turned within this [rad] of each other, and whose tips are within this [m], are one.
SAME_TURN, SAME_TIP = 1e-6, 1e-6


def loaded_from(
    engine: Engine, unloaded: list[State], alpha: Array, D: Array, loads: Loads, packed: Array
) -> list[Equilibrium]:
    """Where the states ``unloaded`` at (alpha, D), (N,) each, lead as ``packed`` loads are put on, snaps and all: each
    once, by potential, or as found where a moment acts and there is none."""
    found: list[Equilibrium] = []
    for state in unloaded:
        arrival = arrive(engine, state, [load_leg(engine.robot, alpha, D, packed)], packed, False, np.inf)
        if arrival.state is None:
            continue
        status = Status.OK if arrival.state.estimate <= engine.tolerance else Status.TOLERANCE_MISSED
        answer = Equilibrium(
            engine, alpha, D, status, "stable equilibrium", "full", state=arrival.state, iterations=arrival.iterations,
            loads=loads,
        )  # fmt: skip
        if not any(_same(answer, other) for other in found):
            found.append(answer)
    return found if loads.has_moments else sorted(found, key=lambda answer: answer.potential)


def _same(a: Equilibrium, b: Equilibrium) -> bool:
    ends = np.array([a.length])
    turned = a._engine.angles(a.state.vector, ends)[0] - b._engine.angles(b.state.vector, ends)[0]
    apart = float(np.linalg.norm(a.tip.position - b.tip.position))
    return bool(np.abs(turned).max() < SAME_TURN and apart < SAME_TIP + a.error_estimate + b.error_estimate)
