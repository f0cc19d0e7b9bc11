"""Gauss points with polynomials on [0, 1], and cross products as matrices: what ``loaded_galerkin`` is made of."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.model.basis import gauss_legendre
from ctr_pvs.model.basis import legendre

Array = NDArray[np.float64]

#: Gauss points beyond the number of coefficients of a field.
MORE_POINTS = 6
#: hat(v) = v @ HATS, for v (..., 3).
HATS = np.zeros((3, 3, 3))
for _a, _b, _c in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
    HATS[_a, _b, _c], HATS[_a, _c, _b] = -1.0, 1.0


def hat(v: Array) -> Array:
    """(..., 3, 3) matrices of the cross products v x, for v (..., 3)."""
    return np.tensordot(v, HATS, axes=1)


class Rule:
    """Gauss points on [0, 1] and polynomials there.

    x, weight (G,); value, integral (G, Q) of the orthonormal Legendre polynomials; partial, slope (G, G) : integral
    from 0 and derivative, at the points, of what interpolates values there.
    """

    def __init__(self, degree: int) -> None:
        rule = gauss_legendre(degree + 1 + MORE_POINTS)
        self.x, self.weight = rule.x, rule.weights
        self.value, self.integral = legendre(degree, self.x)
        values, integrals = legendre(len(self.x) - 1, self.x)
        coefficients = (values * self.weight[:, None]).T
        self.partial = integrals @ coefficients
        raw = np.polynomial.legendre.Legendre
        rates = [raw.basis(k, (0.0, 1.0)).deriv()(self.x) * np.sqrt(2.0 * k + 1.0) for k in range(len(self.x))]
        self.slope = np.stack(rates, axis=1) @ coefficients


rule_of = lru_cache(maxsize=8)(Rule)
