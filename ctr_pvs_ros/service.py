"""The service ~/solve: one equilibrium on request, with a solver of its own."""

from __future__ import annotations

import time

from geometry_msgs.msg import PoseStamped
from std_msgs.msg import Header

from ctr_pvs import Equilibrium
from ctr_pvs import EquilibriumSolver
from ctr_pvs_interfaces.srv import SolveEquilibrium
from ctr_pvs_ros import messages
from ctr_pvs_ros.commands import CommandReader
from ctr_pvs_ros.commands import RejectedCommand
from ctr_pvs_ros.parameters import MAX_BACKBONE_POSES

BAD_INPUT = "bad_input"


class SolveService:
    """Answers SolveEquilibrium requests; `solver` must not be shared with the command stream."""

    def __init__(self, reader: CommandReader, solver: EquilibriumSolver) -> None:
        self._reader = reader
        self._solver = solver

    def answer(
        self,
        request: SolveEquilibrium.Request,
        response: SolveEquilibrium.Response,
        header: Header,
        default_poses: int,
        budget: float,
    ) -> SolveEquilibrium.Response:
        """Fill the response; the solve takes at most `budget` [s]. Never raises for bad input."""
        _fill_failure(response, header)
        poses = request.backbone_poses or default_poses
        try:
            command = self._reader.read(request.joints.name, request.joints.position)
        except RejectedCommand as rejection:
            return _refused(response, f"{rejection.reason.value}: {rejection}")
        if not 2 <= poses <= MAX_BACKBONE_POSES:
            return _refused(response, f"backbone_poses: expected 0 or 2 to {MAX_BACKBONE_POSES}, got {poses}")
        began = time.perf_counter()
        equilibrium = self._solver.solve(
            command.alpha, command.D, start="warm" if request.warm_start else "cold", budget=budget
        )
        response.solve_time = time.perf_counter() - began
        response.success = equilibrium.success
        response.status = equilibrium.status.value
        response.message = equilibrium.message
        if equilibrium.success:
            _fill_answer(response, equilibrium, header, poses)
        return response


def _refused(response: SolveEquilibrium.Response, message: str) -> SolveEquilibrium.Response:
    response.status = BAD_INPUT
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
