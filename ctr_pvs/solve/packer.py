"""External loads on their way to the kernel: checked, and packed once for as long as they stay the same."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.errors import FieldError
from ctr_pvs.model.packing import packed_loads
from ctr_pvs.model.packing import tip_carrier
from ctr_pvs.robot.loads import Loads
from ctr_pvs.robot.loads import check_loads
from ctr_pvs.robot.robot import Robot

Array = NDArray[np.float64]


class LoadPacker:
    """Packs loads on ``robot`` for a solver of this model level and force model, which may have no place for any."""

    def __init__(self, robot: Robot, level: str, force_model: str) -> None:
        self._robot, self._level, self._force_model = robot, level, force_model
        self._last: tuple[Loads, int, Array] | None = None

    def pack(self, D: Array, loads: Loads) -> Array:
        """What the kernel reads of ``loads`` at D (N,) [m]; empty where nothing acts.

        Raises ``LoadError`` for loads that cannot act there, ``FieldError`` where the solver's options know none."""
        check_loads(self._robot, D, loads)
        carrier, last = tip_carrier(self._robot, D), self._last
        if last is not None and last[0] is loads and last[1] == carrier:  # as in most streams: packing takes 9 us
            return last[2]
        packed = packed_loads(self._robot, D, loads)
        if len(packed) and self._level not in ("auto", "full"):
            raise FieldError("fidelity", self._level, "auto or full where loads act", "bending is free under load")
        if len(packed) and self._force_model != "virtual_work":
            raise FieldError(
                "force_model", self._force_model, "virtual_work where loads act", "eq. (41) knows no loads"
            )
        self._last = loads, carrier, packed
        return packed
