"""Many commands at once, each with the answer of a cold start.

Rows are sorted by their base positions, solved together by arrays over rows where each step of their paths can be
proven, and left to the solver of single commands where it cannot: at folds, in snaps, at the highest degrees.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike
from numpy.typing import NDArray

from ctr_pvs.batch_group import Part
from ctr_pvs.batch_sort import CHUNK
from ctr_pvs.batch_sort import Groups
from ctr_pvs.batch_state import margins
from ctr_pvs.batch_state import rebuilt
from ctr_pvs.batch_state import tip_estimates
from ctr_pvs.batch_tables import Tables
from ctr_pvs.equilibrium import Equilibrium
from ctr_pvs.errors import CommandError
from ctr_pvs.errors import FieldError
from ctr_pvs.refine import INTEGRATION_SHARE
from ctr_pvs.robot.command import LARGEST_ALPHA
from ctr_pvs.robot.robot import Robot
from ctr_pvs.status import Status

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Indices = NDArray[np.int64]
Progress = Callable[[int, int], None]

#: Rows that are sorted and grouped together.
BLOCK = 16384
#: In place of the number of a part and of a status.
ALONE, UNSOLVED = -1, -1
#: Added to the message of such rows.
SEVERAL = "; several relaxed states are equally near, the path set out from one of them"

_STATUSES = np.array(list(Status), dtype=object)
_CODES = {status: code for code, status in enumerate(Status)}


class ColdSolver(Protocol):
    """The solver of single commands; nothing else uses it."""

    robot: Robot
    tolerance: float
    force_model: str

    def solve(
        self, alpha: ArrayLike, D: ArrayLike, start: str = "warm", budget: float | None = None
    ) -> Equilibrium: ...


class BatchSolver:
    """Answers many commands of one robot at once; keeps its tables from one batch to the next.

    cold : the solver of single commands, for rows that have to go alone.  level : "auto" or "torsion", or another at
    which every row goes alone.
    """

    def __init__(self, cold: ColdSolver, level: str) -> None:
        self._cold, self._together = cold, level in ("auto", "torsion")
        self._groups = Groups(cold.robot, cold.tolerance, untwisted=level == "auto")

    def solve(
        self,
        alpha: ArrayLike,
        D: ArrayLike,
        progress: Progress | None = None,
        block: int = BLOCK,
        chunk: int = CHUNK,
    ) -> Batch:
        """Answers of cold starts to the commands ``alpha`` [rad], ``D`` [m] (M, N).

        progress : called as progress(done, total) after every ``block`` of rows.  Memory beyond that of the answers
        depends on ``block`` and ``chunk`` only.

        A row that the robot cannot take is told in the batch.  Raises ``CommandError`` for arrays that are no tables of
        real numbers with a column per tube.
        """
        if block < 1 or chunk < 1:
            raise FieldError("block, chunk", (block, chunk), "at least one row")
        tubes = self._cold.robot.n_tubes
        batch = Batch(self._cold, _table("alpha", alpha, tubes), _table("D", D, tubes))
        if len(batch.alpha) != len(batch.D):
            raise CommandError("D", batch.D.shape, f"as many rows as alpha has, {len(batch.alpha)}")
        for start in range(0, len(batch), block):
            rows = np.arange(start, min(start + block, len(batch)))
            self._solve(batch, rows, chunk)
            if progress is not None:
                progress(int(rows[-1]) + 1, len(batch))
        return batch

    def _solve(self, batch: Batch, rows: Indices, chunk: int) -> None:
        good = _plainly_good(self._cold.robot, batch.alpha[rows], batch.D[rows])
        for index in np.flatnonzero(~good).tolist():
            good[index] = batch.mend(int(rows[index]))
        if self._together:
            for here, part, several in self._groups.solve(rows[good], batch.alpha, batch.D, chunk):
                batch.put(here, part, several)
        for index in rows[good & batch.unsolved(rows)].tolist():
            batch.solve_alone(index)


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


@dataclass(eq=False)
class _Kept:
    """What of a ``Part`` it takes to rebuild its rows."""

    tables: Tables
    rows: Indices
    u: Array


class Batch:
    """Answers to M commands; ``batch[i]`` is that of row i with every output that single answers have.

    alpha, D : (M, N) the commands [rad], [m].  Rows without an equilibrium hold NaN, and zeros for counts.
    tip_position : (M, 3) [m]; tip_orientation : (M, 4) unit quaternions x, y, z, w; torque : (M, N) [N m].
    residual : (M,) [rad], as ``Equilibrium`` has it; iterations, degrees_of_freedom : (M,).
    rejected : (M,) true for commands that the robot cannot take: their message says why.
    """

    def __init__(self, cold: ColdSolver, alpha: Array, D: Array) -> None:
        count, tubes = alpha.shape
        self._cold, self.alpha, self.D = cold, alpha, D
        # One row of each for all outputs of an answer: scattering many small arrays takes longer than solving.
        self._numbers = np.full((count, 8 + tubes), np.nan)
        self._counts = np.zeros((count, 4), dtype=np.int32)
        self.tip_position, self.tip_orientation = self._numbers[:, :3], self._numbers[:, 3:7]
        self.residual, self.torque = self._numbers[:, 7], self._numbers[:, 8:]
        self.iterations, self.degrees_of_freedom, self._part, self._column = self._counts.T
        self._part[:] = ALONE
        self.rejected = np.zeros(count, dtype=bool)
        self._code = np.full(count, UNSOLVED, dtype=np.int8)
        self._twists = np.ones(count, dtype=bool)
        self._margin, self._estimate = np.full(count, np.nan), np.full(count, np.nan)
        self._parts: list[_Kept] = []
        self._messages: dict[int, str] = {}
        self._levels: dict[int, str] = {}

    def __len__(self) -> int:
        return len(self.alpha)

    def __getitem__(self, index: int) -> Equilibrium:
        """The full answer of one row; computed again from its unknowns, or by the solver of single commands."""
        index = range(len(self))[index]
        if self.rejected[index]:
            return Equilibrium(
                self.alpha[index], self.D[index], self.status[index], self.message(index), self._cold.tolerance, "auto"
            )
        if self._part[index] < 0:
            return self._cold.solve(self.alpha[index], self.D[index], start="cold")
        kept, column = self._parts[self._part[index]], self._column[index]
        alpha, D = self.alpha[index].copy(), self.D[index].copy()
        twists = bool(self._twists[index])
        position = rebuilt(kept.tables, kept.u[:, column], alpha, D, self._cold.tolerance, twists)
        if position is None:
            return self._cold.solve(alpha, D, start="cold")
        return Equilibrium(
            alpha, D, self.status[index], self.message(index), self._cold.tolerance, position.level,
            self._cold.force_model, residual=position.served.residual, iterations=int(self.iterations[index]),
            source=position,
        )  # fmt: skip

    @property
    def status(self) -> NDArray[np.object_]:
        """(M,) ``Status`` of each row; that of a rejected one is NO_STABLE_EQUILIBRIUM."""
        return _STATUSES[self._code]

    @property
    def success(self) -> Mask:
        """(M,) true for stable equilibria within tolerance."""
        return np.array([status.success for status in Status])[self._code]

    @property
    def fidelity(self) -> list[str]:
        """Model level of each row."""
        levels = ["torsion" if twists else "torsionless" for twists in self._twists.tolist()]
        for index, level in self._levels.items():
            levels[index] = level
        return levels

    def message(self, index: int) -> str:
        """What came of one row, for people."""
        return self._messages.get(range(len(self))[index], "stable equilibrium")

    @cached_property
    def error_estimate(self) -> Array:
        """(M,) estimated tip errors [m], see ``Equilibrium.error_estimate``; NaN without equilibrium."""
        out = self._estimate.copy()
        with np.errstate(all="ignore"):
            for kept in self._parts:
                alpha, D = self.alpha[kept.rows].T, self.D[kept.rows].T
                estimates = tip_estimates(kept.tables, kept.u, alpha, D, self._cold.tolerance)
                out[kept.rows] = estimates + INTEGRATION_SHARE * self._cold.tolerance
        return out

    @cached_property
    def stability_margin(self) -> Array:
        """(M,) smallest eigenvalue of the energy Hessian relative to torsional stiffness, clipped at 1; NaN without
        equilibrium."""
        out = self._margin.copy()
        with np.errstate(all="ignore"):
            for kept in self._parts:
                alpha, D = self.alpha[kept.rows].T, self.D[kept.rows].T
                out[kept.rows] = margins(kept.tables, kept.u, alpha, D, self._cold.tolerance)
        return out

    def put(self, rows: Indices, part: Part, several: Mask) -> None:
        """Takes over answers for ``rows``."""
        residual = part.residual[None]
        self._numbers[rows] = np.concatenate([part.position, part.orientation, residual, part.torque]).T
        counts = np.empty((len(rows), 4), dtype=np.int32)
        counts[:, 0], counts[:, 1] = part.iterations, part.tables.n if part.twists else 0
        counts[:, 2], counts[:, 3] = len(self._parts), np.arange(len(rows))
        self._counts[rows] = counts
        self._twists[rows] = part.twists
        self._code[rows] = _CODES[Status.OK]
        self._parts.append(_Kept(part.tables, rows, part.u))
        for index in rows[several].tolist():
            self._messages[index] = "stable equilibrium" + SEVERAL

    def mend(self, index: int) -> bool:
        """Puts a command on the bounds that it misses by a rounding error; false if the robot cannot take it."""
        try:
            self.alpha[index], self.D[index] = self._cold.robot.check_command(self.alpha[index], self.D[index])
        except CommandError as error:
            self.rejected[index], self._messages[index] = True, str(error)
            self._code[index] = _CODES[Status.NO_STABLE_EQUILIBRIUM]
            return False
        return True

    def unsolved(self, rows: Indices) -> Mask:
        return np.asarray(self._code[rows] == UNSOLVED)

    def solve_alone(self, index: int) -> None:
        """Leaves one row to the solver of single commands."""
        answer = self._cold.solve(self.alpha[index], self.D[index], start="cold")
        self._code[index], self._messages[index] = _CODES[answer.status], answer.message
        self._levels[index] = answer.fidelity
        self.iterations[index] = answer.iterations
        if answer.solution is None:
            return
        tip = answer.tip
        self.tip_position[index], self.tip_orientation[index] = tip.position, tip.orientation
        self.torque[index], self._margin[index] = answer.torque, answer.stability_margin
        self._estimate[index], self.residual[index] = answer.error_estimate, answer.residual
        self.degrees_of_freedom[index] = answer.degrees_of_freedom
