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
from ctr_pvs.kernel.arrays import N_ELEMENTS
from ctr_pvs.kernel.arrays import N_UNKNOWNS
from ctr_pvs.kernel.arrays import PSI
from ctr_pvs.kernel.arrays import PULL
from ctr_pvs.kernel.arrays import REST
from ctr_pvs.kernel.arrays import ROOT
from ctr_pvs.kernel.arrays import ROW
from ctr_pvs.kernel.arrays import SCALE
from ctr_pvs.kernel.arrays import SIZE
from ctr_pvs.kernel.arrays import STIFFNESS
from ctr_pvs.kernel.arrays import TORQUE
from ctr_pvs.kernel.arrays import TURNED
from ctr_pvs.kernel.arrays import WEIGHT
from ctr_pvs.kernel.arrays import Array
from ctr_pvs.kernel.arrays import Ints
from ctr_pvs.kernel.arrays import Scene
from ctr_pvs.kernel.arrays import Y
from ctr_pvs.kernel.compiler import compiled
from ctr_pvs.kernel.layout import FINER

#: What stands for the cosines in a Hessian: themselves, their least value on the box that holds the angles ``before``
#: and the present ones, or the least value there is.
EXACT, LOWERED, WORST = 0, 1, 2
#: The branch between two states may leave the straight line between them: the box is this much wider on either side.
WIDER = 0.25
#: Below this turn [rad] two terms of Taylor's series bound a cosine as well as the cosine itself.
SMALL_TURN = 1e-2


@compiled
def used(size: int, finer: int) -> int:
    """How many of a tube's ``size`` unknowns in an element count: all of them at the finer degree."""
    return size if finer or size < 2 else size - FINER


@compiled
def spread_angles(scene: Scene, alpha: Array, y: Array) -> None:
    """Fills ``angle`` of ``scene``: psi at the elements' ends for base angles alpha (N,) [rad] and unknowns y.

    Past its tip a tube keeps its last angle."""
    N = len(alpha)
    for j in range(N):
        scene.held[ANGLE, 0, j] = alpha[j] + scene.base[ROOT, j] * y[j]
    for m in range(scene.counts[N_ELEMENTS]):
        for j in range(N):
            turned = scene.held[SCALE, m, j] * y[scene.parts[FIRST, m, j]] if scene.parts[SIZE, m, j] > 0 else 0.0
            scene.held[ANGLE, m + 1, j] = scene.held[ANGLE, m, j] + turned


@compiled
def angles_inside(scene: Scene, rules: Array, m: int, start: Array, y: Array, out: Array) -> None:
    """Fills ``out`` (G, N) with psi at the Gauss points of element m, from that at its start (N,) and unknowns y."""
    G = scene.marks[m, GAUSS]
    for g in range(G):
        row = scene.marks[m, ROW] + g
        for j in range(out.shape[1]):
            psi = 0.0
            for k in range(scene.parts[SIZE, m, j]):
                psi += y[scene.parts[FIRST, m, j] + k] * rules[G, g, INTEGRAL + k]
            out[row, j] = start[j] + scene.held[SCALE, m, j] * psi


@compiled
def turn_moments(scene: Scene, m: int) -> None:
    """Fills ``turned`` of element m from ``turn``."""
    for row in range(scene.marks[m, ROW], scene.marks[m, ROW] + scene.marks[m, GAUSS]):
        for j in range(scene.base.shape[1]):
            b = scene.moments[REST, row, j]
            if b != 0.0:
                psi = scene.turns[PSI, row, j]
                b = b * complex(math.cos(psi), math.sin(psi))
            scene.moments[TURNED, row, j] = b


@compiled
def pull_tubes(scene: Scene, m: int) -> None:
    """Fills ``pull`` (G, N) of element m: what bending pulls each tube's psi at the Gauss points [N m], eq. (35)."""
    for row in range(scene.marks[m, ROW], scene.marks[m, ROW] + scene.marks[m, GAUSS]):
        total = 0j
        for j in range(scene.base.shape[1]):
            total += scene.moments[TURNED, row, j]
        share = scene.gauss[row, WEIGHT] / scene.line[m, STIFFNESS]
        for j in range(scene.base.shape[1]):
            b = scene.moments[TURNED, row, j]
            scene.turns[PULL, row, j] = share * (total.real * b.imag - total.imag * b.real)


@compiled
def gather(scene: Scene, rules: Array, out: Array) -> None:
    """What ``pull`` at the Gauss points of the coupled elements means for the unknowns, sum pull dpsi / dy into ``out``
    (U,), and for psi at the elements' ends: the sum of all beyond into ``torque``."""
    N = scene.base.shape[1]
    M = scene.counts[N_ELEMENTS]
    for j in range(N):
        scene.held[TORQUE, M, j] = 0.0
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
            scene.held[TORQUE, m, j] = beyond + here
    for j in range(N):
        out[j] = scene.base[ROOT, j] * scene.held[TORQUE, 0, j]


