"""Actuation loads: tau_alpha = dPi/dalpha and tau_D = dPi/dD, straightening in the guide counted.

Torques are what bending pulls at the bases.  The force on tube j follows from a balance along it: where strains are k
and psi', material slides on as if B_j were its tension,

    B_j' = -dW_j/dX - f_j.t,      dW_j/dX = -K_j Re[conj(k - c_j) exp(i psi_j) dkappa*_j/dX],

with W_j the elastic energy of tube j per length, c_j = kappa*_j exp(i psi_j), f_j the load on it.  Where tube j's
material changes or ends, or a load sits on it, B_j jumps: with

    e = min over k, psi' of [sum W - Re(conj(m) k) - sum T psi']
      = sum K |c|^2 / 2 - |sum b + m|^2 / (2 sum K) - sum T^2 / (2 GJ),

of the tubes, moments and torques on either side, B_j(-) = B_j(+) + e(+) - e(-) + P.t.  The other tubes' ends and loads
do not change B_j.  In the guide the tube is straight: tau_D = B_j(0+) - T_j^2 / (2 GJ_j) + K_j |kappa*_j(D_j)|^2 / 2.

Pi has a kink in D_j where an end of one of tube j's segments, or a load on it, lies on the orifice or on one of another
tube's: it goes to either side of that, so each side has its own derivative.
"""

from __future__ import annotations

import math

from ctr_pvs.kernel.arrays import ABSENT
from ctr_pvs.kernel.arrays import ANGLE
from ctr_pvs.kernel.arrays import ARC
from ctr_pvs.kernel.arrays import AT
from ctr_pvs.kernel.arrays import BEND
from ctr_pvs.kernel.arrays import BENDING
from ctr_pvs.kernel.arrays import BINORMAL
from ctr_pvs.kernel.arrays import CURVATURE
from ctr_pvs.kernel.arrays import END
from ctr_pvs.kernel.arrays import GAUSS
from ctr_pvs.kernel.arrays import LEAD
from ctr_pvs.kernel.arrays import LOADED
from ctr_pvs.kernel.arrays import MOMENT
from ctr_pvs.kernel.arrays import MOMENT_FAR
from ctr_pvs.kernel.arrays import MOMENTS
from ctr_pvs.kernel.arrays import N_ELEMENTS
from ctr_pvs.kernel.arrays import N_LOADS
from ctr_pvs.kernel.arrays import N_POINTS
from ctr_pvs.kernel.arrays import NORMAL
from ctr_pvs.kernel.arrays import PLACE
from ctr_pvs.kernel.arrays import POINT
from ctr_pvs.kernel.arrays import POINT_FORCE
from ctr_pvs.kernel.arrays import POINT_MOMENT
from ctr_pvs.kernel.arrays import PSI
from ctr_pvs.kernel.arrays import REST
from ctr_pvs.kernel.arrays import ROW
from ctr_pvs.kernel.arrays import SEGMENT
from ctr_pvs.kernel.arrays import START
from ctr_pvs.kernel.arrays import STIFFNESS
from ctr_pvs.kernel.arrays import STRAIGHTENING
from ctr_pvs.kernel.arrays import TORQUE
from ctr_pvs.kernel.arrays import TORSION
from ctr_pvs.kernel.arrays import TUBE
from ctr_pvs.kernel.arrays import TURNED
from ctr_pvs.kernel.arrays import WEIGHT
from ctr_pvs.kernel.arrays import Array
from ctr_pvs.kernel.arrays import Bench
from ctr_pvs.kernel.arrays import Ints
from ctr_pvs.kernel.arrays import Scene
from ctr_pvs.kernel.backbone.frames import dot
from ctr_pvs.kernel.backbone.frames import tangent
from ctr_pvs.kernel.compiler import compiled
from ctr_pvs.kernel.loaded.statics import put_axes
from ctr_pvs.kernel.materials import pre_curvature
from ctr_pvs.kernel.materials import pre_curvature_rate
from ctr_pvs.kernel.sections import SAME_PLACE


@compiled
def straightening_energy(tubes: Array, segments: Ints, j: int, D: float) -> float:
    """Energy [J] that holds the guided part of tube j straight, int_0^D K |kappa*|^2 / 2 dX."""
    i = segments[j] - 1
    while i > 0 and tubes[j, i, START] >= D:
        i -= 1
    return float(tubes[j, i, STRAIGHTENING] + segment_straightening(tubes, j, i, max(0.0, D - tubes[j, i, START])))


@compiled
def segment_straightening(tubes: Array, j: int, i: int, x: float) -> float:
    """int_0^x K |kappa*|^2 / 2 along segment i of tube j [J]; the turn drops out of the absolute value."""
    total, count = 0.0, (tubes.shape[2] - CURVATURE) // 2
    for k in range(count):
        c = complex(tubes[j, i, CURVATURE + 2 * k], tubes[j, i, CURVATURE + 2 * k + 1])
        for r in range(count):
            d = complex(tubes[j, i, CURVATURE + 2 * r], tubes[j, i, CURVATURE + 2 * r + 1])
            total += (c.conjugate() * d).real * x ** (k + r + 1) / (k + r + 1)
    return float(0.5 * tubes[j, i, BENDING] * total)


