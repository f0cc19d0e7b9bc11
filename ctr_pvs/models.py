"""The energies of one robot, by base positions and polynomial degree; the last few are kept."""

from __future__ import annotations

from collections import OrderedDict
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.energy import TorsionEnergy
from ctr_pvs.materials import Materials
from ctr_pvs.pair_form import Pairs
from ctr_pvs.robot.robot import Robot
from ctr_pvs.sections import piecewise_domain
from ctr_pvs.twist import Degrees

#: Rotations at one D reuse everything; a path along D needs the latest positions at a few degrees.
KEPT = 16


class Models:
    """Builds ``TorsionEnergy`` for (D, degree), or returns the one it kept."""

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self._kept: OrderedDict[tuple[bytes, Degrees], TorsionEnergy] = OrderedDict()
        self._pairs: WeakKeyDictionary[TorsionEnergy, Pairs] = WeakKeyDictionary()

    def energy(self, D: NDArray[np.float64], degree: Degrees) -> TorsionEnergy:
        """The energy at ``D`` (N,) [m] with twist rates of polynomial ``degree`` in coupled sections."""
        key = (D.tobytes(), degree)
        if key in self._kept:
            self._kept.move_to_end(key)
            return self._kept[key]
        energy = TorsionEnergy(Materials(self.robot, piecewise_domain(self.robot, D)), degree)
        self._kept[key] = energy
        if len(self._kept) > KEPT:
            self._kept.popitem(last=False)
        return energy

    def pairs(self, energy: TorsionEnergy) -> Pairs:
        """The pairwise coupling of ``energy``, made once."""
        if energy not in self._pairs:
            self._pairs[energy] = Pairs(energy)
        return self._pairs[energy]
