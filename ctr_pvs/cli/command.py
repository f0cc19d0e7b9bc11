"""One command on the command line: the words that tell it, what they mean, and the exit code of its answer."""

from __future__ import annotations

import argparse
import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.answer.status import Status
from ctr_pvs.cli.loads import declare_loads
from ctr_pvs.cli.loads import loads_in
from ctr_pvs.cli.words import number
from ctr_pvs.robot.file import load_robot
from ctr_pvs.robot.loads import Loads
from ctr_pvs.robot.loads import check_loads
from ctr_pvs.robot.robot import Robot

if TYPE_CHECKING:
    from ctr_pvs.answer.equilibrium import Equilibrium

Array = NDArray[np.float64]

SUCCESS = 0
BAD_INPUT = 2
NO_STABLE_EQUILIBRIUM = 3
NO_ANSWER_IN_TIME_OR_TOLERANCE = 4
INTERRUPTED = 130  # as shells have it


def declare_robot(parser: argparse.ArgumentParser) -> None:
    """Adds the robot and the tolerance."""
    parser.add_argument("robot", metavar="ROBOT", help="robot file (YAML), or the name of a shipped robot")
    parser.add_argument(
        "--tolerance", type=number, default=1e-5, metavar="M", help="largest error of the tip [m] (%(default)g)"
    )


def declare_command(parser: argparse.ArgumentParser, degrees: str = "--alpha is in degrees") -> None:
    """Adds what tells one command: rotations, translations, external loads; ``degrees``: what that option does."""
    parser.add_argument(
        "--alpha", nargs="+", type=number, required=True, metavar="A", help="base rotation of each tube [rad]"
    )
    parser.add_argument(
        "--D", nargs="+", type=number, required=True, metavar="D", help="base-to-orifice distance of each tube [m]"
    )
    parser.add_argument("--degrees", action="store_true", help=degrees)
    declare_loads(parser)


def command_in(arguments: argparse.Namespace) -> tuple[Robot, Array, Array, Loads | None]:
    """The robot, alpha (N,) [rad], D (N,) [m] and the loads that the words tell; None for no loads."""
    robot = load_robot(arguments.robot)
    angles = [math.radians(angle) for angle in arguments.alpha] if arguments.degrees else arguments.alpha
    alpha, D = robot.check_command(angles, arguments.D)
    loads = loads_in(arguments, robot)
    if loads is not None:
        check_loads(robot, D, loads)
    return robot, alpha, D, loads


def exit_code(equilibrium: Equilibrium) -> int:
    """Of one answer."""
    if equilibrium.success:
        return SUCCESS
    if equilibrium.status is Status.NO_STABLE_EQUILIBRIUM:
        return NO_STABLE_EQUILIBRIUM
    return NO_ANSWER_IN_TIME_OR_TOLERANCE
