"""How the moments of the loads change with a command or with a load, with torque coefficients and mu held.

Elements stretch and material slides, so frames turn by phi, phi' = R (0, dk + dh k / h) at fixed places of them, and
the moment changes by d(m) = int (phi x t) x n + t x n dh / h + t x dn ds over what lies beyond.
"""

from __future__ import annotations

from ctr_pvs.kernel.arrays import AXIAL
from ctr_pvs.kernel.arrays import BEND
from ctr_pvs.kernel.arrays import BINORMAL
from ctr_pvs.kernel.arrays import GAUSS
from ctr_pvs.kernel.arrays import INTERPOLANT
from ctr_pvs.kernel.arrays import LEADER
from ctr_pvs.kernel.arrays import LENGTH
from ctr_pvs.kernel.arrays import LOADED
from ctr_pvs.kernel.arrays import MOMENT
from ctr_pvs.kernel.arrays import N_ELEMENTS
from ctr_pvs.kernel.arrays import N_LOADS
from ctr_pvs.kernel.arrays import N_POINTS
from ctr_pvs.kernel.arrays import NORMAL
from ctr_pvs.kernel.arrays import PER_LENGTH
from ctr_pvs.kernel.arrays import PLACE
from ctr_pvs.kernel.arrays import POINT
from ctr_pvs.kernel.arrays import POINT_MOMENT
from ctr_pvs.kernel.arrays import ROW
from ctr_pvs.kernel.arrays import STIFFNESS
from ctr_pvs.kernel.arrays import TORQUE
from ctr_pvs.kernel.arrays import TRIAL
from ctr_pvs.kernel.arrays import TUBE
from ctr_pvs.kernel.arrays import TURNING
from ctr_pvs.kernel.arrays import WEIGHT
from ctr_pvs.kernel.arrays import Array
from ctr_pvs.kernel.arrays import Bench
from ctr_pvs.kernel.arrays import Scene
from ctr_pvs.kernel.backbone.frames import cross
from ctr_pvs.kernel.backbone.frames import dot
from ctr_pvs.kernel.backbone.frames import tangent
from ctr_pvs.kernel.compiler import compiled
from ctr_pvs.kernel.loaded.statics import force_at
from ctr_pvs.kernel.twist.fields import explicit_angle
from ctr_pvs.kernel.twist.fields import moment_rate


@compiled
def turn_frames(
    scene: Scene, bench: Bench, tubes: Array, rules: Array, D_rate: Array, ends: Array, angles: Array
) -> None:
    """Turns of the frame at the Gauss points of the loaded elements into TURNING of ``axes``, and at the elements' ends
    into the last columns of ``angles`` (M + 1, N + 3); its first are the rates of psi there."""
    N = len(D_rate)
    rates = bench.sites[0]
    for i in range(3):
        angles[0, N + i] = 0.0
    for m in range(scene.counts[N_ELEMENTS]):
        for i in range(3):
            angles[m + 1, N + i] = angles[m, N + i]
        if not scene.marks[m, LOADED]:
            continue
        G, h, first = scene.marks[m, GAUSS], scene.line[m, LENGTH], scene.marks[m, ROW]
        stretch = ends[m + 1] - ends[m]
        for g in range(G):
            row = first + g
            along = ends[m] + rules[G, g, PLACE] * stretch
            dk = 0j
            for j in range(N):
                turned = explicit_angle(scene, m, row, j, angles, stretch / h)
                dk += moment_rate(scene, tubes, m, row, j, along + D_rate[j], turned)
            dk = dk * h / scene.line[m, STIFFNESS] + stretch * scene.bends[row, BEND]
            for i in range(3):
                rates[g, i] = dk.real * scene.axes[row, NORMAL + i] + dk.imag * scene.axes[row, BINORMAL + i]
        for g in range(G):
            for i in range(3):
                turned = angles[m, N + i]
                for k in range(G):
                    turned += rules[G, g, INTERPOLANT + k] * rates[k, i]
                scene.axes[first + g, TURNING + i] = turned
                angles[m + 1, N + i] += rules[G, g, WEIGHT] * rates[g, i]


@compiled
def moment_rates(scene: Scene, bench: Bench, rules: Array, ends: Array, wrench: Array) -> None:
    """Rates of the loads' moments at the Gauss points of the loaded elements into TRIAL of ``bends``; frames turn by
    TURNING, elements stretch with their ``ends`` (M + 1,), and ``wrench`` (6,) is added at the tip."""
    force, change, levers = bench.space[0], bench.space[1], bench.sites[0]
    dn, dm, turned, moved = bench.space[2], bench.space[3], bench.space[4], bench.space[5]
    for i in range(3):
        dn[i], dm[i] = wrench[i], wrench[3 + i]
    for m in range(scene.counts[N_ELEMENTS] - 1, -1, -1):
        if not scene.marks[m, LOADED]:
            continue
        G, h, first = scene.marks[m, GAUSS], scene.line[m, LENGTH], scene.marks[m, ROW]
        stretch = ends[m + 1] - ends[m]
        for g in range(G):
            axes, left = scene.axes[first + g], 1.0 - rules[G, g, PLACE]
            force_at(scene, m, first + g, force)
            for i in range(3):
                change[i] = h * (dn[i] + stretch * left * scene.statics[m, PER_LENGTH + i]) + stretch * force[i]
            cross(axes, change, levers[g])
            cross(axes[TURNING : TURNING + 3], axes, turned)
            cross(turned, force, moved)
            for i in range(3):
                levers[g, i] += h * moved[i]
                dm[i] += rules[G, g, WEIGHT] * levers[g, i]
        for g in range(G):
            axes, moment = scene.axes[first + g], scene.bends[first + g, MOMENT]
            for i in range(3):
                change[i] = dm[i]
                for k in range(G):
                    change[i] -= rules[G, g, INTERPOLANT + k] * levers[k, i]
            phi = axes[TURNING : TURNING + 3]
            about = dot(phi, axes)
            normal = dot(change, axes[NORMAL : NORMAL + 3]) - axes[AXIAL] * dot(phi, axes[BINORMAL : BINORMAL + 3])
            binormal = dot(change, axes[BINORMAL : BINORMAL + 3]) + axes[AXIAL] * dot(phi, axes[NORMAL : NORMAL + 3])
            scene.bends[first + g, TRIAL] = complex(normal, binormal) + about * complex(moment.imag, -moment.real)
        for i in range(3):
            dn[i] += stretch * scene.statics[m, PER_LENGTH + i]


@compiled
def twist_rates_by_moments(scene: Scene, bench: Bench, angles: Array, wrench: Array) -> None:
    """What point moments do to psi changes as the tangent turns by the last columns of ``angles``; and the moment of
    ``wrench`` (6,) acts on the leading tube's end: into ``torque`` at the elements' starts."""
    N, M = len(bench.offset), scene.counts[N_ELEMENTS]
    axis, moved = bench.space[0], bench.space[1]
    first = scene.counts[N_LOADS] - POINT * scene.counts[N_POINTS]
    for p in range(scene.counts[N_POINTS]):
        at, load = scene.point_at[p], first + POINT * p
        tangent(scene.frame, at, axis)
        cross(angles[at, N : N + 3], axis, moved)
        scene.held[TORQUE, at, int(scene.loads[load + TUBE])] -= dot(
            scene.loads[load + POINT_MOMENT : load + POINT], moved
        )
    tangent(scene.frame, M, axis)
    scene.held[TORQUE, M, scene.counts[LEADER]] -= dot(wrench[3:6], axis)
