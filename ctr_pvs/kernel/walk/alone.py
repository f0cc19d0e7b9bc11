"""Cold starts without detours: where no rotation of the bases can fold, Newton finds the only equilibrium from
anywhere; else the path from the relaxed robot, as long as every step of it is proven at once.  What needs more is
left."""

from __future__ import annotations

import math

from ctr_pvs.kernel.arrays import ALPHA_RATE
from ctr_pvs.kernel.arrays import D_RATE
from ctr_pvs.kernel.arrays import N_UNKNOWNS
from ctr_pvs.kernel.arrays import S_ESTIMATE
from ctr_pvs.kernel.arrays import S_STEPS
from ctr_pvs.kernel.arrays import S_SWUNG
from ctr_pvs.kernel.arrays import TWISTED
from ctr_pvs.kernel.arrays import Array
from ctr_pvs.kernel.arrays import Kit
from ctr_pvs.kernel.arrays import Y
from ctr_pvs.kernel.compiler import compiled
from ctr_pvs.kernel.layout import prepare
from ctr_pvs.kernel.twist.condensation import factorize
from ctr_pvs.kernel.twist.element import LOWERED
from ctr_pvs.kernel.twist.fields import FINE
from ctr_pvs.kernel.twist.margin import stability_margin
from ctr_pvs.kernel.twist.newton import convex_everywhere
from ctr_pvs.kernel.twist.newton import correct
from ctr_pvs.kernel.twist.newton import remember
from ctr_pvs.kernel.twist.newton import slack_of
from ctr_pvs.kernel.twist.relaxed import relax
from ctr_pvs.kernel.walk.step import MORE
from ctr_pvs.kernel.walk.step import NOT_PROVEN
from ctr_pvs.kernel.walk.step import OK
from ctr_pvs.kernel.walk.step import TOO_SMALL
from ctr_pvs.kernel.walk.step import finish
from ctr_pvs.kernel.walk.step import open_state
from ctr_pvs.kernel.walk.step import step
from ctr_pvs.kernel.walk.step import try_untwisted
from ctr_pvs.kernel.walk.step import write_state

#: Degree of paths; how far they may turn in one step [rad], and by how much the converged model may differ there [rad].
PATH_DEGREE, PATH_TURN, PATH_SLACK = 3, 0.9, 1e-9
#: With less margin than this an answer is at the edge of a fold: its path is looked at more closely.
DELICATE = 0.1
#: Degrees above the first choice, tried in turn until the estimate is within tolerance.
RAISES = (0, 1, 3, 6, 10, 15)


@compiled
def alone(kit: Kit, alpha: Array, D: Array, tolerance: float, untwisted: bool, out: Array) -> int:
    """The unloaded equilibrium at (alpha, D), (N,) each, where it is the only one; else NOT_PROVEN.

    untwisted : take the state without twist where that is near enough."""
    scene, bench = kit.scenes[0], kit.bench
    steps = 0
    for rung in range(len(RAISES)):
        if not prepare(kit, scene, D, alpha[:0], tolerance, RAISES[rung], 0):
            return TOO_SMALL
        for u in range(scene.counts[N_UNKNOWNS]):
            scene.vectors[Y, u] = 0.0
        slack = slack_of(scene, tolerance)
        remember(scene, kit.rules, alpha)
        if untwisted and rung == 0:
            if try_untwisted(scene, bench, kit.tubes, kit.rules, alpha, slack, tolerance, out):
                return OK
            for u in range(scene.counts[N_UNKNOWNS]):
                scene.vectors[Y, u] = 0.0
        if not convex_everywhere(scene, bench, kit.rules, alpha):
            return NOT_PROVEN
        taken, _ = correct(scene, bench, kit.tubes, kit.rules, alpha, True, 0.0)
        if taken < 0:
            return NOT_PROVEN
        remember(scene, kit.rules, alpha)
        if not factorize(scene, bench, kit.rules, FINE, LOWERED, slack, 0.0, -1.0):
            return NOT_PROVEN
        steps += taken
        if not write_state(scene, alpha, steps, TWISTED, out):
            return TOO_SMALL
        finish(scene, bench, kit.tubes, kit.rules, alpha, slack, tolerance, out)
        if max(out[S_ESTIMATE], out[S_SWUNG]) <= tolerance:
            break
    return OK


@compiled
def cold(kit: Kit, alpha: Array, D: Array, tolerance: float, untwisted: bool, state: Array, out: Array) -> int:
    """The unloaded equilibrium at (alpha, D), (N,) each, into the state ``out``: OK, or MORE where several relaxed
    robots are equally near and the path set out from one of them.  NOT_PROVEN where it takes more than is done here.

    state : room for one."""
    N = len(alpha)
    came = alone(kit, alpha, D, tolerance, untwisted, out)
    if came != NOT_PROVEN:
        return came
    scene, bench = kit.scenes[0], kit.bench
    if not prepare(kit, scene, D, alpha[:0], tolerance, 0, PATH_DEGREE):
        return TOO_SMALL
    if len(state) < 7 * N:
        return TOO_SMALL
    work = state[: 7 * N].reshape(7, N)
    found = relax(scene, bench, kit.tubes, kit.rules, work[6], work)
    if found == 0:
        return NOT_PROVEN
    begin, command, low, high = bench.lines[ALPHA_RATE], bench.lines[D_RATE], 0.0, 0.0
    for j in range(N):
        begin[j] = work[6, j] + alpha[0]
        low, high = min(low, alpha[j] - begin[j]), max(high, alpha[j] - begin[j])
    if not write_state(scene, begin[:N], 0, TWISTED, state):
        return TOO_SMALL
    steps, parts = 0.0, math.ceil((high - low) / PATH_TURN)
    for part in range(1, parts):
        for j in range(N):
            command[j] = begin[j] + (alpha[j] - begin[j]) * part / parts
        came = step(
            kit, state, command[:N], D, alpha[:0], tolerance, 0, PATH_DEGREE, PATH_SLACK, False, False, state
        )  # fmt: skip
        if came != OK:
            return came
        steps += state[S_STEPS]
    came = step(kit, state, alpha, D, alpha[:0], tolerance, 0, 0, 0.0, untwisted, True, out)
    if came != OK:
        return came
    out[S_STEPS] += steps
    if max(out[S_ESTIMATE], out[S_SWUNG]) > tolerance:
        return NOT_PROVEN
    which = open_state(kit, out, tolerance)
    if stability_margin(kit.scenes[which], bench, kit.tubes, kit.rules, alpha) < DELICATE:
        return NOT_PROVEN
    return OK if found == 1 else MORE
