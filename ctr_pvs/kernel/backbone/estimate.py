"""How far the backbone moves, to first order, for a small change of the unknowns.

Where psi changes, so does the curvature, dk = i sum b_j dpsi_j / sum K.  That turns everything beyond by phi, phi' =
R (0, dk), and moves it by dr' = phi x t.  Signs count: a twist of high degree moves what lies beyond by very little.
"""

from __future__ import annotations

import math

from ctr_pvs.kernel.arrays import ABSENT
from ctr_pvs.kernel.arrays import BENT
from ctr_pvs.kernel.arrays import COUPLED
from ctr_pvs.kernel.arrays import FIRST
from ctr_pvs.kernel.arrays import GAUSS
from ctr_pvs.kernel.arrays import INTERPOLANT
from ctr_pvs.kernel.arrays import LENGTH
from ctr_pvs.kernel.arrays import N_ELEMENTS
from ctr_pvs.kernel.arrays import POSITION
from ctr_pvs.kernel.arrays import PSI
from ctr_pvs.kernel.arrays import ROOT
from ctr_pvs.kernel.arrays import ROW
from ctr_pvs.kernel.arrays import SCALE
from ctr_pvs.kernel.arrays import SEGMENT
from ctr_pvs.kernel.arrays import SIZE
from ctr_pvs.kernel.arrays import SPINOR
from ctr_pvs.kernel.arrays import STIFFNESS
from ctr_pvs.kernel.arrays import TURNED
from ctr_pvs.kernel.arrays import Array
from ctr_pvs.kernel.arrays import Bench
from ctr_pvs.kernel.arrays import Scene
from ctr_pvs.kernel.backbone.frames import cross
from ctr_pvs.kernel.backbone.frames import tangent
from ctr_pvs.kernel.backbone.frames import turned_vector
from ctr_pvs.kernel.compiler import compiled
from ctr_pvs.kernel.materials import is_curved
from ctr_pvs.kernel.twist.fields import angles_inside
from ctr_pvs.kernel.twist.fields import mu_at


@compiled
def backbone_motion(scene: Scene, bench: Bench, tubes: Array, rules: Array, change: Array) -> float:
    """The most [m] that any place of the backbone moves when the unknowns change by ``change`` (U,); frames and turned
    moments are those of ``scene``."""
    N = len(bench.offset)
    turned = bench.lines[BENT]
    phi, motion = bench.space[0], bench.space[1]
    for i in range(3):
        phi[i], motion[i] = 0.0, 0.0
    for j in range(N):
        turned[j] = scene.base[ROOT, j] * change[j]
    most = 0.0
    for m in range(scene.counts[N_ELEMENTS]):
        if scene.marks[m, COUPLED]:
            most = max(most, through_coupled(scene, bench, rules, m, change))
        else:
            swing(scene, bench, tubes, m, change)
        for j in range(N):
            if scene.parts[SIZE, m, j] > 0:
                turned[j] += scene.held[SCALE, m, j] * change[scene.parts[FIRST, m, j]]
        most = max(most, math.sqrt(motion[0] ** 2 + motion[1] ** 2 + motion[2] ** 2))
    return most


@compiled
def swing(scene: Scene, bench: Bench, tubes: Array, m: int, change: Array) -> None:
    """Carries phi and dr over an element with one curved tube, or none: it turns as it is about its first tangent."""
    phi, motion, first, last, arm, moved = bench.space
    dpsi = 0.0
    for j in range(len(bench.offset)):
        i = scene.parts[SEGMENT, m, j]
        if i != ABSENT and is_curved(tubes, j, i):
            inside = scene.held[SCALE, m, j] * change[scene.parts[FIRST, m, j]] if scene.parts[SIZE, m, j] > 0 else 0.0
            dpsi = bench.lines[BENT, j] + 0.5 * inside
    tangent(scene.frame, m, first)
    tangent(scene.frame, m + 1, last)
    for i in range(3):
        arm[i] = scene.line[m + 1, POSITION + i] - scene.line[m, POSITION + i]
        phi[i] += dpsi * first[i]
    cross(phi, arm, moved)
    for i in range(3):
        motion[i] += moved[i]
        phi[i] -= dpsi * last[i]


@compiled
def through_coupled(scene: Scene, bench: Bench, rules: Array, m: int, change: Array) -> float:
    """Carries phi and dr over a coupled element; the most [m] that a Gauss point of it moves."""
    G, h, first_row = scene.marks[m, GAUSS], scene.line[m, LENGTH], scene.marks[m, ROW]
    phi, motion = bench.space[0], bench.space[1]
    rates, tangents = bench.sites[0], bench.sites[1]
    angles_inside(scene, rules, m, bench.lines[BENT], change, scene.turns[PSI])
    A, B = scene.frame[m, 0], scene.frame[m, 1]
    for g in range(G):
        row = first_row + g
        dk = 0j
        for j in range(len(bench.offset)):
            dk += scene.moments[TURNED, row, j] * scene.turns[PSI, row, j]
        dk = (1j * dk + mu_at(scene, rules, m, g, change)) / scene.line[m, STIFFNESS]
        a, b = scene.bends[row, SPINOR], scene.bends[row, SPINOR + 1]
        a, b = A * a - B * b.conjugate(), A * b + B * a.conjugate()
        x, yz = turned_vector(a, b, 0.0, dk)
        rates[g, 0], rates[g, 1], rates[g, 2] = x, yz.real, yz.imag
        x, yz = turned_vector(a, b, 1.0, 0j)
        tangents[g, 0], tangents[g, 1], tangents[g, 2] = x, yz.real, yz.imag
    for g in range(G):  # dr' = phi x t in place of the tangents
        x, y, z = phi[0], phi[1], phi[2]
        for k in range(G):
            w = h * rules[G, g, INTERPOLANT + k]
            x += w * rates[k, 0]
            y += w * rates[k, 1]
            z += w * rates[k, 2]
        tx, ty, tz = tangents[g, 0], tangents[g, 1], tangents[g, 2]
        tangents[g, 0], tangents[g, 1], tangents[g, 2] = y * tz - z * ty, z * tx - x * tz, x * ty - y * tx
    most = 0.0
    for g in range(G):
        x, y, z = motion[0], motion[1], motion[2]
        for k in range(G):
            w = h * rules[G, g, INTERPOLANT + k]
            x += w * tangents[k, 0]
            y += w * tangents[k, 1]
            z += w * tangents[k, 2]
        most = max(most, math.sqrt(x * x + y * y + z * z))
    for g in range(G):
        w = h * rules[G, g, 1]
        for i in range(3):
            motion[i] += w * tangents[g, i]
            phi[i] += w * rates[g, i]
    return most
