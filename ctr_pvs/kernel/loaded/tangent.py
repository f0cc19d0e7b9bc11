"""The exact tangent where point moments act.

The virtual work of a dead moment is not the variation of a function, so the tangent is not symmetric: S + U^T A U, with
S, the symmetric part, as ``condensation`` factorises it, and A, skew, between the turns of frame and psi where the
moments sit.  Systems with it are solved by the conjugate gradients of P. Concus and G. H. Golub ("A generalized
conjugate gradient method for nonsymmetric systems of linear equations", 1976) and O. Widlund, preconditioned by S: they
end after one more step than A has rank, two or four for each moment.
"""

from __future__ import annotations

from ctr_pvs.kernel.arrays import ANSWERED
from ctr_pvs.kernel.arrays import FIRST
from ctr_pvs.kernel.arrays import FORCE
from ctr_pvs.kernel.arrays import LOADED
from ctr_pvs.kernel.arrays import MOMENTS
from ctr_pvs.kernel.arrays import MU_SIZE
from ctr_pvs.kernel.arrays import N_ELEMENTS
from ctr_pvs.kernel.arrays import N_LOADS
from ctr_pvs.kernel.arrays import N_POINTS
from ctr_pvs.kernel.arrays import N_UNKNOWNS
from ctr_pvs.kernel.arrays import NONE
from ctr_pvs.kernel.arrays import POINT
from ctr_pvs.kernel.arrays import POINT_MOMENT
from ctr_pvs.kernel.arrays import ROOT
from ctr_pvs.kernel.arrays import ROWS
from ctr_pvs.kernel.arrays import SCALE
from ctr_pvs.kernel.arrays import SIZE
from ctr_pvs.kernel.arrays import TUBE
from ctr_pvs.kernel.arrays import Array
from ctr_pvs.kernel.arrays import Bench
from ctr_pvs.kernel.arrays import Scene
from ctr_pvs.kernel.backbone.frames import cross
from ctr_pvs.kernel.backbone.frames import tangent
from ctr_pvs.kernel.compiler import compiled
from ctr_pvs.kernel.twist.condensation import substitute
from ctr_pvs.kernel.twist.fields import BENDING_ONLY
from ctr_pvs.kernel.twist.fields import counted
from ctr_pvs.kernel.twist.fields import field_of
from ctr_pvs.kernel.twist.fields import used

#: A correction smaller than this share of the solution is rounding.
ROUNDING_SHARE = 1e-15
#: Rows of ``bench.rows`` from which this module works.
WORK = ROWS - 7


@compiled
def solve_tangent(scene: Scene, bench: Bench, which: int, rhs: Array, turned: Array, out: Array, sign: float) -> None:
    """As ``substitute`` with bases held, for the exact tangent; sign -1.0: for its transpose."""
    substitute(scene, bench, which, rhs, turned, out, False)
    if scene.counts[MOMENTS] == 0:
        return
    U = scene.counts[N_UNKNOWNS]
    r, x, x_before, s, s_before, v, a = bench.rows[WORK : WORK + 7]
    turn_by_skew(scene, bench, which, out, turned, sign, r)
    for u in range(U):
        r[u] = -r[u]
        x[u] = x_before[u] = s[u] = s_before[u] = 0.0
    omega, rho_before, first = 1.0, 1.0, 0.0
    for k in range(5 + 4 * scene.counts[MOMENTS]):
        substitute(scene, bench, which, r, bench.lines[NONE], v, False)
        rho = 0.0
        for u in range(U):
            rho += r[u] * v[u]
        if k == 0:
            for u in range(U):
                first += out[u] * out[u]
        else:
            omega = 1.0 / (1.0 + rho / (rho_before * omega))
        if rho <= ROUNDING_SHARE**2 * first:
            break
        for u in range(U):
            ahead = x_before[u] + omega * (v[u] + x[u] - x_before[u])
            s_ahead = s_before[u] + omega * (r[u] + s[u] - s_before[u])
            r[u] += s[u] - s_ahead
            x_before[u], x[u], s_before[u], s[u] = x[u], ahead, s[u], s_ahead
            v[u] = x[u] - x_before[u]
        turn_by_skew(scene, bench, which, v, bench.lines[NONE], sign, a)
        for u in range(U):
            r[u] -= a[u]
        rho_before = rho
    for u in range(U):
        out[u] += x[u]


