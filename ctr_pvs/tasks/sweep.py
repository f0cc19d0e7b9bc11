"""Many commands, answered chunk by chunk in a fixed order: what has been answered can be kept, and gone on from later.

Every row is a cold start by itself, so a row has the same answer, bit for bit, however the rows are cut into chunks,
from whichever row a run sets out, and whoever answers a chunk: any ``concurrent.futures.Executor``, be it threads of
this process or the workers of a cluster.
"""

from __future__ import annotations

import math
import os
import pickle
import time
from collections import deque
from collections.abc import Iterator
from collections.abc import Sequence
from concurrent.futures import Executor
from concurrent.futures import Future
from concurrent.futures import ThreadPoolExecutor
from concurrent.futures import wait
from contextlib import ExitStack
from dataclasses import dataclass
from functools import lru_cache
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.answer.status import Status
from ctr_pvs.errors import CommandError
from ctr_pvs.robot.robot import Robot
from ctr_pvs.solve.solver import EquilibriumSolver

Array = NDArray[np.float64]
Codes = NDArray[np.int8]

#: What became of a row, by its code: a status of the solver, or REJECTED for a command that the robot cannot take.
STATUSES = (*(status.value for status in Status), "rejected")
REJECTED = len(STATUSES) - 1
_CODE = {status: code for code, status in enumerate(Status)}

#: Rows of the first chunk and the most of any; how long one is to take [s], so that whoever waits hears of it and can
#: stop it: a row takes from 0.1 ms to 0.1 s, as robot, loads and compiler will have it.
FIRST, MOST, PACE = 32, 1024, 0.5
#: Chunks that are under way, at most: enough for some hundred workers, and with MOST a bound of memory.  The first is
#: alone, and with every answer there are twice as many: until then nobody knows how long a row takes.
AHEAD = 256
#: Whoever waits is asked after so long [s].
LOOK = 1.0
#: Rows of a grid: years of work, and far below what overflows.
MOST_ROWS = 10**12


class Layout:
    """Which numbers of a row stand where: columns, one name each, in groups.

    tubes : names, outermost first; loaded : whether commands have a force on the tip.
    groups : key -> columns, for alpha [rad], D [m], tip_force [N], tip_position [m], tip_orientation (unit quaternion
        x, y, z, w), stability_margin, torque [N m] and force [N] of the actuators; commands : columns of the command.
    """

    def __init__(self, tubes: Sequence[str], loaded: bool) -> None:
        parts = {
            "alpha": [f"alpha_{name}" for name in tubes],
            "D": [f"D_{name}" for name in tubes],
            "tip_force": [f"tip_force_{axis}" for axis in "xyz"] if loaded else [],
            "tip_position": [f"tip_{axis}" for axis in "xyz"],
            "tip_orientation": [f"tip_q{axis}" for axis in "xyzw"],
            "stability_margin": ["stability_margin"],
            "torque": [f"torque_{name}" for name in tubes],
            "force": [f"force_{name}" for name in tubes],
        }
        self.names = tuple(name for names in parts.values() for name in names)
        self.groups: dict[str, slice] = {}
        start = 0
        for key, names in parts.items():
            if names:
                self.groups[key] = slice(start, start + len(names))
            start += len(names)
        self.commands = slice(0, self.groups["tip_position"].start)


@dataclass(frozen=True)
class Rows:
    """Commands and their answers: numbers (n, W) as ``layout`` has them, NaN for what is not known, and codes (n,) of
    STATUSES."""

    layout: Layout
    numbers: Array
    codes: Codes

    def __len__(self) -> int:
        return len(self.numbers)

    def __getitem__(self, key: str) -> Array:
        """(n, ..) the columns of one group."""
        return self.numbers[:, self.layout.groups[key]]

    @property
    def success(self) -> NDArray[np.bool_]:
        """(n,) true for stable equilibria within tolerance."""
        good = [status.success for status in Status]
        return np.array([*good, False])[self.codes]


def joined(layout: Layout, parts: Sequence[Rows]) -> Rows:
    """All rows of the parts, in their order."""
    numbers = [np.empty((0, len(layout.names))), *(part.numbers for part in parts)]
    codes = [np.empty(0, dtype=np.int8), *(part.codes for part in parts)]
    return Rows(layout, np.concatenate(numbers), np.concatenate(codes))


class Commands(Protocol):
    """Any number of commands in a fixed order; made when they are asked for."""

    layout: Layout

    def __len__(self) -> int: ...

    def rows(self, start: int, stop: int) -> Array:
        """(stop - start, C) alpha [rad], D [m] and, where the layout is loaded, the force on the tip [N]."""
        ...


