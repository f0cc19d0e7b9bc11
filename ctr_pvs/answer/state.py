"""The records that paths are made of: states, and snaps between them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.kernel.arrays import S_ESTIMATE
from ctr_pvs.kernel.arrays import S_LOADS
from ctr_pvs.kernel.arrays import S_RESIDUAL
from ctr_pvs.kernel.arrays import S_SOLVED
from ctr_pvs.kernel.arrays import S_STEPS
from ctr_pvs.kernel.arrays import S_SWUNG
from ctr_pvs.kernel.arrays import S_TIP
from ctr_pvs.kernel.arrays import S_TWISTS
from ctr_pvs.kernel.arrays import S_UNKNOWNS
from ctr_pvs.kernel.arrays import STATE
from ctr_pvs.kernel.arrays import TWISTED

Array = NDArray[np.float64]


class State:
    """An equilibrium as the kernel knows it.

    vector : see ``kernel.arrays``, its first numbers not to be changed any more; alpha (N,) [rad], D (N,) [m], torque
    (N,) dE/dalpha [N m].
    """

    __slots__ = ("_numbers", "_tubes", "vector")

    def __init__(self, vector: Array, tubes: int) -> None:
        self.vector, self._tubes = vector, tubes
        self._numbers: list[float] = vector[:STATE].tolist()  # a solve reads eight: twice as long one by one

    @property
    def alpha(self) -> Array:
        return self.vector[STATE : STATE + self._tubes].copy()

    @property
    def D(self) -> Array:
        return self.vector[STATE + self._tubes : STATE + 2 * self._tubes].copy()

    @property
    def torque(self) -> Array:
        return self.vector[STATE + 2 * self._tubes : STATE + 3 * self._tubes].copy()

    @property
    def loads(self) -> Array:
        """Packed loads, see ``model.packing``."""
        first = STATE + 3 * self._tubes
        return self.vector[first : first + int(self._numbers[S_LOADS])].copy()

    @property
    def coupled(self) -> bool:
        """True if the tubes can twist each other: otherwise nothing is remembered."""
        return self.solved_for > 0

    def turned_to(self, first: float) -> State:
        """This state with all tubes turned together, so that the first has the base angle ``first`` [rad]."""
        vector = self.vector.copy()
        vector[STATE : STATE + self._tubes] += first - vector[STATE]
        return State(vector, self._tubes)

    @property
    def unknowns(self) -> Array:
        """(U,) [sqrt(J)] of the guide, then element by element and tube by tube."""
        first = STATE + 3 * self._tubes + int(self._numbers[S_LOADS])
        return self.vector[first : first + int(self._numbers[S_UNKNOWNS])]

    @property
    def tip(self) -> Array:
        """Position (3,) [m] and unit quaternion x, y, z, w (4,)."""
        return self.vector[S_TIP : S_TIP + 7]

    @property
    def residual(self) -> float:
        """Bound of the twist [rad] that the unbalanced torque would cause."""
        return self._numbers[S_RESIDUAL]

    @property
    def estimate(self) -> float:
        """Of the tip error [m]."""
        return self._numbers[S_ESTIMATE]

    def misses(self, tolerance: float) -> bool:
        """True if it is not within ``tolerance`` [m]: by its estimate, and without loads also by a bound that keeps
        torques and forces in step with it."""
        numbers = self._numbers
        return numbers[S_ESTIMATE] > tolerance or (numbers[S_LOADS] == 0.0 and numbers[S_SWUNG] > tolerance)

    @property
    def steps(self) -> int:
        """Newton steps spent."""
        return int(self._numbers[S_STEPS])

    @property
    def solved_for(self) -> int:
        """Number of unknowns, those that only check left out."""
        return int(self._numbers[S_SOLVED])

    @property
    def twists(self) -> bool:
        """False where twist is neglected."""
        return self._numbers[S_TWISTS] == TWISTED


@dataclass(frozen=True, eq=False)
class Snap:
    """One snap: where on the path, the states before and after, and the elastic energy released [J].

    t : fraction of the path from the previous command to the new one; alpha (N,) [rad], D (N,) [m] and packed loads
    (L,) there.  No energy is known where point moments act: NaN.
    """

    t: float
    alpha: Array
    D: Array
    before: State
    after: State
    energy_released: float

    @property
    def command(self) -> Array:
        """(2 N + L,) alpha, D and packed loads."""
        return np.concatenate([self.alpha, self.D, self.before.loads])
