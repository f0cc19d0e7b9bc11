"""One proven step from a state to a command."""

from __future__ import annotations

import math

from ctr_pvs.kernel.arrays import ANGLE
from ctr_pvs.kernel.arrays import AT
from ctr_pvs.kernel.arrays import FLOOR
from ctr_pvs.kernel.arrays import GRADIENT
from ctr_pvs.kernel.arrays import LEADER
from ctr_pvs.kernel.arrays import N_ELEMENTS
from ctr_pvs.kernel.arrays import N_LOADS
from ctr_pvs.kernel.arrays import N_UNKNOWNS
from ctr_pvs.kernel.arrays import NONE
from ctr_pvs.kernel.arrays import OTHER
from ctr_pvs.kernel.arrays import POSITION
from ctr_pvs.kernel.arrays import RAISED
from ctr_pvs.kernel.arrays import ROOT
from ctr_pvs.kernel.arrays import S_ESTIMATE
from ctr_pvs.kernel.arrays import S_FLOOR
from ctr_pvs.kernel.arrays import S_LOADS
from ctr_pvs.kernel.arrays import S_RAISED
from ctr_pvs.kernel.arrays import S_RESIDUAL
from ctr_pvs.kernel.arrays import S_ROLL
from ctr_pvs.kernel.arrays import S_SOLVED
from ctr_pvs.kernel.arrays import S_STEPS
from ctr_pvs.kernel.arrays import S_SWUNG
from ctr_pvs.kernel.arrays import S_TIP
from ctr_pvs.kernel.arrays import S_TWISTS
from ctr_pvs.kernel.arrays import S_UNKNOWNS
from ctr_pvs.kernel.arrays import STATE
from ctr_pvs.kernel.arrays import STEP
from ctr_pvs.kernel.arrays import SWING
from ctr_pvs.kernel.arrays import TORQUE
from ctr_pvs.kernel.arrays import TWISTED
from ctr_pvs.kernel.arrays import UNTWISTED
from ctr_pvs.kernel.arrays import Array
from ctr_pvs.kernel.arrays import Bench
from ctr_pvs.kernel.arrays import Kit
from ctr_pvs.kernel.arrays import Scene
from ctr_pvs.kernel.arrays import Y
from ctr_pvs.kernel.backbone.estimate import backbone_motion
from ctr_pvs.kernel.backbone.frames import put_frames
from ctr_pvs.kernel.backbone.frames import put_pose
from ctr_pvs.kernel.carry import alike
from ctr_pvs.kernel.carry import carry
from ctr_pvs.kernel.carry import drop_finer
from ctr_pvs.kernel.carry import remember_from
from ctr_pvs.kernel.compiler import compiled
from ctr_pvs.kernel.layout import holds
from ctr_pvs.kernel.layout import prepare
from ctr_pvs.kernel.loaded.tangent import solve_tangent
from ctr_pvs.kernel.sections import FINER
from ctr_pvs.kernel.sections import INTEGRATION_SHARE
from ctr_pvs.kernel.twist.condensation import factorize
from ctr_pvs.kernel.twist.element import ALONG
from ctr_pvs.kernel.twist.element import EXACT
from ctr_pvs.kernel.twist.element import LOWERED
from ctr_pvs.kernel.twist.element import WIDER
from ctr_pvs.kernel.twist.element import energy_gradient
from ctr_pvs.kernel.twist.fields import COARSE
from ctr_pvs.kernel.twist.fields import FINE
from ctr_pvs.kernel.twist.fields import counted
from ctr_pvs.kernel.twist.newton import certainly_convex
from ctr_pvs.kernel.twist.newton import correct
from ctr_pvs.kernel.twist.newton import largest_turn
from ctr_pvs.kernel.twist.newton import predict
from ctr_pvs.kernel.twist.newton import remember
from ctr_pvs.kernel.twist.newton import slack_of
from ctr_pvs.kernel.twist.newton import twist_size

