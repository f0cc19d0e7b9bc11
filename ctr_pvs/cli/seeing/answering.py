"""What sweep and workspace have in common: commands are answered into a table, by threads or by a cluster; Ctrl-C keeps
what is done, and --resume goes on after it."""

from __future__ import annotations

import argparse
import sys
from typing import TYPE_CHECKING

import numpy as np

from ctr_pvs.cli.command import SUCCESS
from ctr_pvs.cli.seeing.progress import Progress
from ctr_pvs.cli.seeing.progress import Stop
from ctr_pvs.cli.seeing.words import cannot_write
from ctr_pvs.cli.words import UsageError
from ctr_pvs.cli.workers import declare_scheduler
from ctr_pvs.cli.workers import executor
from ctr_pvs.robot.robot import Robot

if TYPE_CHECKING:
    from ctr_pvs.cli.seeing.tables import Table
    from ctr_pvs.solve.solver import EquilibriumSolver
    from ctr_pvs.tasks.sweep import Commands
    from ctr_pvs.tasks.sweep import Rows

INTERRUPTED = 130  # as shells have it
#: How far a row that is solved again may be from what is kept, as a share of its largest number.
SAME = 1e-6


def declare_answering(parser: argparse.ArgumentParser) -> None:
    """Adds what is said of the run; --output is there already."""
    parser.add_argument("--resume", action="store_true", help="go on after the rows that --output already holds")
    declare_scheduler(parser)


def check_output(arguments: argparse.Namespace) -> None:
    """Raises ``UsageError`` for a table that is there, unless it is to be gone on with."""
    if arguments.output is None and arguments.resume:
        raise UsageError("--resume: expected --output, the table to go on with")
    if arguments.output is not None and arguments.output.exists() and not arguments.resume:
        raise UsageError(f"--output: {arguments.output} is there already: --resume goes on with it, or remove it")


def answer(arguments: argparse.Namespace, robot: Robot, commands: Commands, table: Table) -> list[int]:
    """Answers the commands that the table of --output does not have yet; how many came to which of STATUSES."""
    from ctr_pvs.solve.solver import EquilibriumSolver

    solver = EquilibriumSolver(robot, tolerance=arguments.tolerance)
    try:
        if arguments.resume and arguments.output.exists():
            _check_kept(solver, commands, table)
        return _answer(arguments, solver, commands, table)
    except OSError as error:
        raise cannot_write("--output", error) from error


def exit_code(arguments: argparse.Namespace, commands: Commands, table: Table) -> int:
    """Of a run that may have been stopped, which is told."""
    if table.count == len(commands):
        return SUCCESS
    more = "" if arguments.output is None else "; --resume goes on"
    print(f"ctr-pvs: stopped{more}", file=sys.stderr)
    return INTERRUPTED


def _answer(arguments: argparse.Namespace, solver: EquilibriumSolver, commands: Commands, table: Table) -> list[int]:
    from ctr_pvs.tasks.sweep import STATUSES
    from ctr_pvs.tasks.sweep import sweep

    counts = np.zeros(len(STATUSES), dtype=np.int64)
    if table.count == len(commands):
        return counts.tolist()
    with executor(arguments.scheduler) as workers, Stop() as stop:
        progress = Progress(table.count, len(commands))
        try:
            for rows in sweep(solver, commands, table.count, workers=workers):
                if len(rows):
                    table.append(rows)
                    counts += np.bincount(rows.codes, minlength=len(STATUSES))
                    progress.tell(table.count)
                if stop.asked:
                    break
        except UsageError as error:
            kept = f"; {table.count} of {len(commands)} rows are kept, --resume goes on"
            raise UsageError(f"{error}{kept if table.count and arguments.output else ''}") from None
        finally:
            if table.count:
                table.close()
    return counts.tolist()


def _check_kept(solver: EquilibriumSolver, commands: Commands, table: Table) -> None:
    """Whether the rows of an earlier run are the first of these commands, and the last of them has the same answer.

    Raises ``UsageError`` where not: rows of two kinds in one file would help nobody.
    """
    from ctr_pvs.tasks.sweep import Listed
    from ctr_pvs.tasks.sweep import joined
    from ctr_pvs.tasks.sweep import sweep

    last: Rows | None = None
    for rows in table.kept():
        start, stop = table.count - len(rows), table.count
        given = commands.rows(start, min(stop, len(commands)))
        if stop > len(commands) or not np.array_equal(given, rows.numbers[:, commands.layout.commands]):
            raise UsageError(f"--resume: {table.path} holds other commands")
        last = rows if len(rows) else last
    if last is None:
        return
    listed = Listed(solver.robot, last.numbers[-1:, commands.layout.commands], "tip_force" in commands.layout.groups)
    again = joined(commands.layout, list(sweep(solver, listed)))
    largest = np.nanmax(np.abs(last.numbers[-1]))
    same = np.allclose(again.numbers[0], last.numbers[-1], rtol=0.0, atol=SAME * largest, equal_nan=True)
    if not same or again.codes[0] != last.codes[-1]:
        raise UsageError(f"--resume: {table.path} has another answer in its last row: another robot, or tolerance")