@compiled
def orifice_segments(tubes: Array, segments: Ints, j: int, D: float) -> tuple[int, int]:
    """Segments of tube j just behind the orifice and just beyond it; they differ if a boundary lies on it."""
    after = 0
    while after < segments[j] and tubes[j, after, END] - D <= SAME_PLACE:
        after += 1
    before = after
    if after > 0 and tubes[j, after - 1, END] - D >= -SAME_PLACE:
        before = after - 1
    return before, after if after < segments[j] else ABSENT


@compiled
def segment_at(scene: Scene, m: int, j: int) -> int:
    """Segment of tube j in element m, ABSENT past the tip."""
    return scene.parts[SEGMENT, m, j] if m < scene.counts[N_ELEMENTS] else ABSENT


@compiled
def twisting(torque: float, stiffness: float, twists: bool) -> float:
    """Work per length [N] that a constant torque [N m] does in twisting a segment beyond its stored energy."""
    return 0.5 * torque * torque / stiffness if twists else 0.0


@compiled
def owns(scene: Scene, m: int, j: int) -> bool:
    """True if an end of one of tube j's segments, or a point load on it, lies where element m > 0 starts."""
    if segment_at(scene, m - 1, j) != segment_at(scene, m, j):
        return True
    first = scene.counts[N_LOADS] - POINT * scene.counts[N_POINTS]
    for p in range(scene.counts[N_POINTS]):
        if scene.point_at[p] == m and int(scene.loads[first + POINT * p + TUBE]) == j:
            return True
    return False


@compiled
def is_shared(scene: Scene, m: int, j: int) -> bool:
    """True if another tube than j has an end of a segment or a load where element m > 0 starts too."""
    for i in range(scene.base.shape[1]):
        if i != j and owns(scene, m, i):
            return True
    return False


@compiled
def point_load(scene: Scene, m: int, j: int, others: bool, column: int, out: Array) -> None:
    """Sum of the forces or moments, by their ``column``, where element m starts, of tube j or of all others, into
    ``out`` (3,)."""
    first = scene.counts[N_LOADS] - POINT * scene.counts[N_POINTS]
    for i in range(3):
        out[i] = 0.0
    for p in range(scene.counts[N_POINTS]):
        load = first + POINT * p
        if scene.point_at[p] == m and (int(scene.loads[load + TUBE]) == j) != others:
            for i in range(3):
                out[i] += scene.loads[load + column + i]


@compiled
def energy_per_length(
    scene: Scene, bench: Bench, tubes: Array, m: int, others: int, j: int, own: int, out: bool, twists: bool
) -> float:
    """e [N] where element m starts: tube j has the segment ``own``, the others those of element ``others``.

    out : what lies outside of tube j's load there, else inside; the others' loads there are beyond if ``others`` lies
    before.  twists : false for tubes that are taken for rigid in torsion, whose torques do no work."""
    M, s = scene.counts[N_ELEMENTS], scene.line[m, ARC]
    moment, mine, theirs, axes = bench.space[0], bench.space[1], bench.space[2], bench.row
    for i in range(3):
        moment[i] = scene.statics[m - 1 if m > 0 else M, MOMENT_FAR + i]
    point_load(scene, m, j, False, POINT_MOMENT, mine)
    point_load(scene, m, j, True, POINT_MOMENT, theirs)
    for i in range(3):
        moment[i] -= (mine[i] if out and m > 0 else 0.0) + (theirs[i] if others >= m > 0 else 0.0)
    put_axes(scene.frame[m, 0], scene.frame[m, 1], axes)
    across = complex(dot(moment, axes[NORMAL : NORMAL + 3]), dot(moment, axes[BINORMAL : BINORMAL + 3]))
    if scene.counts[LEAD] == 0:
        across = 0j
    stiffness, work = 0.0, 0.0
    for k in range(scene.base.shape[1]):
        i = own if k == j else segment_at(scene, others, k)
        if i == ABSENT:
            continue
        psi, K = scene.held[ANGLE, m, k], tubes[k, i, BENDING]
        b = K * pre_curvature(tubes, k, i, s + scene.base[AT, k]) * complex(math.cos(psi), math.sin(psi))
        across += b
        stiffness += K
        work += 0.5 * (b.real * b.real + b.imag * b.imag) / K
        torque = scene.held[TORQUE, m, k]
        if scene.counts[MOMENTS] > 0 and (out if k == j else others >= m):
            point_load(scene, m, k, False, POINT_MOMENT, theirs)
            torque += dot(theirs, axes)
        work -= twisting(torque, tubes[k, i, TORSION], twists)
    if stiffness == 0.0:
        return 0.0
    return work - 0.5 * (across.real * across.real + across.imag * across.imag) / stiffness