@compiled
def energy_gradient(scene: Scene, rules: Array, alpha: Array) -> None:
    """dE/dy of the whole robot at ``y`` and alpha (N,) [rad] into ``gradient``; turned moments and torques
    stay in ``scene``."""
    spread_angles(scene, alpha, scene.vectors[Y])
    for m in range(scene.counts[N_ELEMENTS]):
        if scene.marks[m, COUPLED]:
            angles_inside(scene, rules, m, scene.held[ANGLE, m], scene.vectors[Y], scene.turns[PSI])
            turn_moments(scene, m)
            pull_tubes(scene, m)
    gather(scene, rules, scene.vectors[GRADIENT])
    for u in range(scene.counts[N_UNKNOWNS]):
        scene.vectors[GRADIENT, u] += scene.vectors[Y, u]


@compiled
def spring(b: complex, c: complex, moved: float, slack: float, kind: int) -> float:
    """Re(conj(b) c) [N^2 m^2], |b| |c| times the cosine of the angle between two turned moments; or with the cosine's
    least value when that angle has moved by ``moved`` [rad], and ``slack`` more: a lower bound on that box."""
    product = b.conjugate() * c
    if kind == EXACT:
        return product.real
    size = abs(product)
    if kind == WORST:
        return -size
    turned = abs(moved)
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
    scene: Scene,
    rules: Array,
    m: int,
    finer: int,
    kind: int,
    slack: float,
    offset: Ints,
    H: Array,
    X: Array,
    near: Array,
) -> int:
    """Adds the bending part of element m's second derivative; n, the unknowns it counts.

    H (n, n) : along its unknowns, lower triangle; X (N, n) : between psi at its start and its unknowns; near (N, N) :
    along psi at its start.  offset (N,) is filled with the first row of each tube.  kind, slack : see ``spring``.
    """
    N = len(offset)
    G = scene.marks[m, GAUSS]
    n = 0
    for j in range(N):
        offset[j] = n
        n += used(scene.parts[SIZE, m, j], finer)
    if not scene.marks[m, COUPLED]:
        return n
    for g in range(G):
        row = scene.marks[m, ROW] + g
        share = scene.gauss[row, WEIGHT] / scene.line[m, STIFFNESS]
        for i in range(N):
            if scene.parts[SIZE, m, i] < 2:
                continue
            for j in range(i):
                if scene.parts[SIZE, m, j] < 2:
                    continue
                moved = 0.0
                if kind == LOWERED:
                    moved = (
                        scene.turns[PSI, row, i]
                        - scene.turns[BEFORE, row, i]
                        - scene.turns[PSI, row, j]
                        + scene.turns[BEFORE, row, j]
                    )
                c = share * spring(scene.moments[TURNED, row, j], scene.moments[TURNED, row, i], moved, slack, kind)
                near[i, i] += c
                near[j, j] += c
                near[i, j] -= c
                near[j, i] -= c
                add_spring(scene, rules, m, G, g, i, j, c, finer, offset, H, X)
    return n


@compiled
def add_spring(
    scene: Scene,
    rules: Array,
    m: int,
    G: int,
    g: int,
    i: int,
    j: int,
    c: float,
    finer: int,
    offset: Ints,
    H: Array,
    X: Array,
) -> None:
    """Adds a spring of stiffness c [N m] between tubes i > j at Gauss point g of element m to H and X."""
    ni, nj = used(scene.parts[SIZE, m, i], finer), used(scene.parts[SIZE, m, j], finer)
    oi, oj = offset[i], offset[j]
    si, sj = scene.held[SCALE, m, i], scene.held[SCALE, m, j]
    for k in range(ni):
        a = c * si * rules[G, g, INTEGRAL + k]
        X[i, oi + k] += a
        X[j, oi + k] -= a
        for r in range(k + 1):
            H[oi + k, oi + r] += a * si * rules[G, g, INTEGRAL + r]
        for r in range(nj):
            H[oi + k, oj + r] -= a * sj * rules[G, g, INTEGRAL + r]
    for k in range(nj):
        a = c * sj * rules[G, g, INTEGRAL + k]
        X[j, oj + k] += a
        X[i, oj + k] -= a
        for r in range(k + 1):
            H[oj + k, oj + r] += a * sj * rules[G, g, INTEGRAL + r]


@compiled
def energy_value(scene: Scene, rules: Array, alpha: Array) -> float:
    """The part of the energy [J] that depends on ``y``, at alpha (N,) [rad]."""
    spread_angles(scene, alpha, scene.vectors[Y])
    value = 0.0
    for u in range(scene.counts[N_UNKNOWNS]):
        value += 0.5 * scene.vectors[Y, u] * scene.vectors[Y, u]
    for m in range(scene.counts[N_ELEMENTS]):
        if not scene.marks[m, COUPLED]:
            continue
        angles_inside(scene, rules, m, scene.held[ANGLE, m], scene.vectors[Y], scene.turns[PSI])
        turn_moments(scene, m)
        for row in range(scene.marks[m, ROW], scene.marks[m, ROW] + scene.marks[m, GAUSS]):
            total = 0j
            for j in range(len(alpha)):
                total += scene.moments[TURNED, row, j]
            size = total.real * total.real + total.imag * total.imag
            value -= 0.5 * scene.gauss[row, WEIGHT] * size / scene.line[m, STIFFNESS]
    return value
