"""ctr-pvs reach: the command that brings the tip where it should be, and the way there."""

from __future__ import annotations

import argparse
import json
import math
from pathlib import Path
from typing import TYPE_CHECKING
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.answer.status import NoEquilibriumError
from ctr_pvs.cli.loads import declare_loads
from ctr_pvs.cli.loads import loads_in
from ctr_pvs.cli.words import UsageError
from ctr_pvs.cli.words import number
from ctr_pvs.renda2021.columns import aligned
from ctr_pvs.robot.file import load_robot
from ctr_pvs.robot.robot import Robot

if TYPE_CHECKING:
    from ctr_pvs.tasks.inverse import InverseResult
    from ctr_pvs.tasks.walk import Step

Array = NDArray[np.float64]
Command = tuple[Array, Array]

REACHED, NO_STABLE_EQUILIBRIUM, NOT_IN_TIME, NOT_REACHED = 0, 3, 4, 5


def declare_reach(subcommands: argparse._SubParsersAction[Any]) -> None:
    """Adds the subcommand."""
    reach = subcommands.add_parser(
        "reach",
        allow_abbrev=False,
        help="the command that brings the tip to a place, and a way there without a snap",
        description="Inverse kinematics: looks for base rotations and positions that bring the tip to a place, within "
        "limits, lengths and order, and follows the robot there: no step of the way snaps. Where the target is out of "
        "reach it tells the closest point.",
    )
    reach.add_argument("robot", metavar="ROBOT", help="robot file (YAML), or the name of a shipped robot")
    reach.add_argument(
        "--position", nargs=3, type=number, required=True, metavar=("X", "Y", "Z"), help="of the tip [m]"
    )
    reach.add_argument("--tangent", nargs=3, type=number, metavar=("X", "Y", "Z"), help="direction of the tip")
    reach.add_argument(
        "--orientation", nargs=4, type=number, metavar=("X", "Y", "Z", "W"), help="of the tip's frame, a quaternion"
    )
    reach.add_argument("--within", type=number, default=1e-6, metavar="M", help="how near is there [m] (%(default)g)")
    reach.add_argument("--all", action="store_true", help="look for all solutions, the largest margin first")
    declare_search(reach)
    reach.set_defaults(run=_reach)


def declare_search(parser: argparse.ArgumentParser) -> None:
    """The arguments of all that search: where to start, what to keep, how to tell."""
    parser.add_argument("--start-alpha", nargs="+", type=number, metavar="A", help="where to start: rotations [rad]")
    parser.add_argument("--start-D", nargs="+", type=number, metavar="D", help="and base positions [m]")
    parser.add_argument("--margin-floor", type=number, default=0.1, metavar="M", help="least margin (%(default)g)")
    parser.add_argument("--budget", type=number, metavar="S", help="seconds that the search may take")
    parser.add_argument("--degrees", action="store_true", help="rotations in degrees, here and in text output")
    parser.add_argument(
        "--tolerance", type=number, default=1e-6, metavar="M", help="largest error of the tip's model [m] (%(default)g)"
    )
    parser.add_argument("--json", action="store_true", help="print the answer as JSON, in SI units")
    parser.add_argument("--csv", type=Path, metavar="FILE", help="write the joint values, rad and m, to this file")
    declare_loads(parser)


def start_in(arguments: argparse.Namespace, robot: Robot) -> Command | None:
    """The command to start from; None where it is not given."""
    alpha, D = arguments.start_alpha, arguments.start_D
    if (alpha is None) != (D is None):
        raise UsageError("--start-alpha, --start-D: expected both or neither")
    if alpha is None:
        return None
    return robot.check_command([math.radians(angle) for angle in alpha] if arguments.degrees else alpha, D)


