"""ctr-pvs sweep: many commands, from a grid or a list, to a table."""

from __future__ import annotations

import argparse
import csv
import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.cli.command import SUCCESS
from ctr_pvs.cli.command import declare_robot
from ctr_pvs.cli.seeing.words import cannot_write
from ctr_pvs.cli.seeing.words import declare_output
from ctr_pvs.cli.words import UsageError
from ctr_pvs.cli.words import number
from ctr_pvs.robot.file import load_robot
from ctr_pvs.robot.robot import Robot

if TYPE_CHECKING:
    from ctr_pvs.cli.seeing.tables import Table
    from ctr_pvs.solve.solver import EquilibriumSolver
    from ctr_pvs.tasks.sweep import Commands
    from ctr_pvs.tasks.sweep import Rows

Array = NDArray[np.float64]

INTERRUPTED = 130  # as shells have it
MOST_VALUES = 1_000_000  # of one range
#: How far a row that is solved again may be from what is kept, as a share of its largest number.
SAME = 1e-6
FORCE = ("tip_force_x", "tip_force_y", "tip_force_z")


def declare_sweep(subcommands: argparse._SubParsersAction[Any]) -> None:
    """Adds the sub-command."""
    sweep = subcommands.add_parser(
        "sweep",
        allow_abbrev=False,
        help="many commands, a grid or a list, to a table",
        description="Answers many commands, each a cold start, and writes a table: tip position and orientation, "
        "stability margin, torques, forces, status. Ctrl-C keeps what is done; --resume goes on from there.",
        epilog="Exit codes: 0 every row was answered, with a status of its own; 2 bad input; 130 stopped by Ctrl-C.",
    )
    declare_robot(sweep)
    grid = sweep.add_argument_group("a grid", "One word per tube, outermost first: low:high:count, or one value.")
    grid.add_argument("--alpha-range", nargs="+", type=_values, metavar="A", help="base rotations [rad]")
    grid.add_argument("--D-range", nargs="+", type=_values, metavar="D", help="base-to-orifice distances [m]")
    grid.add_argument("--degrees", action="store_true", help="--alpha-range is in degrees")
    grid.add_argument(
        "--tip-force", nargs=3, type=number, metavar=("FX", "FY", "FZ"), help="force on the tip in every row [N]"
    )
    sweep.add_argument(
        "--commands",
        type=Path,
        metavar="CSV",
        help="a list, in place of a grid: columns alpha_TUBE [rad] and D_TUBE [m], by name, and, if need be, "
        "tip_force_x, .._y, .._z [N]; others are not looked at, so that a table of answers is a list, too",
    )
    endings = (".csv", ".npz", ".parquet")
    declare_output(sweep, "--output", endings, required=True, help=".csv, .npz, or .parquet (needs pyarrow)")
    sweep.add_argument("--resume", action="store_true", help="go on after the rows that --output already holds")
    sweep.set_defaults(run=_sweep)


def _values(text: str) -> Array:
    """The values of low:high:count, or one value, for argparse."""
    parts = text.strip().split(":")
    if len(parts) == 1:
        return np.array([number(parts[0])])
    if len(parts) != 3:
        raise argparse.ArgumentTypeError(f"expected low:high:count or a number, got {text.strip()!r}")
    low, high, count = map(number, parts)
    if count != int(count) or not 2 <= count <= MOST_VALUES:
        raise argparse.ArgumentTypeError(f"expected a count from 2 to {MOST_VALUES}, got {parts[2]!r}")
    return np.linspace(low, high, int(count))


def _sweep(arguments: argparse.Namespace) -> int:
    robot = load_robot(arguments.robot)
    if arguments.output.exists() and not arguments.resume:
        raise UsageError(f"--output: {arguments.output} is there already: --resume goes on with it, or remove it")
    commands = _commands(arguments, robot)

    from ctr_pvs.cli.seeing.tables import table_for
    from ctr_pvs.solve.solver import EquilibriumSolver

    solver = EquilibriumSolver(robot, tolerance=arguments.tolerance)
    table = table_for(arguments.output, commands.layout)
    try:
        if arguments.output.exists():
            _check_kept(solver, commands, table)
        return _run(solver, commands, table)
    except OSError as error:
        raise cannot_write("--output", error) from error