#: What came of a step or a path.  TOO_SMALL: the workspace; ``ints`` says what is needed.
OK, NOT_PROVEN, TOO_SMALL, FOLD, MORE = range(5)

#: Largest change [rad] of the angle between two tubes in one step.
LARGEST_TURN = 1.0
#: Longest first Newton step [rad], of twist or of how the loads turn the frame, under load.
LARGEST_BEND = 0.5
#: Largest slide in one step, as a share of the longest tube: the tubes could couple more in between than at either end.
LARGEST_SLIDE = 0.05
#: The estimate is this many times what two more degrees move to first order: fitted, see bench/accuracy/effectivity.
SAFETY = 2.0
#: The untwisted state is looked at where a crude bound of what its twist would move is within so many tolerances.
PERHAPS_UNTWISTED = 30.0
#: A base that turns takes this many times as much twist away, at most where no fold is near; where more is left than
#: the line above leaves, no look is worth its time, a fifth of a step's.
UNTWISTS = 4.0


@compiled
def open_state(kit: Kit, state: Array, tolerance: float) -> int:
    """Puts ``state`` into a scene of the workspace, one that is cut for it if there is one; which, -1 if too small."""
    N = len(kit.segments)
    D = state[STATE + N : STATE + 2 * N]
    raised, floor = int(state[S_RAISED]), int(state[S_FLOOR])
    loads = state[STATE + 3 * N : loads_end(state, N)]
    which = 1 if holds(kit.scenes[1], D, loads, raised, floor) else 0
    scene = kit.scenes[which]
    if not prepare(kit, scene, D, loads, tolerance, raised, floor):
        return -1
    load_state(scene, state)
    return which


@compiled
def loads_end(state: Array, tubes: int) -> int:
    """Where the packed loads of ``state`` end; they begin after 3 numbers for every tube."""
    return STATE + 3 * tubes + int(state[S_LOADS])


@compiled
def load_state(scene: Scene, state: Array) -> None:
    """The unknowns of ``state`` into a scene that is cut for it."""
    first = loads_end(state, scene.base.shape[1])
    for u in range(int(state[S_UNKNOWNS])):
        scene.vectors[Y, u] = state[first + u]


@compiled
def write_state(scene: Scene, alpha: Array, steps: int, twists: float, out: Array) -> bool:
    """The unknowns of ``scene`` at base angles alpha (N,) as a state, with its torques; false if ``out`` is too short
    for it."""
    N, U, L = len(alpha), scene.counts[N_UNKNOWNS], scene.counts[N_LOADS]
    if len(out) < STATE + 3 * N + L + U:
        return False
    out[S_RAISED], out[S_FLOOR], out[S_UNKNOWNS] = scene.counts[RAISED], scene.counts[FLOOR], U
    for i in range(S_RESIDUAL, STATE):
        out[i] = math.nan
    out[S_LOADS] = L
    out[S_STEPS], out[S_TWISTS], out[S_SOLVED] = steps, twists, solved_for(scene)
    for j in range(N):
        out[STATE + j], out[STATE + N + j], out[STATE + 2 * N + j] = (
            alpha[j],
            scene.base[AT, j],
            scene.held[TORQUE, 0, j],
        )
    for i in range(L):
        out[STATE + 3 * N + i] = scene.loads[i]
    for u in range(U):
        out[STATE + 3 * N + L + u] = scene.vectors[Y, u]
    return True


@compiled
def solved_for(scene: Scene) -> int:
    """How many unknowns a state has, those that only check left out; none where nothing couples the tubes."""
    count = 0
    for m in range(scene.counts[N_ELEMENTS]):
        count += counted(scene, m, COARSE)
    if count > 0:
        for j in range(scene.base.shape[1]):
            count += 1 if scene.base[ROOT, j] > 0.0 else 0
    return count


