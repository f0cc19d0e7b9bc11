"""ctr-pvs follow: joint values that lead the tip along a path."""

from __future__ import annotations

import argparse
import json
import math
from pathlib import Path
from typing import TYPE_CHECKING
from typing import Any

from ctr_pvs.answer.status import NoEquilibriumError
from ctr_pvs.cli.loads import loads_in
from ctr_pvs.cli.tips.reach import command_table
from ctr_pvs.cli.tips.reach import declare_search
from ctr_pvs.cli.tips.reach import exit_code
from ctr_pvs.cli.tips.reach import no_start
from ctr_pvs.cli.tips.reach import save_joints
from ctr_pvs.cli.tips.reach import start_in
from ctr_pvs.cli.words import UsageError
from ctr_pvs.cli.words import is_number
from ctr_pvs.cli.words import number
from ctr_pvs.robot.file import load_robot
from ctr_pvs.robot.robot import Robot

if TYPE_CHECKING:
    from ctr_pvs.tasks.motion import Motion


def declare_follow(subcommands: argparse._SubParsersAction[Any]) -> None:
    """Adds the subcommand."""
    follow = subcommands.add_parser(
        "follow",
        allow_abbrev=False,
        help="joint values that lead the tip along a path",
        description="Leads the tip along straight lines from point to point, within a tolerance, with the time that "
        "the actuators take; where the path cannot be followed on, it tells where and why.",
    )
    follow.add_argument("robot", metavar="ROBOT", help="robot file (YAML), or the name of a shipped robot")
    points = follow.add_mutually_exclusive_group(required=True)
    points.add_argument(
        "--through", nargs=3, type=number, action="append", metavar=("X", "Y", "Z"), help="a point [m]; repeat it"
    )
    points.add_argument("--points", type=Path, metavar="FILE", help="or a CSV file of points, x,y,z [m] a line")
    follow.add_argument(
        "--path-tolerance",
        type=number,
        default=1e-4,
        metavar="M",
        help="how far from it the tip may be [m] (%(default)g)",
    )
    follow.add_argument("--turn-rate", type=number, default=1.0, metavar="W", help="of a tube [rad/s] (%(default)g)")
    follow.add_argument("--slide-rate", type=number, default=0.01, metavar="V", help="of a tube [m/s] (%(default)g)")
    follow.add_argument("--tip-rate", type=number, default=math.inf, metavar="V", help="of the tip [m/s] (any)")
    declare_search(follow)
    follow.set_defaults(run=_follow)


def _follow(arguments: argparse.Namespace) -> int:
    robot = load_robot(arguments.robot)
    start, loads = start_in(arguments, robot), loads_in(arguments, robot)
    points = arguments.through or _points_in(arguments.points)

    # Only here, for they bring the compiler along: see main.
    from ctr_pvs.tasks.motion import Rates
    from ctr_pvs.tasks.solver import EquilibriumSolver

    rates = Rates(arguments.turn_rate, arguments.slide_rate, arguments.tip_rate)
    solver = EquilibriumSolver(robot, arguments.tolerance)
    try:
        motion = solver.motion(
            points, tolerance=arguments.path_tolerance, rates=rates, start=start, loads=loads,
            margin_floor=arguments.margin_floor, budget=arguments.budget,
        )  # fmt: skip
    except NoEquilibriumError as error:
        return no_start(robot, error, arguments.json)
    rest = zip(motion.time.tolist(), motion.margin.tolist(), motion.deviation.tolist(), strict=True)
    rows = [(alpha, D, list(more)) for alpha, D, more in zip(motion.alpha, motion.D, rest, strict=True)]
    save_joints(arguments.csv, robot, rows, ["time", "margin", "deviation"])
    print(_as_json(robot, motion) if arguments.json else _as_text(robot, motion, arguments.degrees))
    return exit_code(motion.status.value)


def _points_in(path: Path) -> list[list[float]]:
    """Three numbers a line; a first line of words is a heading."""
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise UsageError(f"--points: cannot read the points: {error}") from error
    rows = [line.split(",") for line in lines if line.strip()]
    if rows and not any(is_number(word) for word in rows[0]):
        rows = rows[1:]
    for index, row in enumerate(rows, 1):
        if len(row) != 3 or not all(is_number(word) and math.isfinite(float(word)) for word in row):
            raise UsageError(f"--points: expected 3 finite numbers x,y,z in row {index}, got {','.join(row)[:60]!r}")
    if not rows:
        raise UsageError(f"--points: expected at least one point in {path}")
    return [[float(word) for word in row] for row in rows]


def _as_json(robot: Robot, motion: Motion) -> str:
    told = {
        "robot": robot.name,
        "success": motion.success,
        "status": motion.status.value,
        "message": motion.message,
        "length": motion.length,
        **{
            name: getattr(motion, name).tolist()
            for name in ("time", "alpha", "D", "tip", "margin", "deviation", "progress")
        },
        "approach": [
            {"alpha": step.alpha.tolist(), "D": step.D.tolist(), "stability_margin": step.margin}
            for step in motion.approach
        ],
    }
    return json.dumps(told, allow_nan=False)


def _as_text(robot: Robot, motion: Motion, degrees: bool) -> str:
    lines = [
        f"{robot.name}: {motion.status.value}: {motion.message}",
        f"{1e3 * motion.progress[-1]:.4f} of {1e3 * motion.length:.4f} mm, {motion.time[-1]:.3f} s, "
        f"{len(motion.time)} commands (--json, --csv: all)",
        f"farthest from the path {1e3 * motion.deviation.max():.3g} mm, least margin {motion.margin.min():.4f}",
    ]
    for title, index in (("first command", 0), ("last command", -1)):
        lines += ["", title, *command_table(robot, motion.alpha[index], motion.D[index], degrees)]
    return "\n".join(lines)
