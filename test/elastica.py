"""A straight rod that a force across its end bends: K. E. Bisshopp, D. C. Drucker, "Large deflection of cantilever
beams" (1945), in elliptic integrals."""

from __future__ import annotations

import numpy as np
from scipy.special import ellipe
from scipy.special import ellipeinc
from scipy.special import ellipk
from scipy.special import ellipkinc


def side_force_elastica(angle: float, length: float, K: float) -> tuple[float, float, float]:
    """The force [N] that turns the end of a rod of ``length`` [m] and bending stiffness K [N m^2] by ``angle`` [rad],
    and where the end is then, along the rod's first direction and along the force [m]."""
    p = np.sqrt(0.5 * (1.0 + np.sin(angle)))
    start = np.arcsin(1.0 / (p * np.sqrt(2.0)))
    lam = ellipk(p**2) - ellipkinc(start, p**2)  # L sqrt(P / K)
    away = length * (1.0 - 2.0 / lam * (ellipe(p**2) - ellipeinc(start, p**2)))
    return K * (lam / length) ** 2, length * np.sqrt(2.0 * np.sin(angle)) / lam, away
