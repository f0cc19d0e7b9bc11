"""Actuation loads by virtual work: tau_alpha = dE/dalpha and tau_D = dE/dD, straightening in the guide counted.

At an equilibrium dE/dq = 0, so only the explicit dependence on the command counts.  Strains are held at each place x of
their element while

* material slides: a Gauss point carries material of tube j that moves with dX_j = ds + dD_j;
* the ends of sections move: a boundary that belongs to tube j moves with -dD_j;
* the guide swallows tube: it grows more compliant, and new material is straightened.

E has a kink in D_j where an end of one of tube j's segments lies on the orifice or on another tube's: the two part, and
a thin section with its own set of materials appears between them.  Its energy rate is that of the materials on the side
that opens, less the work of the torques that twist it, so each side has its own derivative.

All this is read off angles, twist rates and curvatures at the Gauss points, whichever model they come from.
"""

from __future__ import annotations

import math

from ctr_pvs.kernel.arrays import ABSENT
from ctr_pvs.kernel.arrays import ANGLE
from ctr_pvs.kernel.arrays import ARC
from ctr_pvs.kernel.arrays import AT
from ctr_pvs.kernel.arrays import BEND
from ctr_pvs.kernel.arrays import BENDING
from ctr_pvs.kernel.arrays import CURVATURE
from ctr_pvs.kernel.arrays import END
from ctr_pvs.kernel.arrays import FIRST
from ctr_pvs.kernel.arrays import GAUSS
from ctr_pvs.kernel.arrays import LENGTH
from ctr_pvs.kernel.arrays import N_ELEMENTS
from ctr_pvs.kernel.arrays import PLACE
from ctr_pvs.kernel.arrays import POLYNOMIAL
from ctr_pvs.kernel.arrays import PSI
from ctr_pvs.kernel.arrays import RATE
from ctr_pvs.kernel.arrays import REST
from ctr_pvs.kernel.arrays import ROW
from ctr_pvs.kernel.arrays import SCALE
from ctr_pvs.kernel.arrays import SEGMENT
from ctr_pvs.kernel.arrays import SIZE
from ctr_pvs.kernel.arrays import START
from ctr_pvs.kernel.arrays import STRAIGHTENING
from ctr_pvs.kernel.arrays import TORQUE
from ctr_pvs.kernel.arrays import TORSION
from ctr_pvs.kernel.arrays import TURN
from ctr_pvs.kernel.arrays import WEIGHT
from ctr_pvs.kernel.arrays import Array
from ctr_pvs.kernel.arrays import Ints
from ctr_pvs.kernel.arrays import Scene
from ctr_pvs.kernel.arrays import Y
from ctr_pvs.kernel.compiler import compiled
from ctr_pvs.kernel.layout import SAME_PLACE
from ctr_pvs.kernel.materials import pre_curvature


@compiled
def pre_curvature_rate(tubes: Array, j: int, i: int, X: float) -> complex:
    """d/dX of ``pre_curvature`` [1/m^2]."""
    x, turn = X - tubes[j, i, START], tubes[j, i, TURN]
    rate, power = 0j, (tubes.shape[2] - CURVATURE) // 2 - 1
    for k in range(tubes.shape[2] - 2, CURVATURE, -2):
        rate = rate * x + power * complex(tubes[j, i, k], tubes[j, i, k + 1])
        power -= 1
    if turn != 0.0:
        rate = rate * complex(math.cos(turn * x), math.sin(turn * x)) + 1j * turn * pre_curvature(tubes, j, i, X)
    return rate


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
def twist_rates(scene: Scene, rules: Array) -> None:
    """Fills ``rate`` from the unknowns."""
    for m in range(scene.counts[N_ELEMENTS]):
        G = scene.marks[m, GAUSS]
        for g in range(G):
            for j in range(scene.base.shape[1]):
                value = 0.0
                for k in range(scene.parts[SIZE, m, j]):
                    value += scene.vectors[Y, scene.parts[FIRST, m, j] + k] * rules[G, g, POLYNOMIAL + k]
                scene.turns[RATE, scene.marks[m, ROW] + g, j] = value * scene.held[SCALE, m, j] / scene.line[m, LENGTH]


