"""Entry points that read a state: everything an answer tells.  Arguments are as in ``entries``."""

from __future__ import annotations

import math

from ctr_pvs.kernel.actuation import actuation_loads
from ctr_pvs.kernel.arrays import ANGLE
from ctr_pvs.kernel.arrays import ARC
from ctr_pvs.kernel.arrays import COUPLED
from ctr_pvs.kernel.arrays import DEGREE
from ctr_pvs.kernel.arrays import FIRST
from ctr_pvs.kernel.arrays import GAUSS
from ctr_pvs.kernel.arrays import INTEGRAL
from ctr_pvs.kernel.arrays import LEAD
from ctr_pvs.kernel.arrays import LEADER
from ctr_pvs.kernel.arrays import MOMENT_FAR
from ctr_pvs.kernel.arrays import N_ELEMENTS
from ctr_pvs.kernel.arrays import N_FAR
from ctr_pvs.kernel.arrays import N_UNKNOWNS
from ctr_pvs.kernel.arrays import PLACE
from ctr_pvs.kernel.arrays import REST
from ctr_pvs.kernel.arrays import RIGID
from ctr_pvs.kernel.arrays import ROOT
from ctr_pvs.kernel.arrays import ROW
from ctr_pvs.kernel.arrays import S_ESTIMATE
from ctr_pvs.kernel.arrays import S_STEPS
from ctr_pvs.kernel.arrays import S_TWISTS
from ctr_pvs.kernel.arrays import SCALE
from ctr_pvs.kernel.arrays import SIZE
from ctr_pvs.kernel.arrays import STATE
from ctr_pvs.kernel.arrays import STIFFNESS
from ctr_pvs.kernel.arrays import TORQUE
from ctr_pvs.kernel.arrays import TORQUES
from ctr_pvs.kernel.arrays import TWISTED
from ctr_pvs.kernel.arrays import WEIGHT
from ctr_pvs.kernel.arrays import Array
from ctr_pvs.kernel.arrays import Complex
from ctr_pvs.kernel.arrays import Ints
from ctr_pvs.kernel.arrays import Y
from ctr_pvs.kernel.backbone.frames import put_frames
from ctr_pvs.kernel.backbone.poses import trace
from ctr_pvs.kernel.carry import angle_at
from ctr_pvs.kernel.carry import guide_torque
from ctr_pvs.kernel.carry import torque_at
from ctr_pvs.kernel.compiler import entry_point
from ctr_pvs.kernel.entries import WORKSPACE
from ctr_pvs.kernel.loaded.statics import forces_work
from ctr_pvs.kernel.sensitivity import command_rates
from ctr_pvs.kernel.sensitivity import load_rates
from ctr_pvs.kernel.twist.condensation import factorize
from ctr_pvs.kernel.twist.element import EXACT
from ctr_pvs.kernel.twist.element import energy_gradient
from ctr_pvs.kernel.twist.fields import FINE
from ctr_pvs.kernel.twist.fields import spread_angles
from ctr_pvs.kernel.twist.fields import twist_energy
from ctr_pvs.kernel.twist.margin import stability_margin
from ctr_pvs.kernel.walk.step import NOT_PROVEN
from ctr_pvs.kernel.walk.step import OK
from ctr_pvs.kernel.walk.step import TOO_SMALL
from ctr_pvs.kernel.walk.step import open_state
from ctr_pvs.kernel.walk.step import put_tip
from ctr_pvs.kernel.walk.step import write_state
from ctr_pvs.kernel.workspace import kit_of


@entry_point(f"float64({WORKSPACE}, float64[::1], float64)")
def margin(
    tubes: Array, segments: Ints, rules: Array, floats: Array, ints: Ints, state: Array, tolerance: float
) -> float:
    """The stability margin of ``state``; NaN if the workspace is too small."""
    kit = kit_of(tubes, segments, rules, floats, ints)
    which = open_state(kit, state, tolerance)
    if which < 0:
        return math.nan
    return stability_margin(kit.scenes[which], kit.bench, tubes, rules, state[STATE : STATE + len(segments)])


@entry_point(f"int64({WORKSPACE}, float64[::1], float64, float64[:, ::1])")
def loads(
    tubes: Array, segments: Ints, rules: Array, floats: Array, ints: Ints, state: Array, tolerance: float, out: Array
) -> int:
    """Actuation loads and energy of ``state`` into out (6, N): torque, force towards +D and -D, kinks; then elastic
    energy [J], and the work of the loads' forces [J]."""
    kit = kit_of(tubes, segments, rules, floats, ints)
    N = len(segments)
    which = open_state(kit, state, tolerance)
    if which < 0:
        return TOO_SMALL
    scene, bench = kit.scenes[which], kit.bench
    energy_gradient(scene, bench, tubes, rules, state[STATE : STATE + N])
    put_frames(scene, tubes, rules, True)
    actuation_loads(scene, bench, tubes, segments, state[S_TWISTS] == TWISTED, out)
    out[4, 0] += twist_energy(scene) + out[5, 0]
    out[5, 0] = forces_work(scene) if scene.counts[LEAD] > 0 else 0.0
    return OK


