"""How the tip moves with rates of the fields along the backbone.

The tip's spatial twist is the integral of Ad_g d(h xi) over x: changes of curvature turn everything beyond, changes of
length push it along the tangent (eq. (36)-(37), integrated at fixed x).
"""

from __future__ import annotations

import math

from ctr_pvs.kernel.arrays import ABSENT
from ctr_pvs.kernel.arrays import ARC
from ctr_pvs.kernel.arrays import AT
from ctr_pvs.kernel.arrays import BEFORE
from ctr_pvs.kernel.arrays import BEND
from ctr_pvs.kernel.arrays import GAUSS
from ctr_pvs.kernel.arrays import INTERPOLANT
from ctr_pvs.kernel.arrays import LENGTH
from ctr_pvs.kernel.arrays import N_ELEMENTS
from ctr_pvs.kernel.arrays import PLACE
from ctr_pvs.kernel.arrays import POSITION
from ctr_pvs.kernel.arrays import ROW
from ctr_pvs.kernel.arrays import SEGMENT
from ctr_pvs.kernel.arrays import SPINOR
from ctr_pvs.kernel.arrays import STEP
from ctr_pvs.kernel.arrays import STIFFNESS
from ctr_pvs.kernel.arrays import TURN
from ctr_pvs.kernel.arrays import WEIGHT
from ctr_pvs.kernel.arrays import Array
from ctr_pvs.kernel.arrays import Bench
from ctr_pvs.kernel.arrays import Scene
from ctr_pvs.kernel.backbone.frames import arc
from ctr_pvs.kernel.backbone.frames import arc_start
from ctr_pvs.kernel.backbone.frames import arc_turn
from ctr_pvs.kernel.backbone.frames import cross
from ctr_pvs.kernel.backbone.frames import is_arc
from ctr_pvs.kernel.backbone.frames import turned_vector
from ctr_pvs.kernel.compiler import compiled
from ctr_pvs.kernel.materials import pre_curvature
from ctr_pvs.kernel.sections import nodes_for_turn
from ctr_pvs.kernel.twist.fields import angles_inside
from ctr_pvs.kernel.twist.fields import explicit_angle
from ctr_pvs.kernel.twist.fields import moment_rate
from ctr_pvs.kernel.twist.fields import mu_at

#: Error that quadrature along an arc may leave, relative to its length.
ARC_ERROR = 1e-13


@compiled
def tip_rates(
    scene: Scene, bench: Bench, tubes: Array, rules: Array, leader: int, D_rate: Array, ends: Array, angles: Array,
    answered: Array, out: Array,
) -> None:  # fmt: skip
    """Rates of the tip's position [m] and rotation [rad] in base axes into ``out`` (6,), from what ``answer_rates`` and
    ``answered_ends`` have filled; frames, curvatures and turned moments are those of ``scene``."""
    M = scene.counts[N_ELEMENTS]
    for i in range(6):
        out[i] = 0.0
    for m in range(M):
        if is_arc(scene, tubes, m):
            along_arc(scene, bench, tubes, rules, m, D_rate, ends, angles, answered, out)
        else:
            along_element(scene, bench, tubes, rules, m, D_rate, ends, angles, answered, out)
    x, yz = turned_vector(scene.frame[M, 0], scene.frame[M, 1], 1.0, 0j)
    turned = angles[M, leader] + answered[M, leader]
    out[3] += turned * x
    out[4] += turned * yz.real
    out[5] += turned * yz.imag


@compiled
def along_element(
    scene: Scene, bench: Bench, tubes: Array, rules: Array, m: int, D_rate: Array, ends: Array, angles: Array,
    answered: Array, out: Array,
) -> None:  # fmt: skip
    """Adds what the Gauss points of element m contribute to the tip's rates."""
    G, h = scene.marks[m, GAUSS], scene.line[m, LENGTH]
    stretch = ends[m + 1] - ends[m]
    angles_inside(scene, rules, m, answered[m], scene.vectors[STEP], scene.turns[BEFORE])
    for g in range(G):
        row = scene.marks[m, ROW] + g
        along = ends[m] + rules[G, g, PLACE] * stretch
        dk = 0j
        for j in range(len(D_rate)):
            turned = scene.turns[BEFORE, row, j] + explicit_angle(scene, m, row, j, angles, stretch / h)
            dk += moment_rate(scene, tubes, m, row, j, along + D_rate[j], turned)
        dk += mu_at(scene, rules, m, g, scene.vectors[STEP])
        change = (
            scene.gauss[row, WEIGHT] * dk / scene.line[m, STIFFNESS]
            + rules[G, g, WEIGHT] * stretch * scene.bends[row, BEND]
        )
        a, b = scene.bends[row, SPINOR], scene.bends[row, SPINOR + 1]
        x, yz = position_inside(scene, rules, m, g)
        move_tip(scene, bench, m, a, b, x, yz, change, rules[G, g, WEIGHT] * stretch, out)


