"""The fields of a state: angles of the tubes, turned pre-curvatures, and the moment that loads cause."""

from __future__ import annotations

import math

from ctr_pvs.kernel.arrays import ABSENT
from ctr_pvs.kernel.arrays import ANGLE
from ctr_pvs.kernel.arrays import AT
from ctr_pvs.kernel.arrays import BENDING
from ctr_pvs.kernel.arrays import FIRST
from ctr_pvs.kernel.arrays import GAUSS
from ctr_pvs.kernel.arrays import INTEGRAL
from ctr_pvs.kernel.arrays import LENGTH
from ctr_pvs.kernel.arrays import MU
from ctr_pvs.kernel.arrays import MU_SIZE
from ctr_pvs.kernel.arrays import N_ELEMENTS
from ctr_pvs.kernel.arrays import PLACE
from ctr_pvs.kernel.arrays import POLYNOMIAL
from ctr_pvs.kernel.arrays import PSI
from ctr_pvs.kernel.arrays import REST
from ctr_pvs.kernel.arrays import ROOT
from ctr_pvs.kernel.arrays import ROW
from ctr_pvs.kernel.arrays import SCALE
from ctr_pvs.kernel.arrays import SEGMENT
from ctr_pvs.kernel.arrays import SIZE
from ctr_pvs.kernel.arrays import STIFFNESS
from ctr_pvs.kernel.arrays import TURNED
from ctr_pvs.kernel.arrays import Array
from ctr_pvs.kernel.arrays import Scene
from ctr_pvs.kernel.arrays import Y
from ctr_pvs.kernel.compiler import compiled
from ctr_pvs.kernel.materials import pre_curvature_rate
from ctr_pvs.kernel.sections import FINER

#: Which unknowns count: those that are solved for; with those of two more degrees, that check; only those of bending.
COARSE, FINE, BENDING_ONLY = 0, 1, 2


@compiled
def used(size: int, which: int) -> int:
    """How many of a tube's ``size`` unknowns in an element count."""
    if which == BENDING_ONLY:
        return 0
    return size if which == FINE or size < 2 else size - FINER


@compiled
def used_bending(size: int, which: int) -> int:
    """How many of the ``size`` unknowns of mu in one direction count in an element."""
    return size - FINER if which == COARSE and size > 0 else size


@compiled
def counted(scene: Scene, m: int, which: int) -> int:
    """How many unknowns of element m count."""
    n = 2 * used_bending(scene.marks[m, MU_SIZE], which)
    for j in range(scene.base.shape[1]):
        n += used(scene.parts[SIZE, m, j], which)
    return n


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
def mu_scale(scene: Scene, m: int) -> float:
    """Moment per unknown of mu [N m / sqrt(J)] in element m."""
    return math.sqrt(scene.line[m, STIFFNESS] / scene.line[m, LENGTH])


@compiled
def mu_at(scene: Scene, rules: Array, m: int, g: int, y: Array) -> complex:
    """mu [N m] at Gauss point g of element m for unknowns y."""
    G, first, size = scene.marks[m, GAUSS], scene.marks[m, MU], scene.marks[m, MU_SIZE]
    re, im = 0.0, 0.0
    for k in range(size):
        re += y[first + k] * rules[G, g, POLYNOMIAL + k]
        im += y[first + size + k] * rules[G, g, POLYNOMIAL + k]
    return mu_scale(scene, m) * complex(re, im)


@compiled
def field_of(scene: Scene, m: int, field: int, which: int) -> tuple[int, int]:
    """First unknown of a field of element m, psi of a tube or, after those, mu_y and mu_z, and how many of them
    count."""
    N = scene.base.shape[1]
    if field < N:
        return int(scene.parts[FIRST, m, field]), used(scene.parts[SIZE, m, field], which)
    size = scene.marks[m, MU_SIZE]
    return int(scene.marks[m, MU] + (field - N) * size), used_bending(size, which)


@compiled
def twist_energy(scene: Scene) -> float:
    """Energy [J] of torsion, in the guide too."""
    energy = 0.0
    for j in range(scene.base.shape[1]):
        energy += 0.5 * scene.vectors[Y, j] * scene.vectors[Y, j]
        for m in range(scene.counts[N_ELEMENTS]):
            for u in range(scene.parts[FIRST, m, j], scene.parts[FIRST, m, j] + scene.parts[SIZE, m, j]):
                energy += 0.5 * scene.vectors[Y, u] * scene.vectors[Y, u]
    return energy


@compiled
def explicit_angle(scene: Scene, m: int, row: int, j: int, angles: Array, stretch: float) -> float:
    """d psi of tube j at a Gauss point of element m with torque coefficients held."""
    return float(angles[m, j] + (scene.turns[PSI, row, j] - scene.held[ANGLE, m, j]) * stretch)


@compiled
def moment_rate(scene: Scene, tubes: Array, m: int, row: int, j: int, slide: float, turned: float) -> complex:
    """Rate of a turned moment where the material slides by ``slide`` [m] and turns by ``turned`` [rad]."""
    i = scene.parts[SEGMENT, m, j]
    if i == ABSENT:
        return 0j
    rate = 1j * turned * scene.moments[TURNED, row, j]
    if slide != 0.0:
        psi = scene.turns[PSI, row, j]
        steepness = tubes[j, i, BENDING] * pre_curvature_rate(tubes, j, i, scene.gauss[row, PLACE] + scene.base[AT, j])
        rate += slide * steepness * complex(math.cos(psi), math.sin(psi))
    return rate
