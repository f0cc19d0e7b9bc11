"""What happens where the stable branch ends: a snap, and where it lands.

The landing is that of the gradient flow of the energy in the torsional metric, from the last stable state, at the
command just past the fold.  Real snaps are dynamic: a landing is a prediction, and of several basins inertia may
choose another.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import LSODA
from scipy.linalg import eigh

from ctr_pvs.continuation import CommandPath
from ctr_pvs.continuation import Followed
from ctr_pvs.continuation import State
from ctr_pvs.energy import TorsionEnergy
from ctr_pvs.models import Models
from ctr_pvs.solve import newton
from ctr_pvs.solve import twist_size

Array = NDArray[np.float64]

#: How far past the fold [fraction of the path] the command of the landing lies, tried in turn: past a fold the first
#: does; past a bifurcation the old state must have become unstable enough to be left.
PAST_FOLD = (1e-9, 1e-7, 1e-5, 1e-3)
#: First displacement [rad] along the direction that has lost its stiffness.
NUDGE = 1e-3
#: The flow has come to rest when the unbalanced torque would twist less than this [rad]; Newton does the rest.
AT_REST = 1e-4
#: Longest time of the flow, in which a twist that only its own stiffness holds decays in 1; and its accuracy.
LONGEST_FLOW = 1e9
FLOW_ACCURACY = 1e-6


@dataclass(frozen=True, eq=False)
class Snap:
    """One snap: where on the path, the states before and after, and the elastic energy released [J].

    t : fraction of the straight path from the previous command to the new one; alpha (N,) [rad] and D (N,) [m] there.
    """

    t: float
    alpha: Array
    D: Array
    before: State
    after: State
    energy_released: float


def land(models: Models, path: CommandPath, lost: Followed, degree: int, deadline: float) -> Snap | None:
    """The snap from the end of a stable branch; None if no landing was found before the deadline."""
    for past in PAST_FOLD:
        t = min(1.0, lost.t + past)
        alpha, D = path.at(t)
        energy = models.energy(D, degree)
        start = energy.space.coordinates(lost.state.torques)
        landed = _flow(energy, alpha, _nudged(energy, alpha, start), deadline)
        if landed is None:
            return None
        if twist_size(energy, landed - start) > NUDGE:
            released = energy.value(start, alpha) - energy.value(landed, alpha)
            after = State(alpha, D, energy.space.field(landed))
            return Snap(t, lost.state.alpha, lost.state.D, lost.state, after, released)
    return None


def _nudged(energy: TorsionEnergy, alpha: Array, q: Array) -> Array:
    """``q`` (n,) moved a little along its softest direction, to the side where the energy is lower."""
    _, hessian = energy.derivatives(q, alpha)
    _, vectors = eigh(hessian, subset_by_index=(0, 0))
    softest = vectors[:, 0] * (NUDGE / max(twist_size(energy, vectors[:, 0]), 1e-300))
    ahead, behind = (energy.value(q + side * softest, alpha) for side in (1.0, -1.0))
    return q + softest if ahead <= behind else q - softest


def _flow(energy: TorsionEnergy, alpha: Array, q: Array, deadline: float) -> Array | None:
    """The stable equilibrium (n,) where the gradient flow dq/dtime = -dE/dq from ``q`` rests; None if not in time.

    With strong coupling a twist kink drifts along nearly flat energy before it leaves: the method must take long steps
    when nothing happens, so it is implicit, with the Hessian as its Jacobian.  Newton ends the flow once it converges
    to a stable state right there.
    """
    flow = LSODA(
        lambda _, state: -energy.gradient(state, alpha),
        0.0,
        q,
        LONGEST_FLOW,
        rtol=FLOW_ACCURACY,
        atol=1e-9 * max(float(np.abs(q).max()), 1e-150),
        jac=lambda _, state: -energy.derivatives(state, alpha)[1],
    )
    quiet = AT_REST
    while flow.status == "running" and time.monotonic() < deadline:
        flow.step()
        if twist_size(energy, energy.gradient(flow.y, alpha)) < quiet:
            rest = newton(energy, alpha, flow.y)
            if rest.converged and rest.first_step < AT_REST**0.5:
                return rest.q
            quiet *= 0.1  # still drifting: wait until it is quieter before trying again
    return None