@entry_point(f"int64({WORKSPACE}, float64[::1], float64, float64[::1])")
def base_wrench(
    tubes: Array, segments: Ints, rules: Array, floats: Array, ints: Ints, state: Array, tolerance: float, out: Array
) -> int:
    """Force [N] and moment [N m] about the orifice that all beyond it exerts there, into out (6,)."""
    kit = kit_of(tubes, segments, rules, floats, ints)
    which = open_state(kit, state, tolerance)
    if which < 0:
        return TOO_SMALL
    scene, bench = kit.scenes[which], kit.bench
    energy_gradient(scene, bench, tubes, rules, state[STATE : STATE + len(segments)])
    M = scene.counts[N_ELEMENTS]
    for i in range(3):
        out[i], out[3 + i] = scene.statics[M, N_FAR + i], scene.statics[M, MOMENT_FAR + i]
    return OK


@entry_point(f"int64({WORKSPACE}, float64[::1], float64, float64[:, ::1], float64[:, ::1], float64[:, ::1])")
def jacobian(
    tubes: Array, segments: Ints, rules: Array, floats: Array, ints: Ints, state: Array, tolerance: float, out: Array,
    gain: Array, actuation: Array,
) -> int:  # fmt: skip
    """Rates of the tip of ``state`` with alpha and D into the first rows of out (2 N + 6, 6), position [m] and rotation
    [rad] in base axes, and of the turn at each tube's own end with alpha into gain (N, N).

    Under load, with force and moment on the tip into the last rows of ``out``, and those of torques and forces into
    actuation (2 N, 6).  NOT_PROVEN where the state is not stable.
    """
    kit = kit_of(tubes, segments, rules, floats, ints)
    which = open_state(kit, state, tolerance)
    if which < 0:
        return TOO_SMALL
    scene, bench = kit.scenes[which], kit.bench
    energy_gradient(scene, bench, tubes, rules, state[STATE : STATE + len(segments)])
    twists = state[S_TWISTS] != RIGID
    if twists and not factorize(scene, bench, rules, FINE, EXACT, 0.0, 0.0, -1.0):
        return NOT_PROVEN
    for j in range(len(segments)):
        bench.lines[TORQUES, j] = scene.held[TORQUE, 0, j] if twists else 0.0
    if scene.counts[LEAD] == 0:
        put_frames(scene, tubes, rules, True)
    else:
        load_rates(scene, bench, tubes, segments, rules, out[2 * len(segments) :])
    command_rates(scene, bench, tubes, segments, rules, twists, out, gain, actuation)
    return OK


@entry_point(f"int64({WORKSPACE}, float64[::1], float64, int64, float64[::1], float64[:, ::1], float64[:, ::1])")
def backbone(
    tubes: Array, segments: Ints, rules: Array, floats: Array, ints: Ints, state: Array, tolerance: float, tube: int,
    s: Array, position: Array, orientation: Array,
) -> int:  # fmt: skip
    """Poses of a tube's material, the leader's if ``tube`` < 0, at increasing arc lengths s (n,) [m]: position (n, 3)
    [m] and unit quaternions x, y, z, w (n, 4)."""
    kit = kit_of(tubes, segments, rules, floats, ints)
    N = len(segments)
    which = open_state(kit, state, tolerance)
    if which < 0:
        return TOO_SMALL
    scene, bench = kit.scenes[which], kit.bench
    spread_angles(scene, state[STATE : STATE + N], scene.vectors[Y])
    put_frames(scene, tubes, rules, False)
    trace(scene, bench, tubes, rules, scene.counts[LEADER] if tube < 0 else tube, s, position, orientation)
    return OK


@entry_point(f"int64({WORKSPACE}, float64[::1], float64, float64[::1], float64[:, ::1], float64[:, ::1])")
def angles(
    tubes: Array, segments: Ints, rules: Array, floats: Array, ints: Ints, state: Array, tolerance: float, s: Array,
    psi: Array, torque: Array,
) -> int:  # fmt: skip
    """psi (n, N) [rad] and torques (n, N) [N m] of all tubes at arc lengths s (n,) [m]; before the orifice, at s < 0,
    those in the guide."""
    kit = kit_of(tubes, segments, rules, floats, ints)
    N = len(segments)
    which = open_state(kit, state, tolerance)
    if which < 0:
        return TOO_SMALL
    scene = kit.scenes[which]
    spread_angles(scene, state[STATE : STATE + N], scene.vectors[Y])
    for g in range(len(s)):
        for j in range(N):
            psi[g, j] = angle_at(scene, s[g], j) if s[g] > 0.0 else scene.held[ANGLE, 0, j]
            torque[g, j] = torque_at(scene, s[g], j) if s[g] >= 0.0 else guide_torque(scene, j)
    return OK