def _commands(arguments: argparse.Namespace, robot: Robot) -> Commands:
    from ctr_pvs.tasks.sweep import Grid

    grid = (arguments.alpha_range, arguments.D_range)
    if arguments.commands is not None:
        if any(part is not None for part in (*grid, arguments.tip_force)) or arguments.degrees:
            raise UsageError("--commands: expected no grid beside a list, which tells rotations and forces itself")
        return read_commands(arguments.commands, robot)
    if any(part is None for part in grid):
        raise UsageError("expected --alpha-range and --D-range, or --commands (see ctr-pvs sweep --help)")
    unit = math.pi / 180.0 if arguments.degrees else 1.0
    return Grid(robot, [unit * values for values in grid[0]], grid[1], arguments.tip_force)


def read_commands(path: Path, robot: Robot) -> Commands:
    """The list of a CSV file.  Raises ``UsageError`` for one that cannot be read, or lacks a column or a number."""
    from ctr_pvs.tasks.sweep import Layout
    from ctr_pvs.tasks.sweep import Listed

    names = [tube.name for tube in robot.tubes]
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            reader = csv.DictReader(file, skipinitialspace=True)
            loaded = any(name in (reader.fieldnames or ()) for name in FORCE)
            layout = Layout(names, loaded)
            columns = layout.names[layout.commands]
            missing = [name for name in columns if name not in (reader.fieldnames or ())]
            if missing:
                raise UsageError(f"--commands: {path}: expected columns {', '.join(columns)}; {missing[0]} is missing")
            rows = [[_cell(path, reader.line_num, name, row[name]) for name in columns] for row in reader]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise UsageError(f"--commands: cannot read {path}: {error}") from error
    if not rows:
        raise UsageError(f"--commands: {path}: expected at least one row")
    return Listed(robot, np.array(rows, dtype=np.float64), loaded)


def _cell(path: Path, line: int, name: str, text: str | None) -> float:
    try:
        return number(text or "")
    except argparse.ArgumentTypeError as error:
        raise UsageError(f"--commands: {path}, line {line}, {name}: {error}") from None


def _check_kept(solver: EquilibriumSolver, commands: Commands, table: Table) -> None:
    """Whether the rows of an earlier run are the first of these commands, and the last of them has the same answer.

    Raises ``UsageError`` where not: rows of two kinds in one file would help nobody.
    """
    from ctr_pvs.tasks.sweep import Listed
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
    (again,) = sweep(solver, listed)
    largest = np.nanmax(np.abs(last.numbers[-1]))
    same = np.allclose(again.numbers[0], last.numbers[-1], rtol=0.0, atol=SAME * largest, equal_nan=True)
    if not same or again.codes[0] != last.codes[-1]:
        raise UsageError(f"--resume: {table.path} has another answer in its last row: another robot, or tolerance")


def _run(solver: EquilibriumSolver, commands: Commands, table: Table) -> int:
    """Answers the rows that the table does not have yet."""
    from ctr_pvs.cli.seeing.progress import Progress
    from ctr_pvs.cli.seeing.progress import Stop
    from ctr_pvs.tasks.sweep import STATUSES
    from ctr_pvs.tasks.sweep import sweep

    total = len(commands)
    counts = np.zeros(len(STATUSES), dtype=np.int64)
    progress = Progress(table.count, total)
    with Stop() as stop:
        try:
            for rows in sweep(solver, commands, table.count):
                table.append(rows)
                counts += np.bincount(rows.codes, minlength=len(STATUSES))
                progress.tell(table.count)
                if stop.asked:
                    break
        finally:
            table.close()
    told = ", ".join(f"{count} {name}" for name, count in zip(STATUSES, counts.tolist(), strict=True) if count)
    print(f"{table.path}: {table.count} of {total} rows{'; new: ' + told if told else ''}")
    if table.count < total:
        print("ctr-pvs: stopped; --resume goes on", file=sys.stderr)
        return INTERRUPTED
    return SUCCESS