@compiled
def slide_work(scene: Scene, tubes: Array, m: int, j: int) -> float:
    """What sliding tube j's material costs in element m [N]: int dW_j/dX + f_j.t."""
    i, total = scene.parts[SEGMENT, m, j], 0.0
    if i == ABSENT:
        return 0.0
    loaded, first = scene.marks[m, LOADED] == 1, 3 * (j * tubes.shape[1] + i)
    K = tubes[j, i, BENDING]
    for row in range(scene.marks[m, ROW], scene.marks[m, ROW] + scene.marks[m, GAUSS]):
        w = scene.gauss[row, WEIGHT]
        rate = pre_curvature_rate(tubes, j, i, scene.gauss[row, PLACE] + scene.base[AT, j])
        if rate != 0.0:
            k = scene.bends[row, MOMENT]
            for other in range(scene.base.shape[1]):
                k += scene.moments[TURNED, row, other]
            psi = scene.turns[PSI, row, j]
            e = complex(math.cos(psi), math.sin(psi))
            strain = scene.moments[REST, row, j] / K - k / scene.line[m, STIFFNESS] * e.conjugate()
            total += w * K * (strain.conjugate() * rate).real
        if loaded:
            total += w * dot(scene.loads[first : first + 3], scene.axes[row])
    return total


@compiled
def one_sided_force(
    scene: Scene, bench: Bench, tubes: Array, segments: Ints, j: int, side: int, twists: bool
) -> float:  # fmt: skip
    """dPi/dD_j [N] towards ``side`` (+1, -1): towards +D tube j's ends and loads move in, to where the other tubes are
    those before, towards -D out."""
    M, force = scene.counts[N_ELEMENTS], 0.0
    push, axis = bench.space[3], bench.space[4]
    for m in range(M, 0, -1):
        if owns(scene, m, j):
            others = m - 1 if side > 0 else m
            own, beyond = segment_at(scene, m - 1, j), segment_at(scene, m, j)
            force += energy_per_length(scene, bench, tubes, m, others, j, beyond, True, twists)
            force -= energy_per_length(scene, bench, tubes, m, others, j, own, False, twists)
            if scene.counts[N_LOADS] > 0:
                point_load(scene, m, j, False, POINT_FORCE, push)
                tangent(scene.frame, m, axis)
                force += dot(push, axis)
        force += slide_work(scene, tubes, m - 1, j)
    before, after = orifice_segments(tubes, segments, j, scene.base[AT, j])
    guided = after if side > 0 and before != after else before
    if before != after and side < 0:
        force += energy_per_length(scene, bench, tubes, 0, 0, j, after, True, twists)
        force -= energy_per_length(scene, bench, tubes, 0, 0, j, before, True, twists)
    if guided != ABSENT:
        kappa = pre_curvature(tubes, j, guided, scene.base[AT, j])
        force += 0.5 * tubes[j, guided, BENDING] * (kappa.real * kappa.real + kappa.imag * kappa.imag)
        force -= twisting(scene.held[TORQUE, 0, j], tubes[j, guided, TORSION], twists)
    return force


@compiled
def has_kink(scene: Scene, tubes: Array, segments: Ints, j: int) -> bool:
    """True where the energy has a kink in D_j."""
    before, after = orifice_segments(tubes, segments, j, scene.base[AT, j])
    if before != after:
        return True
    for m in range(1, scene.counts[N_ELEMENTS] + 1):
        if owns(scene, m, j) and is_shared(scene, m, j):
            return True
    return False


@compiled
def bending_energy(scene: Scene, tubes: Array, m: int) -> float:
    """Of element m [J]."""
    total = 0.0
    for row in range(scene.marks[m, ROW], scene.marks[m, ROW] + scene.marks[m, GAUSS]):
        for j in range(scene.base.shape[1]):
            i = scene.parts[SEGMENT, m, j]
            if i != ABSENT:
                K = tubes[j, i, BENDING]
                strain = scene.moments[TURNED, row, j] / K - scene.bends[row, BEND]
                size = strain.real * strain.real + strain.imag * strain.imag
                total += 0.5 * scene.gauss[row, WEIGHT] * K * size
    return total


@compiled
def actuation_loads(
    scene: Scene, bench: Bench, tubes: Array, segments: Ints, twists: bool, out: Array
) -> None:  # fmt: skip
    """Torques, forces towards +D and -D, and kinks (1 or 0) of the N tubes into out[:4] (N each), the bending energy
    beyond the orifice and that of straightening in the guide into out[4, 0] and out[5, 0] [J]; from the gradient and
    the curvatures of ``scene``.

    twists : false for tubes that are taken for rigid in torsion, whose torques do no work."""
    bending, straightening = 0.0, 0.0
    for m in range(scene.counts[N_ELEMENTS]):
        bending += bending_energy(scene, tubes, m)
    for j in range(scene.base.shape[1]):
        out[0, j] = scene.held[TORQUE, 0, j]
        out[1, j] = one_sided_force(scene, bench, tubes, segments, j, 1, twists)
        kink = has_kink(scene, tubes, segments, j)
        out[2, j] = one_sided_force(scene, bench, tubes, segments, j, -1, twists) if kink else out[1, j]
        out[3, j] = 1.0 if kink else 0.0
        straightening += straightening_energy(tubes, segments, j, scene.base[AT, j])
    out[4, 0], out[5, 0] = bending, straightening
