"""Many commands at once, each with the answer of a cold start.

The kernel takes them in small portions, in as many threads as the machine has processors; the rows it leaves (folds on
the way, or at the edge of one) go to the solver of single commands, in the same threads.  Every row is solved by
itself, so results do not depend on the number of threads.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike
from numpy.typing import NDArray

from ctr_pvs.answer.engine import Engine
from ctr_pvs.answer.equilibrium import Equilibrium
from ctr_pvs.answer.state import State
from ctr_pvs.answer.status import Status
from ctr_pvs.errors import CommandError
from ctr_pvs.errors import LoadError
from ctr_pvs.kernel.arrays import S_ESTIMATE
from ctr_pvs.kernel.arrays import S_RESIDUAL
from ctr_pvs.kernel.arrays import S_SOLVED
from ctr_pvs.kernel.arrays import S_STEPS
from ctr_pvs.kernel.arrays import S_TIP
from ctr_pvs.kernel.arrays import S_TWISTS
from ctr_pvs.kernel.arrays import STATE
from ctr_pvs.kernel.arrays import TWISTED
from ctr_pvs.kernel.arrays import UNTWISTED
from ctr_pvs.kernel.walk.step import MORE
from ctr_pvs.kernel.walk.step import OK
from ctr_pvs.robot.command import LARGEST_ALPHA
from ctr_pvs.robot.loads import Loads
from ctr_pvs.robot.robot import Robot

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Ints = NDArray[np.int64]
Progress = Callable[[int, int], None]

#: Rows of one call of the kernel: a few milliseconds at most, so that signals and progress are looked at in between.
PORTION = 16
#: Rows between two reports of progress.
BLOCK = 2048
#: Stands for a row that is not solved yet, and for one that the kernel leaves to the solver of single commands.
UNSOLVED, ALONE = -1, -2

#: Added to the message of such rows.
SEVERAL = "; several relaxed states are equally near, the path set out from one of them"

_STATUSES = np.array(list(Status), dtype=object)
_CODES = {status: code for code, status in enumerate(Status)}


class ColdSolver(Protocol):
    """The solver of single commands; nothing else uses it."""

    robot: Robot
    tolerance: float
    force_model: str

    def solve_alone(self, alpha: Array, D: Array, loads: Loads | None) -> Equilibrium: ...


def solve_rows(
    cold: ColdSolver,
    engine: Engine,
    alpha: ArrayLike,
    D: ArrayLike,
    tip_force: ArrayLike | None,
    tip_moment: ArrayLike | None,
    level: str,
    progress: Progress | None,
    complete: bool,
    threads: int | None,
) -> Batch:
    """Answers of cold starts to the commands ``alpha`` [rad], ``D`` [m] (M, N) and forces [N] and moments [N m] on the
    tip (M, 3) at a model level.

    progress : called as progress(done, total) after every block of rows.  complete : margins and forces are noted on
    the way.  threads : how many, None for one per processor.

    A row that the robot cannot take is told in the batch.  Raises ``CommandError`` for arrays that are no tables of
    real numbers with a column per tube, ``LoadError`` for tip loads that are none of 3 columns and as many rows.
    """
    tubes = cold.robot.n_tubes
    batch = Batch(cold, level, _table("alpha", alpha, tubes), _table("D", D, tubes), complete)
    if len(batch.alpha) != len(batch.D):
        raise CommandError("D", batch.D.shape, f"as many rows as alpha has, {len(batch.alpha)}")
    for index in np.flatnonzero(~_plainly_good(cold.robot, batch.alpha, batch.D)).tolist():
        batch.mend(index)
    if len(batch) and (tip_force is not None or tip_moment is not None):
        batch.load(_tip_loads("tip_force", tip_force, len(batch)), _tip_loads("tip_moment", tip_moment, len(batch)))
    together = level in ("auto", "torsion") and batch.wrench is None
    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        for start in range(0, len(batch), BLOCK):
            stop = min(start + BLOCK, len(batch))
            if together:
                portions = [slice(i, min(i + PORTION, stop)) for i in range(start, stop, PORTION)]
                list(pool.map(lambda rows: batch.solve_portion(engine, rows), portions))
            alone = start + np.flatnonzero(batch.left(slice(start, stop)))
            list(pool.map(batch.solve_alone, alone.tolist()))
            if progress is not None:
                progress(stop, len(batch))
    return batch


def _table(name: str, values: ArrayLike, tubes: int) -> Array:
    rule = f"a table of real numbers with {tubes} columns, one per tube, outermost first"
    try:
        array = np.asarray(values)
    except ValueError:  # lists of unequal lengths
        raise CommandError(name, values, rule) from None
    if array.size == 0 and array.ndim <= 2:
        array = np.zeros((0, tubes))
    if array.ndim != 2 or array.shape[1] != tubes or array.dtype.kind not in "iuf":
        raise CommandError(name, values, rule)
    return np.array(array, dtype=np.float64, order="C")


def _tip_loads(name: str, values: ArrayLike | None, count: int) -> Array:
    if values is None:
        return np.zeros((count, 3))
    array = np.asarray(values)
    if array.shape != (count, 3) or array.dtype.kind not in "iuf" or not np.isfinite(array).all():
        raise LoadError(name, values, f"a table of finite numbers, {count} rows as alpha has, 3 columns")
    return array.astype(np.float64)


def _plainly_good(robot: Robot, alpha: Array, D: Array) -> Mask:
    """(rows,) true for commands that ``Robot.check_command`` takes as they are."""
    good = np.ones(len(alpha), dtype=bool)
    previous = np.zeros(len(alpha))
    for j, tube in enumerate(robot.tubes):
        low, high = (robot.limits.alpha[j] if robot.limits.alpha else None) or (-LARGEST_ALPHA, LARGEST_ALPHA)
        good &= (alpha[:, j] >= low) & (alpha[:, j] <= high)
        low, high = (robot.limits.D[j] if robot.limits.D else None) or (0.0, tube.length)
        good &= (D[:, j] >= max(low, 0.0)) & (D[:, j] <= min(high, tube.length)) & (D[:, j] >= previous)
        previous = D[:, j]
    return good


class Batch:
    """Answers to M commands; ``batch[i]`` is that of row i with every output that single answers have, solved again.

    alpha, D : (M, N) the commands [rad], [m].  Rows without an equilibrium hold NaN, and zeros for counts.
    wrench : (M, 6) force [N] and moment [N m] on the tips, None without.
    tip_position : (M, 3) [m]; tip_orientation : (M, 4) unit quaternions x, y, z, w; torque : (M, N) [N m].
    stability_margin : (M,) and force : (M, N) [N], as ``Equilibrium`` has them; unless the batch is ``complete`` every
    row is solved again when one of them is first asked for.
    residual : (M,) [rad] and error_estimate : (M,) [m], as ``Equilibrium`` has them; iterations, degrees_of_freedom :
    (M,).
    rejected : (M,) true for commands that the robot cannot take: their message says why.
    """

    def __init__(self, cold: ColdSolver, level: str, alpha: Array, D: Array, complete: bool) -> None:
        count, tubes = alpha.shape
        self._cold, self._level, self.alpha, self.D = cold, level, alpha, D
        self._numbers = np.full((count, STATE + 3 * tubes), np.nan)
        self._numbers[:, [S_STEPS, S_SOLVED]] = 0.0
        self._codes = np.full(count, UNSOLVED, dtype=np.int64)
        self.rejected = np.zeros(count, dtype=bool)
        self._status = np.full(count, _CODES[Status.OK], dtype=np.int8)
        self.wrench: Array | None = None
        self._messages: dict[int, str] = {}
        self._levels: dict[int, str] = {}
        self.complete = complete
        if complete:
            self._margin_and_force = np.full((count, 1 + tubes), np.nan)

    def __len__(self) -> int:
        return len(self.alpha)

    def __getitem__(self, index: int) -> Equilibrium:
        """The full answer of one row, solved again."""
        index = range(len(self))[index]
        if self.rejected[index]:
            engine = Engine(self._cold.robot, self._cold.tolerance)
            status, message = self.status[index], self.message(index)
            return Equilibrium(engine, self.alpha[index], self.D[index], status, message, self._level)
        return self._cold.solve_alone(self.alpha[index].copy(), self.D[index].copy(), self.applied_loads(index))

    def load(self, force: Array, moment: Array) -> None:
        """Puts forces [N] and moments [N m], (M, 3) each, on the tips."""
        self.wrench = np.hstack([force, moment])

    def applied_loads(self, index: int) -> Loads | None:
        """What acts on the tip of one row."""
        if self.wrench is None or not self.wrench[index].any():
            return None
        fx, fy, fz, mx, my, mz = self.wrench[index].tolist()
        return Loads((fx, fy, fz), (mx, my, mz))

    @property
    def tip_position(self) -> Array:
        return self._numbers[:, S_TIP : S_TIP + 3]

    @property
    def tip_orientation(self) -> Array:
        return self._numbers[:, S_TIP + 3 : S_TIP + 7]

    @property
    def torque(self) -> Array:
        return self._numbers[:, STATE + 2 * self.alpha.shape[1] :]

    @property
    def residual(self) -> Array:
        return self._numbers[:, S_RESIDUAL]

    @property
    def error_estimate(self) -> Array:
        return self._numbers[:, S_ESTIMATE]

    @property
    def iterations(self) -> Ints:
        return self._numbers[:, S_STEPS].astype(np.int64)

    @property
    def degrees_of_freedom(self) -> Ints:
        return np.where(self._numbers[:, S_TWISTS] == TWISTED, self._numbers[:, S_SOLVED], 0.0).astype(np.int64)

    @property
    def status(self) -> NDArray[np.object_]:
        """(M,) ``Status`` of each row; that of a rejected one is NO_STABLE_EQUILIBRIUM."""
        return _STATUSES[self._status]

    @property
    def success(self) -> Mask:
        """(M,) true for stable equilibria within tolerance."""
        return np.array([status.success for status in Status])[self._status]

    @property
    def fidelity(self) -> list[str]:
        """Model level of each row."""
        levels = ["torsionless" if twists == UNTWISTED else "torsion" for twists in self._numbers[:, S_TWISTS].tolist()]
        if self.wrench is not None:
            levels = [
                "full" if loaded else level for loaded, level in zip(np.any(self.wrench, axis=1), levels, strict=True)
            ]
        for index, level in self._levels.items():
            levels[index] = level
        return levels

    def message(self, index: int) -> str:
        """What came of one row, for people."""
        index = range(len(self))[index]
        return self._messages.get(index, "stable equilibrium" + (SEVERAL if self._codes[index] == MORE else ""))

    @property
    def stability_margin(self) -> Array:
        return self._margin_and_force[:, 0]

    @property
    def force(self) -> Array:
        return self._margin_and_force[:, 1:]

    @cached_property
    def _margin_and_force(self) -> Array:
        """(M, 1 + N)"""
        found = np.full((len(self), 1 + self.alpha.shape[1]), np.nan)
        for index in np.flatnonzero(np.isfinite(self.tip_position[:, 0])).tolist():
            found[index] = _told(self[index])
        return found

    def mend(self, index: int) -> None:
        """Puts a command on the bounds that it misses by a rounding error, or marks it as one that the robot cannot
        take."""
        try:
            self.alpha[index], self.D[index] = self._cold.robot.check_command(self.alpha[index], self.D[index])
        except CommandError as error:
            self.rejected[index], self._messages[index] = True, str(error)
            self._status[index], self._codes[index] = _CODES[Status.NO_STABLE_EQUILIBRIUM], OK

    def left(self, rows: slice) -> Mask:
        """True for rows that are for the solver of single commands."""
        return np.asarray((self._codes[rows] != OK) & (self._codes[rows] != MORE))

    def solve_portion(self, engine: Engine, rows: slice) -> None:
        """Lets the kernel answer some rows."""
        numbers, codes, tubes = self._numbers[rows], self._codes[rows].copy(), self.alpha.shape[1]
        asked = codes == UNSOLVED
        states = engine.cold_states(self.alpha[rows], self.D[rows], self._level == "auto", codes)
        good = asked & ((codes == OK) | (codes == MORE)) & ~(states[:, S_ESTIMATE] > engine.tolerance)
        numbers[good] = states[good, : numbers.shape[1]]
        self._codes[rows] = np.where(good | ~asked, codes, ALONE)
        for place in np.flatnonzero(good).tolist() if self.complete else ():
            command, state = (self.alpha[rows][place], self.D[rows][place]), State(states[place], tubes)
            model = self._cold.force_model
            answer = Equilibrium(engine, *command, Status.OK, "", self._level, model, state)
            self._margin_and_force[rows][place] = _told(answer)

    def solve_alone(self, index: int) -> None:
        """Leaves one row to the solver of single commands."""
        answer = self._cold.solve_alone(self.alpha[index].copy(), self.D[index].copy(), self.applied_loads(index))
        self._status[index], self._messages[index] = _CODES[answer.status], answer.message
        self._levels[index], self._codes[index] = answer.fidelity, OK
        row = self._numbers[index]
        row[:] = np.nan
        row[S_STEPS], row[S_SOLVED] = answer.iterations, 0.0
        if np.isnan(answer.residual):
            return
        row[S_TWISTS] = UNTWISTED if answer.fidelity == "torsionless" else TWISTED
        tip = answer.tip
        row[S_TIP : S_TIP + 3], row[S_TIP + 3 : S_TIP + 7] = tip.position, tip.orientation
        row[STATE + 2 * len(answer.alpha) :] = answer.torque
        row[S_RESIDUAL], row[S_ESTIMATE], row[S_SOLVED] = (
            answer.residual,
            answer.error_estimate,
            answer.degrees_of_freedom,
        )
        if self.complete:
            self._margin_and_force[index] = _told(answer)


def _told(answer: Equilibrium) -> Array:
    """(1 + N,) margin and forces."""
    return np.array([answer.stability_margin, *answer.force])
