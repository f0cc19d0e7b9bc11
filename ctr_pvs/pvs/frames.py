"""The backbone of a shape: R' = R hat(0, k_y, k_z), r' = R e_x, from its curvature alone.

Gauss collocation, part by part of every panel, where the curvature is smooth.  The equation is linear in R, so a part
of length h is one linear system for the frames R_i at its Gauss points x_i,

    R_i = I + h sum_j S_ij R_j A_j,      S_ij = int_0^x_i l_j dx,

with A_j = hat(0, k_y, k_z) there and l_j Lagrange's polynomials; in between R and r follow from the same polynomials,
to the order of the points, and at the part's end to twice that.  Parts are halved until nothing asked for changes by
more than the tolerance.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.model.basis import gauss_legendre
from ctr_pvs.model.basis import legendre
from ctr_pvs.model.shape import Shape

Array = NDArray[np.float64]

#: Gauss points in a part, and the most parts of a panel.
NODES, MOST_PARTS = 12, 256
#: Differences below this share of the robot's length are rounding.
ROUNDING = 1e-14


def tip_position(shape: Shape, tolerance: float) -> Array:
    """Position (3,) [m] of the farthest tip in the base frame, integrated for an error of ``tolerance`` [m]."""
    return bishop_frames(shape, np.array([shape.domain.length]), tolerance)[1][0]


def bishop_frames(shape: Shape, s: Array, tolerance: float) -> tuple[Array, Array]:
    """Rotations (g, 3, 3) of the Bishop frame, which starts as the identity, and positions (g, 3) [m] of the backbone.

    s : (g,) arc lengths [m] from 0 to the robot's length, in any order.
    tolerance : error [m] of the positions; rotations have it divided by the robot's length, in rad.
    """
    length = shape.domain.length
    s = np.clip(s, 0.0, length)
    if not shape.domain.n_sections:
        return np.tile(np.eye(3), (len(s), 1, 1)), np.zeros((len(s), 3))
    parts, enough = 1, max(tolerance, ROUNDING * length)
    rotation, position = _integrated(shape, s, parts)
    while parts < MOST_PARTS:
        parts *= 2
        before_rotation, before_position = rotation, position
        rotation, position = _integrated(shape, s, parts)
        turned = length * float(np.abs(rotation - before_rotation).max(initial=0.0))
        if max(turned, float(np.abs(position - before_position).max(initial=0.0))) <= enough:
            break
    return rotation, position


def _integrated(shape: Shape, s: Array, parts: int) -> tuple[Array, Array]:
    """``bishop_frames`` with ``parts`` parts for each panel."""
    rotation, position = np.empty((len(s), 3, 3)), np.empty((len(s), 3))
    section = shape.domain.locate(s)
    frame, origin = np.eye(3), np.zeros(3)
    for m, start, length, frames, slopes in _parts(shape, parts):
        # Rounding may put a place just outside its section, or between two parts: the ends of parts overlap.
        near = 1e-9 * length
        here = np.flatnonzero((section == m) & (s >= start - near) & (s <= start + length + near))
        x = np.append((s[here] - start) / length, 1.0)
        local, path = _between(frames, slopes, length, x)
        rotation[here], position[here] = frame @ local[:-1], origin + path[:-1] @ frame.T
        frame, origin = frame @ local[-1], origin + frame @ path[-1]
    return rotation, position


def _parts(shape: Shape, parts: int) -> Iterator[tuple[int, float, float, Array, Array]]:
    """Part by part from the orifice: section, start and length [m], R_i and R_i A_i (NODES, 3, 3), with R = I at the
    start of each part."""
    rule = gauss_legendre(NODES)
    values, integrals = legendre(NODES - 1, rule.x)
    S = integrals @ (values.T * rule.weights)
    for m, (section_start, section_length) in enumerate(
        zip(shape.domain.boundaries.tolist(), shape.domain.lengths.tolist(), strict=False)
    ):
        count = parts * shape.panels(m)
        length = section_length / count
        k = shape.curvature(m, gauss_legendre(NODES, count).x).reshape(count, NODES)
        A = np.zeros((count, NODES, 3, 3))
        A[..., 0, 1], A[..., 0, 2], A[..., 1, 0], A[..., 2, 0] = -k.imag, k.real, k.imag, -k.real
        # Row by row of R: sum_j (delta_ij I - h S_ij A_j^T) r_j = e, with r_j a row of R_j as a column.
        system = -length * np.einsum("ij,pjab->pibja", S, A).reshape(count, 3 * NODES, 3 * NODES)
        system += np.eye(3 * NODES)
        right = np.tile(np.eye(3), (NODES, 1))
        rows = np.linalg.solve(system, np.broadcast_to(right, (count, *right.shape)))
        frames = rows.reshape(count, NODES, 3, 3).swapaxes(-1, -2)
        slopes = frames @ A
        for number in range(count):
            yield m, section_start + number * length, length, frames[number], slopes[number]


def _between(frames: Array, slopes: Array, length: float, x: Array) -> tuple[Array, Array]:
    """R (g, 3, 3) and r (g, 3) [m] at the places ``x`` (g,) in [0, 1] of a part that starts at the identity."""
    rule = gauss_legendre(NODES)
    weighted = legendre(NODES - 1, rule.x)[0].T * rule.weights
    reach = legendre(NODES - 1, x)[1] @ weighted  # (g, NODES): int_0^x l_j
    rotation = np.eye(3) + length * np.einsum("gj,jab->gab", reach, slopes)
    return rotation, length * reach @ frames[:, :, 0]
