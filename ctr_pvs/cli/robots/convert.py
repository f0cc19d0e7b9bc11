"""ctr-pvs convert: a robot file from another code's."""

from __future__ import annotations

import argparse
import sys
import tempfile
import warnings
from pathlib import Path
from typing import Any

from ctr_pvs.cli.remarks import tell
from ctr_pvs.cli.words import UsageError
from ctr_pvs.errors import RobotFileError
from ctr_pvs.errors import RobotWarning
from ctr_pvs.robot.file import load_robot
from ctr_pvs.robot.plausibility import implausible
from ctr_pvs.robot.reading.foreign import SHAPES
from ctr_pvs.robot.reading.foreign import read_foreign
from ctr_pvs.robot.reading.foreign_units import WORDS
from ctr_pvs.robot.reading.written import robot_text
from ctr_pvs.robot.robot import Robot

SUCCESS = 0
ORDERS = {"innermost-first": True, "outermost-first": False}


def declare_convert(subcommands: argparse._SubParsersAction[Any]) -> None:
    """Adds the subcommand."""
    convert = subcommands.add_parser(
        "convert",
        allow_abbrev=False,
        help="a robot file from another code's: other order, units, signs and words",
        description="Reads YAML or JSON with the tubes of a z-forward code (OD, ID, E, G or nu, length, "
        "length_curved, curvature, radius or u_x and u_y, beta, theta), as lists with an entry for each tube or as a "
        "mapping for each, and writes a robot file. What the file does not say is refused, not guessed.",
    )
    convert.add_argument("file", metavar="FILE", help="YAML or JSON")
    convert.add_argument("--from", dest="shape", choices=SHAPES, help="the file's shape (by the look of it)")
    convert.add_argument(
        "--units", nargs="+", choices=WORDS, default=[], metavar="UNIT", help=f"of the file: {', '.join(WORDS)}"
    )
    convert.add_argument("--order", choices=ORDERS, help="of the file's tubes (by their diameters)")
    convert.add_argument("--output", type=Path, metavar="FILE", help="robot file to write (standard output)")
    convert.set_defaults(run=_convert)


def _convert(arguments: argparse.Namespace) -> int:
    file = arguments.file
    order = None if arguments.order is None else ORDERS[arguments.order]
    foreign = read_foreign(file, arguments.shape, arguments.units, order)
    text = robot_text(foreign, Path(file).name, Path(file).stem)
    for remark in implausible(_checked(text, file)):
        tell("warning", f"{file}: {remark}")
    if arguments.output is None:
        sys.stdout.write(text)
        return SUCCESS
    try:
        arguments.output.write_text(text, encoding="utf-8")
    except OSError as error:
        raise UsageError(f"--output: cannot write {arguments.output}: {error.strerror}") from error
    print(f"{arguments.output}: {len(foreign.tubes)} tubes")
    return SUCCESS


def _checked(text: str, source: str) -> Robot:
    """The robot that the text describes; raises in the name of the file it was made of."""
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore", RobotWarning)
        path = Path(folder) / "converted.yaml"
        path.write_text(text, encoding="utf-8")
        try:
            return load_robot(path)
        except RobotFileError as error:
            raise RobotFileError(source, f"converted: {error.field}", error.value, error.limit, error.remedy) from None