@compiled
def step(
    kit: Kit, last: Array, alpha: Array, D: Array, loads: Array,
    tolerance: float, raised: int, floor: int, slack: float, untwisted: bool, tip: bool, out: Array,
) -> int:  # fmt: skip
    """The equilibrium at (alpha, D), (N,) [rad], [m], under packed ``loads``, on the branch of the state ``last``, into
    ``out``.

    raised, floor : degrees, see ``plan_sections``.  slack : by which the converged model may differ [rad], 0 for what
    the tolerance suggests.  untwisted : take the state without twist where that is near enough.
    tip : also its tip and the estimate of its error.  NOT_PROVEN unless a check certifies the step.
    """
    N = len(alpha)
    which = open_state(kit, last, tolerance)
    if which < 0:
        return TOO_SMALL
    old, bench = kit.scenes[which], kit.bench
    same = holds(old, D, loads, raised, floor)
    new = old if same else kit.scenes[1 - which]
    if not same and not prepare(kit, new, D, loads, tolerance, raised, floor):
        return TOO_SMALL
    before = last[STATE : STATE + N]
    moved, turn, loaded = False, 0.0, len(loads) > 0
    for j in range(N):
        moved = moved or D[j] != old.base[AT, j]
        turn = max(turn, abs(alpha[j] - before[j]))
    if slack == 0.0:
        slack = slack_of(new, tolerance)
    set_out(old, new, kit.rules, before, same)
    twist = 0.0 if moved else twist_size(new, new.vectors[Y], COARSE) - UNTWISTS * turn
    if untwisted and not loaded and twist * new.base[SWING, 0] <= UNTWISTS * PERHAPS_UNTWISTED * tolerance:
        if try_untwisted(new, bench, kit.tubes, kit.rules, alpha, slack, tolerance, out):
            return OK
        load_state(old, last)
        set_out(old, new, kit.rules, before, same)
    first = 0.0
    if turn > 0.0 or loaded:
        first = predict(new, bench, kit.tubes, kit.rules, before, alpha)
    if loaded and not first < LARGEST_BEND:
        return NOT_PROVEN
    steps, strayed = settle(new, bench, kit.tubes, kit.rules, alpha, slack, first)
    turned = largest_turn(new)
    if steps < 0 or turned > LARGEST_TURN:
        return NOT_PROVEN
    if not write_state(new, alpha, steps, TWISTED, out):
        return TOO_SMALL
    if tip:
        finish(new, bench, kit.tubes, kit.rules, alpha, slack, tolerance, out)
    if strayed > 0.0:
        if same:
            remember(new, kit.rules, alpha)
        else:
            remember_from(new, old, kit.rules, alpha)
        load_state(old, last)
        energy_gradient(old, bench, kit.tubes, kit.rules, before)
        return OK if factorize(old, bench, kit.rules, FINE, ALONG, strayed, 0.0, -1.0) else NOT_PROVEN
    if moved and not loaded:
        load_state(old, last)
        if not certainly_convex(old, bench, kit.tubes, kit.rules, before, (1.0 + WIDER) * turned + slack):
            return NOT_PROVEN
    return OK


@compiled
def set_out(old: Scene, new: Scene, rules: Array, alpha: Array, same: bool) -> None:
    """Gives ``new`` the torques of the state in ``old``, and lets it remember the angles there, under base angles alpha
    (N,) [rad]; same : they are one scene."""
    if not same:
        carry(old, new, rules)
    drop_finer(new, FINER)
    if same or alike(old, new):
        remember(new, rules, alpha)
    else:
        remember_from(old, new, rules, alpha)


