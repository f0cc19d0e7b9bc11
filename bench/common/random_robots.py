"""Random robots of nested tubes, and base positions for them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ctr_pvs import Robot
from ctr_pvs import Segment
from ctr_pvs import Tube

Array = NDArray[np.float64]


def random_robot(rng: np.random.Generator, tubes: int) -> Robot:
    """Straight and curved segments; from weak to strong coupling, in one plane or not."""
    length, curvature = rng.uniform(0.06, 0.16), rng.uniform(4, 22)
    planar = rng.random() < 0.5
    parts = []
    for index in range(tubes):
        K = 0.04 * rng.uniform(0.3, 1.0)
        G = K / rng.uniform(1.0, 1.6)
        kappa = curvature * rng.uniform(0.5, 1.2) * (1.0 if planar else np.exp(1j * rng.uniform(-1, 1)))
        slope = 0.0 if rng.random() < 0.5 else kappa * rng.uniform(-4, 4)
        bent = Segment(length * rng.uniform(0.7, 1.2), K, G, (kappa, slope))
        parts.append(Tube(f"t{index}", (Segment(0.03 + 0.03 * index, K, G), bent)))
    return Robot("random", tuple(parts))


def random_D(rng: np.random.Generator, robot: Robot) -> Array:
    """(N,) [m], ordered."""
    D = [rng.uniform(0.1, 0.6) * tube.length for tube in robot.tubes]
    return np.minimum.accumulate(np.maximum.accumulate(D)[::-1])[::-1]


def helical_robot(rng: np.random.Generator, tubes: int) -> Robot:
    """Straight tubes with polynomial and helical pre-curvatures at their ends."""
    parts = []
    for index in range(tubes):
        K = 0.04 * rng.uniform(0.3, 1.0)
        kappa = rng.uniform(2, 14) * np.exp(1j * rng.uniform(-np.pi, np.pi))
        coefficients = kappa * np.array([1.0, rng.uniform(-6, 6), rng.uniform(-30, 30)])[: rng.integers(1, 4)]
        bent = Segment(rng.uniform(0.05, 0.15), K, K / rng.uniform(1.0, 1.6), tuple(coefficients), rng.uniform(-15, 15))
        parts.append(Tube(f"t{index}", (Segment(0.02 + 0.03 * index, K, K / 1.3), bent)))
    return Robot("helical", tuple(parts))
