"""One element at the twist level: its energy, gradient and Hessian.

With no load beyond, bending follows point by point, k = sum K_j kappa_j exp(i psi_j) / sum K (eq. (26) of the seed),
and what is left of the energy of an element is

    y.y / 2 - int |sum b_j|^2 / (2 sum K) ds + constant,      b_j = K_j kappa*_j exp(i psi_j) [N m],

in complex notation for the two bending directions.  Its second derivative along psi is that of springs between every
two tubes, of stiffness Re(conj(b_i) b_j) / sum K, a cosine of the angle between their turned pre-curvatures.
"""

from __future__ import annotations

import math

from ctr_pvs.kernel.arrays import ANGLE
from ctr_pvs.kernel.arrays import BEFORE
from ctr_pvs.kernel.arrays import COUPLED
from ctr_pvs.kernel.arrays import FIRST
from ctr_pvs.kernel.arrays import GAUSS
from ctr_pvs.kernel.arrays import GRADIENT
from ctr_pvs.kernel.arrays import INTEGRAL
from ctr_pvs.kernel.arrays import LEAD
from ctr_pvs.kernel.arrays import LOADED
from ctr_pvs.kernel.arrays import MOMENT
from ctr_pvs.kernel.arrays import MU_SIZE
from ctr_pvs.kernel.arrays import N_ELEMENTS
from ctr_pvs.kernel.arrays import N_LOADS
from ctr_pvs.kernel.arrays import N_UNKNOWNS
from ctr_pvs.kernel.arrays import PSI
from ctr_pvs.kernel.arrays import PULL
from ctr_pvs.kernel.arrays import ROOT
from ctr_pvs.kernel.arrays import ROW
from ctr_pvs.kernel.arrays import SCALE
from ctr_pvs.kernel.arrays import SIZE
from ctr_pvs.kernel.arrays import STIFFNESS
from ctr_pvs.kernel.arrays import TORQUE
from ctr_pvs.kernel.arrays import TURNED
from ctr_pvs.kernel.arrays import WEIGHT
from ctr_pvs.kernel.arrays import Array
from ctr_pvs.kernel.arrays import Bench
from ctr_pvs.kernel.arrays import Scene
from ctr_pvs.kernel.arrays import Y
from ctr_pvs.kernel.backbone.frames import bend
from ctr_pvs.kernel.backbone.frames import chain
from ctr_pvs.kernel.compiler import compiled
from ctr_pvs.kernel.loaded.hessian import load_hessian
from ctr_pvs.kernel.loaded.statics import forces_work
from ctr_pvs.kernel.loaded.statics import gather_moments
from ctr_pvs.kernel.loaded.statics import spread_loads
from ctr_pvs.kernel.loaded.statics import twist_by_moments
from ctr_pvs.kernel.twist.fields import angles_inside
from ctr_pvs.kernel.twist.fields import spread_angles
from ctr_pvs.kernel.twist.fields import turn_moments
from ctr_pvs.kernel.twist.fields import used
from ctr_pvs.kernel.twist.fields import used_bending

#: What stands for the cosines in a Hessian: themselves; their least value on the box that holds the angles ``before``
#: and the present ones; the least value there is; or, at the two ends of a straight way, what makes the mean of both a
#: bound for all on the way: cos and |sin| leave their chords by no more than an eighth of the square of the turn.
EXACT, LOWERED, WORST, ALONG = 0, 1, 2, 3
#: The branch between two states may leave the straight line between them: the box is this much wider on either side.
WIDER = 0.25
#: Below this turn [rad] two terms of Taylor's series bound a cosine as well as the cosine itself.
SMALL_TURN = 1e-2


@compiled
def pull_tubes(scene: Scene, m: int) -> None:
    """Fills ``pull`` (G, N) of element m: what bending pulls each tube's psi at the Gauss points [N m], eq. (35), with
    the moment of the loads: bending follows pointwise, k = (sum b_j + moment) / sum K."""
    for row in range(scene.marks[m, ROW], scene.marks[m, ROW] + scene.marks[m, GAUSS]):
        total = scene.bends[row, MOMENT]
        for j in range(scene.base.shape[1]):
            total += scene.moments[TURNED, row, j]
        share = scene.gauss[row, WEIGHT] / scene.line[m, STIFFNESS]
        for j in range(scene.base.shape[1]):
            b = scene.moments[TURNED, row, j]
            scene.turns[PULL, row, j] = share * (total.real * b.imag - total.imag * b.real)


