"""Orthonormal Legendre polynomials on [0, 1], in one piece or on several panels, and Gauss quadrature.

A strain basis on a section is a set of functions of x = (s - s_start) / h.  With functions scaled so that
``int_0^1 P_i P_k dx = delta_ik`` the torsional energy of a twist field is a plain sum of squares (see ``twist``).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.model.basis import GaussRule
from ctr_pvs.model.basis import gauss_legendre
from ctr_pvs.model.basis import legendre

Array = NDArray[np.float64]


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
