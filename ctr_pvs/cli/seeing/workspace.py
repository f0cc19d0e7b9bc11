"""ctr-pvs workspace: where the tip of a robot can be."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING
from typing import Any

import numpy as np

from ctr_pvs.cli.command import declare_robot
from ctr_pvs.cli.seeing.answering import answer
from ctr_pvs.cli.seeing.answering import check_output
from ctr_pvs.cli.seeing.answering import declare_answering
from ctr_pvs.cli.seeing.answering import exit_code
from ctr_pvs.cli.seeing.words import cannot_write
from ctr_pvs.cli.seeing.words import declare_output
from ctr_pvs.cli.words import UsageError
from ctr_pvs.cli.words import number
from ctr_pvs.cli.words import whole_number
from ctr_pvs.robot.file import load_robot

if TYPE_CHECKING:
    from ctr_pvs.tasks.sweep import Rows

MOST, LARGEST_SEED = 10_000_000, 2**53
EDGES = (1e-6, 1.0)  # m


def declare_workspace(subcommands: argparse._SubParsersAction[Any]) -> None:
    """Adds the sub-command."""
    workspace = subcommands.add_parser(
        "workspace",
        allow_abbrev=False,
        help="where the tip can be: random commands, volume, picture",
        description="Answers random commands, uniform over the robot's limits with the bases in order (a tube without "
        "limits turns once), and tells how much room the tips fill. Ctrl-C ends with those that are done, and "
        "--resume goes on with those of --output.",
    )
    declare_robot(workspace)
    workspace.add_argument(
        "--count", type=whole_number(1, MOST), default=100_000, metavar="N", help="commands (%(default)s)"
    )
    workspace.add_argument(
        "--seed", type=whole_number(0, LARGEST_SEED), default=0, metavar="S", help="of the random numbers (%(default)s)"
    )
    workspace.add_argument(
        "--voxel", type=number, metavar="M", help="edge of the cubes that the volume is counted in [m] (fitting)"
    )
    declare_output(workspace, "--output", (".npz", ".csv"), help="table of all rows, as of sweep: .npz or .csv")
    declare_answering(workspace)
    declare_output(workspace, "--picture", (".png", ".svg"), help="picture of the tips (needs matplotlib)")
    workspace.set_defaults(run=_workspace)


def _workspace(arguments: argparse.Namespace) -> int:
    robot = load_robot(arguments.robot)
    check_output(arguments)
    if arguments.voxel is not None and not EDGES[0] <= arguments.voxel <= EDGES[1]:
        raise UsageError(f"--voxel: expected an edge from {EDGES[0]:g} to {EDGES[1]:g} m, got {arguments.voxel:g}")

    from ctr_pvs.cli.seeing.tables import table_for
    from ctr_pvs.renda2021.figures import PictureError
    from ctr_pvs.renda2021.figures import empty_figure
    from ctr_pvs.tasks.sweep import Listed
    from ctr_pvs.tasks.workspace import random_commands

    if arguments.picture is not None:
        try:
            empty_figure((1.0, 1.0))  # before the work, not after it
        except PictureError as error:
            raise UsageError(str(error)) from error
    commands = Listed(robot, random_commands(robot, arguments.count, arguments.seed), False)
    table = table_for(arguments.output, commands.layout)
    answer(arguments, robot, commands, table)
    rows = table.rows()
    for line in summary(robot.name, rows, arguments.count, arguments.seed, arguments.voxel):
        print(line)
    if arguments.output is not None:
        print(arguments.output)
    if arguments.picture is not None:
        _draw(robot.name, rows, arguments.picture)
    return exit_code(arguments, commands, table)


def summary(name: str, rows: Rows, asked: int, seed: int, edge: float | None) -> list[str]:
    """What came of it, in lines: statuses, extent, margins, volume."""
    from ctr_pvs.tasks.sweep import STATUSES
    from ctr_pvs.tasks.workspace import fitting_edge
    from ctr_pvs.tasks.workspace import volume

    counts = np.bincount(rows.codes, minlength=len(STATUSES)).tolist()
    told = ", ".join(f"{count} {status}" for status, count in zip(STATUSES, counts, strict=True) if count)
    cut = "" if len(rows) == asked else f" of {asked}, stopped"
    lines = [f"{name}: {len(rows)} random commands{cut}, seed {seed}: {told}"]
    good = rows.success
    if not good.any():
        return lines
    tips, margin = rows["tip_position"][good], rows["stability_margin"][good, 0]
    low, high = 1e3 * tips.min(axis=0), 1e3 * tips.max(axis=0)
    box = ", ".join(f"{axis} {a:.1f} to {b:.1f}" for axis, a, b in zip("xyz", low, high, strict=True))
    least, tenth, half = np.quantile(margin, (0.0, 0.1, 0.5))
    room = volume(tips, edge or fitting_edge(tips))
    return [
        *lines,
        f"tips within      {box} mm",
        f"stability margin least {least:.4f}, of a tenth below {tenth:.4f}, of half below {half:.4f}",
        f"volume           {1e6 * room.volume:.4g} cm^3: {room.cubes} cubes of {1e3 * room.edge:g} mm hold a tip, "
        f"{room.once} of these one only; half the commands find {room.half}",
    ]


def _draw(name: str, rows: Rows, path: Path) -> None:
    from ctr_pvs.cli.seeing.workspace_figure import save_workspace

    try:
        save_workspace(name, rows, path)
    except OSError as error:
        raise cannot_write("--picture", error) from error
    print(path)