@compiled
def gather(scene: Scene, rules: Array, out: Array) -> None:
    """What ``pull`` at the Gauss points of the coupled elements means for the tubes' unknowns, sum pull dpsi / dy into
    ``out`` (U,), and for psi at the elements' ends: the sum of all beyond into ``torque``.  That begins with what
    stands in ``torque`` already: see ``clear_torques`` and ``twist_by_moments``."""
    N = scene.base.shape[1]
    M = scene.counts[N_ELEMENTS]
    for m in range(M - 1, -1, -1):
        G = scene.marks[m, GAUSS]
        for j in range(N):
            beyond = scene.held[TORQUE, m + 1, j]
            first, size = scene.parts[FIRST, m, j], scene.parts[SIZE, m, j]
            here = 0.0
            for k in range(size):
                out[first + k] = 0.0
            if scene.marks[m, COUPLED] and size > 1:
                for g in range(G):
                    pull = scene.turns[PULL, scene.marks[m, ROW] + g, j]
                    here += pull
                    for k in range(size):
                        out[first + k] += pull * rules[G, g, INTEGRAL + k]
                for k in range(size):
                    out[first + k] *= scene.held[SCALE, m, j]
            if size > 0:
                out[first] += scene.held[SCALE, m, j] * beyond
            scene.held[TORQUE, m, j] += beyond + here
    for j in range(N):
        out[j] = scene.base[ROOT, j] * scene.held[TORQUE, 0, j]


@compiled
def clear_torques(scene: Scene) -> None:
    """No point of load twists anything."""
    for m in range(scene.counts[N_ELEMENTS] + 1):
        for j in range(scene.base.shape[1]):
            scene.held[TORQUE, m, j] = 0.0


@compiled
def energy_gradient(scene: Scene, bench: Bench, tubes: Array, rules: Array, alpha: Array) -> None:
    """dE/dy of the whole robot, less the loads' virtual work, at ``y`` and alpha (N,) [rad] into ``gradient``; turned
    moments and torques stay in ``scene``, and under load frames and moments."""
    spread_angles(scene, alpha, scene.vectors[Y])
    clear_torques(scene)
    if scene.counts[N_LOADS] > 0:
        bend(scene, rules, False)
        chain(scene, tubes, rules)
        spread_loads(scene, bench, rules)
        twist_by_moments(scene)
    for m in range(scene.counts[N_ELEMENTS]):
        if scene.marks[m, COUPLED]:
            if scene.counts[N_LOADS] == 0:
                angles_inside(scene, rules, m, scene.held[ANGLE, m], scene.vectors[Y], scene.turns[PSI])
                turn_moments(scene, m)
            pull_tubes(scene, m)
    gather(scene, rules, scene.vectors[GRADIENT])
    gather_moments(scene, rules, MOMENT, scene.vectors[GRADIENT])
    for u in range(scene.counts[N_UNKNOWNS]):
        scene.vectors[GRADIENT, u] += scene.vectors[Y, u]


@compiled
def spring(product: complex, moved: float, slack: float, kind: int) -> float:
    """Re(product) [N^2 m^2], product = conj(b) c: |b| |c| times the cosine of the angle between two turned moments.  Or
    a lower bound by ``kind``, where that angle has moved by ``moved`` [rad] and ``slack`` more."""
    if kind == EXACT:
        return product.real
    size = math.sqrt(product.real * product.real + product.imag * product.imag)
    if kind == WORST:
        return -size
    turned = abs(moved)
    if kind == ALONG:
        curved = 0.125 * turned * turned * (1.0 + slack) + 0.5 * slack * slack
        return product.real - abs(product.imag) * slack - size * curved
    if turned < SMALL_TURN:
        reach = (1.0 + WIDER) * turned + slack
        return max(-size, product.real - abs(product.imag) * reach - 0.5 * size * reach * reach)
    # The box is centred halfway between the two states.
    half, reach = 0.5 * moved, (0.5 + WIDER) * turned + slack
    centre = product * complex(math.cos(half), -math.sin(half))
    if reach >= math.pi or centre.real <= -size * math.cos(reach):
        return -size
    return centre.real * math.cos(reach) - abs(centre.imag) * math.sin(reach)


