"""Where tips are to be: from a CSV file, checked."""

from __future__ import annotations

import os
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.errors import TableError
from ctr_pvs.tasks.aim import Aim
from ctr_pvs.tasks.calibration.table import POSITION
from ctr_pvs.tasks.calibration.table import TANGENT
from ctr_pvs.tasks.calibration.table import column
from ctr_pvs.tasks.calibration.table import read_rows
from ctr_pvs.tasks.calibration.table import unit_rows

Array = NDArray[np.float64]

MOST = 1000


@dataclass(frozen=True, eq=False)
class Targets:
    """M places for the tip in base axes: position (M, 3) [m], before the orifice; tangent (M, 3) or None.

    Raises ``TableError`` for tables of other shapes, numbers that are not finite, and places behind the orifice.
    """

    position: Array
    tangent: Array | None = None

    def __post_init__(self) -> None:
        rows = len(np.atleast_1d(self.position))
        if not 1 <= rows <= MOST:
            raise TableError("targets", rows, f"1 to {MOST} of them")
        for name in ("position", "tangent"):
            if getattr(self, name) is None:
                continue
            value = np.asarray(getattr(self, name), dtype=np.float64)
            if value.shape != (rows, 3):
                raise TableError(name, value.shape, f"a table of {rows} rows and 3 columns")
            if (wrong := np.flatnonzero(~np.isfinite(value).all(axis=1))).size:
                row = int(wrong[0])
                raise TableError(f"{name}, row {row + 1}", value[row].tolist(), "finite numbers")
            object.__setattr__(self, name, value)
        if (wrong := np.flatnonzero(self.position[:, 0] < 0.0)).size:
            row = int(wrong[0])
            rule, remedy = "x of 0 or more: before the orifice", "+x is the insertion direction (docs/conventions.md)"
            raise TableError(f"x, row {row + 1}", float(self.position[row, 0]), rule, remedy)

    def __len__(self) -> int:
        return len(self.position)

    def aims(self, within: float, within_angle: float) -> list[Aim]:
        """Of each target; within [m], within_angle [rad] : how near is there."""
        tangents = [None] * len(self) if self.tangent is None else list(self.tangent)
        both = zip(self.position, tangents, strict=True)
        return [Aim(position, tangent, None, within, within_angle) for position, tangent in both]

    def check_within(self, length: float) -> None:
        """Raises ``TableError`` for a target farther from the orifice [m] than any tube can be long."""
        distance = np.linalg.norm(self.position, axis=1)
        if (far := np.flatnonzero(distance > length)).size:
            row = int(far[0])
            rule = f"at most {length:.4g} m, the longest tube within the bounds"
            raise TableError(
                f"distance from the orifice, row {row + 1}", float(distance[row]), rule, "is that in mm? --mm"
            )


def read_targets(path: str | os.PathLike[str], mm: bool = False) -> Targets:
    """The rows of a CSV file with a header: x, y, z [m], or [mm], and if there are any tx, ty, tz (tangent).

    Raises ``TableError`` for what cannot be read, naming the column and the row.
    """
    file = os.fspath(path)
    head, rows = read_rows(file, 1)
    position = np.column_stack([column(file, head, rows, name) for name in POSITION])
    tangent = None
    if any(name in head for name in TANGENT):
        tangent = unit_rows(file, "tangent", np.column_stack([column(file, head, rows, name) for name in TANGENT]))
    return Targets(position * (1e-3 if mm else 1.0), tangent)
