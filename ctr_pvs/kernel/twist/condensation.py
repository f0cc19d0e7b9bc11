"""Newton's linear system, solved element by element.

From the tip inwards the unknowns of each element are eliminated by a small Cholesky factorisation: what is left of the
elements beyond is a stiffness (N, N) and a force (N,) on the angles where they start.  At the base the guide closes the
system.  Going out again gives the solution.  The cost is linear in the number of elements, and every pivot is positive
if and only if the whole Hessian is positive definite: stability comes with the solution.
"""

from __future__ import annotations

import math

from ctr_pvs.kernel.arrays import BASE
from ctr_pvs.kernel.arrays import BENT
from ctr_pvs.kernel.arrays import BEYOND
from ctr_pvs.kernel.arrays import FORCE
from ctr_pvs.kernel.arrays import LAST_ACTIVE
from ctr_pvs.kernel.arrays import LEAD
from ctr_pvs.kernel.arrays import LOADED
from ctr_pvs.kernel.arrays import MOMENTS
from ctr_pvs.kernel.arrays import MU_SIZE
from ctr_pvs.kernel.arrays import N_LOADS
from ctr_pvs.kernel.arrays import N_POINTS
from ctr_pvs.kernel.arrays import POINT
from ctr_pvs.kernel.arrays import POINT_MOMENT
from ctr_pvs.kernel.arrays import ROOT
from ctr_pvs.kernel.arrays import SCALE
from ctr_pvs.kernel.arrays import SIZE
from ctr_pvs.kernel.arrays import TUBE
from ctr_pvs.kernel.arrays import Array
from ctr_pvs.kernel.arrays import Bench
from ctr_pvs.kernel.arrays import Scene
from ctr_pvs.kernel.backbone.frames import cross
from ctr_pvs.kernel.backbone.frames import tangent
from ctr_pvs.kernel.compiler import compiled
from ctr_pvs.kernel.loaded.hessian import add_symmetric
from ctr_pvs.kernel.loaded.hessian import spread_of
from ctr_pvs.kernel.twist.element import element_hessian
from ctr_pvs.kernel.twist.fields import BENDING_ONLY
from ctr_pvs.kernel.twist.fields import counted
from ctr_pvs.kernel.twist.fields import field_of
from ctr_pvs.kernel.twist.fields import used


@compiled
def cholesky(A: Array, n: int, wide: int) -> bool:
    """Eliminates the first n rows of the symmetric A (wide, wide), of which the lower triangle counts: there they
    become L, below them B L^-T, and the rest is what is left for the others.  False at the first pivot that is not
    positive."""
    for j in range(n):
        s = A[j, j]
        for k in range(j):
            s -= A[j, k] * A[j, k]
        if not s > 0.0:
            return False
        pivot = math.sqrt(s)
        A[j, j] = pivot
        pivot = 1.0 / pivot
        for i in range(j + 1, wide):
            s = A[i, j]
            for k in range(j):
                s -= A[i, k] * A[j, k]
            A[i, j] = s * pivot
    for i in range(n, wide):
        for j in range(n, i + 1):
            s = A[i, j]
            for k in range(n):
                s -= A[i, k] * A[j, k]
            A[i, j] = s
    return True


@compiled
def solve_lower(L: Array, n: int, b: Array) -> None:
    """b (n,) becomes L^-1 b."""
    for i in range(n):
        s = b[i]
        for k in range(i):
            s -= L[i, k] * b[k]
        b[i] = s / L[i, i]


@compiled
def solve_upper(L: Array, n: int, b: Array) -> None:
    """b (n,) becomes L^-T b."""
    for i in range(n - 1, -1, -1):
        s = b[i]
        for k in range(i + 1, n):
            s -= L[k, i] * b[k]
        b[i] = s / L[i, i]


