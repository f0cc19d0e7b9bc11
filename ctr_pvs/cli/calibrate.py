"""ctr-pvs calibrate: its arguments, and the report, picture and robot file they ask for."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

from ctr_pvs.cli.words import UsageError
from ctr_pvs.cli.words import number
from ctr_pvs.cli.words import whole_number
from ctr_pvs.robot.file import load_robot

SUCCESS, NOT_CONVERGED = 0, 4
MOST_ROWS = 1_000_000


def declare_calibrate(subcommands: argparse._SubParsersAction[Any]) -> None:
    """Adds the subcommand."""
    calibrate = subcommands.add_parser(
        "calibrate",
        allow_abbrev=False,
        help="fit a robot's parameters to measured tips",
        description="Fits parameters of a robot to commands and measured tips by robust least squares with priors, and "
        "tells errors on rows held out, standard errors, and what the data cannot tell apart (docs/calibration.md). "
        "DATA has a header: alpha_1 .. and D_1 .. for each tube, outermost first; x, y, z; and if measured tx, ty, tz "
        "(tangent) or qx, qy, qz, qw (pose), and fx, fy, fz (force on the tip).",
    )
    calibrate.add_argument("robot", metavar="ROBOT", help="robot file (YAML), or the name of a shipped robot")
    calibrate.add_argument("data", metavar="DATA.csv", help="rows in the order in which they were measured")
    calibrate.add_argument(
        "--fit",
        nargs="+",
        metavar="WHAT",
        help="groups or single parameters: bending, torsion, poisson, curvature, length, alpha, D, play_alpha, play_D, "
        "registration, sensor, or for example bending:inner, length:inner:2 "
        "(bending curvature poisson alpha D registration)",
    )
    for what, pair in (("prior", "MEAN,STD"), ("bounds", "LOW,HIGH")):
        calibrate.add_argument(
            f"--{what}", nargs="+", default=[], metavar=f"WHAT={pair}", help=f"{what} of a parameter or group [SI]"
        )
    calibrate.add_argument(
        "--columns", nargs="+", default=[], metavar="NAME=TITLE", help="titles of columns, such as alpha_1=theta1"
    )
    calibrate.add_argument("--degrees", action="store_true", help="rotations in DATA are in degrees")
    calibrate.add_argument("--mm", action="store_true", help="translations and positions in DATA are in mm")
    calibrate.add_argument(
        "--beta-sign", type=number, choices=(1.0, -1.0), default=1.0, help="D is the number in DATA times this (1)"
    )
    calibrate.add_argument(
        "--any-order",
        action="store_true",
        help="rows are no path: each is a cold start, rotations stay as written, no play",
    )
    calibrate.add_argument(
        "--position-std", type=number, metavar="M", help="of a measured coordinate, model error counted [m] (estimated)"
    )
    calibrate.add_argument(
        "--direction-std", type=number, default=0.05, metavar="S", help="of a part of a tangent or axis (%(default)g)"
    )
    calibrate.add_argument(
        "--robust", type=number, default=1.5, metavar="C",
        help="what is off by more than C deviations counts less than squared; 1000 for plain squares (%(default)g)",
    )  # fmt: skip
    calibrate.add_argument(
        "--hold-out", type=whole_number(0, MOST_ROWS), default=50, metavar="ROWS",
        help="hold out every second block of this many rows; 0 holds out none (%(default)s)",
    )  # fmt: skip
    calibrate.add_argument("--write", type=Path, metavar="FILE", help="write the new robot file")
    calibrate.add_argument("--output", type=Path, metavar="PNG", help="draw what is left between told and measured")
    calibrate.add_argument("--json", action="store_true", help="print the answer as JSON, in SI units")
    calibrate.set_defaults(run=_calibrate)


def _calibrate(arguments: argparse.Namespace) -> int:
    robot = load_robot(arguments.robot)
    priors, bounds = (_pairs(f"--{what}", getattr(arguments, what)) for what in ("prior", "bounds"))
    columns = dict(_split("--columns", word) for word in arguments.columns)

    # Only here, for they bring the compiler along: see main.
    from ctr_pvs.tasks.calibrate import calibrate
    from ctr_pvs.tasks.calibrate import read_measurements
    from ctr_pvs.tasks.calibration.parameters import USUAL
    from ctr_pvs.tasks.calibration.parameters import chosen
    from ctr_pvs.tasks.calibration.report import as_json
    from ctr_pvs.tasks.calibration.report import as_text
    from ctr_pvs.tasks.calibration.report import comments

    fit = arguments.fit or USUAL
    chosen(robot, fit, priors, bounds)  # before a long table is read
    data = read_measurements(
        arguments.data, robot.n_tubes, columns, arguments.degrees, arguments.mm, arguments.beta_sign,
        unwrap=not arguments.any_order,
    )  # fmt: skip
    found = calibrate(
        robot, data, fit, priors=priors, bounds=bounds, position_std=arguments.position_std,
        direction_std=arguments.direction_std, robust=arguments.robust,
        history=not arguments.any_order, block=arguments.hold_out or None,
        progress=lambda line: print(line, file=sys.stderr, flush=True),
    )  # fmt: skip
    print(as_json(found) if arguments.json else as_text(found))
    if arguments.write is not None:
        try:
            arguments.write.write_text(found.robot_file(comments(found, Path(arguments.data).name)), encoding="utf-8")
        except OSError as error:
            raise UsageError(f"--write: cannot write the robot file: {error}") from error
    if arguments.output is not None:
        _draw(found, arguments.output)
    return SUCCESS if found.converged else NOT_CONVERGED


def _draw(found: Any, path: Path) -> None:
    from ctr_pvs.tasks.calibration.picture import CalibrationPictureError
    from ctr_pvs.tasks.calibration.picture import save_picture

    try:
        save_picture(found, path)
    except (CalibrationPictureError, OSError, ValueError) as error:  # ValueError: an ending that no format has
        raise UsageError(f"--output: {error}") from error


def _split(option: str, word: str) -> tuple[str, str]:
    name, equals, value = word.partition("=")
    if not (name and equals and value):
        raise UsageError(f"{option}: expected NAME=..., got {word!r}")
    return name, value


def _pairs(option: str, words: list[str]) -> dict[str, tuple[float, float]]:
    found = {}
    for word in words:
        name, value = _split(option, word)
        try:
            first, second = map(float, value.split(","))
        except ValueError:
            raise UsageError(f"{option}: expected two numbers with a comma between them, got {word!r}") from None
        found[name] = first, second
    return found
