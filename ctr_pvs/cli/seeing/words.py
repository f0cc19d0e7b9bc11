"""The words that the sub-commands which show have in common."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING
from typing import Any

from ctr_pvs.cli.command import command_in
from ctr_pvs.cli.words import UsageError
from ctr_pvs.robot.robot import Robot

if TYPE_CHECKING:
    from ctr_pvs.answer.equilibrium import Equilibrium


def solved(arguments: argparse.Namespace) -> tuple[Robot, Equilibrium]:
    """The robot, and the answer of a cold start to the one command that the words tell."""
    robot, alpha, D, loads = command_in(arguments)

    from ctr_pvs.solve.solver import EquilibriumSolver  # brings the compiler along: see main

    return robot, EquilibriumSolver(robot, tolerance=arguments.tolerance).solve(alpha, D, loads=loads)


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
