"""The words that the sub-commands which show have in common."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING
from typing import Any

from ctr_pvs.answer.status import Status
from ctr_pvs.cli.loads import declare_loads
from ctr_pvs.cli.loads import loads_in
from ctr_pvs.cli.words import UsageError
from ctr_pvs.cli.words import number
from ctr_pvs.robot.file import load_robot
from ctr_pvs.robot.loads import check_loads
from ctr_pvs.robot.robot import Robot

if TYPE_CHECKING:
    from ctr_pvs.answer.equilibrium import Equilibrium

SUCCESS, NO_STABLE_EQUILIBRIUM, NO_ANSWER_IN_TIME_OR_TOLERANCE = 0, 3, 4


def declare_robot(parser: argparse.ArgumentParser) -> None:
    """Adds the robot and the tolerance."""
    parser.add_argument("robot", metavar="ROBOT", help="robot file (YAML), or the name of a shipped robot")
    parser.add_argument(
        "--tolerance", type=number, default=1e-5, metavar="M", help="largest error of the tip [m] (%(default)g)"
    )


def declare_command(parser: argparse.ArgumentParser) -> None:
    """Adds what tells one command: rotations, translations, external loads."""
    parser.add_argument(
        "--alpha", nargs="+", type=number, required=True, metavar="A", help="base rotation of each tube [rad]"
    )
    parser.add_argument(
        "--D", nargs="+", type=number, required=True, metavar="D", help="base-to-orifice distance of each tube [m]"
    )
    parser.add_argument("--degrees", action="store_true", help="--alpha is in degrees")
    declare_loads(parser)


def solved(arguments: argparse.Namespace) -> tuple[Robot, Equilibrium]:
    """The robot, and the answer of a cold start to the one command that the words tell."""
    robot = load_robot(arguments.robot)
    angles = [math.radians(angle) for angle in arguments.alpha] if arguments.degrees else arguments.alpha
    alpha, D = robot.check_command(angles, arguments.D)
    loads = loads_in(arguments, robot)
    if loads is not None:
        check_loads(robot, D, loads)

    from ctr_pvs.solve.solver import EquilibriumSolver  # brings the compiler along: see main

    return robot, EquilibriumSolver(robot, tolerance=arguments.tolerance).solve(alpha, D, loads=loads)


def exit_code(equilibrium: Equilibrium) -> int:
    """That of one answer, as for ``ctr-pvs solve``."""
    if equilibrium.success:
        return SUCCESS
    none_there = equilibrium.status is Status.NO_STABLE_EQUILIBRIUM
    return NO_STABLE_EQUILIBRIUM if none_there else NO_ANSWER_IN_TIME_OR_TOLERANCE


def declare_output(parser: argparse.ArgumentParser, option: str, endings: tuple[str, ...], **more: Any) -> None:
    """Adds an option for a file whose ending says what it is to be."""

    def path(text: str) -> Path:
        file = Path(text)
        if file.suffix.lower() not in endings:
            raise argparse.ArgumentTypeError(f"expected a file that ends in {' or '.join(endings)}, got {text!r}")
        if not file.absolute().parent.is_dir():
            raise argparse.ArgumentTypeError(f"its folder is not there: {text!r}")
        return file

    parser.add_argument(option, type=path, metavar="FILE", **more)


def cannot_write(option: str, error: OSError) -> UsageError:
    """The one line for a file that could not be written."""
    return UsageError(f"{option}: cannot write it: {error}")