@entry_point(f"int64({WORKSPACE}, float64[::1], float64, float64[:, ::1])")
def elements(
    tubes: Array, segments: Ints, rules: Array, floats: Array, ints: Ints, state: Array, tolerance: float, out: Array
) -> int:
    """Start and end [m] of the elements of ``state``, 1 where tubes are coupled, and the degree there, into out (E, 4);
    how many there are, -1 if the workspace is too small."""
    kit = kit_of(tubes, segments, rules, floats, ints)
    which = open_state(kit, state, tolerance)
    if which < 0:
        return -1
    scene = kit.scenes[which]
    M = scene.counts[N_ELEMENTS]
    for m in range(min(M, len(out))):
        out[m, 0], out[m, 1] = scene.line[m, ARC], scene.line[m + 1, ARC]
        out[m, 2], out[m, 3] = scene.marks[m, COUPLED], scene.marks[m, DEGREE]
    return M


@entry_point(f"int64({WORKSPACE}, float64[::1], float64, float64[::1])")
def describe(
    tubes: Array, segments: Ints, rules: Array, floats: Array, ints: Ints, state: Array, tolerance: float, out: Array
) -> int:
    """``state``, stable or not, with its torques, residual and tip, into ``out``; its estimate is NaN."""
    kit = kit_of(tubes, segments, rules, floats, ints)
    N = len(segments)
    which = open_state(kit, state, tolerance)
    if which < 0:
        return TOO_SMALL
    scene, bench = kit.scenes[which], kit.bench
    alpha = state[STATE : STATE + N]
    energy_gradient(scene, bench, tubes, rules, alpha)
    if not write_state(scene, alpha, int(state[S_STEPS]), TWISTED, out):
        return TOO_SMALL
    put_tip(scene, tubes, rules, out)
    out[S_ESTIMATE] = math.nan
    return OK


@entry_point(
    f"int64({WORKSPACE}, float64[::1], float64, float64[:, ::1], complex128[:, ::1], float64[::1], float64[::1])"
)
def dense_map(
    tubes: Array, segments: Ints, rules: Array, floats: Array, ints: Ints, state: Array, tolerance: float, out: Array,
    moment: Complex, share: Array, place: Array,
) -> int:  # fmt: skip
    """For who wants whole matrices: psi at the Gauss points of the coupled elements is alpha plus ``out`` (G N, U)
    times the unknowns; moment (G, N) K kappa* [N m], share (G,) weight over sum of K [1/(N m)], place (G,)
    their arc lengths [m].  How many Gauss points, -1 if the
    workspace is too small; arrays that are too short are not filled."""
    kit = kit_of(tubes, segments, rules, floats, ints)
    N = len(segments)
    which = open_state(kit, state, tolerance)
    if which < 0:
        return -1
    scene = kit.scenes[which]
    count = 0
    for m in range(scene.counts[N_ELEMENTS]):
        count += scene.marks[m, GAUSS] if scene.marks[m, COUPLED] else 0
    if len(share) < count or out.shape[1] < scene.counts[N_UNKNOWNS]:
        return count
    row = 0
    for m in range(scene.counts[N_ELEMENTS]):
        G = scene.marks[m, GAUSS]
        for g in range(G if scene.marks[m, COUPLED] else 0):
            place[row] = scene.gauss[scene.marks[m, ROW] + g, PLACE]
            share[row] = scene.gauss[scene.marks[m, ROW] + g, WEIGHT] / scene.line[m, STIFFNESS]
            for j in range(N):
                moment[row, j] = scene.moments[REST, scene.marks[m, ROW] + g, j]
                line = out[row * N + j]
                for u in range(len(line)):
                    line[u] = 0.0
                line[j] = scene.base[ROOT, j]
                for before in range(m):
                    if scene.parts[SIZE, before, j] > 0:
                        line[scene.parts[FIRST, before, j]] += scene.held[SCALE, before, j]
                for k in range(scene.parts[SIZE, m, j]):
                    line[scene.parts[FIRST, m, j] + k] += scene.held[SCALE, m, j] * rules[G, g, INTEGRAL + k]
            row += 1
    return count