def _reach(arguments: argparse.Namespace) -> int:
    robot = load_robot(arguments.robot)
    start, loads = start_in(arguments, robot), loads_in(arguments, robot)

    # Only here, for they bring the compiler along: see main.
    from ctr_pvs.tasks.solver import EquilibriumSolver

    solver = EquilibriumSolver(robot, arguments.tolerance)
    try:
        result = solver.inverse(
            arguments.position, arguments.tangent, arguments.orientation, start=start, loads=loads,
            margin_floor=arguments.margin_floor, budget=arguments.budget, all=arguments.all, within=arguments.within,
        )  # fmt: skip
    except NoEquilibriumError as error:
        return no_start(robot, error, arguments.json)
    save_joints(arguments.csv, robot, [(step.alpha, step.D, [step.margin]) for step in result.way], ["margin"])
    print(_as_json(robot, result) if arguments.json else _as_text(robot, result, arguments.degrees))
    return exit_code(result.status.value)


def no_start(robot: Robot, error: NoEquilibriumError, as_json: bool) -> int:
    """Tells that there is nothing to set out from."""
    told = {"robot": robot.name, "success": False, "status": "no_stable_equilibrium", "message": str(error)}
    print(json.dumps(told) if as_json else f"{robot.name}: no_stable_equilibrium: {error}")
    return NO_STABLE_EQUILIBRIUM


def exit_code(status: str) -> int:
    """Of a search."""
    codes = {"reached": REACHED, "timeout": NOT_IN_TIME, "not_converged": NOT_IN_TIME}
    return codes.get(status, NOT_REACHED)


def save_joints(
    path: Path | None, robot: Robot, rows: list[tuple[Array, Array, list[float]]], more: list[str]
) -> None:  # fmt: skip
    """Writes a line for each command: rotations [rad], positions [m], and ``more``."""
    if path is None:
        return
    joints = [f"{tube.name}_{kind}" for kind in ("rotation", "translation") for tube in robot.tubes]
    lines = [",".join([*joints, *more])]
    lines += [",".join(repr(float(value)) for value in (*alpha, *D, *rest)) for alpha, D, rest in rows]
    try:
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    except OSError as error:
        raise UsageError(f"--csv: cannot write the joint values: {error}") from error


def _as_json(robot: Robot, result: InverseResult) -> str:
    told = {"robot": robot.name, **_found(result), "iterations": result.iterations}
    told["way"] = [_step(step) for step in result.way]
    told["others"] = [_found(other) for other in result.others]
    return json.dumps(told, allow_nan=False)


def _found(result: InverseResult) -> dict[str, Any]:
    tip = result.equilibrium.tip
    return {
        "success": result.success,
        "status": result.status.value,
        "message": result.message,
        "alpha": result.alpha.tolist(),
        "D": result.D.tolist(),
        "distance": result.distance,
        "angle": result.angle,
        "stability_margin": result.equilibrium.stability_margin,
        "tip": {"position": tip.position.tolist(), "orientation": tip.orientation.tolist()},
    }


def _step(step: Step) -> dict[str, Any]:
    return {"alpha": step.alpha.tolist(), "D": step.D.tolist(), "stability_margin": step.margin}


def _as_text(robot: Robot, result: InverseResult, degrees: bool) -> str:
    lines = [f"{robot.name}: {result.status.value}: {result.message}"]
    for one in (result, *result.others):
        lines += ["", *command_table(robot, one.alpha, one.D, degrees)]
        lines.append(f"stability margin {one.equilibrium.stability_margin:.4f}")
    if result.way:
        least = min(step.margin for step in result.way)
        lines.append(f"on the way there: {len(result.way)} commands, least margin {least:.4f} (--json, --csv: all)")
    return "\n".join(lines)


def command_table(robot: Robot, alpha: Array, D: Array, degrees: bool) -> list[str]:
    """Lines: a tube, its rotation and position each."""
    unit, name = (180.0 / math.pi, "deg") if degrees else (1.0, "rad")
    rows = [
        [tube.name, f"{unit * angle:.6f}", f"{1e3 * depth:.6f}"]
        for tube, angle, depth in zip(robot.tubes, alpha.tolist(), D.tolist(), strict=True)
    ]
    return aligned(["tube", f"alpha [{name}]", "D [mm]"], *rows)
