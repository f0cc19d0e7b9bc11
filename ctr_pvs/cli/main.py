"""The command line, ctr-pvs SUBCOMMAND: what the user writes becomes a call of the library, its answer text.

A subcommand is two functions here, one that declares its arguments and one that runs it and returns an exit code.
Bad input is one line on standard error; standard output is for answers only.

What solves is imported by the function that needs it, after the words, the robot file and the loads have been found
right: it brings the compiler along, which takes longer than all the rest.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ctr_pvs.cli.calibrate import declare_calibrate
from ctr_pvs.cli.command import BAD_INPUT
from ctr_pvs.cli.command import INTERRUPTED
from ctr_pvs.cli.command import SUCCESS
from ctr_pvs.cli.command import command_in
from ctr_pvs.cli.command import declare_command
from ctr_pvs.cli.command import declare_robot
from ctr_pvs.cli.command import exit_code
from ctr_pvs.cli.designs.design import declare_design
from ctr_pvs.cli.live.view import declare_view
from ctr_pvs.cli.remarks import robot_warnings_told
from ctr_pvs.cli.remarks import tell
from ctr_pvs.cli.remarks import turn_hints
from ctr_pvs.cli.report import answer_as_json
from ctr_pvs.cli.report import answer_as_text
from ctr_pvs.cli.robots.convert import declare_convert
from ctr_pvs.cli.robots.info import declare_info
from ctr_pvs.cli.seeing.plot import declare_plot
from ctr_pvs.cli.seeing.sweep import declare_sweep
from ctr_pvs.cli.seeing.workspace import declare_workspace
from ctr_pvs.cli.stability.command import declare_stability
from ctr_pvs.cli.tips.follow import declare_follow
from ctr_pvs.cli.tips.reach import declare_reach
from ctr_pvs.cli.version import declare_version
from ctr_pvs.cli.words import Parser
from ctr_pvs.cli.words import UsageError
from ctr_pvs.cli.words import shielded
from ctr_pvs.cli.words import whole_number
from ctr_pvs.errors import FieldError
from ctr_pvs.errors import RobotFileError

if TYPE_CHECKING:
    pass

EXIT_CODES = (
    "Exit codes: 0 success, 2 bad input, 3 no stable equilibrium, 4 not converged, tolerance missed or out of time, "
    "5 a target that was not reached, 130 stopped by Ctrl-C with what was done kept."
)

MOST_POSES = 100_000
PICTURES = Path("reproduce")


def main(argv: Sequence[str] | None = None) -> int:
    """Runs one subcommand.

    Args:
        argv: the words after the program's name; those of the process when None.

    Returns:
        The exit code, see EXIT_CODES.
    """
    words = sys.argv[1:] if argv is None else argv
    try:
        arguments = _parser().parse_args(shielded(words))
        run: Callable[[argparse.Namespace], int] = arguments.run
        with robot_warnings_told():
            code = run(arguments)
        sys.stdout.flush()  # here, where a closed pipe can still be answered
        return code
    except (UsageError, FieldError, RobotFileError) as error:
        print("ctr-pvs:", " ".join(str(error).splitlines()), file=sys.stderr)
        return BAD_INPUT
    except KeyboardInterrupt:
        print("ctr-pvs: stopped", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:  # whoever read the answer has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return SUCCESS


def _declare_solve(subcommands: argparse._SubParsersAction[Parser]) -> None:
    solve = subcommands.add_parser(
        "solve",
        allow_abbrev=False,
        help="one equilibrium: shape, torques, forces, stability",
        description="Solves for the equilibrium of a robot. Give one rotation and one translation per tube, outermost "
        "first. The model has no friction and no clearance, and is quasi-static.",
    )
    declare_robot(solve)
    declare_command(solve, degrees="--alpha is in degrees; text output shows degrees too")
    solve.add_argument(
        "--fidelity",
        choices=("auto", "torsionless", "torsion", "full"),
        default="auto",
        help="the model; auto takes the smallest that meets the tolerance",
    )
    solve.add_argument(
        "--start",
        choices=("cold", "lowest-energy"),
        default="cold",
        help="which equilibrium where there are several: cold follows the path from the relaxed robot",
    )
    solve.add_argument(
        "--force-model",
        choices=("virtual_work", "renda2021"),
        default="virtual_work",
        help="insertion forces: dE/dD, or eq. (41) of Renda et al. 2021",
    )
    solve.add_argument(
        "--poses",
        type=whole_number(2, MOST_POSES),
        default=51,
        metavar="N",
        help="poses along the backbone, in --json (%(default)s)",
    )
    solve.add_argument("--json", action="store_true", help="print the answer as JSON, in SI units")
    solve.set_defaults(run=_solve)


def _solve(arguments: argparse.Namespace) -> int:
    robot, alpha, D, loads = command_in(arguments)

    from ctr_pvs.tasks.solver import EquilibriumSolver

    solver = EquilibriumSolver(
        robot,
        tolerance=arguments.tolerance,
        fidelity=arguments.fidelity,
        force_model=arguments.force_model,
    )
    equilibrium = solver.solve(alpha, D, loads=loads, start=arguments.start)
    hints = turn_hints(solver, equilibrium, arguments.tolerance, loads, arguments.degrees)
    for hint in hints:
        tell("hint", hint)
    if arguments.json:
        print(answer_as_json(robot, equilibrium, arguments.poses, hints))
    else:
        print(answer_as_text(robot, equilibrium, arguments.degrees))
    return exit_code(equilibrium)


def _declare_reproduce(subcommands: argparse._SubParsersAction[Parser]) -> None:
    reproduction = subcommands.add_parser(
        "reproduce",
        allow_abbrev=False,
        help="the seed paper's numbers beside ours; draws its Fig. 2 and Fig. 4",
        description="Computes Fig. 2, Fig. 4, eq. (31) and Table II of Renda et al. 2021 and prints the paper's number "
        "beside ours and the difference. Draws fig2.png and fig4.png (needs matplotlib).",
    )
    reproduction.add_argument(
        "--json", action="store_true", help="print a list of {name, seed, ours, difference}; draw only with --output"
    )
    reproduction.add_argument("--output", type=Path, metavar="DIR", help=f"folder for the pictures ({PICTURES})")
    reproduction.set_defaults(run=_reproduce)


def _reproduce(arguments: argparse.Namespace) -> int:
    from ctr_pvs.renda2021.figures import PictureError
    from ctr_pvs.renda2021.reproduce import as_json
    from ctr_pvs.renda2021.reproduce import as_text
    from ctr_pvs.renda2021.reproduce import reproduce
    from ctr_pvs.renda2021.reproduce import save_pictures

    reproduction = reproduce()
    print(as_json(reproduction) if arguments.json else as_text(reproduction))
    if arguments.output is None and arguments.json:
        return SUCCESS
    try:
        paths = save_pictures(reproduction, arguments.output or PICTURES)
    except PictureError as error:
        if arguments.output is not None:
            raise UsageError(str(error)) from error
        print(f"ctr-pvs: {error}", file=sys.stderr)  # nobody has asked for them
        return SUCCESS
    except OSError as error:
        raise UsageError(f"--output: cannot write the pictures: {error}") from error
    if not arguments.json:
        print("\nPictures:", *paths)
    return SUCCESS


def _parser() -> Parser:
    parser = Parser(
        prog="ctr-pvs",
        allow_abbrev=False,
        description="Equilibria of concentric tube robots.",
        epilog=EXIT_CODES,
    )
    declare_version(parser)
    subcommands = parser.add_subparsers(metavar="SUBCOMMAND", required=True)
    for declare in (
        _declare_solve,
        _declare_reproduce,
        declare_stability,
        declare_convert,
        declare_info,
        declare_calibrate,
        declare_design,
        declare_reach,
        declare_follow,
        declare_plot,
        declare_sweep,
        declare_workspace,
        declare_view,
    ):
        declare(subcommands)
    return parser
