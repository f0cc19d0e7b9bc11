"""Robots whose cost is measured: nested families of 2 to 20 curved tubes, and pairs of tubes in many segments."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ctr_pvs import Robot
from ctr_pvs import Segment
from ctr_pvs import Tube

Array = NDArray[np.float64]

#: Of the family: bending stiffness [N m^2] of the outermost tube and the ratio to the next; K / GJ.
STIFFEST, SOFTER, RATIO = 0.06, 0.75, 1.3
#: Lengths [m]: what lies in the guide, how much farther each next base is back, how much farther each next tip reaches.
GUIDED, BACK, REACH = 0.04, 0.03, 0.02
CURVED, CURVATURE = 0.08, 6.0  # m, 1/m


def nested(n: int) -> tuple[Robot, Array]:
    """``n`` tubes, each with a curved end, all of them overlapping, and D (n,) [m]; 2 n - 1 sections outside."""
    tubes = []
    for j in range(n):
        K = STIFFEST * SOFTER**j
        straight = Segment(GUIDED + j * (BACK + 0.5 * REACH), K, K / RATIO)
        curved = Segment(CURVED + 0.5 * j * REACH, K, K / RATIO, (CURVATURE * (1.0 + 0.1 * j),))
        tubes.append(Tube(f"tube_{j}", (straight, curved)))
    return Robot(f"nested_{n}", tuple(tubes)), GUIDED + BACK * np.arange(n)


def turned(n: int) -> Array:
    """(n,) how fast the bases of ``nested`` turn in a sweep: the innermost by 1, the others in proportion."""
    return np.arange(n) / (n - 1.0)


def segmented(k: int) -> tuple[Robot, Array]:
    """Two tubes of 0.12 m whose curved parts consist of ``k`` segments each, and D (2,) [m].

    Curvature grows towards the tip; the inner tube is shifted by half a segment, so that no two joints meet.
    """
    tubes = []
    for j in range(2):
        K, piece = STIFFEST * SOFTER**j, 0.12 / k
        curvature = CURVATURE * (1.0 + 0.5 * (np.arange(k) + 0.5) / k)
        segments = [Segment(piece, K, K / RATIO, (float(value),)) for value in curvature]
        straight = Segment(0.05 + 0.03 * j + 0.5 * j * piece, K, K / RATIO)
        tubes.append(Tube(f"tube_{j}", (straight, *segments)))
    return Robot(f"segmented_{k}", tuple(tubes)), np.array([0.05, 0.08])
