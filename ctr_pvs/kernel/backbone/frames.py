"""The Bishop frame and the position along the backbone.

The frame is the unit quaternion a + b j with complex a = w + i x and b = y + i z.  With the body rate (0, k_y, k_z),
k = k_y + i k_z, its equations are linear (eq. (5) of the seed):

    a' = -conj(k) b / 2,    b' = k a / 2,

and the tangent is (|a|^2 - |b|^2, -2 i a b), the second entry being y + i z.  They are solved element by element by
Gauss collocation (E. Hairer, C. Lubich, G. Wanner, "Geometric Numerical Integration", section II.1.3), or in closed
form where only a constant turn changes the curvature: in a frame that turns with it the strain is constant.
"""

from __future__ import annotations

import cmath
import math

from ctr_pvs.kernel.arrays import ABSENT
from ctr_pvs.kernel.arrays import ANGLE
from ctr_pvs.kernel.arrays import ARC
from ctr_pvs.kernel.arrays import BEND
from ctr_pvs.kernel.arrays import COUPLED
from ctr_pvs.kernel.arrays import FRAMED
from ctr_pvs.kernel.arrays import FRAMED_ANGLE
from ctr_pvs.kernel.arrays import GAUSS
from ctr_pvs.kernel.arrays import INTERPOLANT
from ctr_pvs.kernel.arrays import LENGTH
from ctr_pvs.kernel.arrays import LOADED
from ctr_pvs.kernel.arrays import MU_HERE
from ctr_pvs.kernel.arrays import N_ELEMENTS
from ctr_pvs.kernel.arrays import N_UNKNOWNS
from ctr_pvs.kernel.arrays import PLACE
from ctr_pvs.kernel.arrays import POSITION
from ctr_pvs.kernel.arrays import PSI
from ctr_pvs.kernel.arrays import ROW
from ctr_pvs.kernel.arrays import SEGMENT
from ctr_pvs.kernel.arrays import SPINOR
from ctr_pvs.kernel.arrays import STIFFNESS
from ctr_pvs.kernel.arrays import TRIAL
from ctr_pvs.kernel.arrays import TURN
from ctr_pvs.kernel.arrays import TURNED
from ctr_pvs.kernel.arrays import WEIGHT
from ctr_pvs.kernel.arrays import Array
from ctr_pvs.kernel.arrays import Complex
from ctr_pvs.kernel.arrays import Scene
from ctr_pvs.kernel.arrays import Y
from ctr_pvs.kernel.compiler import compiled
from ctr_pvs.kernel.materials import is_constant
from ctr_pvs.kernel.materials import is_curved
from ctr_pvs.kernel.twist.fields import angles_inside
from ctr_pvs.kernel.twist.fields import mu_at
from ctr_pvs.kernel.twist.fields import turn_moments

#: Rounds of the collocation equations, the most and what ends them: a change this small, as each round is at least a
#: thousand times better than the one before by then.
MOST_ROUNDS, LAST_CHANGE = 60, 1e-12


@compiled
def put_frames(scene: Scene, tubes: Array, rules: Array, turned: bool) -> None:
    """Curvature, frames and positions for ``y`` and ``angle``, unless they stand there: an answer is often asked for
    its backbone right after it was solved.  turned : see ``bend``."""
    if not is_framed(scene):
        bend(scene, rules, turned)
        chain(scene, tubes, rules)


@compiled
def bend(scene: Scene, rules: Array, turned: bool) -> None:
    """Curvature at all Gauss points of ``scene`` for its ``y`` and ``angle``: eq. (26) point by point, and what the
    loads add.  turned : the turned moments of coupled elements are those of ``y``, as a gradient leaves them."""
    scene.base[FRAMED_ANGLE, 0] = math.nan
    for m in range(scene.counts[N_ELEMENTS]):
        if not (turned and scene.marks[m, COUPLED]):
            angles_inside(scene, rules, m, scene.held[ANGLE, m], scene.vectors[Y], scene.turns[PSI])
            turn_moments(scene, m)
        for g in range(scene.marks[m, GAUSS]):
            row = scene.marks[m, ROW] + g
            total = 0j
            if scene.marks[m, LOADED]:
                total = mu_at(scene, rules, m, g, scene.vectors[Y])
                scene.bends[row, MU_HERE] = total
            for j in range(scene.base.shape[1]):
                total += scene.moments[TURNED, row, j]
            scene.bends[row, BEND] = total / scene.line[m, STIFFNESS]


