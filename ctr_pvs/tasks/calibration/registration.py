"""Rotations, and how a cloud of model tips lies in the frame of the measurement."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Below this angle [rad] series stand for quotients that cancel.
SMALL = 1e-4


def cross_matrix(v: Array) -> Array:
    """(3, 3) with which v (3,) is multiplied crosswise."""
    x, y, z = v.tolist()
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def rotation(v: Array) -> Array:
    """(3, 3) rotation by the vector v (3,) [rad]."""
    angle, K = float(np.linalg.norm(v)), cross_matrix(v)
    if angle < SMALL:
        return np.asarray(np.eye(3) + K + 0.5 * K @ K)
    return np.asarray(np.eye(3) + np.sin(angle) / angle * K + (1.0 - np.cos(angle)) / angle**2 * K @ K)


def left_jacobian(v: Array) -> Array:
    """(3, 3) that takes a change of v to the turn [rad] by which ``rotation(v)`` is multiplied from the left."""
    angle, K = float(np.linalg.norm(v)), cross_matrix(v)
    if angle < SMALL:
        return np.asarray(np.eye(3) + 0.5 * K + K @ K / 6.0)
    first, second = (1.0 - np.cos(angle)) / angle**2, (angle - np.sin(angle)) / angle**3
    return np.asarray(np.eye(3) + first * K + second * K @ K)


def matrices(quaternions: Array) -> Array:
    """(M, 3, 3) from unit quaternions x, y, z, w (M, 4); columns are the axes of the turned frame."""
    x, y, z, w = np.asarray(quaternions).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def quaternion(R: Array) -> Array:
    """(4,) unit quaternion x, y, z, w >= 0 of a rotation (3, 3)."""
    # The largest eigenvalue of this matrix is 3 and belongs to the quaternion (Bar-Itzhack 2000).
    K = np.empty((4, 4))
    K[:3, :3] = R + R.T - np.trace(R) * np.eye(3)
    K[3, :3] = K[:3, 3] = [R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]
    K[3, 3] = np.trace(R)
    q = np.linalg.eigh(K)[1][:, -1]
    return np.asarray(q if q[3] >= 0.0 else -q)


def best_registration(told: Array, measured: Array) -> tuple[Array, Array]:
    """Rotation (3, 3) and translation (3,) [m] that bring the points ``told`` (M, 3) nearest to ``measured`` (M, 3), in
    squares (Kabsch)."""
    centre, there = told.mean(axis=0), measured.mean(axis=0)
    u, _, vt = np.linalg.svd((told - centre).T @ (measured - there))
    R = vt.T @ np.diag([1.0, 1.0, np.sign(np.linalg.det(vt.T @ u.T))]) @ u.T
    return R, there - R @ centre
