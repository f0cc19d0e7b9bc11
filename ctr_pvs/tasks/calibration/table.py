"""Measured tips and the commands they belong to: from a CSV file, checked."""

from __future__ import annotations

import csv
import os
from collections.abc import Mapping
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.errors import TableError
from ctr_pvs.tasks.calibration.registration import matrices

Array = NDArray[np.float64]

POSITION, TANGENT, POSE, FORCE = ("x", "y", "z"), ("tx", "ty", "tz"), ("qx", "qy", "qz", "qw"), ("fx", "fy", "fz")
FEWEST = 4  # rows
#: How far a direction's or a quaternion's length may be from 1.
OFF_UNIT = 0.05
#: What to do about a column that is not there.
MAPPED = "or map another to it: --columns {}=NAME"


@dataclass(frozen=True, eq=False)
class Measurements:
    """M rows, in the order in which they were measured.

    alpha (M, N) [rad], D (M, N) [m] : commands.  position (M, 3) [m] : of the tip, or of a sensor near it, in the frame
    of the measurement.  axes (M, 3 a) : a = 0, 1 or 2 measured axes of the tip's frame there, its tangent first.
    tip_force (M, 3) [N] or None : known to act on the tip, in the axes of the robot's base.

    Raises ``TableError`` for tables of other shapes, and for numbers that are not finite.
    """

    alpha: Array
    D: Array
    position: Array
    axes: Array | None = None
    tip_force: Array | None = None

    def __post_init__(self) -> None:
        rows = len(np.atleast_1d(self.position))
        if rows < FEWEST:
            raise TableError("position", rows, f"at least {FEWEST} rows")
        tubes = np.shape(self.alpha)[-1] if np.ndim(self.alpha) == 2 else 0
        widths = {"alpha": (tubes,), "D": (tubes,), "position": (3,), "axes": (0, 3, 6), "tip_force": (3,)}
        for name, width in widths.items():
            if (value := getattr(self, name)) is None:
                value = np.zeros((rows, 0)) if name == "axes" else None
            else:
                value = np.asarray(value, dtype=np.float64)
                if value.ndim != 2 or len(value) != rows or value.shape[1] not in width:
                    columns = " or ".join(map(str, width))
                    raise TableError(name, value.shape, f"a table of {rows} rows and {columns} columns")
                if not np.isfinite(value).all():
                    row = int(np.flatnonzero(~np.isfinite(value).all(axis=1))[0])
                    raise TableError(f"{name}, row {row + 1}", value[row].tolist(), "finite numbers")
            object.__setattr__(self, name, value)

    def __len__(self) -> int:
        return len(self.position)

    @property
    def n_axes(self) -> int:
        return 0 if self.axes is None else self.axes.shape[1] // 3


def unwrapped(alpha: Array) -> Array:
    """Rotations (M, N) [rad] along a path, told modulo a turn, as the ways that the joints went: no step is longer than
    half a turn."""
    return np.unwrap(alpha, axis=0)


def read_measurements(
    path: str | os.PathLike[str],
    tubes: int,
    columns: Mapping[str, str] | None = None,
    degrees: bool = False,
    mm: bool = False,
    beta_sign: float = 1.0,
    unwrap: bool = True,
) -> Measurements:
    """The rows of a CSV file with a header: alpha_1 .. and D_1 .. for each tube, outermost first; x, y, z; if there are
    any, tx, ty, tz (tangent) or qx, qy, qz, qw (pose), and fx, fy, fz (force on the tip).

    columns : the file's name of a column, where it is another.  degrees, mm : units of rotations, and of D and
    positions.  beta_sign : D is the file's number times it.  unwrap : see ``unwrapped``; for rows that are a path.

    Raises ``TableError`` for what cannot be read, naming the column and the row.
    """
    file = os.fspath(path)
    head, rows = read_rows(file, FEWEST)
    names = dict(columns or {})
    joints = [[f"{kind}_{j + 1}" for j in range(tubes)] for kind in ("alpha", "D")]
    known = (*joints[0], *joints[1], *POSITION, *TANGENT, *POSE, *FORCE)
    for name in names:
        if name not in known:
            raise TableError("columns", name, f"one of {', '.join(known)}")

    def take(wanted: Sequence[str]) -> Array:
        return np.column_stack(
            [column(file, head, rows, names.get(name, name), MAPPED.format(name)) for name in wanted]
        )

    def there(wanted: Sequence[str]) -> bool:
        return any(name in names or name in head for name in wanted)

    length = 1e-3 if mm else 1.0
    alpha = take(joints[0]) * (np.pi / 180.0 if degrees else 1.0)
    axes = None
    if there(POSE):
        axes = _axes(unit_rows(file, "quaternion", take(POSE)))
    elif there(TANGENT):
        axes = unit_rows(file, "tangent", take(TANGENT))
    return Measurements(
        unwrapped(alpha) if unwrap else alpha,
        take(joints[1]) * length * beta_sign,
        take(POSITION) * length,
        axes,
        take(FORCE) if there(FORCE) else None,
    )


def read_rows(file: str, fewest: int) -> tuple[list[str], list[list[str]]]:
    """Header and rows of a CSV file that has at least so many of these.  Raises ``TableError`` where not."""
    try:
        with open(file, newline="", encoding="utf-8-sig") as stream:
            rows = [row for row in csv.reader(stream) if any(cell.strip() for cell in row)]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise TableError(file, str(error), "a CSV file that can be read") from None
    if len(rows) <= fewest:
        raise TableError(file, f"{max(0, len(rows) - 1)} rows", f"a header and rows, {fewest} at least")
    head = [cell.strip() for cell in rows[0]]
    for index, row in enumerate(rows[1:]):
        if len(row) < len(head):
            raise TableError(f"{file}, row {index + 1}", f"{len(row)} cells", f"{len(head)} cells, as in the header")
    return head, rows[1:]


def column(file: str, head: list[str], rows: list[list[str]], title: str, remedy: str = "") -> Array:
    """The finite numbers of one column.  Raises ``TableError``, with the ``remedy`` if the column is not there."""
    if title not in head:
        raise TableError(f"{file}, column {title}", ", ".join(head), "a column of this name", remedy)
    place, values = head.index(title), np.empty(len(rows))
    for index, row in enumerate(rows):
        try:
            values[index] = float(row[place])
        except ValueError:
            values[index] = np.nan
        if not np.isfinite(values[index]):
            raise TableError(f"{file}, column {title}, row {index + 1}", row[place], "a finite number")
    return values


def unit_rows(file: str, what: str, vectors: Array) -> Array:
    """The rows of ``vectors`` at length 1.  Raises ``TableError`` for one that is far from it."""
    sizes = np.linalg.norm(vectors, axis=1)
    if (wrong := np.flatnonzero(np.abs(sizes - 1.0) > OFF_UNIT)).size:
        row = int(wrong[0])
        raise TableError(f"{file}, {what}, row {row + 1}", vectors[row].tolist(), "a vector of length 1")
    return np.asarray(vectors / sizes[:, None])


def _axes(quaternions: Array) -> Array:
    """(M, 6) the first two axes of frames."""
    return np.moveaxis(matrices(quaternions), 2, 1)[:, :2].reshape(-1, 6)
