"""SE(3) integration of the backbone: g' = g xi with xi = (k, e_x), by a sixth-order Magnus method.

The curvature is that of the Bishop frame, which does not twist; material frames follow by a turn psi about the tangent.
All steps are computed at once; their product is taken with a logarithmic number of array operations.

Reference: S. Blanes, F. Casas, J. A. Oteo, J. Ros, "The Magnus expansion and some of its applications", Physics
Reports 470 (2009), section 5.4 (three Gauss points, order six).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ctr_pvs.shape import Shape

Array = NDArray[np.float64]

#: Gauss points of a step on [0, 1].
STEP_NODES = 0.5 + 0.5 * np.array([-math.sqrt(0.6), 0.0, math.sqrt(0.6)])
#: Below this rotation [rad] the exponential's coefficients come from their series.
SMALL_ANGLE = 1e-2


@dataclass(frozen=True, eq=False)
class Pose:
    """position (3,) [m] in the base frame, orientation (4,) unit quaternion x, y, z, w."""

    position: Array
    orientation: Array


@dataclass(frozen=True, eq=False)
class Backbone:
    """Poses along the robot: s (n,) [m], position (n, 3) [m], orientation (n, 4) unit quaternions x, y, z, w."""

    s: Array
    position: Array
    orientation: Array

    def __len__(self) -> int:
        return len(self.s)


def bishop_frames(shape: Shape, s: Array, tolerance: float) -> Array:
    """(g, 4, 4) homogeneous matrices of the Bishop frame at increasing arc lengths ``s`` (g,) [m] from the orifice on.

    ``tolerance`` [m] bounds the step length by an a-priori rule (``steps_needed``); the caller checks what it gives.
    """
    domain = shape.domain
    stops = np.union1d(s, domain.boundaries)
    stops = stops[stops <= s[-1]] if len(s) else stops
    section = domain.locate(stops[1:])
    edges, owner, arrival = [], [], [0]
    for m in np.unique(section):
        ends = stops[1:][section == m]
        starts = np.concatenate([stops[:-1][section == m][:1], ends[:-1]])
        length = steps_needed(shape, int(m), tolerance)
        for a, b in zip(starts, ends, strict=True):
            count = max(1, math.ceil((b - a) / length))
            grid = np.linspace(a, b, count + 1)
            edges.append(np.column_stack([grid[:-1], grid[1:]]))
            owner.append(np.full(count, m))
            arrival.append(arrival[-1] + count)
    if not edges:
        return np.tile(np.eye(4), (len(s), 1, 1))
    steps = np.concatenate(edges)
    frames = cumulative_product(exponential(*magnus(shape, steps, np.concatenate(owner))))
    frames = np.concatenate([np.eye(4)[None], frames])
    return frames[np.array(arrival)[np.searchsorted(stops, s)]]


def steps_needed(shape: Shape, m: int, tolerance: float) -> float:
    """Step length [m] for section m: a sixth-order step errs with its seventh power times how fast curvature
    changes."""
    x = np.linspace(0.0, 1.0, 5)
    length = shape.domain.lengths[m]
    k = shape.curvature(m, x)
    bend = float(np.abs(k).max())
    change = float(np.abs(np.diff(k)).max()) * 4.0 / length
    if change * length**2 < 1e-14:
        return length  # constant curvature: one step is exact
    rate = max(bend, math.sqrt(change), float(np.abs(shape.twist_rate(m, x)).max()))
    relative = tolerance / max(shape.domain.length, tolerance)
    return min(length, 1.6 * relative ** (1.0 / 6.0) / rate)


def magnus(shape: Shape, steps: Array, owner: NDArray[np.int64]) -> tuple[Array, Array]:
    """Rotation vectors and translations (n, 3) whose SE(3) exponential is the motion over each of ``steps`` (n, 2)
    [m]."""
    h = np.diff(steps, axis=1)
    s = steps[:, :1] + h * STEP_NODES
    k = np.empty(s.shape, dtype=complex)
    for m in np.unique(owner):
        here = owner == m
        x = (s[here] - shape.domain.boundaries[m]) / shape.domain.lengths[m]
        k[here] = shape.curvature(int(m), x.ravel()).reshape(x.shape)
    return magnus_exponent(h[:, 0], k)


def magnus_exponent(h: Array, k: NDArray[np.complex128]) -> tuple[Array, Array]:
    """The sixth-order exponent of g' = g (k, e_x) from ``k`` (n, 3) at the three Gauss points of steps ``h`` (n,).

    The reference treats Y' = A Y; for g' = g xi the commutators change sign.
    """
    first = _twist(h, k[:, 1], 1.0)
    second = _twist(math.sqrt(15.0) / 3.0 * h, k[:, 2] - k[:, 0], 0.0)
    third = _twist(10.0 / 3.0 * h, k[:, 2] - 2.0 * k[:, 1] + k[:, 0], 0.0)
    inner = -_bracket(first, second)
    outer = _bracket(first, 2.0 * third + inner) / 60.0
    exponent = first + third / 12.0 - _bracket(-20.0 * first - third + inner, second + outer) / 240.0
    return exponent[:, :3], exponent[:, 3:]


def _twist(h: Array, k: NDArray[np.complex128], tangent: float) -> Array:
    """(n, 6) h (0, k_y, k_z, tangent, 0, 0)."""
    out = np.zeros((len(h), 6))
    out[:, 1] = h * k.real
    out[:, 2] = h * k.imag
    out[:, 3] = h * tangent
    return out


def _bracket(a: Array, b: Array) -> Array:
    """(n, 6) Lie bracket of se(3), rotations first."""
    out = np.empty(a.shape)
    out[:, :3] = _cross(a[:, :3], b[:, :3])
    out[:, 3:] = _cross(a[:, :3], b[:, 3:]) + _cross(a[:, 3:], b[:, :3])
    return out


def _cross(a: Array, b: Array) -> Array:
    """(n, 3) cross products; ``np.cross`` spends most of its time on generality."""
    out = np.empty(a.shape)
    out[:, 0] = a[:, 1] * b[:, 2] - a[:, 2] * b[:, 1]
    out[:, 1] = a[:, 2] * b[:, 0] - a[:, 0] * b[:, 2]
    out[:, 2] = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    return out


def exponential(rotation: Array, translation: Array) -> Array:
    """(n, 4, 4) exponential of se(3) elements given by ``rotation`` (n, 3) [rad] and ``translation`` (n, 3) [m]."""
    angle2 = np.sum(rotation * rotation, axis=1)
    angle = np.sqrt(angle2)
    small = angle < SMALL_ANGLE
    safe = np.where(small, 1.0, angle)
    sinc = np.where(small, 1.0 - angle2 / 6.0 * (1.0 - angle2 / 20.0), np.sin(safe) / safe)
    half = np.where(small, 0.5 - angle2 / 24.0 * (1.0 - angle2 / 30.0), 2.0 * (np.sin(0.5 * safe) / safe) ** 2)
    third = np.where(small, 1.0 / 6.0 - angle2 / 120.0 * (1.0 - angle2 / 42.0), (safe - np.sin(safe)) / safe**3)
    cross = np.zeros((len(rotation), 3, 3))
    cross[:, 2, 1] = rotation[:, 0]
    cross[:, 0, 2] = rotation[:, 1]
    cross[:, 1, 0] = rotation[:, 2]
    cross -= cross.transpose(0, 2, 1)
    square = cross @ cross
    out = np.zeros((len(rotation), 4, 4))
    out[:, :3, :3] = np.eye(3) + sinc[:, None, None] * cross + half[:, None, None] * square
    left = np.eye(3) + half[:, None, None] * cross + third[:, None, None] * square
    out[:, :3, 3] = (left @ translation[:, :, None])[:, :, 0]
    out[:, 3, 3] = 1.0
    return out


def cumulative_product(matrices: Array) -> Array:
    """(n, 4, 4) products of the first 1, 2, .. n matrices, in order, by doubling."""
    out = matrices.copy()
    reach = 1
    while reach < len(out):
        out[reach:] = out[:-reach] @ out[reach:]
        reach *= 2
    return out


def material_poses(shape: Shape, tube: int, s: Array, frames: Array) -> Backbone:
    """Poses of ``tube``'s material frame at ``s`` (g,) on the Bishop ``frames`` (g, 4, 4).

    Quaternions are sign-continuous along s, and the first one's sign follows the unwrapped base angle, so that it is
    also continuous in time.
    """
    psi = shape.angles_at(s)[:, tube]
    turns = Rotation.from_rotvec(np.column_stack([psi, np.zeros_like(psi), np.zeros_like(psi)]))
    orientation = (Rotation.from_matrix(frames[:, :3, :3]) * turns).as_quat()
    start = np.array([math.sin(0.5 * psi[0]), 0.0, 0.0, math.cos(0.5 * psi[0])])
    before = np.concatenate([start[None], orientation[:-1]])
    flips = np.where(np.sum(before * orientation, axis=1) < 0.0, -1.0, 1.0)
    return Backbone(s, frames[:, :3, 3], orientation * np.cumprod(flips)[:, None])
