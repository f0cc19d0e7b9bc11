"""How an equilibrium and its tip move with the command: the implicit function theorem on dE/dy = 0.

A rate is taken at fixed torque coefficients first (the *explicit* part: elements stretch, material slides, compliances
grow), then the unknowns answer through the Hessian.  Elements stretch because their ends ride on the tubes: an end of
one of tube j's segments moves with -dD_j, several on one place with their mean; parts of a section share its stretch.
"""

from __future__ import annotations

from ctr_pvs.kernel.actuation import orifice_segments
from ctr_pvs.kernel.actuation import owns
from ctr_pvs.kernel.arrays import ABSENT
from ctr_pvs.kernel.arrays import ALPHA_RATE
from ctr_pvs.kernel.arrays import ANGLE
from ctr_pvs.kernel.arrays import ANSWERED
from ctr_pvs.kernel.arrays import AT
from ctr_pvs.kernel.arrays import COUPLED
from ctr_pvs.kernel.arrays import D_RATE
from ctr_pvs.kernel.arrays import EXPLICIT
from ctr_pvs.kernel.arrays import FIRST
from ctr_pvs.kernel.arrays import GAUSS
from ctr_pvs.kernel.arrays import LEAD
from ctr_pvs.kernel.arrays import LEADER
from ctr_pvs.kernel.arrays import LENGTH
from ctr_pvs.kernel.arrays import LOADED
from ctr_pvs.kernel.arrays import MOMENT
from ctr_pvs.kernel.arrays import MOMENTS
from ctr_pvs.kernel.arrays import N_ELEMENTS
from ctr_pvs.kernel.arrays import N_LOADS
from ctr_pvs.kernel.arrays import N_NODES
from ctr_pvs.kernel.arrays import N_POINTS
from ctr_pvs.kernel.arrays import N_UNKNOWNS
from ctr_pvs.kernel.arrays import NONE
from ctr_pvs.kernel.arrays import OTHER
from ctr_pvs.kernel.arrays import PLACE
from ctr_pvs.kernel.arrays import POINT
from ctr_pvs.kernel.arrays import POINT_MOMENT
from ctr_pvs.kernel.arrays import PULL
from ctr_pvs.kernel.arrays import ROOT
from ctr_pvs.kernel.arrays import ROW
from ctr_pvs.kernel.arrays import SCALE
from ctr_pvs.kernel.arrays import SIZE
from ctr_pvs.kernel.arrays import STEP
from ctr_pvs.kernel.arrays import STIFFNESS
from ctr_pvs.kernel.arrays import TORQUES
from ctr_pvs.kernel.arrays import TORSION
from ctr_pvs.kernel.arrays import TRIAL
from ctr_pvs.kernel.arrays import TUBE
from ctr_pvs.kernel.arrays import TURNED
from ctr_pvs.kernel.arrays import WEIGHT
from ctr_pvs.kernel.arrays import WRENCH
from ctr_pvs.kernel.arrays import Array
from ctr_pvs.kernel.arrays import Bench
from ctr_pvs.kernel.arrays import Ints
from ctr_pvs.kernel.arrays import Scene
from ctr_pvs.kernel.backbone.frames import cross
from ctr_pvs.kernel.backbone.frames import dot
from ctr_pvs.kernel.backbone.frames import tangent
from ctr_pvs.kernel.backbone.tip_rates import tip_rates
from ctr_pvs.kernel.compiler import compiled
from ctr_pvs.kernel.loaded.rates import moment_rates
from ctr_pvs.kernel.loaded.rates import turn_frames
from ctr_pvs.kernel.loaded.rates import twist_rates_by_moments
from ctr_pvs.kernel.loaded.statics import gather_moments
from ctr_pvs.kernel.loaded.tangent import solve_tangent
from ctr_pvs.kernel.loaded.tangent import turns_at_ends
from ctr_pvs.kernel.twist.element import clear_torques
from ctr_pvs.kernel.twist.element import gather
from ctr_pvs.kernel.twist.fields import FINE
from ctr_pvs.kernel.twist.fields import explicit_angle
from ctr_pvs.kernel.twist.fields import moment_rate


@compiled
def boundary_rates(scene: Scene, D_rate: Array, out: Array) -> None:
    """Motion (M + 1,) of the elements' ends for base motions D_rate (N,).  The orifice stays."""
    M = scene.counts[N_ELEMENTS]
    out[0] = 0.0
    first = 0
    for m in range(1, M + 1):
        count, total = 0, 0.0
        for j in range(len(D_rate)):
            if owns(scene, m, j):
                count += 1
                total -= D_rate[j]
        if count == 0:
            continue
        out[m] = total / count
        for inner in range(first + 1, m):
            out[inner] = out[first] + (out[m] - out[first]) * (inner - first) / (m - first)
        first = m


