"""SE(3) in the seed's notation (Appendix A): six-vectors hold the angular part first, the linear part second.

Every function works on stacks: leading axes (...) are kept.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def hat(w: Array) -> Array:
    """(..., 3, 3) skew matrix of ``w`` (..., 3): hat(a) b = a x b."""
    out = np.zeros((*w.shape, 3))
    out[..., 2, 1], out[..., 0, 2], out[..., 1, 0] = w[..., 0], w[..., 1], w[..., 2]
    out[..., 1, 2], out[..., 2, 0], out[..., 0, 1] = -w[..., 0], -w[..., 1], -w[..., 2]
    return out


def adjoint(g: Array) -> Array:
    """Ad_g (..., 6, 6) of homogeneous matrices ``g`` (..., 4, 4): carries twists from the body to the space frame."""
    rotation, position = g[..., :3, :3], g[..., :3, 3]
    out = np.zeros((*g.shape[:-2], 6, 6))
    out[..., :3, :3] = out[..., 3:, 3:] = rotation
    out[..., 3:, :3] = hat(position) @ rotation
    return out


def coadjoint(g: Array) -> Array:
    """Ad*_g (..., 6, 6): carries wrenches; Ad*_g = Ad_(g^-1)^T."""
    rotation, position = g[..., :3, :3], g[..., :3, 3]
    out = np.zeros((*g.shape[:-2], 6, 6))
    out[..., :3, :3] = out[..., 3:, 3:] = rotation
    out[..., :3, 3:] = hat(position) @ rotation
    return out


def small_adjoint(xi: Array) -> Array:
    """ad_xi (..., 6, 6) of twists ``xi`` (..., 6)."""
    out = np.zeros((*xi.shape, 6))
    out[..., :3, :3] = out[..., 3:, 3:] = hat(xi[..., :3])
    out[..., 3:, :3] = hat(xi[..., 3:])
    return out


def small_coadjoint(xi: Array) -> Array:
    """ad*_xi (..., 6, 6) = -ad_xi^T."""
    out = np.zeros((*xi.shape, 6))
    out[..., :3, :3] = out[..., 3:, 3:] = hat(xi[..., :3])
    out[..., :3, 3:] = hat(xi[..., 3:])
    return out


def roll(angle: Array) -> Array:
    """g_theta (..., 4, 4) of eq. (2): rotation by ``angle`` (...) [rad] about x."""
    angle = np.asarray(angle, dtype=float)
    out = np.zeros((*angle.shape, 4, 4))
    out[..., 0, 0] = out[..., 3, 3] = 1.0
    out[..., 1, 1] = out[..., 2, 2] = np.cos(angle)
    out[..., 2, 1], out[..., 1, 2] = np.sin(angle), -np.sin(angle)
    return out


def homogeneous(rotation: Array, position: Array) -> Array:
    """(..., 4, 4) of a rotation (..., 3, 3) and a position (..., 3)."""
    out = np.zeros((*position.shape[:-1], 4, 4))
    out[..., :3, :3], out[..., :3, 3], out[..., 3, 3] = rotation, position, 1.0
    return out


def inverse(g: Array) -> Array:
    """g^-1 (..., 4, 4)."""
    out = np.zeros_like(g)
    transposed = np.swapaxes(g[..., :3, :3], -1, -2)
    out[..., :3, :3] = transposed
    out[..., :3, 3] = -(transposed @ g[..., :3, 3, None])[..., 0]
    out[..., 3, 3] = 1.0
    return out
