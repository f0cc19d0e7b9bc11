"""How far tubes can slide, as a cube: every share from 0 to 1 of each tube's travel keeps lengths, order and limits."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.robot.robot import Robot
from ctr_pvs.tasks.bounds import Bounds

Array = NDArray[np.float64]


#: Nearer than this to the orifice [m] a place of a tube is on it.
AT_ORIFICE = 1e-7


class Travel:
    """Of ``robot``: tube j goes from where the one around it is, or from its limit, to ``high`` (N,) [m]."""

    def __init__(self, robot: Robot) -> None:
        bounds, N = Bounds(robot, None), robot.n_tubes
        self._low, self.high = bounds.low[N:], bounds.high[N:]
        lengths = np.array([tube.length for tube in robot.tubes])
        self._ends = np.zeros((N, N), dtype=bool)  # whether the length of tube k is what ends the travel of tube j
        for j in range(N):
            if len(ends := np.flatnonzero(lengths[j:] <= self.high[j])):
                self._ends[j, j + int(ends[0])] = True
        self._breaks = [tube.breaks[1:-1] for tube in robot.tubes]
        self._first = np.concatenate([[0], np.cumsum([len(tube.segments) for tube in robot.tubes])]).tolist()

    def D(self, shares: Array) -> Array:
        """(M, N) [m] at ``shares`` (M, N)."""
        D = np.empty_like(shares)
        for j in range(shares.shape[1]):
            least = self._least(D, j)
            D[:, j] = least + shares[:, j] * (self.high[j] - least)
        return D

    def shares(self, D: Array) -> Array:
        """(M, N) of ``D`` (M, N) [m], or of the nearest that can be; of a tube that cannot slide one half."""
        shares, D = np.full_like(D, 0.5), D.copy()
        for j in range(D.shape[1]):
            least = self._least(D, j)
            D[:, j] = np.clip(D[:, j], least, self.high[j])
            room = self.high[j] - least
            np.divide(D[:, j] - least, room, out=shares[:, j], where=room > 0.0)
        return np.clip(shares, 0.0, 1.0)

    def rates(self, shares: Array) -> Array:
        """(M, N, S) rates of D with the lengths of all S segments, outermost tube first, at held ``shares`` (M, N).

        Where a segment of a tube begins at the orifice the tip's rates jump, and a least distance may rest there: such
        a tube is taken to stay at that place.
        """
        D, out = self.D(shares), np.zeros((*shares.shape, self._first[-1]))
        for j in range(len(self.high)):
            for k in np.flatnonzero(self._ends[j]).tolist():
                out[:, j, self._first[k] : self._first[k + 1]] = shares[:, j, None]
            if j:
                pushed = (D[:, j - 1] > self._low[j])[:, None]  # its least is where the tube around it is
                out[:, j] += np.where(pushed, (1.0 - shares[:, j, None]) * out[:, j - 1], 0.0)
            for place, number in zip(self._breaks[j], range(1, len(self._breaks[j]) + 1), strict=True):
                at = np.abs(D[:, j] - place) < AT_ORIFICE
                out[at, j] = 0.0
                out[at, j, self._first[j] : self._first[j] + number] = 1.0
        return out

    def _least(self, D: Array, j: int) -> Array:
        """(M,) [m] that D of tube j cannot be below."""
        low = np.full(len(D), self._low[j])
        return np.maximum(low, D[:, j - 1]) if j else low