@compiled
def position_inside(scene: Scene, rules: Array, m: int, g: int) -> tuple[float, complex]:
    """Way along x and y + i z [m] from the start of element m, in its frame, to Gauss point g."""
    G, row, h = scene.marks[m, GAUSS], scene.marks[m, ROW], scene.line[m, LENGTH]
    x, yz = 0.0, 0j
    for k in range(G):
        w = h * rules[G, g, INTERPOLANT + k]
        a, b = scene.bends[row + k, SPINOR], scene.bends[row + k, SPINOR + 1]
        x += w * (a.real * a.real + a.imag * a.imag - b.real * b.real - b.imag * b.imag)
        yz -= 2j * w * a * b
    return x, yz


@compiled
def along_arc(
    scene: Scene, bench: Bench, tubes: Array, rules: Array, m: int, D_rate: Array, ends: Array, angles: Array,
    answered: Array, out: Array,
) -> None:  # fmt: skip
    """Adds what an arc contributes to the tip's rates: frames in closed form at Gauss points of its own."""
    h, stretch = scene.line[m, LENGTH], ends[m + 1] - ends[m]
    turn = arc_turn(scene, tubes, m)
    start = arc_start(scene, tubes, rules, m, turn)
    G = nodes_for_turn((abs(start) + abs(turn)) * h + 1.0, ARC_ERROR)
    curved, own_turn = -1, 0.0
    for j in range(len(D_rate)):
        i = scene.parts[SEGMENT, m, j]
        if i != ABSENT and abs(pre_curvature(tubes, j, i, scene.line[m, ARC] + scene.base[AT, j])) > 0.0:
            curved, own_turn = j, float(tubes[j, i, TURN])
    for g in range(G):
        x = rules[G, g, PLACE]
        k = start * complex(math.cos(turn * h * x), math.sin(turn * h * x))
        change = rules[G, g, WEIGHT] * stretch * k
        if curved >= 0:
            first = angles[m, curved] + answered[m, curved]
            last = angles[m + 1, curved] + answered[m + 1, curved]
            slide = ends[m] + x * stretch + D_rate[curved]
            change += 1j * h * rules[G, g, WEIGHT] * k * (first + x * (last - first) + own_turn * slide)
        a, b, along, across = arc(start, turn, x * h)
        move_tip(scene, bench, m, a, b, along, across, change, rules[G, g, WEIGHT] * stretch, out)


@compiled
def move_tip(
    scene: Scene, bench: Bench, m: int, a: complex, b: complex, x: float, yz: complex, change: complex, push: float,
    out: Array,
) -> None:  # fmt: skip
    """Adds to the tip's rates a turn by ``change`` [rad], k_y + i k_z in the frame (a, b) at the place (x, yz) [m]
    since the start of element m, and a ``push`` [m] along the tangent there."""
    arm, turning, moved = bench.space[0], bench.space[1], bench.space[2]
    A, B = scene.frame[m, 0], scene.frame[m, 1]
    x, yz = turned_vector(A, B, x, yz)
    last = scene.counts[N_ELEMENTS]
    arm[0] = scene.line[last, POSITION] - scene.line[m, POSITION] - x
    arm[1] = scene.line[last, POSITION + 1] - scene.line[m, POSITION + 1] - yz.real
    arm[2] = scene.line[last, POSITION + 2] - scene.line[m, POSITION + 2] - yz.imag
    a, b = A * a - B * b.conjugate(), A * b + B * a.conjugate()
    x, yz = turned_vector(a, b, 0.0, change)
    turning[0], turning[1], turning[2] = x, yz.real, yz.imag
    cross(turning, arm, moved)
    x, yz = turned_vector(a, b, push, 0j)
    out[0] += moved[0] + x
    out[1] += moved[1] + yz.real
    out[2] += moved[2] + yz.imag
    for i in range(3):
        out[3 + i] += turning[i]
