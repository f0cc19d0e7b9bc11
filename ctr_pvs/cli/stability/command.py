"""ctr-pvs stability: its arguments, and the answer and pictures they ask for."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING
from typing import Any

import numpy as np

from ctr_pvs.cli.words import UsageError
from ctr_pvs.cli.words import number
from ctr_pvs.cli.words import whole_number
from ctr_pvs.robot.file import load_robot
from ctr_pvs.robot.robot import Robot

if TYPE_CHECKING:
    from ctr_pvs.cli.stability.scan import Scene

SUCCESS, NOT_ALL_SOLVED = 0, 4
MOST_STEPS, MOST_ROWS = 10_000, 1_000
TURN = {True: 360.0, False: 2.0 * math.pi}  # by --degrees


def declare_stability(subcommands: argparse._SubParsersAction[Any]) -> None:
    """Adds the subcommand."""
    stability = subcommands.add_parser(
        "stability",
        allow_abbrev=False,
        help="stability margin, snaps and folds while one tube is rotated; pictures",
        description="Rotates one tube step by step, as actuators would, and tells the stability margin on the way, the "
        "snaps, and all folds where exactly two pre-curved tubes overlap. The margin is 1 where nothing pulls the "
        "tubes off, 0 where the branch ends, negative for unstable equilibria.",
    )
    stability.add_argument("robot", metavar="ROBOT", help="robot file (YAML), or the name of a shipped robot")
    stability.add_argument(
        "--D", nargs="+", type=number, required=True, metavar="D", help="base-to-orifice distance of each tube [m]"
    )
    stability.add_argument(
        "--alpha",
        nargs="+",
        type=number,
        metavar="A",
        help="base rotation of each tube [rad] (0; the rotated one's is moot)",
    )
    stability.add_argument(
        "--tube", metavar="T", help="tube to rotate: its name, or its number from the outermost, 1 (innermost)"
    )
    stability.add_argument(
        "--range",
        nargs=2,
        type=number,
        metavar=("A0", "A1"),
        help="from which to which angle [rad] (0 to a whole turn)",
    )
    stability.add_argument(
        "--steps", type=whole_number(2, MOST_STEPS), default=73, metavar="N", help="angles in that range (%(default)s)"
    )
    stability.add_argument(
        "--map",
        nargs=2,
        type=number,
        metavar=("D0", "D1"),
        help="also map the margin over this range of the tube's D [m]",
    )
    stability.add_argument(
        "--map-steps",
        type=whole_number(2, MOST_ROWS),
        default=31,
        metavar="M",
        help="values of D in the map (%(default)s)",
    )
    stability.add_argument("--degrees", action="store_true", help="angles in degrees, here and in text output")
    stability.add_argument(
        "--tolerance", type=number, default=1e-5, metavar="M", help="largest error of the tip [m] (%(default)g)"
    )
    stability.add_argument(
        "--output", type=Path, metavar="DIR", help="folder for pictures: stability.png, and map.png with --map"
    )
    stability.add_argument("--json", action="store_true", help="print the answer as JSON, in SI units")
    stability.set_defaults(run=_stability)


def _stability(arguments: argparse.Namespace) -> int:
    robot = load_robot(arguments.robot)

    # Only here, for they bring the compiler along: see main.
    from ctr_pvs.cli.stability.figures import save_pictures
    from ctr_pvs.cli.stability.report import scan_as_json
    from ctr_pvs.cli.stability.report import scan_as_text
    from ctr_pvs.cli.stability.scan import scan
    from ctr_pvs.renda2021.figures import PictureError

    unit = math.pi / 180.0 if arguments.degrees else 1.0
    low, high = arguments.range or (0.0, TURN[arguments.degrees])
    if not low != high:
        raise UsageError(f"--range: expected two different angles, got {low:g} twice")
    angles = unit * np.linspace(low, high, arguments.steps)
    map_D = None if arguments.map is None else np.linspace(arguments.map[0], arguments.map[1], arguments.map_steps)
    result = scan(_scene(robot, arguments, unit), angles, arguments.tolerance, map_D)
    print(scan_as_json(result) if arguments.json else scan_as_text(result, arguments.degrees))
    if arguments.output is not None:
        try:
            paths = save_pictures(result, arguments.output)
        except PictureError as error:
            raise UsageError(str(error)) from error
        except OSError as error:
            raise UsageError(f"--output: cannot write the pictures: {error}") from error
        if not arguments.json:
            print("\nPictures:", *paths)
    return SUCCESS if all(one.success for one in result.sweep.answers) else NOT_ALL_SOLVED


def _scene(robot: Robot, arguments: argparse.Namespace, unit: float) -> Scene:
    from ctr_pvs.cli.stability.scan import Scene

    tube = _tube(robot, arguments.tube)
    alpha = [0.0] * robot.n_tubes if arguments.alpha is None else [unit * angle for angle in arguments.alpha]
    if len(alpha) == robot.n_tubes:
        alpha[tube] = unit * arguments.range[0] if arguments.range else 0.0
    checked, D = robot.check_command(alpha, arguments.D)
    return Scene(robot, checked, D, tube)


def _tube(robot: Robot, word: str | None) -> int:
    names = [tube.name for tube in robot.tubes]
    if word is None:
        return len(names) - 1
    if word in names:
        return names.index(word)
    if word.strip().isdecimal() and 1 <= int(word) <= len(names):
        return int(word) - 1
    raise UsageError(f"--tube: expected one of {', '.join(names)}, or a number from 1 to {len(names)}, got {word!r}")