@compiled
def element_hessian(
    scene: Scene, bench: Bench, rules: Array, m: int, which: int, kind: int, slack: float, A: Array
) -> int:  # fmt: skip
    """Adds the bending part of element m's second derivative to the lower triangle of A (n + S, n + S); n, the unknowns
    it counts.

    Rows: the unknowns, tube by tube, then mu_y and mu_z; under load the turn of the frame at its start (3,); psi there
    (N,).  ``bench.offset`` is filled with the first row of each tube.  kind, slack : see ``spring``.
    """
    N = len(bench.offset)
    n = 0
    for j in range(N):
        bench.offset[j] = n
        n += used(scene.parts[SIZE, m, j], which)
    n += 2 * used_bending(scene.marks[m, MU_SIZE], which)
    if not scene.marks[m, COUPLED]:
        return n
    start = n + scene.counts[LEAD]
    for i in range(N):
        if scene.parts[SIZE, m, i] < 2:
            continue
        wide = used(scene.parts[SIZE, m, i], which) + 1  # of all tubes that are curved here
        if scene.marks[m, LOADED]:
            sum_springs(scene, rules, m, i, i, kind, slack, wide, bench.sums)
            add_springs(scene, bench, m, i, i, 1.0, start, wide, A)
        for j in range(i):
            if scene.parts[SIZE, m, j] > 1:
                sum_springs(scene, rules, m, i, j, kind, slack, wide, bench.sums)
                add_springs(scene, bench, m, i, i, 1.0, start, wide, A)
                add_springs(scene, bench, m, j, j, 1.0, start, wide, A)
                add_springs(scene, bench, m, i, j, -1.0, start, wide, A)
    if scene.marks[m, LOADED]:
        load_hessian(scene, bench, rules, m, which, n, A)
    return n


@compiled
def sum_springs(
    scene: Scene, rules: Array, m: int, i: int, j: int, kind: int, slack: float, wide: int, out: Array
) -> None:  # fmt: skip
    """The springs c [N m] between tubes i and j at the Gauss points of element m, or for i = j between tube i and the
    moment of the loads, as one of psi's unknowns: sum c w w^T into the first ``wide`` rows of ``out``, w the
    integrals of the polynomials and, last, 1, for psi at the element's start."""
    G, last = scene.marks[m, GAUSS], wide - 1
    for k in range(last + 1):
        for r in range(k + 1):
            out[k, r] = 0.0
    for g in range(G):
        row = scene.marks[m, ROW] + g
        c = scene.gauss[row, WEIGHT] / scene.line[m, STIFFNESS]
        b = scene.moments[TURNED, row, i]
        if i == j:
            moment = scene.bends[row, MOMENT]
            c *= moment.real * b.real + moment.imag * b.imag
        else:
            moved = (scene.turns[PSI, row, i] - scene.turns[BEFORE, row, i]) - (
                scene.turns[PSI, row, j] - scene.turns[BEFORE, row, j]
            )
            c *= spring(scene.moments[TURNED, row, j].conjugate() * b, moved, slack, kind)
        for k in range(last):
            a = c * rules[G, g, INTEGRAL + k]
            for r in range(k + 1):
                out[k, r] += a * rules[G, g, INTEGRAL + r]
            out[last, k] += a
        out[last, last] += c
    for k in range(last):
        for r in range(k):
            out[r, k] = out[k, r]


@compiled
def add_springs(
    scene: Scene, bench: Bench, m: int, i: int, j: int, sign: float, start: int, wide: int, A: Array
) -> None:  # fmt: skip
    """Adds ``sign`` times the springs of ``sums``, of ``wide`` rows, between psi_i and psi_j of element m, i >= j, to
    the lower triangle of A; psi at the element's start begins at the row ``start``."""
    sums, last = bench.sums, wide - 1
    oi, oj = bench.offset[i], bench.offset[j]
    si, sj = sign * scene.held[SCALE, m, i], scene.held[SCALE, m, j]
    for k in range(last):
        for r in range(k + 1 if i == j else last):
            A[oi + k, oj + r] += si * sj * sums[k, r]
        A[start + i, oj + k] += sign * sj * sums[last, k]
        if i != j:
            A[start + j, oi + k] += si * sums[last, k]
    A[start + i, start + j] += sign * sums[last, last]


@compiled
def energy_value(scene: Scene, tubes: Array, rules: Array, alpha: Array) -> float:
    """The part of the energy [J] that depends on ``y``, at alpha (N,) [rad], less the work of the loads' forces."""
    loaded = scene.counts[N_LOADS] > 0
    spread_angles(scene, alpha, scene.vectors[Y])
    if loaded:
        bend(scene, rules, False)
        chain(scene, tubes, rules)
    value = 0.0
    for u in range(scene.counts[N_UNKNOWNS]):
        value += 0.5 * scene.vectors[Y, u] * scene.vectors[Y, u]
    for m in range(scene.counts[N_ELEMENTS]):
        if not scene.marks[m, COUPLED]:
            continue
        if not loaded:
            angles_inside(scene, rules, m, scene.held[ANGLE, m], scene.vectors[Y], scene.turns[PSI])
            turn_moments(scene, m)
        for row in range(scene.marks[m, ROW], scene.marks[m, ROW] + scene.marks[m, GAUSS]):
            total = 0j
            for j in range(len(alpha)):
                total += scene.moments[TURNED, row, j]
            size = total.real * total.real + total.imag * total.imag
            value -= 0.5 * scene.gauss[row, WEIGHT] * size / scene.line[m, STIFFNESS]
    return value - forces_work(scene) if loaded else value
