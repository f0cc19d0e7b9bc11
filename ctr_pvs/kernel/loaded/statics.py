"""Forces and moments of the loads along the backbone.

Loads are dead, so the force n(s) of all beyond s is known in base axes whatever the shape is; their moment follows from
the shape, m' = -t x n.  Bending feels its part across the tangent, m.d2 + i m.d3, twist that of point moments along it.
"""

from __future__ import annotations

from ctr_pvs.kernel.arrays import ARC
from ctr_pvs.kernel.arrays import AXIAL
from ctr_pvs.kernel.arrays import BINORMAL
from ctr_pvs.kernel.arrays import GAUSS
from ctr_pvs.kernel.arrays import INTERPOLANT
from ctr_pvs.kernel.arrays import LENGTH
from ctr_pvs.kernel.arrays import LOADED
from ctr_pvs.kernel.arrays import MOMENT
from ctr_pvs.kernel.arrays import MOMENT_FAR
from ctr_pvs.kernel.arrays import MOMENTS
from ctr_pvs.kernel.arrays import MU
from ctr_pvs.kernel.arrays import MU_SIZE
from ctr_pvs.kernel.arrays import N_ELEMENTS
from ctr_pvs.kernel.arrays import N_FAR
from ctr_pvs.kernel.arrays import N_LOADS
from ctr_pvs.kernel.arrays import N_POINTS
from ctr_pvs.kernel.arrays import NORMAL
from ctr_pvs.kernel.arrays import PER_LENGTH
from ctr_pvs.kernel.arrays import PLACE
from ctr_pvs.kernel.arrays import POINT
from ctr_pvs.kernel.arrays import POINT_MOMENT
from ctr_pvs.kernel.arrays import POLYNOMIAL
from ctr_pvs.kernel.arrays import ROW
from ctr_pvs.kernel.arrays import SPINOR
from ctr_pvs.kernel.arrays import STIFFNESS
from ctr_pvs.kernel.arrays import TANGENT
from ctr_pvs.kernel.arrays import TORQUE
from ctr_pvs.kernel.arrays import TUBE
from ctr_pvs.kernel.arrays import WEIGHT
from ctr_pvs.kernel.arrays import Array
from ctr_pvs.kernel.arrays import Bench
from ctr_pvs.kernel.arrays import Scene
from ctr_pvs.kernel.backbone.frames import cross
from ctr_pvs.kernel.backbone.frames import tangent
from ctr_pvs.kernel.compiler import compiled
from ctr_pvs.kernel.twist.fields import mu_scale


@compiled
def force_at(scene: Scene, m: int, row: int, out: Array) -> None:
    """Force [N] of the loads beyond a Gauss point of element m, in base axes, into ``out`` (3,)."""
    left = scene.line[m + 1, ARC] - scene.gauss[row, PLACE]
    for i in range(3):
        out[i] = scene.statics[m, N_FAR + i] + left * scene.statics[m, PER_LENGTH + i]


@compiled
def spread_axes(scene: Scene, m: int) -> None:
    """Fills ``axes`` of element m from the frames."""
    A, B = scene.frame[m, 0], scene.frame[m, 1]
    for row in range(scene.marks[m, ROW], scene.marks[m, ROW] + scene.marks[m, GAUSS]):
        a, b = scene.bends[row, SPINOR], scene.bends[row, SPINOR + 1]
        a, b = A * a - B * b.conjugate(), A * b + B * a.conjugate()
        put_axes(a, b, scene.axes[row])


@compiled
def put_axes(a: complex, b: complex, out: Array) -> None:
    """Tangent, normal and binormal of the frame a + b j into ``out`` (9,)."""
    w, x, y, z = a.real, a.imag, b.real, b.imag
    out[0], out[1], out[2] = w * w + x * x - y * y - z * z, 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)
    out[3], out[4], out[5] = 2.0 * (x * y - w * z), w * w - x * x + y * y - z * z, 2.0 * (y * z + w * x)
    out[6], out[7], out[8] = 2.0 * (x * z + w * y), 2.0 * (y * z - w * x), w * w - x * x - y * y + z * z


