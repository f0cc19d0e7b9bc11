"""From nothing to an equilibrium: the path from the relaxed robot, where one has to be walked at all.

Where no rotation of the bases can fold, the equilibrium of a command is the only one: Newton finds it from anywhere.
"""

from __future__ import annotations

from ctr_pvs.kernel.arrays import N_UNKNOWNS
from ctr_pvs.kernel.arrays import S_ESTIMATE
from ctr_pvs.kernel.arrays import S_STEPS
from ctr_pvs.kernel.arrays import S_SWUNG
from ctr_pvs.kernel.arrays import STATE
from ctr_pvs.kernel.arrays import TWISTED
from ctr_pvs.kernel.arrays import Array
from ctr_pvs.kernel.arrays import Kit
from ctr_pvs.kernel.arrays import Y
from ctr_pvs.kernel.arrays import bench_of
from ctr_pvs.kernel.arrays import scene_of
from ctr_pvs.kernel.compiler import compiled
from ctr_pvs.kernel.layout import prepare
from ctr_pvs.kernel.twist.newton import convex_everywhere
from ctr_pvs.kernel.twist.newton import correct
from ctr_pvs.kernel.twist.newton import remember
from ctr_pvs.kernel.twist.newton import slack_of
from ctr_pvs.kernel.twist.relaxed import relax
from ctr_pvs.kernel.walk.path import PATH_SLACK
from ctr_pvs.kernel.walk.path import follow
from ctr_pvs.kernel.walk.path import margin_of
from ctr_pvs.kernel.walk.step import LARGEST_TURN
from ctr_pvs.kernel.walk.step import MORE
from ctr_pvs.kernel.walk.step import NOT_PROVEN
from ctr_pvs.kernel.walk.step import OK
from ctr_pvs.kernel.walk.step import TOO_SMALL
from ctr_pvs.kernel.walk.step import finish
from ctr_pvs.kernel.walk.step import settle
from ctr_pvs.kernel.walk.step import step
from ctr_pvs.kernel.walk.step import try_untwisted
from ctr_pvs.kernel.walk.step import write_state

#: Degrees above the first choice, tried in turn until the estimate is within tolerance.
RAISES = (0, 1, 3, 6, 10, 15)
#: Least degree at which paths are followed.
PATH_DEGREE = 3
#: With less margin than this an answer is at the edge of a fold: its path is looked at more closely.
DELICATE = 0.1
#: Tries of a step on a path that is walked here; longer ones are for who can stop in between.
MOST_TRIES = 60


@compiled
def raise_degrees(
    kit: Kit, alpha: Array, D: Array, tolerance: float,
    came: int, out: Array,
) -> int:  # fmt: skip
    """Solves the state ``out``, of the first choice of degrees, again with higher ones until it meets ``tolerance``."""
    rung, steps = 1, out[S_STEPS]
    while came == OK and max(out[S_ESTIMATE], out[S_SWUNG]) > tolerance and rung < len(RAISES):
        raised = RAISES[rung]
        came = step(kit, out, alpha, D, tolerance, raised, 0, 0.0, False, True, out)
        steps += out[S_STEPS]
        out[S_STEPS] = steps
        rung += 1
    return came


@compiled
def settle_down(
    kit: Kit, state: Array, tolerance: float,
    untwisted: bool, out: Array,
) -> int:  # fmt: skip
    """``state``, of any degrees, at the smallest that meet ``tolerance`` [m]; NOT_PROVEN if no degrees have a stable
    equilibrium there: it is too near a fold."""
    N = len(kit.segments)
    alpha, D = state[STATE : STATE + N], state[STATE + N : STATE + 2 * N]
    steps, found = 0.0, False
    for rung in range(len(RAISES)):
        for tight in range(2):
            slack = PATH_SLACK if tight else 0.0
            came = step(
                kit, state, alpha, D, tolerance, RAISES[rung], 0, slack,
                untwisted and rung == 0 and not tight, True, out,
            )  # fmt: skip
            if came != NOT_PROVEN:
                break
        if came == TOO_SMALL:
            return TOO_SMALL
        if came == OK:
            steps += out[S_STEPS]
            found = True
            if max(out[S_ESTIMATE], out[S_SWUNG]) <= tolerance:
                break
    out[S_STEPS] = steps
    return OK if found else NOT_PROVEN


