"""Second derivatives of the loads' virtual work in one element.

A change of curvature dk turns the frame of all beyond by phi, phi' = R (0, dk).  Along a straight line of unknowns the
virtual work of forces n and of a moment m about the place has the second derivative (symmetric part where point moments
act)

    int [ (n.t) phi.phi - (n.phi)(t.phi) - m.(phi x R dk) ] ds,

and where psi turns by dpsi, dk = (i sum b_j dpsi_j + dmu) / sum K has one of its own, - sum b_j dpsi_j^2 / sum K, which
is in ``element.springs``.
"""

from __future__ import annotations

from typing import NamedTuple

from ctr_pvs.kernel.arrays import AXIAL
from ctr_pvs.kernel.arrays import BINORMAL
from ctr_pvs.kernel.arrays import GAUSS
from ctr_pvs.kernel.arrays import INTEGRAL
from ctr_pvs.kernel.arrays import INTERPOLANT
from ctr_pvs.kernel.arrays import LENGTH
from ctr_pvs.kernel.arrays import MOMENT
from ctr_pvs.kernel.arrays import MU_SIZE
from ctr_pvs.kernel.arrays import NORMAL
from ctr_pvs.kernel.arrays import POLYNOMIAL
from ctr_pvs.kernel.arrays import ROW
from ctr_pvs.kernel.arrays import SCALE
from ctr_pvs.kernel.arrays import SIZE
from ctr_pvs.kernel.arrays import STIFFNESS
from ctr_pvs.kernel.arrays import TURNED
from ctr_pvs.kernel.arrays import WEIGHT
from ctr_pvs.kernel.arrays import Array
from ctr_pvs.kernel.arrays import Bench
from ctr_pvs.kernel.arrays import Scene
from ctr_pvs.kernel.backbone.frames import dot
from ctr_pvs.kernel.compiler import compiled
from ctr_pvs.kernel.loaded.statics import force_at
from ctr_pvs.kernel.twist.fields import mu_scale
from ctr_pvs.kernel.twist.fields import used
from ctr_pvs.kernel.twist.fields import used_bending


class Spread(NamedTuple):
    """Three numbers per unknown of an element and its start, W in all: phi at its end, room for phi at one of its Gauss
    points and for work, and for R dk at one of them, (3, W) each; the same but for the first flat, (3 W,); then R dk at
    all Gauss points, flat."""

    end: Array
    turned: Array
    work: Array
    rate: Array
    flat_end: Array
    flat_turned: Array
    flat_rate: Array
    rates: Array


@compiled
def spread_of(bench: Bench, wide: int) -> Spread:
    """Of an element with ``wide`` rows."""
    flat, n = bench.spread, 3 * wide
    return Spread(
        flat[:n].reshape(3, wide), flat[n : 2 * n].reshape(3, wide), flat[2 * n : 3 * n].reshape(3, wide),
        flat[3 * n : 4 * n].reshape(3, wide), flat[:n], flat[n : 2 * n], flat[3 * n : 4 * n], flat[4 * n :],
    )  # fmt: skip


@compiled
def load_hessian(scene: Scene, bench: Bench, rules: Array, m: int, which: int, n: int, A: Array) -> None:
    """Adds the loads' part of element m, of n unknowns, to the lower triangle of A; see ``element.element_hessian``.

    How its end turns stays in ``spread_of``."""
    G, h, first = scene.marks[m, GAUSS], scene.line[m, LENGTH], scene.marks[m, ROW]
    wide = n + 3 + len(bench.offset)
    spread = spread_of(bench, wide)
    long = 3 * wide
    start_turning(spread.end, n)
    for g in range(G):
        turning(scene, bench, rules, m, g, which, n, spread.rate)
        add_multiple(spread.flat_end, spread.flat_rate, h * rules[G, g, WEIGHT])
        copy(spread.rates[long * g : long * (g + 1)], spread.flat_rate)
    for g in range(G):
        start_turning(spread.turned, n)
        for k in range(G):
            add_multiple(
                spread.flat_turned, spread.rates[long * k : long * (k + 1)], h * rules[G, g, INTERPOLANT + k]
            )  # fmt: skip
        copy(spread.flat_rate, spread.rates[long * g : long * (g + 1)])
        half_work(scene, bench, m, first + g, spread.turned, spread.rate, spread.work)
        add_symmetric(A, spread.turned, spread.work)


