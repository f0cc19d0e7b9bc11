"""The service ~/solve: one equilibrium on request, with a solver of its own."""

from __future__ import annotations

import time

from geometry_msgs.msg import PoseStamped
from std_msgs.msg import Header

from ctr_pvs import Equilibrium
from ctr_pvs import EquilibriumSolver
from ctr_pvs import Status
from ctr_pvs_interfaces.srv import SolveEquilibrium
from ctr_pvs_ros import messages
from ctr_pvs_ros.commands import Command
from ctr_pvs_ros.commands import CommandReader
from ctr_pvs_ros.commands import RejectedCommand
from ctr_pvs_ros.parameters import MAX_BACKBONE_POSES
from ctr_pvs_ros.turns import Late
from ctr_pvs_ros.turns import Turns

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
        except RejectedCommand as rejection:
            return _failed(response, BAD_INPUT, f"{rejection.reason.value}: {rejection}")
        if not 2 <= poses <= MAX_BACKBONE_POSES:
            rule = f"backbone_poses: expected 0 or 2 to {MAX_BACKBONE_POSES}, got {poses}"
            return _failed(response, BAD_INPUT, rule)
        start = "warm" if request.warm_start else "cold"
        try:
            solved = self._turns.take(lambda left: self._solve(command, start, left), budget)
        except Late as late:
            return _failed(response, Status.TIMEOUT.value, str(late))
        except Exception as error:  # whatever went wrong, the client gets an answer
            return _failed(response, Status.NOT_CONVERGED.value, f"internal error: {type(error).__name__}: {error}")
        equilibrium, response.solve_time = solved
        response.success = equilibrium.success
        response.status = equilibrium.status.value
        response.message = equilibrium.message
        if equilibrium.success:
            _fill_answer(response, equilibrium, header, poses)
        return response

    def _solve(self, command: Command, start: str, budget: float) -> tuple[Equilibrium, float]:
        """The equilibrium, and the wall-clock time it took [s]."""
        began = time.perf_counter()
        equilibrium = self._solver.solve(command.alpha, command.D, start=start, budget=budget)
        return equilibrium, time.perf_counter() - began


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


def _fill_answer(response: SolveEquilibrium.Response, equilibrium: Equilibrium, header: Header, poses: int) -> None:
    backbone = equilibrium.backbone(poses)
    response.tip = messages.tip_of(equilibrium, header)
    response.backbone = messages.backbone_of(backbone, header)
    response.backbone_s = backbone.s.tolist()
    response.torque = equilibrium.torque.tolist()
    response.force = equilibrium.force.tolist()
    response.force_lower = equilibrium.force_interval[:, 0].tolist()
    response.force_upper = equilibrium.force_interval[:, 1].tolist()
    response.stability_margin = float(equilibrium.stability_margin)
    response.fidelity = equilibrium.fidelity
    response.degrees_of_freedom = int(equilibrium.degrees_of_freedom)
    response.error_estimate = float(equilibrium.error_estimate)
    response.residual = float(equilibrium.residual)
    response.iterations = int(equilibrium.iterations)
    response.energy = float(equilibrium.energy)