@compiled
def factorize(
    scene: Scene, bench: Bench, rules: Array, which: int, kind: int, slack: float, shift: float, base_shift: float
) -> bool:
    """Condenses the Hessian at the turned moments of ``scene``, its symmetric part where point moments act; false if it
    is not positive definite.

    which : unknowns that count, see ``fields``; kind, slack : see ``element_hessian``.  shift : added to the diagonal
    of the unknowns.  base_shift < 0: the guide closes the system; else the base angles are free, but for that of the
    first tube, and ``base_shift`` [N m] is added to their stiffness.
    """
    lead = scene.counts[LEAD]
    ends = lead + len(bench.offset)
    P = bench.squares[BEYOND]
    for i in range(ends):
        for j in range(ends):
            P[i, j] = 0.0
    for m in range(scene.counts[LAST_ACTIVE] - 1, -1, -1):
        stiffen_by_moments(scene, bench, m + 1)
        n = counted(scene, m, which)
        wide = n + ends
        A = bench.factors[m]
        for i in range(wide):
            for k in range(i + 1):
                A[i, k] = 0.0
        for i in range(n):
            A[i, i] = 1.0 + shift
        element_hessian(scene, bench, rules, m, which, kind, slack, A)
        add_psi_beyond(scene, bench, m, which, n + lead, A)
        if scene.marks[m, LOADED]:
            add_frame_beyond(scene, bench, m, which, n, A)
        if not cholesky(A, n, wide):
            return False
        for i in range(ends):
            for k in range(i + 1):
                P[i, k] = A[n + i, n + k]
                P[k, i] = A[n + i, n + k]
    return close_base(scene, bench, which, shift, base_shift)


@compiled
def add_psi_beyond(scene: Scene, bench: Bench, m: int, which: int, start: int, A: Array) -> None:
    """Adds the stiffness of what lies beyond element m along psi at its end: psi at its start, which begins at the row
    ``start``, plus scale times the first unknown."""
    lead = scene.counts[LEAD]
    P = bench.squares[BEYOND]
    for i in range(len(bench.offset)):
        for j in range(len(bench.offset)):
            p = P[lead + i, lead + j]
            if i >= j:
                A[start + i, start + j] += p
            if used(scene.parts[SIZE, m, j], which) > 0:
                stiff = scene.held[SCALE, m, j] * p
                A[start + i, bench.offset[j]] += stiff
                if i >= j and used(scene.parts[SIZE, m, i], which) > 0:
                    A[bench.offset[i], bench.offset[j]] += scene.held[SCALE, m, i] * stiff


@compiled
def add_frame_beyond(scene: Scene, bench: Bench, m: int, which: int, n: int, A: Array) -> None:
    """Adds the stiffness of what lies beyond element m, of n unknowns, along the turn of the frame at its end, and
    along that and psi."""
    N = len(bench.offset)
    wide = n + 3 + N
    P = bench.squares[BEYOND]
    spread = spread_of(bench, wide)
    end, work = spread.end, spread.work
    kept = bench.swings[m]
    for i in range(3):
        for a in range(wide):
            kept[i, a] = end[i, a]
            work[i, a] = 0.5 * (P[i, 0] * end[0, a] + P[i, 1] * end[1, a] + P[i, 2] * end[2, a])
        for j in range(N):
            work[i, n + 3 + j] += P[i, 3 + j]
            if used(scene.parts[SIZE, m, j], which) > 0:
                work[i, bench.offset[j]] += scene.held[SCALE, m, j] * P[i, 3 + j]
    add_symmetric(A, end, work)


@compiled
def stiffen_by_moments(scene: Scene, bench: Bench, at: int) -> None:
    """Adds the symmetric part of what point moments where element ``at`` starts do to the stiffness beyond: their work
    on psi changes as the tangent turns."""
    if scene.counts[MOMENTS] == 0:
        return
    P, axis, turning = bench.squares[BEYOND], bench.space[0], bench.space[1]
    tangent(scene.frame, at, axis)
    first = scene.counts[N_LOADS] - POINT * scene.counts[N_POINTS]
    for p in range(scene.counts[N_POINTS]):
        if scene.point_at[p] == at:
            load = first + POINT * p
            j = 3 + int(scene.loads[load + TUBE])
            cross(axis, scene.loads[load + POINT_MOMENT : load + POINT], turning)
            for i in range(3):
                P[i, j] -= 0.5 * turning[i]
                P[j, i] -= 0.5 * turning[i]


@compiled
def close_base(scene: Scene, bench: Bench, which: int, shift: float, base_shift: float) -> bool:
    """Factorises what the base angles feel, in ``BASE``."""
    N, lead = len(bench.offset), scene.counts[LEAD]
    B, P = bench.squares[BASE], bench.squares[BEYOND]
    if which == BENDING_ONLY:
        return True
    for i in range(N):
        for j in range(i + 1):
            p = P[lead + i, lead + j]
            if base_shift < 0.0:
                B[i, j] = scene.base[ROOT, i] * p * scene.base[ROOT, j]
            else:
                B[i, j] = p if j > 0 else 0.0
        if base_shift < 0.0:
            B[i, i] += 1.0 + shift
        else:
            B[i, i] = B[i, i] + base_shift if i > 0 else 1.0
    return cholesky(B, N, N)


