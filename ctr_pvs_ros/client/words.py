"""What the words of ctr_client mean. Needs no ROS."""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence

from ctr_pvs.cli.live.view import declare_page
from ctr_pvs.cli.version import declare_version
from ctr_pvs.cli.words import Parser
from ctr_pvs.cli.words import UsageError
from ctr_pvs.cli.words import number
from ctr_pvs.cli.words import shielded
from ctr_pvs.cli.words import whole_number

ROTATION = "_rotation"
EXIT_CODES = (
    "Exit codes: 0 answered, 1 refused, failed or no answer in time, 2 wrong usage or no node, 130 interrupted."
)
Joint = tuple[str, float]


def parse(words: Sequence[str]) -> argparse.Namespace:
    """The words after the program's name; raises ctr_pvs.cli's UsageError.

    The result has `command`, which is send, watch, view, solve or inverse, and what that takes; `joints` are in rad
    and m; for inverse also `goal` and `orientation`, as SolveInverse wants them.
    """
    arguments = _parser().parse_args(shielded(_joints_first(words)))
    if "joints" in arguments and arguments.degrees:
        arguments.joints = [_in_radians(joint) for joint in arguments.joints]
    if arguments.command == "inverse":
        arguments.goal = "tangent" if arguments.tangent else "orientation" if arguments.orientation else "position"
        if arguments.tangent:
            arguments.orientation = _turned_from_x(arguments.tangent)
    arguments.namespace = arguments.namespace.strip("/")
    return arguments


def _joints_first(words: Sequence[str]) -> list[str]:
    """With the joints right after the subcommand: argparse takes them in one run only."""
    joints = [word for word in words[1:] if "=" in word and not word.startswith("-")]
    return [*words[:1], *joints, *(word for word in words[1:] if word not in joints)]


def joint(text: str) -> Joint:
    """NAME=POSITION, for argparse."""
    name, equals, value = text.partition("=")
    if not name or not equals:
        raise argparse.ArgumentTypeError(f"expected JOINT=POSITION, such as inner_rotation=1.0, got {text!r}")
    try:
        return name, number(value)
    except argparse.ArgumentTypeError as error:
        raise argparse.ArgumentTypeError(f"{name}: {error}") from None


def _in_radians(joint: Joint) -> Joint:
    name, value = joint
    return name, math.radians(value) if name.endswith(ROTATION) else value


def _turned_from_x(direction: Sequence[float]) -> list[float]:
    """The quaternion xyzw of the least rotation that turns the x axis into a direction."""
    x, y, z = direction
    size = math.hypot(x, y, z)
    if size == 0.0:
        raise UsageError("--tangent: expected a direction, got zeros (see ctr_client inverse --help)")
    quaternion = [0.0, -z, y, size + x] if size + x > 1e-12 * size else [0.0, 0.0, 1.0, 0.0]
    whole = math.hypot(*quaternion)
    return [part / whole for part in quaternion]


def _parser() -> Parser:
    parser = Parser(
        prog="ctr_client",
        allow_abbrev=False,
        description="Talks with a running equilibrium node.",
        epilog=EXIT_CODES,
    )
    declare_version(parser)
    subcommands = parser.add_subparsers(metavar="SUBCOMMAND", required=True, dest="command")
    send = _declared(subcommands, "send", "one command on servo_jp, and what the node says of it")
    watch = _declared(subcommands, "watch", "a line for each command or wrench as the node tells of it, until Ctrl-C")
    view = _declared(subcommands, "view", "the tubes as the node moves them, on a page in a browser, until Ctrl-C")
    solve = _declared(subcommands, "solve", "one equilibrium from ~/solve, beside the stream of commands")
    inverse = _declared(subcommands, "inverse", "the command that brings the tip to a place, and a way, from ~/inverse")
    for subcommand in (send, solve):
        _declare_joints(subcommand, "+", "<tube>_rotation [rad] or <tube>_translation [m]")
    for subcommand in (send, watch, solve, inverse):
        subcommand.add_argument("--json", action="store_true", help="one JSON object a line; SI units, null: not known")
    declare_page(view, "that has the longest arrow")
    _declare_joints(inverse, "*", "where the way begins (none: the stream's last answer)")
    _declare_place(inverse)
    watch.add_argument("--count", type=whole_number(1, 10**9), metavar="N", help="end after so many lines")
    solve.add_argument("--warm", action="store_true", help="set out from the service's last answer, not from rest")
    for kind, letter, unit in (("force", "F", "N"), ("moment", "M", "N m")):
        axes = tuple(f"{letter}{axis}" for axis in "XYZ")
        text = f"external {kind} on the tip, along the base's axes [{unit}]"
        for subcommand in (solve, inverse):
            subcommand.add_argument(f"--{kind}", nargs=3, type=number, default=[0.0] * 3, metavar=axes, help=text)
    return parser


def _declare_place(inverse: Parser) -> None:
    """Where the tip should be, and how it is looked for."""
    axes = ("X", "Y", "Z")
    inverse.add_argument("--position", nargs=3, type=number, required=True, metavar=axes, help="of the tip [m]")
    turned = inverse.add_mutually_exclusive_group()
    turned.add_argument("--tangent", nargs=3, type=number, metavar=axes, help="direction of the tip")
    turned.add_argument(
        "--orientation", nargs=4, type=number, metavar=(*axes, "W"), help="of the tip's frame, a quaternion"
    )
    for name, default, metavar, text in (
        ("--within", 1e-6, "M", "how near is there [m]"),
        ("--within-angle", 1e-4, "RAD", "and how near a tangent or an orientation [rad]"),
        ("--margin-floor", 0.1, "M", "least margin of the way"),
    ):
        inverse.add_argument(name, type=number, default=default, metavar=metavar, help=f"{text} (%(default)g)")
    inverse.add_argument("--all", action="store_true", help="look for all solutions, the largest margin first")
    inverse.add_argument(
        "--time-limit", type=number, default=0.0, metavar="S", help="of the search [s] (0: the node's compute_budget)"
    )


def _declared(subcommands: argparse._SubParsersAction[Parser], name: str, text: str) -> Parser:
    """A subcommand with the options that all have."""
    subcommand = subcommands.add_parser(name, allow_abbrev=False, help=text, description=f"{text}.", epilog=EXIT_CODES)
    subcommand.add_argument("--namespace", default="", metavar="NS", help="namespace of the node (none)")
    subcommand.add_argument("--node", default="ctr_equilibrium", metavar="NAME", help="name of the node (%(default)s)")
    return subcommand


def _declare_joints(subcommand: Parser, count: str, text: str) -> None:
    subcommand.add_argument("joints", nargs=count, type=joint, metavar="JOINT=POSITION", help=text)
    subcommand.add_argument("--degrees", action="store_true", help="rotations are in degrees, in what is printed, too")
    subcommand.add_argument(
        "--wait", type=number, default=10.0, metavar="S", help="for the node, and for its answer [s] (%(default)g)"
    )
