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
from ctr_pvs.kernel.arrays import BLOCK
from ctr_pvs.kernel.arrays import FIRST
from ctr_pvs.kernel.arrays import FORCE
from ctr_pvs.kernel.arrays import LAST_COUPLED
from ctr_pvs.kernel.arrays import NEAR
from ctr_pvs.kernel.arrays import ROOT
from ctr_pvs.kernel.arrays import SCALE
from ctr_pvs.kernel.arrays import SIZE
from ctr_pvs.kernel.arrays import Array
from ctr_pvs.kernel.arrays import Bench
from ctr_pvs.kernel.arrays import Scene
from ctr_pvs.kernel.compiler import compiled
from ctr_pvs.kernel.twist.element import element_hessian
from ctr_pvs.kernel.twist.element import used


@compiled
def cholesky(A: Array, n: int) -> bool:
    """A = L L^T in the lower triangle of A (n, n); false at the first pivot that is not positive."""
    for j in range(n):
        s = A[j, j]
        for k in range(j):
            s -= A[j, k] * A[j, k]
        if not s > 0.0:
            return False
        pivot = math.sqrt(s)
        A[j, j] = pivot
        pivot = 1.0 / pivot
        for i in range(j + 1, n):
            s = A[i, j]
            for k in range(j):
                s -= A[i, k] * A[j, k]
            A[i, j] = s * pivot
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
def counted(scene: Scene, m: int, finer: int) -> int:
    """How many unknowns of element m count."""
    n = 0
    for j in range(scene.base.shape[1]):
        n += used(scene.parts[SIZE, m, j], finer)
    return n


@compiled
def factorize(
    scene: Scene, bench: Bench, rules: Array, finer: int, kind: int, slack: float, shift: float, base_shift: float
) -> bool:
    """Condenses the Hessian at the turned moments of ``scene``; false if it is not positive definite.

    finer, kind, slack : see ``element_hessian``.  shift : added to the diagonal of the unknowns.  base_shift < 0: the
    guide closes the system; else the base angles are free, but for that of the first tube, and ``base_shift`` [N m] is
    added to their stiffness.
    """
    N = len(bench.offset)
    P, near = bench.squares[BEYOND], bench.squares[NEAR]
    for i in range(N):
        for j in range(N):
            P[i, j] = 0.0
    for m in range(scene.counts[LAST_COUPLED] - 1, -1, -1):
        n = counted(scene, m, finer)
        o = scene.marks[m, BLOCK]
        H = bench.factors[o : o + n * n].reshape(n, n)
        X = bench.factors[o + n * n : o + n * (n + N)].reshape(N, n)
        for i in range(n):
            for k in range(i):
                H[i, k] = 0.0
            H[i, i] = 1.0 + shift
        for i in range(N):
            for k in range(n):
                X[i, k] = 0.0
            for k in range(N):
                near[i, k] = P[i, k]
        element_hessian(scene, rules, m, finer, kind, slack, bench.offset, H, X, near)
        add_beyond(scene, bench, m, H, X)
        if not cholesky(H, n):
            return False
        for i in range(N):
            solve_lower(H, n, X[i])
        for i in range(N):
            for k in range(i + 1):
                s = near[i, k]
                for u in range(n):
                    s -= X[i, u] * X[k, u]
                P[i, k] = s
                P[k, i] = s
    return close_base(scene, bench, shift, base_shift)


@compiled
def add_beyond(scene: Scene, bench: Bench, m: int, H: Array, X: Array) -> None:
    """Adds the stiffness of what lies beyond element m: it turns with the angles at the element's end, psi at its start
    plus scale times the first unknown."""
    P = bench.squares[BEYOND]
    for i in range(len(bench.offset)):
        for j in range(len(bench.offset)):
            if scene.parts[SIZE, m, j] > 0:
                o = bench.offset[j]
                stiff = scene.held[SCALE, m, j] * P[i, j]
                X[i, o] += stiff
                if i >= j and scene.parts[SIZE, m, i] > 0:
                    H[bench.offset[i], o] += scene.held[SCALE, m, i] * stiff


