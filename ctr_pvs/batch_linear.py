"""Linear algebra and circular functions for many small problems at once: entry by entry, with arrays over the rows.

LAPACK spends a microsecond on a system of six unknowns, numpy's loops less than a nanosecond on a product.  So a
thousand systems are solved together, each step of the elimination being one array operation.  Symmetric matrices hold
their lower triangle, column by column; rows are the last axis of every array.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

#: Multiplications of one product up to which OpenBLAS uses one thread, and columns that are never parted.
ONE_THREAD, FEWEST_COLUMNS = 250_000, 64


class Scratch:
    """Memory for intermediate results, used again and again: the operating system takes longer to hand out and clear a
    megabyte than it takes to fill it."""

    def __init__(self) -> None:
        self._kept: dict[str, Array] = {}

    def array(self, name: str, rows: int, columns: int) -> Array:
        """(rows, columns) of the array ``name``, which any later call for that name overwrites."""
        size = rows * columns
        kept = self._kept.get(name)
        if kept is None or len(kept) < size:
            kept = self._kept[name] = np.empty(size)
        return kept[:size].reshape(rows, columns)


def product(table: Array, values: Array, out: Array | None = None) -> Array:
    """table @ values, a few columns at a time: OpenBLAS shares larger products among threads, which here takes longer
    than the product does, and many times as long on a busy machine."""
    if out is None:
        out = np.empty((len(table), values.shape[1]))
    width = max(FEWEST_COLUMNS, ONE_THREAD // max(table.size, 1))
    for start in range(0, values.shape[1], width):
        part = slice(start, start + width)
        np.matmul(table, values[:, part], out=out[:, part])
    return out


def packed_entries(n: int) -> tuple[Indices, Indices]:
    """Row and column of every entry of the lower triangle, column by column."""
    column, row = np.triu_indices(n)
    return row, column


def column_starts(n: int) -> list[int]:
    """Place of each column's diagonal entry, and the number of all entries."""
    return [k * n - k * (k - 1) // 2 for k in range(n + 1)]


def factorise(packed: Array, n: int) -> tuple[Array, NDArray[np.bool_]]:
    """LDL^T of packed matrices (n (n + 1) / 2, rows), in place: L below the diagonal.

    Returns 1 / D (n, rows), and (rows,) true where the matrix is positive definite; elsewhere the numbers mean nothing.
    """
    starts = column_starts(n)
    inverse = np.empty((n, packed.shape[1]))
    for k in range(n):
        start, end = starts[k], starts[k + 1]
        np.divide(1.0, packed[start], out=inverse[k])
        below = packed[start + 1 : end]
        scaled = below * inverse[k]
        for j in range(k + 1, n):
            packed[starts[j] : starts[j + 1]] -= scaled[j - k - 1] * below[j - k - 1 :]
        below[:] = scaled
    return inverse, np.asarray((packed[starts[:n]] > 0.0).all(axis=0))


def solve(packed: Array, inverse: Array, right: Array) -> Array:
    """Solutions (n, rows) for right-hand sides (n, rows), overwritten, with what ``factorise`` left."""
    n = len(inverse)
    starts = column_starts(n)
    for k in range(n - 1):
        right[k + 1 :] -= packed[starts[k] + 1 : starts[k + 1]] * right[k]
    right *= inverse
    for k in range(n - 2, -1, -1):
        right[k] -= (packed[starts[k] + 1 : starts[k + 1]] * right[k + 1 :]).sum(axis=0)
    return right


def circle(angle: Array) -> tuple[Array, Array]:
    """cos and sin, by the tangent of the half angle: numpy has vector instructions for tan in double precision, and
    calls the mathematics library number by number for cos and sin."""
    tangent = np.tan(0.5 * angle)
    share = 2.0 / (1.0 + tangent * tangent)
    return share - 1.0, tangent * share
