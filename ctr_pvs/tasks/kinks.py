"""Where rates of the tip jump: an end of a segment on the orifice, or the ends of two tubes' segments on one place.

Each is a plane in the space of commands (see ``bounds``): D_i = p, or D_i - D_j = p - q, p and q being abscissae of
ends.  Along it the rates of the position are the same from both sides.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.robot.robot import Robot

Array = NDArray[np.float64]

#: Kinks no farther than this, in units of ``Bounds.scaled``, may be what holds a descent up; so many are tried.
NEAR, MOST = 0.05, 3


class Kinks:
    """rows (K, 2 N) and right (K,): x is on a kink where a row's product with it is its right side; ``unit`` [m] is
    that of D in x."""

    def __init__(self, robot: Robot, unit: float) -> None:
        N = robot.n_tubes
        ends = [np.cumsum([segment.length for segment in tube.segments]) / unit for tube in robot.tubes]
        eye = np.eye(2 * N)[N:]
        planes = [(eye[i], float(p)) for i in range(N) for p in ends[i]]
        planes += [
            (eye[i] - eye[j], float(p - q)) for i, j in combinations(range(N), 2) for p in ends[i] for q in ends[j]
        ]
        self.rows, self.right = np.array([row for row, _ in planes]), np.array([right for _, right in planes])

    def near(self, x: Array) -> list[int]:
        """Those that x (2 N,) is near to, the nearest first."""
        off = np.abs(self.rows @ x - self.right)
        return [row for row in np.argsort(off).tolist()[:MOST] if off[row] < NEAR]

    def off(self, x: Array, kink: int) -> float:
        """How far beyond a kink x (2 N,) is."""
        return float(self.rows[kink] @ x - self.right[kink])

    def onto(self, x: Array, kink: int) -> Array:
        """(2 N,) the place on a kink that is nearest to x (2 N,)."""
        row = self.rows[kink]
        return np.asarray(x - row * (self.off(x, kink) / (row @ row)))