@compiled
def start_turning(out: Array, n: int) -> None:
    """``out`` (3, W) becomes the turn of the frame at an element's start, whose rows begin at n."""
    for i in range(3):
        for a in range(out.shape[1]):
            out[i, a] = 0.0
        out[i, n + i] = 1.0


@compiled
def add_multiple(out: Array, v: Array, w: float) -> None:
    """Adds w v to ``out``."""
    for a in range(len(out)):
        out[a] += w * v[a]


@compiled
def copy(out: Array, v: Array) -> None:
    """``out`` becomes v."""
    for a in range(len(out)):
        out[a] = v[a]


@compiled
def turning(scene: Scene, bench: Bench, rules: Array, m: int, g: int, which: int, n: int, out: Array) -> None:
    """R dk at Gauss point g of element m, per unknown and per psi at its start, into ``out`` (3, W)."""
    G, row, N = scene.marks[m, GAUSS], scene.marks[m, ROW] + g, len(bench.offset)
    stiffness = scene.line[m, STIFFNESS]
    size = used_bending(scene.marks[m, MU_SIZE], which)
    scale = mu_scale(scene, m) / stiffness
    for i in range(3):
        for a in range(out.shape[1]):
            out[i, a] = 0.0
        normal, binormal = scene.axes[row, NORMAL + i], scene.axes[row, BINORMAL + i]
        for j in range(N):
            if scene.parts[SIZE, m, j] < 2:
                continue
            b = scene.moments[TURNED, row, j]
            e = (b.real * binormal - b.imag * normal) / stiffness
            out[i, n + 3 + j] = e
            e *= scene.held[SCALE, m, j]
            for k in range(used(scene.parts[SIZE, m, j], which)):
                out[i, bench.offset[j] + k] = e * rules[G, g, INTEGRAL + k]
        normal, binormal = scale * normal, scale * binormal
        for k in range(size):
            p = rules[G, g, POLYNOMIAL + k]
            out[i, n - 2 * size + k] = p * normal
            out[i, n - size + k] = p * binormal


@compiled
def half_work(scene: Scene, bench: Bench, m: int, row: int, turned: Array, rates: Array, out: Array) -> None:
    """Half of what ``turned``, phi, and ``rates``, R dk, meet at a Gauss point of element m, into ``out``, (3, W) each:
    out.phi + phi.out is the second derivative."""
    n, axes = bench.space[0], scene.axes[row]
    moment, w = scene.bends[row, MOMENT], 0.5 * scene.gauss[row, WEIGHT]
    force_at(scene, m, row, n)
    nt = w * dot(n, axes)
    for i in range(3):
        i1, i2 = (i + 1) % 3, (i + 2) % 3
        m1 = axes[AXIAL] * axes[i1] + moment.real * axes[NORMAL + i1] + moment.imag * axes[BINORMAL + i1]
        m2 = axes[AXIAL] * axes[i2] + moment.real * axes[NORMAL + i2] + moment.imag * axes[BINORMAL + i2]
        m1, m2 = w * m1, w * m2
        p0 = -0.5 * w * (n[i] * axes[0] + axes[i] * n[0])
        p1 = -0.5 * w * (n[i] * axes[1] + axes[i] * n[1])
        p2 = -0.5 * w * (n[i] * axes[2] + axes[i] * n[2])
        to, phi, r1, r2 = out[i], turned[i], rates[i1], rates[i2]
        for a in range(out.shape[1]):
            to[a] = p0 * turned[0, a] + p1 * turned[1, a] + p2 * turned[2, a]
        for a in range(out.shape[1]):
            to[a] += nt * phi[a] + m1 * r2[a] - m2 * r1[a]


@compiled
def add_symmetric(A: Array, u: Array, v: Array) -> None:
    """Adds u^T v + v^T u of u, v (3, W) to the lower triangle of A (W, W)."""
    for a in range(u.shape[1]):
        u0, u1, u2, v0, v1, v2 = u[0, a], u[1, a], u[2, a], v[0, a], v[1, a], v[2, a]
        for b in range(a + 1):
            A[a, b] += u0 * v[0, b] + u1 * v[1, b] + u2 * v[2, b] + v0 * u[0, b] + v1 * u[1, b] + v2 * u[2, b]
