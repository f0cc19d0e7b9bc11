"""Many independent commands in one call: the one place where the speed benches touch ``solve_batch``."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ctr_pvs import EquilibriumSolver

Array = NDArray[np.float64]


def batch_tips(solver: EquilibriumSolver, alpha: Array, D: Array) -> tuple[Array, int]:
    """Tips (M, 3) [m] of the commands ``alpha`` (M, N) [rad], ``D`` (M, N) [m], and how many have not succeeded."""
    found = solver.solve_batch(alpha, D, start="cold")
    return found.tip_position, sum(not status.success for status in found.status)


def commands(many: int, direction: Array, largest: float, D: Array, slide: float, seed: int = 7) -> tuple[Array, Array]:
    """``many`` random commands alpha, D (many, N): rotations along ``direction`` (N,) up to ``largest`` [rad], and the
    innermost tube within ``slide`` [m] of where ``D`` (N,) has it."""
    rng = np.random.default_rng(seed)
    alpha = rng.uniform(0.0, largest, (many, 1)) * direction
    return alpha, D + rng.uniform(-slide, slide, (many, 1)) * (np.arange(len(D)) == len(D) - 1)