@compiled
def settle(
    scene: Scene, bench: Bench, tubes: Array, rules: Array, alpha: Array, slack: float, first: float
) -> tuple[int, float]:  # fmt: skip
    """Newton from ``y`` to the equilibrium at alpha (N,) [rad], and the check: the steps it took, -1 if it fails.

    The Hessian that is then factorised is that of the finer degree; without loads it is lowered to hold on the box
    around the state, ``before`` and ``slack`` [rad] more.  Where it does not hold there it may hold along the way: then
    how far [rad] the branch may stray from the straight way also comes back, and the same check is to be made at its
    other end; else 0.  first : length [rad] of the step that predicted ``y``."""
    steps, corrected = correct(scene, bench, tubes, rules, alpha, False, first)
    if steps < 0:
        return -1, 0.0
    if scene.counts[N_LOADS] > 0:
        return (steps if factorize(scene, bench, rules, FINE, EXACT, 0.0, 0.0, -1.0) else -1), 0.0
    if factorize(scene, bench, rules, FINE, LOWERED, slack, 0.0, -1.0):
        return steps, 0.0
    # Of a parabola the chord is as far as a quarter of what corrects the tangent; angles between tubes take twice that.
    strayed = 2.0 * corrected + slack
    near = first > 0.0 and corrected <= WIDER * largest_turn(scene)
    if near and factorize(scene, bench, rules, FINE, ALONG, strayed, 0.0, -1.0):
        return steps, strayed
    return -1, 0.0


@compiled
def finish(
    scene: Scene, bench: Bench, tubes: Array, rules: Array, alpha: Array, slack: float, tolerance: float, out: Array
) -> None:
    """Tip, residual and estimate of a checked state into ``out``.  The estimate is infinite where the finer model is
    too far away to be believed."""
    for u in range(scene.counts[N_UNKNOWNS]):
        scene.vectors[OTHER, u] = -scene.vectors[GRADIENT, u]
    solve_tangent(scene, bench, FINE, scene.vectors[OTHER], bench.lines[NONE], scene.vectors[STEP], 1.0)
    put_tip(scene, tubes, rules, out)
    change = twist_size(scene, scene.vectors[STEP], FINE)
    out[S_SWUNG] = change * scene.base[SWING, 0]
    far = change > max(slack, slack_of(scene, tolerance))
    motion = math.inf if far else backbone_motion(scene, bench, tubes, rules, scene.vectors[STEP])
    out[S_ESTIMATE] = SAFETY * motion + INTEGRATION_SHARE * tolerance


@compiled
def put_tip(scene: Scene, tubes: Array, rules: Array, out: Array) -> None:
    """Residual, number of unknowns and tip of a state whose gradient ``scene`` holds, into ``out``."""
    out[S_RESIDUAL], out[S_SOLVED] = twist_size(scene, scene.vectors[GRADIENT], COARSE), solved_for(scene)
    put_frames(scene, tubes, rules, True)
    M = scene.counts[N_ELEMENTS]
    put_pose(scene.frame[M, 0], scene.frame[M, 1], scene.held[ANGLE, M, scene.counts[LEADER]], out[S_ROLL : S_ROLL + 4])
    for i in range(3):
        out[S_TIP + i] = scene.line[M, POSITION + i]


@compiled
def try_untwisted(
    scene: Scene, bench: Bench, tubes: Array, rules: Array, alpha: Array, slack: float, tolerance: float, out: Array
) -> bool:
    """The state without twist, eq. (28)-(31), at alpha (N,) [rad]: true if it is near enough and on the branch of
    ``before``."""
    for u in range(scene.counts[N_UNKNOWNS]):
        scene.vectors[Y, u] = 0.0
    energy_gradient(scene, bench, tubes, rules, alpha)
    if twist_size(scene, scene.vectors[GRADIENT], FINE) * scene.base[SWING, 0] > PERHAPS_UNTWISTED * tolerance:
        return False
    if largest_turn(scene) > LARGEST_TURN or not factorize(scene, bench, rules, FINE, LOWERED, slack, 0.0, -1.0):
        return False
    if not write_state(scene, alpha, 0, UNTWISTED, out):
        return False
    finish(scene, bench, tubes, rules, alpha, slack, tolerance, out)
    return bool(out[S_ESTIMATE] <= tolerance and out[S_SWUNG] <= tolerance)