@compiled
def spread_loads(scene: Scene, bench: Bench, rules: Array) -> None:
    """Fills ``axes`` and MOMENT at the Gauss points of the loaded elements, MOMENT_FAR of all, from the frames; the
    last row of ``statics`` gets what acts on the orifice."""
    M = scene.counts[N_ELEMENTS]
    force, moment, levers = bench.space[0], bench.space[1], bench.sites[0]
    for i in range(3):
        moment[i] = 0.0
    for m in range(M - 1, -1, -1):
        add_moments(scene, m + 1, moment)
        for i in range(3):
            scene.statics[m, MOMENT_FAR + i] = moment[i]
        if not scene.marks[m, LOADED]:
            continue
        spread_axes(scene, m)
        G, row, h = scene.marks[m, GAUSS], scene.marks[m, ROW], scene.line[m, LENGTH]
        for g in range(G):
            force_at(scene, m, row + g, force)
            cross(scene.axes[row + g, :3], force, levers[g])
            for i in range(3):
                moment[i] += scene.gauss[row + g, WEIGHT] * levers[g, i]
        for g in range(G):
            axial, normal, binormal = 0.0, 0.0, 0.0
            for i in range(3):
                here = moment[i]
                for k in range(G):
                    here -= h * rules[G, g, INTERPOLANT + k] * levers[k, i]
                axial += here * scene.axes[row + g, TANGENT + i]
                normal += here * scene.axes[row + g, NORMAL + i]
                binormal += here * scene.axes[row + g, BINORMAL + i]
            scene.axes[row + g, AXIAL] = axial
            scene.bends[row + g, MOMENT] = complex(normal, binormal)
    for i in range(3):
        scene.statics[M, MOMENT_FAR + i] = moment[i]


@compiled
def add_moments(scene: Scene, at: int, moment: Array) -> None:
    """Adds the point moments where element ``at`` starts to ``moment`` (3,)."""
    if scene.counts[MOMENTS] == 0:
        return
    first = scene.counts[N_LOADS] - POINT * scene.counts[N_POINTS]
    for p in range(scene.counts[N_POINTS]):
        if scene.point_at[p] == at:
            for i in range(3):
                moment[i] += scene.loads[first + POINT * p + POINT_MOMENT + i]


@compiled
def twist_by_moments(scene: Scene) -> None:
    """Adds what point moments do to psi of the tubes they sit on to ``torque`` at the elements' starts."""
    if scene.counts[MOMENTS] == 0:
        return
    axis = scene.statics[scene.counts[N_ELEMENTS], PER_LENGTH : PER_LENGTH + 3]  # free there
    first = scene.counts[N_LOADS] - POINT * scene.counts[N_POINTS]
    for p in range(scene.counts[N_POINTS]):
        at, load = scene.point_at[p], first + POINT * p
        tangent(scene.frame, at, axis)
        along = 0.0
        for i in range(3):
            along += scene.loads[load + POINT_MOMENT + i] * axis[i]
        scene.held[TORQUE, at, int(scene.loads[load + TUBE])] -= along


@compiled
def gather_moments(scene: Scene, rules: Array, column: int, out: Array) -> None:
    """What moments of the loads in a ``column`` of ``bends`` mean for the unknowns of mu, their virtual work with
    the minus of a gradient, into ``out`` (U,)."""
    for m in range(scene.counts[N_ELEMENTS]):
        first, size = scene.marks[m, MU], scene.marks[m, MU_SIZE]
        if size == 0:
            continue
        G, scale = scene.marks[m, GAUSS], mu_scale(scene, m) / scene.line[m, STIFFNESS]
        for k in range(2 * size):
            out[first + k] = 0.0
        for g in range(G):
            row = scene.marks[m, ROW] + g
            moment = -scale * scene.gauss[row, WEIGHT] * scene.bends[row, column]
            for k in range(size):
                out[first + k] += moment.real * rules[G, g, POLYNOMIAL + k]
                out[first + size + k] += moment.imag * rules[G, g, POLYNOMIAL + k]


@compiled
def forces_work(scene: Scene) -> float:
    """int n.t ds [J]: the work of the forces of all loads on their way from a straight robot; of point moments
    nothing."""
    work = 0.0
    force = scene.statics[scene.counts[N_ELEMENTS], PER_LENGTH : PER_LENGTH + 3]  # free there
    for m in range(scene.counts[N_ELEMENTS]):
        if scene.marks[m, LOADED]:
            spread_axes(scene, m)
            for row in range(scene.marks[m, ROW], scene.marks[m, ROW] + scene.marks[m, GAUSS]):
                force_at(scene, m, row, force)
                for i in range(3):
                    work += scene.gauss[row, WEIGHT] * force[i] * scene.axes[row, i]
    return work
