"""The service ~/solve: one equilibrium on request, with a solver of its own."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

from geometry_msgs.msg import PoseStamped
from std_msgs.msg import Header

from ctr_pvs import Backbone
from ctr_pvs import Loads
from ctr_pvs import Pose
from ctr_pvs import Status
from ctr_pvs.errors import FieldError
from ctr_pvs_interfaces.srv import SolveEquilibrium
from ctr_pvs_ros import messages
from ctr_pvs_ros.commands import Command
from ctr_pvs_ros.commands import CommandReader
from ctr_pvs_ros.commands import RejectedCommand
from ctr_pvs_ros.parameters import MAX_BACKBONE_POSES
from ctr_pvs_ros.turns import Late
from ctr_pvs_ros.turns import Turns
from ctr_pvs_ros.wrenches import RejectedWrench
from ctr_pvs_ros.wrenches import check_wrench

if TYPE_CHECKING:
    from ctr_pvs import Equilibrium
    from ctr_pvs import EquilibriumSolver

BAD_INPUT = "bad_input"


class SolveService:
    """Answers SolveEquilibrium requests from any number of threads.

    Args:
        reader: checks commands; may be replaced between requests.
        solver: must not be shared with the command stream.
    """

    def __init__(self, reader: CommandReader, solver: EquilibriumSolver) -> None:
        self.reader = reader
        self._solver = solver
        self._turns = Turns()

    def answer(
        self,
        request: SolveEquilibrium.Request,
        response: SolveEquilibrium.Response,
        header: Header,
        default_poses: int,
        budget: float,
    ) -> SolveEquilibrium.Response:
        """Fill the response within `budget` [s] and a little more. Never raises."""
        _fill_failure(response, header)
        poses = request.backbone_poses or default_poses
        try:
            command = self.reader.read(request.joints.name, request.joints.position)
            force, moment = messages.vectors_of(request.tip_wrench)
            check_wrench(force, moment)
        except RejectedCommand as rejection:
            return _failed(response, BAD_INPUT, f"{rejection.reason.value}: {rejection}")
        except RejectedWrench as rejection:
            return _failed(response, BAD_INPUT, f"{rejection.reason.value}: tip_wrench.{rejection}")
        if not 2 <= poses <= MAX_BACKBONE_POSES:
            rule = f"backbone_poses: expected 0 or 2 to {MAX_BACKBONE_POSES}, got {poses}"
            return _failed(response, BAD_INPUT, rule)
        loads = Loads(force, moment)
        start = "warm" if request.warm_start else "cold"
        try:
            solved = self._turns.take(lambda left: self._solve(command, loads, start, poses, left), budget)
        except Late as late:
            return _failed(response, Status.TIMEOUT.value, str(late))
        except FieldError as error:  # a load, at a model level or with a force model that knows none
            return _failed(response, BAD_INPUT, str(error))
        except Exception as error:  # whatever went wrong, the client gets an answer
            return _failed(response, Status.NOT_CONVERGED.value, f"internal error: {type(error).__name__}: {error}")
        response.success = solved.success
        response.status = solved.status.value
        response.message = solved.message
        response.solve_time = solved.time
        if solved.numbers is not None:
            _fill_answer(response, solved.numbers, header)
        return response

    def _solve(self, command: Command, loads: Loads, start: str, poses: int, budget: float) -> _Solved:
        began = time.perf_counter()
        equilibrium = self._solver.solve(command.alpha, command.D, start=start, budget=budget, loads=loads)
        took = time.perf_counter() - began
        numbers = _numbers_of(equilibrium, poses) if equilibrium.success else None
        return _Solved(equilibrium.success, equilibrium.status, equilibrium.message, took, numbers)


@dataclass(frozen=True)
class _Numbers:
    """All of an equilibrium that is told. It is computed in turn: one thread at a time may use a solver."""

    tip: Pose
    backbone: Backbone
    arrays: dict[str, list[float] | list[bool]]
    scalars: dict[str, float | int | str]


@dataclass(frozen=True)
class _Solved:
    """What came of a solve, and the wall-clock time it took [s]."""

    success: bool
    status: Status
    message: str
    time: float
    numbers: _Numbers | None


def _numbers_of(equilibrium: Equilibrium, poses: int) -> _Numbers:
    lower, upper = equilibrium.force_interval.T
    arrays = {
        "torque": equilibrium.torque,
        "force": equilibrium.force,
        "force_lower": lower,
        "force_upper": upper,
        "force_interval_reversed": equilibrium.force_interval_reversed,
    }
    return _Numbers(
        equilibrium.tip,
        equilibrium.backbone(poses),
        {name: array.tolist() for name, array in arrays.items()},
        {
            "stability_margin": float(equilibrium.stability_margin),
            "fidelity": equilibrium.fidelity,
            "degrees_of_freedom": int(equilibrium.degrees_of_freedom),
            "error_estimate": float(equilibrium.error_estimate),
            "residual": float(equilibrium.residual),
            "iterations": int(equilibrium.iterations),
            "energy": float(equilibrium.energy),
        },
    )


def _failed(response: SolveEquilibrium.Response, status: str, message: str) -> SolveEquilibrium.Response:
    response.status = status
    response.message = message
    return response


def _fill_failure(response: SolveEquilibrium.Response, header: Header) -> None:
    """No number that could be taken for an answer."""
    nan = float("nan")
    response.success = False
    response.tip = PoseStamped(header=header)
    for part, names in ((response.tip.pose.position, "xyz"), (response.tip.pose.orientation, "xyzw")):
        for name in names:
            setattr(part, name, nan)
    response.backbone.header = header
    response.stability_margin = nan
    response.error_estimate = nan
    response.residual = nan
    response.energy = nan


def _fill_answer(response: SolveEquilibrium.Response, numbers: _Numbers, header: Header) -> None:
    pose = messages.pose_of(numbers.tip.position, numbers.tip.orientation)
    response.tip = PoseStamped(header=header, pose=pose)
    response.backbone = messages.backbone_of(numbers.backbone, header)
    response.backbone_s = numbers.backbone.s.tolist()
    for name, value in (numbers.arrays | numbers.scalars).items():
        setattr(response, name, value)