class Grid:
    """Every combination of values: of alpha and D of each tube, the last D varying fastest; one tip force for all.

    alpha, D : values of each tube [rad], [m].  tip_force : (3,) [N] or None.
    """

    def __init__(
        self, robot: Robot, alpha: Sequence[Array], D: Sequence[Array], tip_force: Sequence[float] | None = None
    ) -> None:
        for name, axes in (("alpha", alpha), ("D", D)):
            if len(axes) != robot.n_tubes:
                raise CommandError(name, len(axes), f"values for {robot.n_tubes} tubes, outermost first")
        self._axes = [np.asarray(values, dtype=np.float64) for values in (*alpha, *D)]
        self._shape = tuple(len(values) for values in self._axes)
        self._count = math.prod(self._shape)
        if self._count > MOST_ROWS:
            raise CommandError("alpha, D", self._count, f"at most {MOST_ROWS:.0e} combinations")
        self._force = tip_force
        self.layout = Layout([tube.name for tube in robot.tubes], tip_force is not None)

    def __len__(self) -> int:
        return self._count

    def rows(self, start: int, stop: int) -> Array:
        places = np.unravel_index(np.arange(start, stop), self._shape)
        columns = [values[place] for values, place in zip(self._axes, places, strict=True)]
        columns += [np.full(stop - start, component) for component in self._force or ()]
        return np.column_stack(columns)


class Listed:
    """Commands of a table (M, C): alpha [rad], D [m] and, if ``loaded``, the force on the tip [N]."""

    def __init__(self, robot: Robot, table: Array, loaded: bool) -> None:
        self._table = table
        self.layout = Layout([tube.name for tube in robot.tubes], loaded)

    def __len__(self) -> int:
        return len(self._table)

    def rows(self, start: int, stop: int) -> Array:
        return self._table[start:stop]


def sweep(
    solver: EquilibriumSolver,
    commands: Commands,
    first: int = 0,
    chunk: int | None = None,
    workers: Executor | None = None,
) -> Iterator[Rows]:
    """The answers of cold starts to ``commands`` from row ``first`` on, chunk by chunk, in their order.

    chunk : rows of each; None for as many as one worker answers in about half a second.
    workers : who answers the chunks, one each at a time; None for a thread per processor.  To other processes the
        solver travels pickled, and is kept there.

    A chunk without rows says that nothing has come for a while, so that whoever waits can look after other things.
    """
    with ExitStack() as stack:
        pool = workers or stack.enter_context(ThreadPoolExecutor(os.cpu_count()))
        yield from _in_order(pool, pickle.dumps(solver.fork()), commands, first, chunk)


def _in_order(pool: Executor, solver: bytes, commands: Commands, first: int, chunk: int | None) -> Iterator[Rows]:
    total, count, ahead = len(commands), chunk or FIRST, 1
    under_way: deque[Future[tuple[Rows, float]]] = deque()
    try:
        while first < total or under_way:
            while first < total and len(under_way) < ahead:
                table = commands.rows(first, min(first + count, total))
                under_way.append(pool.submit(answered, solver, commands.layout, table))
                first += len(table)
            if not wait([under_way[0]], LOOK).done:
                yield joined(commands.layout, [])
                continue
            rows, seconds = under_way.popleft().result()
            yield rows
            ahead = min(2 * ahead, AHEAD)
            if chunk is None:
                count = int(min(MOST, 4 * len(rows), max(1.0, len(rows) * PACE / seconds)))
    finally:
        for future in under_way:
            future.cancel()


def answered(solver: bytes, layout: Layout, commands: Array) -> tuple[Rows, float]:
    """What one worker makes of a chunk of commands (n, C): the answers of a pickled solver, and the seconds it took."""
    began = time.perf_counter()
    numbers = np.full((len(commands), len(layout.names)), np.nan)
    numbers[:, layout.commands] = commands
    rows = Rows(layout, numbers, np.zeros(len(commands), dtype=np.int8))
    force = rows["tip_force"] if "tip_force" in layout.groups else None
    batch = _unpickled(solver).solve_batch(rows["alpha"], rows["D"], tip_force=force, complete=True, threads=1)
    for key in ("tip_position", "tip_orientation", "torque", "force"):
        rows[key][:] = getattr(batch, key)
    rows["stability_margin"][:, 0] = batch.stability_margin
    rows.codes[:] = [_CODE[status] for status in batch.status]
    rows.codes[batch.rejected] = REJECTED
    return rows, time.perf_counter() - began


@lru_cache(maxsize=2)
def _unpickled(solver: bytes) -> EquilibriumSolver:
    """One for all threads of this process: a batch keeps nothing in it, and each thread has a workspace of its own."""
    kept: EquilibriumSolver = pickle.loads(solver)
    return kept
