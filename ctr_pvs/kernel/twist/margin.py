"""The stability margin: the smallest eigenvalue of the energy's Hessian, relative to torsional stiffness.

The unknowns are scaled so that torsion alone has the unit matrix, hence this is an ordinary eigenvalue; bending is
eliminated, the guide counted.  1: nothing pulls the tubes off; 0: a fold.  A twist field outside the basis has 1.
"""

from __future__ import annotations

import math

from ctr_pvs.kernel.arrays import COUPLED
from ctr_pvs.kernel.arrays import GAUSS
from ctr_pvs.kernel.arrays import LEAD
from ctr_pvs.kernel.arrays import MU
from ctr_pvs.kernel.arrays import MU_SIZE
from ctr_pvs.kernel.arrays import N_ELEMENTS
from ctr_pvs.kernel.arrays import N_LOADS
from ctr_pvs.kernel.arrays import N_UNKNOWNS
from ctr_pvs.kernel.arrays import NONE
from ctr_pvs.kernel.arrays import OTHER
from ctr_pvs.kernel.arrays import ROW
from ctr_pvs.kernel.arrays import ROWS
from ctr_pvs.kernel.arrays import STEP
from ctr_pvs.kernel.arrays import TURNED
from ctr_pvs.kernel.arrays import Array
from ctr_pvs.kernel.arrays import Bench
from ctr_pvs.kernel.arrays import Scene
from ctr_pvs.kernel.compiler import compiled
from ctr_pvs.kernel.twist.condensation import factorize
from ctr_pvs.kernel.twist.condensation import substitute
from ctr_pvs.kernel.twist.element import EXACT
from ctr_pvs.kernel.twist.element import energy_gradient
from ctr_pvs.kernel.twist.fields import BENDING_ONLY
from ctr_pvs.kernel.twist.fields import FINE

#: Most Lanczos vectors, and the relative change of the largest Ritz value that ends it.
MOST_VECTORS, SETTLED = ROWS - 2, 1e-13
#: Below this a new vector is rounding: the space is exhausted.
BREAKDOWN = 1e-12
#: A step of Newton by less than this share is rounding.
ROUNDED = 4e-16


@compiled
def all_attract(scene: Scene) -> bool:
    """True if no load acts and no two tubes push each other anywhere: then the margin is 1 without a look at the
    Hessian."""
    N = scene.base.shape[1]
    if scene.counts[N_LOADS] > 0:
        return False
    for m in range(scene.counts[N_ELEMENTS]):
        if not scene.marks[m, COUPLED]:
            continue
        for row in range(scene.marks[m, ROW], scene.marks[m, ROW] + scene.marks[m, GAUSS]):
            for i in range(N):
                for j in range(i):
                    if (scene.moments[TURNED, row, i].conjugate() * scene.moments[TURNED, row, j]).real < 0.0:
                        return False
    return True


@compiled
def stability_margin(scene: Scene, bench: Bench, tubes: Array, rules: Array, alpha: Array) -> float:
    """The margin of ``y`` at alpha (N,) [rad] and the finer degree, clipped at 1; -1 if it is not positive.

    Under load bending may lose its stiffness too: the margin is the smaller one of that of bending alone, with psi held
    and relative to bending stiffness, and that of psi, bending eliminated.
    """
    energy_gradient(scene, bench, tubes, rules, alpha)
    if all_attract(scene):
        return 1.0
    margin = 1.0
    for which in (BENDING_ONLY, FINE):
        if which == BENDING_ONLY and scene.counts[LEAD] == 0:
            continue
        if not factorize(scene, bench, rules, which, EXACT, 0.0, 0.0, -1.0):
            return -1.0
        largest = largest_compliance(scene, bench, which)
        margin = min(margin, 1.0 / largest if largest > 1.0 else 1.0)
    return margin


@compiled
def mark_unknowns(scene: Scene, which: int, out: Array) -> int:
    """1 into ``out`` (U,) for the unknowns whose margin is asked for, of mu or of psi, else 0; how many they are."""
    for u in range(scene.counts[N_UNKNOWNS]):
        out[u] = 0.0 if which == BENDING_ONLY else 1.0
    for m in range(scene.counts[N_ELEMENTS]):
        for k in range(2 * scene.marks[m, MU_SIZE]):
            out[scene.marks[m, MU] + k] = 1.0 if which == BENDING_ONLY else 0.0
    count = 0
    for u in range(scene.counts[N_UNKNOWNS]):
        count += 1 if out[u] > 0.0 else 0
    return count


@compiled
def largest_compliance(scene: Scene, bench: Bench, which: int) -> float:
    """The largest eigenvalue of the inverse of the factorised Hessian on the unknowns of ``mark_unknowns``, by Lanczos
    from a fixed start; others adapt."""
    U = scene.counts[N_UNKNOWNS]
    vectors = bench.rows
    v, marked = vectors[0], scene.vectors[OTHER]
    most = min(MOST_VECTORS, mark_unknowns(scene, which, marked))
    size = 0.0
    for u in range(U):
        v[u] = marked[u] * (1.0 + 0.5 * math.sin(1.7 * u))  # a mixed start: no symmetry of a robot is orthogonal to it
        size += v[u] * v[u]
    for u in range(U):
        v[u] /= max(math.sqrt(size), 1e-300)
    diagonal, side = vectors[MOST_VECTORS], vectors[MOST_VECTORS + 1]
    largest, count = 0.0, 0
    for k in range(most):
        w = scene.vectors[STEP]
        substitute(scene, bench, which, vectors[k], bench.lines[NONE], w, False)
        dot = 0.0
        for u in range(U):
            w[u] *= marked[u]
            dot += vectors[k, u] * w[u]
        diagonal[k] = dot
        count = k + 1
        for _ in range(2):  # full orthogonalisation, twice: few vectors, no ghosts
            for i in range(k + 1):
                dot = 0.0
                for u in range(U):
                    dot += vectors[i, u] * w[u]
                for u in range(U):
                    w[u] -= dot * vectors[i, u]
        size = 0.0
        for u in range(U):
            size += w[u] * w[u]
        size = math.sqrt(size)
        previous = largest
        largest = largest_eigenvalue(diagonal, side, count, previous)
        if size < BREAKDOWN * largest or largest - previous <= SETTLED * largest:
            break
        if k + 1 < most:
            side[k] = size
            for u in range(U):
                vectors[k + 1, u] = w[u] / size
    return largest


@compiled
def largest_eigenvalue(diagonal: Array, side: Array, n: int, before: float) -> float:
    """Of the symmetric tridiagonal matrix with ``diagonal`` (n,) and ``side`` (n - 1,), whose first n - 1 rows have
    ``before``: by Newton on the characteristic polynomial from above all roots, where it falls to the largest."""
    if n == 1:
        return float(diagonal[0])
    x = max(before, diagonal[n - 1]) + abs(side[n - 2])  # above all by Weyl's inequality
    while True:
        ratio, pivot, rate = 0.0, 1.0, 0.0  # p' / p, and the pivots of x - T with their derivatives
        for i in range(n):
            share = side[i - 1] * side[i - 1] / (pivot * pivot) if i > 0 else 0.0
            pivot, rate = x - diagonal[i] - share * pivot, 1.0 + share * rate
            if not pivot > 0.0:
                return x
            ratio += rate / pivot
        if not 1.0 / ratio > ROUNDED * x:
            return x
        x -= 1.0 / ratio
