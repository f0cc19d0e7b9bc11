"""Orthonormal Legendre polynomials on [0, 1], their integrals, and Gauss quadrature.

A strain basis on a section is a set of functions of x = (s - s_start) / h.  With the polynomials scaled so that
``int_0^1 P_i P_k dx = delta_ik`` the torsional energy of a twist field is a plain sum of squares (see ``twist``).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class LegendreRule:
    """Gauss quadrature on [0, 1] with the basis tabulated at its nodes.

    x, weights : (g,) nodes and weights.
    values : (g, degree + 1) P_k(x).
    integrals : (g, degree + 1) int_0^x P_k.
    """

    x: NDArray[np.float64]
    weights: NDArray[np.float64]
    values: NDArray[np.float64]
    integrals: NDArray[np.float64]


def legendre(degree: int, x: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
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
def gauss_legendre(degree: int, nodes: int) -> LegendreRule:
    """The rule with ``nodes`` Gauss points, exact for polynomials up to degree 2 nodes - 1."""
    y, w = np.polynomial.legendre.leggauss(nodes)
    x = 0.5 * (y + 1.0)
    values, integrals = legendre(degree, x)
    rule = LegendreRule(x, 0.5 * w, values, integrals)
    for table in (rule.x, rule.weights, rule.values, rule.integrals):
        table.flags.writeable = False  # shared by every caller through the cache
    return rule