@compiled
def close_base(scene: Scene, bench: Bench, shift: float, base_shift: float) -> bool:
    """Factorises what the base angles feel, in ``BASE``."""
    N = len(bench.offset)
    B = bench.squares[BASE]
    for i in range(N):
        for j in range(i + 1):
            if base_shift < 0.0:
                B[i, j] = scene.base[ROOT, i] * bench.squares[BEYOND, i, j] * scene.base[ROOT, j]
            else:
                B[i, j] = bench.squares[BEYOND, i, j] if j > 0 else 0.0
        if base_shift < 0.0:
            B[i, i] += 1.0 + shift
        else:
            B[i, i] = B[i, i] + base_shift if i > 0 else 1.0
    return cholesky(B, N)


@compiled
def substitute(scene: Scene, bench: Bench, finer: int, rhs: Array, turned: Array, out: Array, free: bool) -> None:
    """Solves the factorised system for the right-hand side ``rhs`` (U,) into ``out`` (U,), while the base angles turn
    by ``turned`` (N,) [rad].  Unknowns that do not count get 0.

    free : base angles are unknown, as ``factorize`` was told by base_shift >= 0; ``turned`` then comes with the forces
    on them [N m], and goes with their turns [rad].
    """
    N = len(bench.offset)
    force, bent = bench.lines[FORCE], bench.lines[BENT]
    for j in range(N):
        force[j] = 0.0
    for m in range(scene.counts[LAST_COUPLED] - 1, -1, -1):
        n = counted(scene, m, finer)
        o = scene.marks[m, BLOCK]
        L = bench.factors[o : o + n * n].reshape(n, n)
        X = bench.factors[o + n * n : o + n * (n + N)].reshape(N, n)
        x = bench.factors[o + n * (n + N) : o + n * (n + N + 1)]
        row = 0
        for j in range(N):
            if scene.parts[SIZE, m, j] > 0:
                first = scene.parts[FIRST, m, j]
                for k in range(used(scene.parts[SIZE, m, j], finer)):
                    x[row + k] = rhs[first + k]
                x[row] += scene.held[SCALE, m, j] * force[j]
                row += used(scene.parts[SIZE, m, j], finer)
        solve_lower(L, n, x)
        for i in range(N):
            s = force[i]
            for k in range(n):
                s -= X[i, k] * x[k]
            force[i] = s
    turn_base(scene, bench, rhs, turned, out, free)
    for m in range(scene.counts[LAST_COUPLED]):
        n = counted(scene, m, finer)
        o = scene.marks[m, BLOCK]
        L = bench.factors[o : o + n * n].reshape(n, n)
        X = bench.factors[o + n * n : o + n * (n + N)].reshape(N, n)
        x = bench.factors[o + n * (n + N) : o + n * (n + N + 1)]
        for k in range(n):
            s = x[k]
            for i in range(N):
                s -= X[i, k] * bent[i]
            x[k] = s
        solve_upper(L, n, x)
        row = 0
        for j in range(N):
            if scene.parts[SIZE, m, j] > 0:
                first = scene.parts[FIRST, m, j]
                for k in range(scene.parts[SIZE, m, j]):
                    out[first + k] = x[row + k] if k < used(scene.parts[SIZE, m, j], finer) else 0.0
                bent[j] += scene.held[SCALE, m, j] * x[row]
                row += used(scene.parts[SIZE, m, j], finer)


@compiled
def turn_base(scene: Scene, bench: Bench, rhs: Array, turned: Array, out: Array, free: bool) -> None:
    """The guide's unknowns into ``out``, or the base's turns into ``turned``; the turns at the orifice into
    ``BENT``."""
    N = len(bench.offset)
    bent, row = bench.lines[BENT], bench.row
    if free:
        for j in range(N):
            row[j] = turned[j] + bench.lines[FORCE, j] if j > 0 else 0.0
            out[j] = 0.0
    else:
        for i in range(N):
            s = bench.lines[FORCE, i]
            for j in range(N):
                s -= bench.squares[BEYOND, i, j] * turned[j]
            row[i] = rhs[i] + scene.base[ROOT, i] * s
    solve_lower(bench.squares[BASE], N, row)
    solve_upper(bench.squares[BASE], N, row)
    for j in range(N):
        if free:
            turned[j] = row[j]
            bent[j] = row[j]
        else:
            out[j] = row[j]
            bent[j] = turned[j] + scene.base[ROOT, j] * row[j]