@compiled
def turn_by_skew(scene: Scene, bench: Bench, which: int, v: Array, turned: Array, sign: float, out: Array) -> None:
    """The skew part of the tangent, times ``sign``, on unknowns v (U,) and turns of the bases (N,), into ``out``
    (U,)."""
    M, ends = scene.counts[N_ELEMENTS], 3 + len(bench.offset)
    turns, axis, arm = bench.rates, bench.space[0], bench.space[1]
    turns_at_ends(scene, bench, which, v, turned, turns)
    first = scene.counts[N_LOADS] - POINT * scene.counts[N_POINTS]
    pushes = bench.moved[ANSWERED]
    for m in range(M + 1):
        for i in range(ends):
            pushes[m, i] = 0.0
    for p in range(scene.counts[N_POINTS]):
        at, load = scene.point_at[p], first + POINT * p
        j, Q = 3 + int(scene.loads[load + TUBE]), scene.loads[load + POINT_MOMENT : load + POINT]
        tangent(scene.frame, at, axis)
        cross(axis, Q, arm)
        for i in range(3):
            pushes[at, j] -= 0.5 * sign * arm[i] * turns[at, i]
            pushes[at, i] += 0.5 * sign * arm[i] * turns[at, j]
        cross(Q, turns[at, :3], arm)
        for i in range(3):
            pushes[at, i] -= 0.5 * sign * arm[i]
    gather_pushes(scene, bench, which, pushes, out)


@compiled
def turns_at_ends(scene: Scene, bench: Bench, which: int, v: Array, turned: Array, out: Array) -> None:
    """Turns of the frame and of psi at the elements' starts, and the last one's end, into ``out`` (M + 1, 3 + N) for a
    change v (U,) of the unknowns and ``turned`` (N,) of the bases [rad]."""
    N = len(bench.offset)
    for i in range(3):
        out[0, i] = 0.0
    for j in range(N):
        out[0, 3 + j] = turned[j] + scene.base[ROOT, j] * v[j]
    for m in range(scene.counts[N_ELEMENTS]):
        for i in range(3 + N):
            out[m + 1, i] = out[m, i]
        for j in range(N):
            if used(scene.parts[SIZE, m, j], which) > 0:
                out[m + 1, 3 + j] += scene.held[SCALE, m, j] * v[scene.parts[FIRST, m, j]]
        if not scene.marks[m, LOADED]:
            continue
        n = counted(scene, m, which)
        end = bench.swings[m]
        for i in range(3):
            s = out[m, i]
            for j in range(N):
                s += end[i, n + 3 + j] * out[m, 3 + j]
            out[m + 1, i] = s
        row = 0
        for field in range(N + 2):
            first, size = field_of(scene, m, field, which)
            for k in range(size):
                for i in range(3):
                    out[m + 1, i] += end[i, row + k] * v[first + k]
            row += size


@compiled
def gather_pushes(scene: Scene, bench: Bench, which: int, pushes: Array, out: Array) -> None:
    """What forces on the turns of frame and psi at the elements' ends (M + 1, 3 + N) mean for the unknowns, into
    ``out`` (U,): the transpose of ``turns_at_ends``."""
    N = len(bench.offset)
    force = bench.lines[FORCE]
    for i in range(3 + N):
        force[i] = 0.0
    for m in range(scene.counts[N_ELEMENTS] - 1, -1, -1):
        for i in range(3 + N):
            force[i] += pushes[m + 1, i]
        n, row = counted(scene, m, which), 0
        end = bench.swings[m]
        for field in range(N + 2):
            first, size = field_of(scene, m, field, which)
            whole = scene.parts[SIZE, m, field] if field < N else scene.marks[m, MU_SIZE]
            for k in range(whole):
                out[first + k] = 0.0
            if field < N and size > 0:
                out[first] = scene.held[SCALE, m, field] * force[3 + field]
            for k in range(size if scene.marks[m, LOADED] else 0):
                out[first + k] += end[0, row + k] * force[0] + end[1, row + k] * force[1] + end[2, row + k] * force[2]
            row += size
        for j in range(N if scene.marks[m, LOADED] else 0):
            a = n + 3 + j
            force[3 + j] += end[0, a] * force[0] + end[1, a] * force[1] + end[2, a] * force[2]
    for j in range(N):
        out[j] = scene.base[ROOT, j] * (force[3 + j] + pushes[0, 3 + j]) if which != BENDING_ONLY else 0.0