@compiled
def explicit_angles(
    scene: Scene,
    tubes: Array,
    segments: Ints,
    alpha_rate: Array,
    D_rate: Array,
    torque: Array,
    ends: Array,
    out: Array,
) -> None:
    """d psi (M + 1, N) at the elements' ends, whose motion is ``ends`` (M + 1,), with torque coefficients held;
    torque (N,) [N m] is what bending pulls at the orifice."""
    for j in range(len(alpha_rate)):
        out[0, j] = alpha_rate[j]
        if D_rate[j] != 0.0:
            guided = orifice_segments(tubes, segments, j, scene.base[AT, j])[1]
            if guided != ABSENT:
                out[0, j] -= torque[j] * D_rate[j] / tubes[j, guided, TORSION]
    for m in range(scene.counts[N_ELEMENTS]):
        stretch = (ends[m + 1] - ends[m]) / scene.line[m, LENGTH]
        for j in range(len(alpha_rate)):
            out[m + 1, j] = out[m, j] + (scene.held[ANGLE, m + 1, j] - scene.held[ANGLE, m, j]) * stretch


@compiled
def explicit_pull(scene: Scene, tubes: Array, rules: Array, D_rate: Array, ends: Array, angles: Array) -> None:
    """Rates of ``pull`` at the Gauss points of the coupled elements, into ``pull``, with torque coefficients and mu
    held; those of the loads' moments stand in TRIAL of ``bends``."""
    N = len(D_rate)
    for m in range(scene.counts[N_ELEMENTS]):
        if not scene.marks[m, COUPLED]:
            continue
        G, h = scene.marks[m, GAUSS], scene.line[m, LENGTH]
        stretch = (ends[m + 1] - ends[m]) / h
        for g in range(G):
            row = scene.marks[m, ROW] + g
            share = scene.gauss[row, WEIGHT] / scene.line[m, STIFFNESS]
            along = ends[m] + rules[G, g, PLACE] * (ends[m + 1] - ends[m])
            total, change = scene.bends[row, MOMENT], scene.bends[row, TRIAL]
            for j in range(N):
                total += scene.moments[TURNED, row, j]
                turned = explicit_angle(scene, m, row, j, angles, stretch)
                change += moment_rate(scene, tubes, m, row, j, along + D_rate[j], turned)
            for j in range(N):
                b = scene.moments[TURNED, row, j]
                turned = explicit_angle(scene, m, row, j, angles, stretch)
                own = moment_rate(scene, tubes, m, row, j, along + D_rate[j], turned)
                rate = (change.conjugate() * b + total.conjugate() * own).imag + stretch * (total.conjugate() * b).imag
                scene.turns[PULL, row, j] = share * rate


@compiled
def explicit_rates(
    scene: Scene, bench: Bench, tubes: Array, segments: Ints, rules: Array, alpha_rate: Array, D_rate: Array,
    wrench: Array, torque: Array, ends: Array, angles: Array, out: Array,
) -> None:  # fmt: skip
    """Rates of the gradient into ``out`` (U,) along (alpha_rate, D_rate), (N,) each, and ``wrench`` (6,), force and
    moment on the tip, with torque coefficients and mu held.

    ends (M + 1,) gets the motion of the elements' ends, angles (M + 1, N + 3) the rates of psi there and, under load,
    of the frame's turn.
    """
    boundary_rates(scene, D_rate, ends)
    explicit_angles(scene, tubes, segments, alpha_rate, D_rate, torque, ends, angles)
    clear_torques(scene)
    for row in range(scene.counts[N_NODES]):
        scene.bends[row, TRIAL] = 0j
    if scene.counts[LEAD] > 0:
        turn_frames(scene, bench, tubes, rules, D_rate, ends, angles)
        moment_rates(scene, bench, rules, ends, wrench)
        twist_rates_by_moments(scene, bench, angles, wrench)
    explicit_pull(scene, tubes, rules, D_rate, ends, angles)
    gather(scene, rules, out)
    gather_moments(scene, rules, TRIAL, out)


@compiled
def answer_rates(scene: Scene, bench: Bench, rates: Array, out: Array) -> None:
    """How the unknowns answer to ``rates`` (U,) of the gradient, into ``out`` (U,), at a state whose Hessian is
    factorised at the finer degree."""
    for u in range(scene.counts[N_UNKNOWNS]):
        scene.vectors[OTHER, u] = -rates[u]
    solve_tangent(scene, bench, FINE, scene.vectors[OTHER], bench.lines[NONE], out, 1.0)


@compiled
def answered_ends(scene: Scene, out: Array) -> None:
    """psi's answer to ``step`` at the elements' ends into ``out`` (M + 1, N)."""
    for j in range(scene.base.shape[1]):
        out[0, j] = scene.base[ROOT, j] * scene.vectors[STEP, j]
        for m in range(scene.counts[N_ELEMENTS]):
            turned = (
                scene.held[SCALE, m, j] * scene.vectors[STEP, scene.parts[FIRST, m, j]]
                if scene.parts[SIZE, m, j] > 0
                else 0.0
            )
            out[m + 1, j] = out[m, j] + turned


