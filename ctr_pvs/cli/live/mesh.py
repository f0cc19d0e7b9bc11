"""Tubes as triangles."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.cli.seeing.drawn import DrawnTube

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

#: Corners of a tube's cross section.
RING = 20


@dataclass(frozen=True)
class Solid:
    """A tube as triangles: vertices (v, 3) [m], faces (m, 3) their corners, colour red, green, blue from 0 to 255."""

    name: str
    colour: tuple[int, int, int]
    vertices: Array
    faces: Ints


def solids(tubes: tuple[DrawnTube, ...]) -> tuple[Solid, ...]:
    """Those tubes that come out of the orifice."""
    return tuple(
        Solid(
            tube.name,
            tube.colour,
            tube_vertices(tube.position, tube.orientation, 0.5 * tube.diameter),
            tube_faces(len(tube.position)),
        )
        for tube in tubes
        if len(tube.position)
    )


def tube_vertices(position: Array, orientation: Array, radius: float) -> Array:
    """(n RING + 2, 3) [m]: a ring around each of the poses, position (n, 3) [m] and unit quaternions (n, 4), whose x is
    along the tube, and the middles of both ends."""
    x, y, z, w = orientation.T
    side = np.column_stack([2.0 * (x * y - z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + x * w)])
    up = np.column_stack([2.0 * (x * z + y * w), 2.0 * (y * z - x * w), 1.0 - 2.0 * (x * x + y * y)])
    angle = 2.0 * np.pi * np.arange(RING) / RING
    around = np.cos(angle)[:, None] * side[:, None] + np.sin(angle)[:, None] * up[:, None]
    rings = position[:, None] + radius * around
    return np.concatenate([rings.reshape(-1, 3), position[[0, -1]]])


@lru_cache(maxsize=8)
def tube_faces(poses: int) -> Ints:
    """(m, 3) corners of the triangles of ``tube_vertices`` for so many poses, counterclockwise from outside."""
    here = np.arange(RING)
    after = (here + 1) % RING
    start = RING * np.arange(poses - 1)[:, None]
    low, low_after, high, high_after = (start + ring for ring in (here, after, here + RING, after + RING))
    sides = np.concatenate([np.dstack([low, low_after, high_after]), np.dstack([low, high_after, high])])
    first, last, end = poses * RING, poses * RING + 1, (poses - 1) * RING
    caps = [
        np.column_stack([np.full(RING, first), after, here]),
        np.column_stack([np.full(RING, last), end + here, end + after]),
    ]
    return np.concatenate([sides.reshape(-1, 3), *caps])
