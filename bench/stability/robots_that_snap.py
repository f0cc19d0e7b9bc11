"""Robots for the failure chart: pairs with a given lambda and b, and random robots of three tubes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ctr_pvs import Robot
from ctr_pvs import Segment
from ctr_pvs import Tube

Array = NDArray[np.float64]

OVERLAP = 0.1  # m
STIFFNESS, RATIO = 0.02, 1.3  # K [N m^2], K / GJ
#: A segment cannot have length zero; this much is straight where the guide has none.
SHORTEST = 1e-7


def pair(lam: float, b: float) -> tuple[Robot, Array]:
    """Two equal tubes with coupling ``lam`` and guide length ``b`` (both without a unit), and the D (2,) [m] for it."""
    K, G = STIFFNESS, STIFFNESS / RATIO
    curvature = float(np.sqrt(lam * G / K)) / OVERLAP
    segments = (Segment(max(b * OVERLAP, SHORTEST), K, G), Segment(OVERLAP, K, G, (curvature,)))
    return Robot("pair", (Tube("outer", segments), Tube("inner", segments))), np.full(2, b * OVERLAP)


def three_tubes(rng: np.random.Generator) -> tuple[Robot, Array, Array]:
    """A robot of three tubes curved in one plane, D (3,) [m], and how fast its bases turn (3,), no two of them apart
    faster than 1.

    Its relaxed state is alpha = 0: all curvatures point the same way.
    """
    length, curvature = rng.uniform(0.08, 0.16), rng.uniform(12.0, 28.0)
    tubes = []
    for index in range(3):
        K = STIFFNESS * rng.uniform(0.5, 1.5)
        straight = Segment(0.03 + 0.03 * index, K, K / RATIO)
        curved = Segment(length * rng.uniform(0.7, 1.2), K, K / RATIO, (curvature * rng.uniform(0.6, 1.2),))
        tubes.append(Tube(f"tube_{index}", (straight, curved)))
    D = np.array([0.03, 0.06, 0.09]) * rng.uniform(0.2, 1.2) + 0.02 * np.sort(rng.random(3))
    direction = np.concatenate([[0.0], rng.uniform(-1.0, 1.0, 2)])
    return Robot("three", tuple(tubes)), D, direction / np.ptp(direction)