@compiled
def substitute(scene: Scene, bench: Bench, which: int, rhs: Array, turned: Array, out: Array, free: bool) -> None:
    """Solves the factorised system for the right-hand side ``rhs`` (U,) into ``out`` (U,), while the base angles turn
    by ``turned`` (N,) [rad].  Unknowns that do not count get 0.

    free : base angles are unknown, as ``factorize`` was told by base_shift >= 0; ``turned`` then comes with the forces
    on them [N m], and goes with their turns [rad].
    """
    N, lead = len(bench.offset), scene.counts[LEAD]
    force, bent = bench.lines[FORCE], bench.lines[BENT]
    ends = lead + N
    for i in range(ends):
        force[i] = 0.0
    for m in range(scene.counts[LAST_ACTIVE] - 1, -1, -1):
        n = counted(scene, m, which)
        L, x, end = bench.factors[m], bench.sides[m], bench.swings[m]
        row = 0
        for field in range(N + 2):
            first, size = field_of(scene, m, field, which)
            for k in range(size):
                x[row + k] = rhs[first + k]
            if field < N and size > 0:
                x[row] += scene.held[SCALE, m, field] * force[lead + field]
            row += size
        for i in range(ends):
            x[n + i] = force[i]
        if scene.marks[m, LOADED]:
            for a in range(n + ends):
                pushed = end[0, a] * force[0] + end[1, a] * force[1] + end[2, a] * force[2]
                x[a] = pushed if n <= a < n + 3 else x[a] + pushed
        solve_lower(L, n, x)
        for i in range(ends):
            s = x[n + i]
            for k in range(n):
                s -= L[n + i, k] * x[k]
            force[i] = s
    turn_base(scene, bench, which, rhs, turned, out, free)
    for m in range(scene.counts[LAST_ACTIVE]):
        n = counted(scene, m, which)
        L, x, end = bench.factors[m], bench.sides[m], bench.swings[m]
        for k in range(n):
            s = x[k]
            for i in range(ends):
                s -= L[n + i, k] * bent[i]
            x[k] = s
        solve_upper(L, n, x)
        row = 0
        if scene.marks[m, LOADED]:
            for i in range(ends):
                x[n + i] = bent[i]
            for i in range(3):
                s = 0.0
                for a in range(n + ends):
                    s += end[i, a] * x[a]
                bent[i] = s
        for field in range(N + 2):
            first, size = field_of(scene, m, field, which)
            whole = scene.parts[SIZE, m, field] if field < N else scene.marks[m, MU_SIZE]
            for k in range(whole):
                out[first + k] = x[row + k] if k < size else 0.0
            if field < N and size > 0:
                bent[lead + field] += scene.held[SCALE, m, field] * x[row]
            row += size


@compiled
def turn_base(scene: Scene, bench: Bench, which: int, rhs: Array, turned: Array, out: Array, free: bool) -> None:
    """The guide's unknowns into ``out``, or the base's turns into ``turned``; the turns at the orifice into
    ``BENT``."""
    N, lead = len(bench.offset), scene.counts[LEAD]
    bent, row = bench.lines[BENT], bench.row
    for i in range(lead):
        bent[i] = 0.0
    if which == BENDING_ONLY:
        for j in range(N):
            out[j], bent[lead + j] = 0.0, 0.0
        return
    if free:
        for j in range(N):
            row[j] = turned[j] + bench.lines[FORCE, lead + j] if j > 0 else 0.0
            out[j] = 0.0
    else:
        for i in range(N):
            s = bench.lines[FORCE, lead + i]
            for j in range(N):
                s -= bench.squares[BEYOND, lead + i, lead + j] * turned[j]
            row[i] = rhs[i] + scene.base[ROOT, i] * s
    solve_lower(bench.squares[BASE], N, row)
    solve_upper(bench.squares[BASE], N, row)
    for j in range(N):
        if free:
            turned[j] = row[j]
            bent[lead + j] = row[j]
        else:
            out[j] = row[j]
            bent[lead + j] = turned[j] + scene.base[ROOT, j] * row[j]