@compiled
def load_rates(
    scene: Scene, bench: Bench, tubes: Array, segments: Ints, rules: Array, out: Array
) -> None:  # fmt: skip
    """Rates of the tip with force and moment on it into out (6, 6), and the unknowns' into the first rows of
    ``bench.rows``."""
    explicit, answered = bench.moved[EXPLICIT], bench.moved[ANSWERED]
    none, wrench = bench.lines[NONE], bench.lines[WRENCH]
    N = len(bench.offset)
    for p in range(6):
        for i in range(6):
            wrench[i] = 1.0 if i == p else 0.0
        explicit_rates(
            scene, bench, tubes, segments, rules, none[:N], none[:N], wrench[:6], none, bench.ends, explicit,
            bench.rows[6],
        )  # fmt: skip
        answer_rates(scene, bench, bench.rows[6], scene.vectors[STEP])
        answered_ends(scene, answered)
        tip_rates(
            scene, bench, tubes, rules, scene.counts[LEADER], none[:N], bench.ends, explicit, answered, out[p]
        )  # fmt: skip
        for u in range(scene.counts[N_UNKNOWNS]):
            bench.rows[p, u] = scene.vectors[STEP, u]


@compiled
def command_rates(
    scene: Scene, bench: Bench, tubes: Array, segments: Ints, rules: Array, twists: bool, out: Array, gain: Array,
    actuation: Array,
) -> None:  # fmt: skip
    """Rates of the tip with alpha and D into the first rows of out (2 N, 6), and of psi at the ends with alpha into
    gain (N, N); under load those of torques and forces with what acts on the tip into actuation (2 N, 6)."""
    N, M, leader = len(bench.offset), scene.counts[N_ELEMENTS], scene.counts[LEADER]
    reciprocal = scene.counts[MOMENTS] == 0 and M > 0 and scene.marks[M - 1, LOADED] == 1
    alpha_rate, D_rate, none = bench.lines[ALPHA_RATE], bench.lines[D_RATE], bench.lines[NONE]
    ends, explicit, answered, rates = bench.ends, bench.moved[EXPLICIT], bench.moved[ANSWERED], bench.rows[6]
    for p in range(2 * N):
        for j in range(N):
            alpha_rate[j] = 1.0 if p == j else 0.0
            D_rate[j] = 1.0 if p == N + j else 0.0
        explicit_rates(
            scene, bench, tubes, segments, rules, alpha_rate[:N], D_rate[:N], none[:6], bench.lines[TORQUES], ends,
            explicit, rates,
        )  # fmt: skip
        for u in range(scene.counts[N_UNKNOWNS]):
            scene.vectors[STEP, u] = 0.0
        if scene.counts[LEAD] > 0:
            answered_ends(scene, answered)
            tip_rates(scene, bench, tubes, rules, leader, D_rate[:N], ends, explicit, answered, out[p])
            for i in range(6):
                actuation[p, i] = work_rate(scene, bench, i, rates, explicit) - out[p, i]
                if reciprocal:
                    out[p, i] = -actuation[p, i]  # forces have a potential, and bending is free up to the tip
        if reciprocal and p >= N:
            continue
        if twists:
            answer_rates(scene, bench, rates, scene.vectors[STEP])
        answered_ends(scene, answered)
        if not reciprocal:
            tip_rates(scene, bench, tubes, rules, leader, D_rate[:N], ends, explicit, answered, out[p])
        if p < N:
            for j in range(N):
                gain[j, p] = explicit[M, j] + answered[M, j]


@compiled
def work_rate(scene: Scene, bench: Bench, i: int, rates: Array, explicit: Array) -> float:
    """How the answer to component i of the tip's wrench changes the actuation load along a command: what is unbalanced
    there, ``rates`` (U,), times that answer; point moments add their work on the turn that both make, which depends on
    their order."""
    total = 0.0
    for u in range(scene.counts[N_UNKNOWNS]):
        total += bench.rows[i, u] * rates[u]
    if scene.counts[MOMENTS] == 0:
        return total
    N, turns = len(bench.offset), bench.rates
    axis, w, moved = bench.space[0], bench.space[1], bench.space[2]
    turns_at_ends(scene, bench, FINE, bench.rows[i], bench.lines[NONE], turns)
    first = scene.counts[N_LOADS] - POINT * scene.counts[N_POINTS]
    for p in range(scene.counts[N_POINTS]):
        at, load = scene.point_at[p], first + POINT * p
        j = int(scene.loads[load + TUBE])
        tangent(scene.frame, at, axis)
        for c in range(3):
            w[c] = explicit[at, N + c] + axis[c] * explicit[at, j]
            axis[c] = turns[at, c] + axis[c] * turns[at, 3 + j]
        cross(axis, w, moved)
        total -= dot(scene.loads[load + POINT_MOMENT : load + POINT], moved)
    return total
