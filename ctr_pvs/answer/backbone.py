"""Poses of the backbone, as an answer tells them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Pose:
    """position (3,) [m] in the base frame, orientation (4,) unit quaternion x, y, z, w."""

    __slots__ = ("orientation", "position")

    def __init__(self, position: Array, orientation: Array) -> None:
        self.position, self.orientation = position, orientation


class Backbone:
    """Poses along the robot: s (n,) [m], position (n, 3) [m], orientation (n, 4) unit quaternions x, y, z, w."""

    __slots__ = ("orientation", "position", "s")

    def __init__(self, s: Array, position: Array, orientation: Array) -> None:
        self.s, self.position, self.orientation = s, position, orientation

    def __len__(self) -> int:
        return len(self.s)