@compiled
def alone(
    kit: Kit, alpha: Array, D: Array, tolerance: float,
    untwisted: bool, out: Array,
) -> int:  # fmt: skip
    """The equilibrium at (alpha, D), (N,) each, where it is the only one; else NOT_PROVEN."""
    scene, bench = scene_of(kit, 0), bench_of(kit)
    if not prepare(kit, scene, D, tolerance, 0, 0):
        return TOO_SMALL
    for u in range(scene.counts[N_UNKNOWNS]):
        scene.vectors[Y, u] = 0.0
    slack = slack_of(scene, tolerance)
    remember(scene, kit.rules, alpha)
    if untwisted and try_untwisted(scene, bench, kit.tubes, kit.rules, alpha, slack, tolerance, out):
        return OK
    for u in range(scene.counts[N_UNKNOWNS]):
        scene.vectors[Y, u] = 0.0
    if not convex_everywhere(scene, bench, kit.rules, alpha):
        return NOT_PROVEN
    steps = correct(scene, bench, kit.rules, alpha, 0, True)
    if steps < 0:
        return NOT_PROVEN
    remember(scene, kit.rules, alpha)
    more = settle(scene, bench, kit.rules, alpha, slack)
    if more < 0:
        return NOT_PROVEN
    if not write_state(scene, alpha, steps + more, TWISTED, out):
        return TOO_SMALL
    finish(scene, bench, kit.tubes, kit.rules, alpha, slack, tolerance, out)
    return raise_degrees(kit, alpha, D, tolerance, OK, out)


@compiled
def cold(
    kit: Kit, alpha: Array, D: Array, tolerance: float,
    untwisted: bool, room: Array, out: Array,
) -> int:  # fmt: skip
    """The equilibrium at (alpha, D), (N,) each, into the state ``out``: OK, or MORE where several relaxed robots are
    equally near and the path set out from one of them.  NOT_PROVEN where the path meets a fold, or its end is at the
    edge of one: that takes more than is done here.

    room (4, L) : L floats for a state, (7 N) at least.
    """
    N = len(alpha)
    came = alone(kit, alpha, D, tolerance, untwisted, out)
    if came != NOT_PROVEN:
        return came
    scene, bench = scene_of(kit, 0), bench_of(kit)
    if not prepare(kit, scene, D, tolerance, 0, PATH_DEGREE):
        return TOO_SMALL
    work = room[0, : 7 * N].reshape(7, N)
    origin, state, ahead = work[6], room[1], room[2]
    found = relax(scene, bench, kit.rules, origin, work)
    if found == 0:
        return NOT_PROVEN
    begin, end, command = work[0:2].reshape(2 * N), work[2:4].reshape(2 * N), work[4:6].reshape(2 * N)
    low, high = 0.0, 0.0
    for j in range(N):
        begin[j], begin[N + j] = origin[j] + alpha[0], D[j]
        end[j], end[N + j] = alpha[j], D[j]
        low, high = min(low, end[j] - begin[j]), max(high, end[j] - begin[j])
    if not write_state(scene, begin[:N], 0, TWISTED, state) or len(ahead) < len(state):
        return TOO_SMALL
    clock = bench.space[5]
    clock[0], clock[1], clock[2] = 0.0, min(1.0, LARGEST_TURN / max(high - low, 1e-300)), 0.0
    came = follow(
        kit, begin, end, clock, tolerance, 0, PATH_DEGREE, MOST_TRIES, state, ahead,
        command,
    )  # fmt: skip
    if came != OK:
        return TOO_SMALL if came == TOO_SMALL else NOT_PROVEN
    steps = clock[2]
    came = settle_down(kit, state, tolerance, untwisted, out)
    if came != OK:
        return came
    out[S_STEPS] += steps
    if margin_of(kit, out, tolerance) < DELICATE:
        return NOT_PROVEN
    return OK if found == 1 else MORE
