"""ctr-pvs sweep: many commands, from a grid or a list, to a table."""

from __future__ import annotations

import argparse
import csv
import math
from pathlib import Path
from typing import TYPE_CHECKING
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.cli.command import declare_robot
from ctr_pvs.cli.seeing.answering import answer
from ctr_pvs.cli.seeing.answering import check_output
from ctr_pvs.cli.seeing.answering import declare_answering
from ctr_pvs.cli.seeing.answering import exit_code
from ctr_pvs.cli.seeing.words import declare_output
from ctr_pvs.cli.words import UsageError
from ctr_pvs.cli.words import number
from ctr_pvs.robot.file import load_robot
from ctr_pvs.robot.robot import Robot

if TYPE_CHECKING:
    from ctr_pvs.tasks.sweep import Commands

Array = NDArray[np.float64]

MOST_VALUES = 1_000_000  # of one range
FORCE = ("tip_force_x", "tip_force_y", "tip_force_z")


def declare_sweep(subcommands: argparse._SubParsersAction[Any]) -> None:
    """Adds the sub-command."""
    sweep = subcommands.add_parser(
        "sweep",
        allow_abbrev=False,
        help="many commands, a grid or a list, to a table",
        description="Answers many commands, each a cold start, and writes a table: tip position and orientation, "
        "stability margin, torques, forces, status. Ctrl-C keeps what is done; --resume goes on from there.",
        epilog="Exit codes: 0 every row was answered, with a status of its own; 2 bad input or no cluster; 130 Ctrl-C.",
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
    declare_answering(sweep)
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
    check_output(arguments)
    commands = _commands(arguments, robot)

    from ctr_pvs.cli.seeing.tables import table_for
    from ctr_pvs.tasks.sweep import STATUSES

    table = table_for(arguments.output, commands.layout)
    counts = answer(arguments, robot, commands, table)
    told = ", ".join(f"{count} {name}" for name, count in zip(STATUSES, counts, strict=True) if count)
    print(f"{table.path}: {table.count} of {len(commands)} rows{'; new: ' + told if told else ''}")
    return exit_code(arguments, commands, table)


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