@compiled
def element_rates(
    scene: Scene, tubes: Array, rules: Array, m: int, slide: Array, right: Array, left: Array, density: Array
) -> None:
    """What moving element m's ends and sliding its materials costs at strains fixed in x.

    right, left (M,) [N] : per motion of the far and of the near end, the other held; slide (M, N) [N] : per slide of
    each tube's material; density (M,) : its bending energy [J].  ``torque`` is filled at its start [N m].
    """
    N = scene.base.shape[1]
    G, h = scene.marks[m, GAUSS], scene.line[m, LENGTH]
    stretch, with_far_end, bending, twisting, outermost = 0.0, 0.0, 0.0, 0.0, -1
    for j in range(N):
        slide[m, j] = 0.0
        scene.held[TORQUE, m, j] = scene.held[TORQUE, m + 1, j]
        if outermost < 0 and scene.parts[SEGMENT, m, j] != ABSENT:
            outermost = j
    for g in range(G):
        row = scene.marks[m, ROW] + g
        w, k = scene.gauss[row, WEIGHT], scene.bends[row, BEND]
        turned_first = scene.turns[PSI, row, outermost] - scene.held[ANGLE, m, outermost]
        for j in range(N):
            i = scene.parts[SEGMENT, m, j]
            if i == ABSENT:
                continue
            K, psi = tubes[j, i, BENDING], scene.turns[PSI, row, j]
            e = complex(math.cos(psi), math.sin(psi))
            strain = scene.moments[REST, row, j] / K - k * e.conjugate()
            bending += 0.5 * w * K * (strain.real * strain.real + strain.imag * strain.imag)
            twisting += 0.5 * w * tubes[j, i, TORSION] * scene.turns[RATE, row, j] ** 2
            rate = pre_curvature_rate(tubes, j, i, scene.gauss[row, PLACE] + scene.base[AT, j])
            work = w * K * (strain.conjugate() * rate).real
            slide[m, j] += work
            with_far_end += rules[G, g, PLACE] * work
            # Curvature is held in the outermost tube's frame, which so carries all others with it.
            pull = w * (scene.moments[REST, row, j] * e * k.conjugate()).imag
            scene.held[TORQUE, m, j] += pull
            scene.held[TORQUE, m, outermost] -= pull
            stretch += pull * (psi - scene.held[ANGLE, m, j] - turned_first) / h
    density[m] = bending
    stretch += (bending + twisting) / h
    for j in range(N):
        stretch += (scene.held[ANGLE, m + 1, j] - scene.held[ANGLE, m, j]) / h * scene.held[TORQUE, m + 1, j]
    slides = 0.0
    for j in range(N):
        slides += slide[m, j]
    right[m] = stretch + with_far_end
    left[m] = slides - right[m]


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
def ends_at(scene: Scene, m: int) -> int:
    """How many tubes have the end of a segment where element m > 0 starts."""
    count = 0
    for j in range(scene.base.shape[1]):
        if segment_at(scene, m - 1, j) != segment_at(scene, m, j):
            count += 1
    return count


@compiled
def twisting(torque: float, stiffness: float, twists: bool) -> float:
    """Work per length [N] that a constant torque [N m] does in twisting a segment beyond its stored energy."""
    return 0.5 * torque * torque / stiffness if twists else 0.0


