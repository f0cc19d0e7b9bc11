"""The service ~/solve: one equilibrium on request."""

from __future__ import annotations

import time
from functools import partial
from typing import Any

from geometry_msgs.msg import PoseStamped
from std_msgs.msg import Header

from ctr_pvs_interfaces.srv import SolveEquilibrium
from ctr_pvs_ros.inputs.commands import CommandReader
from ctr_pvs_ros.inputs.joints import Joints
from ctr_pvs_ros.outputs import messages
from ctr_pvs_ros.parameters import MAX_BACKBONE_POSES
from ctr_pvs_ros.service.jobs import Numbers
from ctr_pvs_ros.service.jobs import Solved
from ctr_pvs_ros.service.jobs import SolveJob
from ctr_pvs_ros.service.request_service import BadRequest
from ctr_pvs_ros.service.request_service import Fill
from ctr_pvs_ros.service.request_service import RequestService
from ctr_pvs_ros.service.request_service import command_of
from ctr_pvs_ros.service.request_service import loads_of
from ctr_pvs_ros.service.request_service import no_pose


class SolveService(RequestService):
    """Answers SolveEquilibrium requests."""

    TYPE, NAME = SolveEquilibrium, "~/solve"

    def _begin(self, request: SolveEquilibrium.Request) -> tuple[SolveEquilibrium.Response, Fill]:
        header = messages.receipt_header(request.joints.header, self._clock, self.settings.frame_id)
        response = nothing(header)
        return response, partial(filled, response, joints=self.reader.joints, header=header)

    def _job(self, request: SolveEquilibrium.Request) -> SolveJob:
        return job_of(request, self.reader, self.settings.backbone_poses, self.settings.compute_budget)


def job_of(request: SolveEquilibrium.Request, reader: CommandReader, default_poses: int, budget: float) -> SolveJob:
    """What a request asks for, within `budget` [s] from now; raises BadRequest."""
    poses = request.backbone_poses or default_poses
    command, loads = command_of(request.joints, reader), loads_of(request.tip_wrench)
    if not 2 <= poses <= MAX_BACKBONE_POSES:
        raise BadRequest(f"backbone_poses: expected 0 or 2 to {MAX_BACKBONE_POSES}, got {poses}")
    start = "warm" if request.warm_start else "cold"
    deadline = time.monotonic() + budget
    return SolveJob(alpha=command.alpha, D=command.D, loads=loads, start=start, poses=poses, deadline=deadline)


def nothing(header: Header) -> SolveEquilibrium.Response:
    """No number that could be taken for an answer."""
    nan = float("nan")
    response = SolveEquilibrium.Response(tip=no_pose(header))
    response.backbone.header = header
    response.stability_margin = nan
    response.error_estimate = nan
    response.residual = nan
    response.energy = nan
    return response


def filled(
    response: SolveEquilibrium.Response, solved: Solved, joints: Joints, header: Header
) -> SolveEquilibrium.Response:
    """A response that said nothing yet, with what came of its job."""
    response.status, response.message, response.solve_time = solved.status, solved.message, solved.time
    if solved.numbers is not None:
        response.success = True
        _fill_answer(response, solved.numbers, joints, header)
    return response


def _fill_answer(response: SolveEquilibrium.Response, numbers: Numbers, joints: Joints, header: Header) -> None:
    pose = messages.pose_of(numbers.tip.position, numbers.tip.orientation)
    response.tip = PoseStamped(header=header, pose=pose)
    response.backbone = messages.backbone_of(numbers.backbone, header)
    response.backbone_s = numbers.backbone.s.tolist()
    for name, value in (_along_joints(numbers.arrays, joints) | numbers.scalars).items():
        setattr(response, name, value)


def _along_joints(arrays: dict[str, Any], joints: Joints) -> dict[str, Any]:
    """As lists, with forces as the translations count them: the lower end along D is the upper one against it."""
    if joints.translation_sign < 0:
        lower, upper = -arrays["force_upper"], -arrays["force_lower"]
        arrays = arrays | {"force": -arrays["force"], "force_lower": lower, "force_upper": upper}
    return {name: array.tolist() for name, array in arrays.items()}
