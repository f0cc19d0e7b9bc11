"""Orthonormal Legendre polynomials on [0, 1], and Gauss quadrature in one piece or on several panels.

Fields along a section are functions of x = (s - s_start) / h in [0, 1].  The polynomials are scaled so that
``int_0^1 P_i P_k dx = delta_ik``: the coefficients of a field are its integrals against them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class GaussRule:
    """Gauss quadrature on [0, 1]: x, weights (g,)."""

    x: Array
    weights: Array


def legendre(degree: int, x: Array) -> tuple[Array, Array]:
    """Orthonormal Legendre polynomials up to ``degree`` at ``x`` (...) in [0, 1], and their integrals from 0.

    Returns two arrays (..., degree + 1).  int_0^x P_k follows from (2k+1) L_k = (L_{k+1} - L_{k-1})'.
    """
    raw = np.polynomial.legendre.legvander(2.0 * x - 1.0, degree + 1)
    k = np.arange(degree + 1)
    norm = np.sqrt(2.0 * k + 1.0)
    integrals = np.empty((*x.shape, degree + 1))
    integrals[..., 0] = x
    integrals[..., 1:] = (raw[..., 2:] - raw[..., :-2]) / (2.0 * norm[1:])
    return raw[..., :-1] * norm, integrals


@lru_cache(maxsize=128)
def gauss_legendre(nodes: int, panels: int = 1) -> GaussRule:
    """``nodes`` Gauss points on each of ``panels`` equal panels; exact for degree 2 nodes - 1 on each of them."""
    y, w = np.polynomial.legendre.leggauss(nodes)
    starts = np.arange(panels)[:, None]
    x = ((starts + 0.5 * (y + 1.0)) / panels).ravel()
    rule = GaussRule(x, np.tile(0.5 * w / panels, panels))
    for table in (rule.x, rule.weights):
        table.flags.writeable = False  # shared by every caller through the cache
    return rule