@compiled
def thin_section(scene: Scene, tubes: Array, m: int, shortened: int, tube: int, own: int, twists: bool) -> float:
    """Energy per length [N] of a vanishing section where element m starts: segments are those of element ``shortened``,
    but for ``own`` of ``tube``.  Bending density less the work of the torques that twist it."""
    s, moment, stiffness, work = scene.line[m, ARC], 0j, 0.0, 0.0
    for j in range(scene.base.shape[1]):
        i = own if j == tube else segment_at(scene, shortened, j)
        if i != ABSENT:
            psi, K = scene.held[ANGLE, m, j], tubes[j, i, BENDING]
            b = K * pre_curvature(tubes, j, i, s + scene.base[AT, j]) * complex(math.cos(psi), math.sin(psi))
            moment += b
            stiffness += K
            work += 0.5 * (b.real * b.real + b.imag * b.imag) / K
            work -= twisting(scene.held[TORQUE, m, j], tubes[j, i, TORSION], twists)
    if stiffness == 0.0:
        return 0.0
    return work - 0.5 * (moment.real * moment.real + moment.imag * moment.imag) / stiffness


@compiled
def one_sided_force(
    scene: Scene, tubes: Array, segments: Ints, j: int, side: int, slide: Array, right: Array, left: Array, twists: bool
) -> float:
    """dE/dD_j [N] towards ``side`` (+1, -1).

    Towards +D an end of tube j's segment moves back and shortens the section before; towards -D it moves on and
    shortens the one after.  Without a kink it does both to both; on the orifice it goes into the guide.
    """
    M = scene.counts[N_ELEMENTS]
    force = 0.0
    before, after = orifice_segments(tubes, segments, j, scene.base[AT, j])
    guided = after if side > 0 and before != after else before
    near = 0.0
    if before != after and side < 0:
        near = -1.0
        force -= thin_section(scene, tubes, 0, 0, j, before, twists)
    first = 0
    for m in range(M):
        force += slide[m, j]
        if m + 1 < M and ends_at(scene, m + 1) == 0:
            continue
        own, beyond = scene.parts[SEGMENT, m, j], segment_at(scene, m + 1, j)
        ends = own != beyond
        kink = ends_at(scene, m + 1) > 1
        far = -1.0 if ends and (side > 0 or not kink) else 0.0
        parts = m + 1 - first
        for part in range(parts):
            start = near + (far - near) * part / parts
            end = near + (far - near) * (part + 1) / parts
            force += left[first + part] * start + right[first + part] * end
        near = -1.0 if ends and (side < 0 or not kink) else 0.0
        if ends and kink:
            shortened, mine = (m, beyond) if side > 0 else (m + 1, own)
            force += side * thin_section(scene, tubes, m + 1, shortened, j, mine, twists)
        first = m + 1
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
    for m in range(scene.counts[N_ELEMENTS]):
        if segment_at(scene, m, j) != segment_at(scene, m + 1, j) and ends_at(scene, m + 1) > 1:
            return True
    return False


@compiled
def actuation_loads(
    scene: Scene, tubes: Array, segments: Ints, rules: Array, twists: bool, work: Array, out: Array
) -> None:
    """Torques, forces towards +D and -D, and kinks (1 or 0) of the N tubes into out[:4] (N each), the bending energy
    beyond the orifice and that of straightening in the guide into out[4, 0] and out[5, 0] [J].

    twists : false for tubes that are taken for rigid in torsion, whose torques do no work.  work (M + 1, N + 3) : room.
    """
    N, M = scene.base.shape[1], scene.counts[N_ELEMENTS]
    slide, right, left, density = work[:, :N], work[:, N], work[:, N + 1], work[:, N + 2]
    for j in range(N):
        scene.held[TORQUE, M, j] = 0.0
    bending, straightening = 0.0, 0.0
    for m in range(M - 1, -1, -1):
        element_rates(scene, tubes, rules, m, slide, right, left, density)
        bending += density[m]
    for j in range(N):
        out[0, j] = scene.held[TORQUE, 0, j]
        out[1, j] = one_sided_force(scene, tubes, segments, j, 1, slide, right, left, twists)
        kink = has_kink(scene, tubes, segments, j)
        out[2, j] = out[1, j]
        if kink:
            out[2, j] = one_sided_force(scene, tubes, segments, j, -1, slide, right, left, twists)
        out[3, j] = 1.0 if kink else 0.0
        straightening += straightening_energy(tubes, segments, j, scene.base[AT, j])
    out[4, 0], out[5, 0] = bending, straightening
