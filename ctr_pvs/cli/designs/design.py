"""ctr-pvs design: its arguments, and the report, robot file and picture they ask for."""

from __future__ import annotations

import argparse
import sys
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING
from typing import Any

from ctr_pvs.cli.command import SUCCESS
from ctr_pvs.cli.seeing.words import cannot_write
from ctr_pvs.cli.seeing.words import declare_output
from ctr_pvs.cli.words import UsageError
from ctr_pvs.cli.words import number
from ctr_pvs.cli.words import whole_number
from ctr_pvs.cli.workers import declare_scheduler
from ctr_pvs.cli.workers import executor
from ctr_pvs.robot.file import load_robot

if TYPE_CHECKING:
    from ctr_pvs.tasks.design.design import Design

NOT_REACHED, INTERRUPTED = 5, 130
MOST_STARTS, LARGEST_SEED = 10_000, 2**53


def declare_design(subcommands: argparse._SubParsersAction[Any]) -> None:
    """Adds the sub-command."""
    design = subcommands.add_parser(
        "design",
        allow_abbrev=False,
        help="the robot that reaches targets: lengths, curvatures, diameters within limits",
        description="Looks for lengths, curvatures and diameters that bring the tip to all targets, within limits of "
        "strain, stability margin, wall and clearance; first of all the tips are to be near, then curvatures low "
        "(docs/design.md). TARGETS has a header: x, y, z [m], and if asked for tx, ty, tz (tangent).",
        epilog="Exit codes: 0 every target is reached, 2 bad input, 5 some are not (the best robot is told and "
        "written), 130 stopped by Ctrl-C with the best so far kept.",
    )
    design.add_argument(
        "robot", metavar="ROBOT", help="where to begin: robot file (YAML), or the name of a shipped robot"
    )
    design.add_argument("targets", metavar="TARGETS.csv", help="where the tip is to be")
    design.add_argument("--mm", action="store_true", help="x, y, z are in mm")
    design.add_argument(
        "--vary", nargs="+", metavar="WHAT",
        help="curvature, length, inner_diameter, outer_diameter, of one tube (curvature:inner) or segment "
        "(length:inner:2), with bounds in SI units or multiples if need be (curvature:inner=5,20, "
        "length:outer:1=0.5x,2x); tubes without curvature have none (length curvature)",
    )  # fmt: skip
    design.add_argument(
        "--strain", type=number, default=0.05, metavar="S", help="largest of any tube, straightened (%(default)g)"
    )
    design.add_argument(
        "--margin-floor", type=number, default=0.1, metavar="M", help="least margin at a target (%(default)g)"
    )
    design.add_argument(
        "--clearance", type=number, metavar="M",
        help="least diametral clearance of two tubes [m] (5e-5, or what the robot has if less)",
    )  # fmt: skip
    design.add_argument(
        "--wall", type=number, metavar="M", help="least thickness of a wall [m] (5e-5, or what the robot has if less)"
    )
    design.add_argument("--within", type=number, default=1e-6, metavar="M", help="how near is there [m] (%(default)g)")
    design.add_argument(
        "--within-angle", type=number, default=1e-4, metavar="A", help="of a tangent [rad] (%(default)g)"
    )
    design.add_argument(
        "--starts",
        type=whole_number(1, MOST_STARTS),
        default=8,
        metavar="N",
        help="designs to begin with (%(default)s)",
    )
    design.add_argument(
        "--seed", type=whole_number(0, LARGEST_SEED), default=0, metavar="S", help="of the random numbers (%(default)s)"
    )
    declare_scheduler(design)
    declare_output(design, "--write", (".yaml", ".yml"), help="write the new robot file")
    declare_output(design, "--output", (".png", ".svg"), help="draw robots at the targets, and what is left")
    design.add_argument("--json", action="store_true", help="print the answer as JSON, in SI units")
    design.set_defaults(run=_design)


def _design(arguments: argparse.Namespace) -> int:
    robot = load_robot(arguments.robot)

    # Only here, for they bring the compiler along: see main.
    from ctr_pvs.cli.designs.report import as_json
    from ctr_pvs.cli.designs.report import as_text
    from ctr_pvs.cli.seeing.progress import Stop
    from ctr_pvs.renda2021.figures import PictureError
    from ctr_pvs.renda2021.figures import empty_figure
    from ctr_pvs.tasks.design.design import design
    from ctr_pvs.tasks.design.parameters import USUAL
    from ctr_pvs.tasks.design.room import DesignLimits
    from ctr_pvs.tasks.design.targets import read_targets

    if arguments.output is not None:
        try:
            empty_figure((1.0, 1.0))  # before the work, not after it
        except PictureError as error:
            raise UsageError(str(error)) from error
    limits = DesignLimits(arguments.strain, arguments.margin_floor, arguments.clearance, arguments.wall)
    targets = read_targets(arguments.targets, arguments.mm)
    # Threads of its own are not waited for when it is stopped.
    workers = executor(arguments.scheduler) if arguments.scheduler else nullcontext()
    with Stop() as stop, workers as pool:
        found = design(
            robot, targets, arguments.vary or USUAL, limits, within=arguments.within,
            within_angle=arguments.within_angle, starts=arguments.starts, seed=arguments.seed,
            executor=pool, progress=lambda line: print(line, file=sys.stderr, flush=True), stopped=lambda: stop.asked,
        )  # fmt: skip
    print(as_json(found) if arguments.json else as_text(found))
    _save(found, arguments)
    if found.stopped:
        print("ctr-pvs: stopped; this is the best so far", file=sys.stderr)
        return INTERRUPTED
    return SUCCESS if found.success else NOT_REACHED


def _save(found: Design, arguments: argparse.Namespace) -> None:
    from ctr_pvs.cli.designs.report import comments

    if arguments.write is not None:
        try:
            arguments.write.write_text(
                found.robot_file(comments(found, Path(arguments.targets).name, arguments.seed)), encoding="utf-8"
            )
        except OSError as error:
            raise cannot_write("--write", error) from error
    if arguments.output is not None:
        from ctr_pvs.cli.designs.picture import save_picture

        try:
            save_picture(found, arguments.output)
        except OSError as error:
            raise cannot_write("--output", error) from error
