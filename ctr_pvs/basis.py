"""Orthonormal Legendre polynomials on [0, 1], in one piece or on several panels, and Gauss quadrature.

A strain basis on a section is a set of functions of x = (s - s_start) / h.  With functions scaled so that
``int_0^1 P_i P_k dx = delta_ik`` the torsional energy of a twist field is a plain sum of squares (see ``twist``).
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


@dataclass(frozen=True)
class TwistBasis:
    """Polynomials up to ``degree`` on each of ``panels`` equal panels of [0, 1], orthonormal over all of it."""

    degree: int
    panels: int = 1

    @property
    def size(self) -> int:
        return self.panels * (self.degree + 1)

    @property
    def rule(self) -> GaussRule:
        """Quadrature for products with smooth functions of the twist angle."""
        return gauss_legendre(self.degree + 3, self.panels)

    def tabulate(self, x: Array) -> tuple[Array, Array]:
        """The functions at ``x`` (g,), and their integrals from 0: two arrays (g, size), panel by panel; read-only.

        Gauss points and ends of sections come again with every base position, so the last tables are kept.
        """
        return _tabulated(self, x.tobytes())

    def _tabulate(self, x: Array) -> tuple[Array, Array]:
        if self.panels == 1:
            return legendre(self.degree, x)
        panel = np.minimum((x * self.panels).astype(int), self.panels - 1)
        root = np.sqrt(self.panels)
        local, inside = legendre(self.degree, x * self.panels - panel)
        values = np.zeros((len(x), self.panels, self.degree + 1))
        integrals = np.zeros_like(values)
        # Past a panel only its constant has an integral left.
        integrals[:, :, 0] = (np.arange(self.panels) < panel[:, None]) / root
        here = np.arange(len(x))
        values[here, panel] = local * root
        integrals[here, panel] = inside / root
        return values.reshape(len(x), -1), integrals.reshape(len(x), -1)


@lru_cache(maxsize=256)
def _tabulated(basis: TwistBasis, x: bytes) -> tuple[Array, Array]:
    values, integrals = basis._tabulate(np.frombuffer(x))
    for table in (values, integrals):
        table.flags.writeable = False
    return values, integrals
