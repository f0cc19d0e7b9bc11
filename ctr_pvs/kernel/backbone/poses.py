"""Poses at any place of the backbone, from the frames at the Gauss points."""

from __future__ import annotations

import math

from ctr_pvs.kernel.arrays import ANGLE
from ctr_pvs.kernel.arrays import ARC
from ctr_pvs.kernel.arrays import BEND
from ctr_pvs.kernel.arrays import GAUSS
from ctr_pvs.kernel.arrays import HIGHEST_DEGREE
from ctr_pvs.kernel.arrays import LENGTH
from ctr_pvs.kernel.arrays import N_ELEMENTS
from ctr_pvs.kernel.arrays import POLYNOMIAL
from ctr_pvs.kernel.arrays import POSITION
from ctr_pvs.kernel.arrays import ROW
from ctr_pvs.kernel.arrays import SPINOR
from ctr_pvs.kernel.arrays import WEIGHT
from ctr_pvs.kernel.arrays import Array
from ctr_pvs.kernel.arrays import Bench
from ctr_pvs.kernel.arrays import Scene
from ctr_pvs.kernel.backbone.frames import arc
from ctr_pvs.kernel.backbone.frames import arc_start
from ctr_pvs.kernel.backbone.frames import arc_turn
from ctr_pvs.kernel.backbone.frames import is_arc
from ctr_pvs.kernel.backbone.frames import put_pose
from ctr_pvs.kernel.backbone.frames import turned_vector
from ctr_pvs.kernel.carry import angle_at
from ctr_pvs.kernel.compiler import compiled


@compiled
def expand_rates(scene: Scene, bench: Bench, rules: Array, m: int) -> int:
    """Legendre series of a, b and the position along element m, of their rates times its length, into ``bench.series``
    (7 of each degree), divided by what ``inside`` would divide by; how many degrees."""
    G, row, h = scene.marks[m, GAUSS], scene.marks[m, ROW], scene.line[m, LENGTH]
    count = min(G, HIGHEST_DEGREE + 1)
    for k in range(count):
        for i in range(7):
            bench.series[k, i] = 0.0
    for g in range(G):
        a, b, bend = scene.bends[row + g, SPINOR], scene.bends[row + g, SPINOR + 1], scene.bends[row + g, BEND]
        a_rate, b_rate, across = -0.5 * bend.conjugate() * b, 0.5 * bend * a, -2j * a * b
        along = a.real * a.real + a.imag * a.imag - b.real * b.real - b.imag * b.imag
        for k in range(count):
            w = h * rules[G, g, WEIGHT] * rules[G, g, POLYNOMIAL + k]
            bench.series[k, 0] += w * a_rate.real
            bench.series[k, 1] += w * a_rate.imag
            bench.series[k, 2] += w * b_rate.real
            bench.series[k, 3] += w * b_rate.imag
            bench.series[k, 4] += w * along
            bench.series[k, 5] += w * across.real
            bench.series[k, 6] += w * across.imag
    for k in range(1, count):
        for i in range(7):
            bench.series[k, i] /= 2.0 * math.sqrt(2.0 * k + 1.0)
    return count


@compiled
def inside(bench: Bench, count: int, x: float, out: Array) -> None:
    """Integrals from 0 to x in [0, 1] of the rates that ``expand_rates`` has made ``count`` series of, into ``out``
    (7,)."""
    y = 2.0 * x - 1.0
    for i in range(7):
        out[i] = bench.series[0, i] * x
    before, here = 1.0, y
    for k in range(1, count):  # int_0^x P_k = (L_(k+1) - L_(k-1)) / (2 sqrt(2 k + 1))
        after = ((2.0 * k + 1.0) * y * here - k * before) / (k + 1.0)
        for i in range(7):
            out[i] += bench.series[k, i] * (after - before)
        before, here = here, after


@compiled
def trace(
    scene: Scene, bench: Bench, tubes: Array, rules: Array, tube: int, s: Array, position: Array, orientation: Array
) -> None:
    """Poses of the material of ``tube`` at increasing arc lengths s (n,) [m]: position (n, 3) [m], orientation (n, 4)
    unit quaternions x, y, z, w.  They are sign-continuous along s, and in time: the first one's sign follows the
    roll."""
    M = scene.counts[N_ELEMENTS]
    m, opened, count = 0, -1, 0
    turn, k = 0.0, 0j
    series = bench.series[HIGHEST_DEGREE + 1]
    for g in range(len(s)):
        roll = angle_at(scene, s[g], tube) if s[g] > 0.0 else scene.held[ANGLE, 0, tube]
        if M == 0 or s[g] <= 0.0:
            put_pose(1.0 + 0j, 0j, roll, orientation[g])
            for i in range(3):
                position[g, i] = 0.0
            continue
        while m < M - 1 and s[g] > scene.line[m + 1, ARC]:
            m += 1
        on_arc = is_arc(scene, tubes, m)
        if opened != m:
            opened = m
            if on_arc:
                turn = arc_turn(scene, tubes, m)
                k = arc_start(scene, tubes, rules, m, turn)
            else:
                count = expand_rates(scene, bench, rules, m)
        x = min(max((s[g] - scene.line[m, ARC]) / scene.line[m, LENGTH], 0.0), 1.0)
        if on_arc:
            a, b, along, across = arc(k, turn, x * scene.line[m, LENGTH])
        else:
            inside(bench, count, x, series)
            a, b = complex(1.0 + series[0], series[1]), complex(series[2], series[3])
            along, across = series[4], complex(series[5], series[6])
        A, B = scene.frame[m, 0], scene.frame[m, 1]
        put_pose(A * a - B * b.conjugate(), A * b + B * a.conjugate(), roll, orientation[g])
        dx, dyz = turned_vector(A, B, along, across)
        position[g, 0] = scene.line[m, POSITION] + dx
        position[g, 1] = scene.line[m, POSITION + 1] + dyz.real
        position[g, 2] = scene.line[m, POSITION + 2] + dyz.imag