@compiled
def is_arc(scene: Scene, tubes: Array, m: int) -> bool:
    """True if element m bends with a constant curvature that turns at a constant rate."""
    if scene.marks[m, COUPLED]:
        return False
    for j in range(scene.base.shape[1]):
        i = scene.parts[SEGMENT, m, j]
        if i != ABSENT and not is_constant(tubes, j, i):
            return False
    return True


@compiled
def arc_turn(scene: Scene, tubes: Array, m: int) -> float:
    """Turn [rad/m] of the curvature along an arc: of the one curved tube's pre-curvature and twist."""
    for j in range(scene.base.shape[1]):
        i = scene.parts[SEGMENT, m, j]
        if i != ABSENT and is_curved(tubes, j, i):
            return float(
                tubes[j, i, TURN] + (scene.held[ANGLE, m + 1, j] - scene.held[ANGLE, m, j]) / scene.line[m, LENGTH]
            )
    return 0.0


@compiled
def arc(k: complex, turn: float, s: float) -> tuple[complex, complex, float, complex]:
    """After s [m] from the identity with curvature k exp(i turn s) [1/m]: a, b, the way along x and y + i z [m]."""
    omega = math.hypot(turn, abs(k))
    if omega * s < 1e-12:
        return 1.0 + 0j, 0.5 * s * k, s, -0.5j * s * s * k
    n, m = 1j * (turn / omega), k / omega
    sin, cos = math.sin(0.5 * omega * s), math.cos(0.5 * omega * s)
    squares = 0.5 * s - sin * cos / omega
    a, b = cos + n * sin, m * sin
    if turn != 0.0:
        e = cmath.exp(0.5j * turn * s)
        a, b = a * e.conjugate(), b * e
    size = (m.real * m.real + m.imag * m.imag) * squares
    return a, b, s - 2.0 * size, -2j * (m * (sin * sin / omega + n * squares))


@compiled
def collocate(scene: Scene, rules: Array, m: int) -> tuple[complex, complex, float, complex]:
    """Frames at the Gauss points of element m into ``spinor``; at its end a, b, the way along x and y + i z [m]."""
    G, row, h = scene.marks[m, GAUSS], scene.marks[m, ROW], scene.line[m, LENGTH]
    spinor = scene.bends[:, SPINOR : SPINOR + 2]
    for g in range(G):
        spinor[row + g, 0], spinor[row + g, 1] = 1.0, 0.0
    for _ in range(MOST_ROUNDS):
        change = 0.0
        for g in range(G):
            spinor[row + g, 1], scene.bends[row + g, TRIAL] = 0.0, 1.0
        for j in range(G):  # column by column: sums that do not wait for one another
            rate = 0.5 * h * (scene.bends[row + j, BEND] * spinor[row + j, 0])
            for g in range(G):
                w = rules[G, g, INTERPOLANT + j]
                spinor[row + g, 1] += complex(w * rate.real, w * rate.imag)
        for j in range(G):
            rate = -0.5 * h * (scene.bends[row + j, BEND].conjugate() * spinor[row + j, 1])
            for g in range(G):
                w = rules[G, g, INTERPOLANT + j]
                scene.bends[row + g, TRIAL] += complex(w * rate.real, w * rate.imag)
        for g in range(G):
            a = scene.bends[row + g, TRIAL]
            change = max(change, abs(a.real - spinor[row + g, 0].real) + abs(a.imag - spinor[row + g, 0].imag))
            spinor[row + g, 0] = a
        if change < LAST_CHANGE:
            break
    a, b, along, across = 1.0 + 0j, 0j, 0.0, 0j
    for g in range(G):
        w = h * rules[G, g, WEIGHT]
        A, B, k = spinor[row + g, 0], spinor[row + g, 1], scene.bends[row + g, BEND]
        a -= 0.5 * w * k.conjugate() * B
        b += 0.5 * w * k * A
        along += w * (A.real * A.real + A.imag * A.imag - B.real * B.real - B.imag * B.imag)
        across -= 2j * w * A * B
    return a, b, along, across


