"""ctr-pvs info: what a robot is, as a sheet and a picture."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

from ctr_pvs.cli.words import UsageError
from ctr_pvs.robot.file import load_robot

SUCCESS = 0


def declare_info(subcommands: argparse._SubParsersAction[Any]) -> None:
    """Adds the subcommand."""
    info = subcommands.add_parser(
        "info",
        allow_abbrev=False,
        help="what a robot is: dimensions, stiffnesses, strains, clearances, which pairs can snap; a picture",
        description="Prints a sheet of a robot: its tubes and their segments, clearances, how strongly each two tubes "
        "pull at each other, limits and warnings.",
    )
    info.add_argument("robot", metavar="ROBOT", help="robot file (YAML), or the name of a shipped robot")
    info.add_argument("--json", action="store_true", help="print the sheet as JSON, in SI units")
    info.add_argument("--output", type=Path, metavar="FILE.png", help="also draw the tubes, each by itself at rest")
    info.set_defaults(run=_info)


def _info(arguments: argparse.Namespace) -> int:
    robot = load_robot(arguments.robot)

    # Only here: they bring scipy along, and the picture what solves.
    from ctr_pvs.cli.robots.sheet import sheet
    from ctr_pvs.cli.robots.sheet_text import sheet_as_text

    found = sheet(robot)
    print(json.dumps(found, allow_nan=False) if arguments.json else sheet_as_text(found))
    if arguments.output is not None:
        from ctr_pvs.cli.robots.picture import save_picture
        from ctr_pvs.renda2021.figures import PictureError

        try:
            save_picture(robot, arguments.output)
        except PictureError as error:
            raise UsageError(str(error)) from error
        except (OSError, ValueError) as error:  # ValueError: no format of pictures has that suffix
            raise UsageError(f"--output: cannot write {arguments.output}: {error}") from error
        if not arguments.json:
            print(f"\nPicture: {arguments.output}")
    return SUCCESS