@compiled
def go_on(frame: Complex, line: Array, m: int, a: complex, b: complex, along: float, across: complex) -> None:
    """Fills the end of element m from its start and what happens along it."""
    A, B = frame[m, 0], frame[m, 1]
    frame[m + 1, 0] = A * a - B * b.conjugate()
    frame[m + 1, 1] = A * b + B * a.conjugate()
    x, yz = turned_vector(A, B, along, across)
    line[m + 1, POSITION] = line[m, POSITION] + x
    line[m + 1, POSITION + 1] = line[m, POSITION + 1] + yz.real
    line[m + 1, POSITION + 2] = line[m, POSITION + 2] + yz.imag


@compiled
def turned_vector(A: complex, B: complex, x: float, yz: complex) -> tuple[float, complex]:
    """The vector (x, y + i z) turned by the frame A + B j."""
    size = A.real * A.real + A.imag * A.imag - B.real * B.real - B.imag * B.imag
    across = A * A * yz + B * B * yz.conjugate() - 2j * A * B * x
    return size * x + 2.0 * (A * B.conjugate() * yz).imag, across


@compiled
def chain(scene: Scene, tubes: Array, rules: Array) -> None:
    """Frames and positions from the orifice to the tip, from ``curvature``."""
    frame, line = scene.frame, scene.line
    frame[0, 0], frame[0, 1] = 1.0, 0.0
    for i in range(3):
        line[0, POSITION + i] = 0.0
    for m in range(scene.counts[N_ELEMENTS]):
        if is_arc(scene, tubes, m):
            turn = arc_turn(scene, tubes, m)
            k = arc_start(scene, tubes, rules, m, turn)
            a, b, along, across = arc(k, turn, scene.line[m, LENGTH])
        else:
            a, b, along, across = collocate(scene, rules, m)
        go_on(frame, line, m, a, b, along, across)
    for j in range(scene.base.shape[1]):
        scene.base[FRAMED_ANGLE, j] = scene.held[ANGLE, 0, j]
    for u in range(scene.counts[N_UNKNOWNS]):
        scene.vectors[FRAMED, u] = scene.vectors[Y, u]


@compiled
def is_framed(scene: Scene) -> bool:
    """True if the frames in ``scene`` are those of its unknowns and angles."""
    for j in range(scene.base.shape[1]):
        if scene.base[FRAMED_ANGLE, j] != scene.held[ANGLE, 0, j]:
            return False
    for u in range(scene.counts[N_UNKNOWNS]):
        if scene.vectors[FRAMED, u] != scene.vectors[Y, u]:
            return False
    return True


@compiled
def arc_start(scene: Scene, tubes: Array, rules: Array, m: int, turn: float) -> complex:
    """Curvature [1/m] at the start of an arc, from that at its first Gauss point."""
    row = scene.marks[m, ROW]
    return scene.bends[row, BEND] * cmath.exp(-1j * turn * (scene.gauss[row, PLACE] - scene.line[m, ARC]))


@compiled
def put_pose(A: complex, B: complex, roll: float, out: Array) -> None:
    """The unit quaternion x, y, z, w of material turned by ``roll`` [rad] against the frame (A, B) into ``out``
    (4,)."""
    size = 1.0 / math.sqrt(A.real * A.real + A.imag * A.imag + B.real * B.real + B.imag * B.imag)
    e = size * complex(math.cos(0.5 * roll), math.sin(0.5 * roll))
    a, b = A * e, B * e.conjugate()
    out[0], out[1], out[2], out[3] = a.imag, b.real, b.imag, a.real


@compiled
def cross(u: Array, v: Array, out: Array) -> None:
    """``out`` becomes u x v, (3,) each."""
    out[0] = u[1] * v[2] - u[2] * v[1]
    out[1] = u[2] * v[0] - u[0] * v[2]
    out[2] = u[0] * v[1] - u[1] * v[0]


@compiled
def tangent(frame: Complex, m: int, out: Array) -> None:
    """The tangent (3,) where element m starts."""
    x, yz = turned_vector(frame[m, 0], frame[m, 1], 1.0, 0j)
    out[0], out[1], out[2] = x, yz.real, yz.imag


@compiled
def dot(u: Array, v: Array) -> float:
    """u.v of the first three."""
    return float(u[0] * v[0] + u[1] * v[1] + u[2] * v[2])
