"""The service ~/solve: one equilibrium on request, with a solver of its own in a process of its own.

A request is read and checked in the node; its response is sent when the solver's process has answered, or is late, or
has died.
"""

from __future__ import annotations

import time
from typing import Any

from geometry_msgs.msg import PoseStamped
from rclpy.node import Node
from std_msgs.msg import Header

from ctr_pvs import Loads
from ctr_pvs_interfaces.srv import SolveEquilibrium
from ctr_pvs_ros.inputs.commands import CommandReader
from ctr_pvs_ros.inputs.commands import RejectedCommand
from ctr_pvs_ros.inputs.joints import Joints
from ctr_pvs_ros.inputs.wrenches import RejectedWrench
from ctr_pvs_ros.inputs.wrenches import check_wrench
from ctr_pvs_ros.outputs import messages
from ctr_pvs_ros.parameters import MAX_BACKBONE_POSES
from ctr_pvs_ros.parameters import Settings
from ctr_pvs_ros.service.jobs import BAD_INPUT
from ctr_pvs_ros.service.jobs import Job
from ctr_pvs_ros.service.jobs import Numbers
from ctr_pvs_ros.service.jobs import Solved
from ctr_pvs_ros.service.service_process import ServiceProcess
from ctr_pvs_ros.service.service_thread import Respond
from ctr_pvs_ros.service.service_thread import ServiceThread

LOG_PERIOD = 2.0  # s


class SolveService:
    """Answers SolveEquilibrium requests.

    Args:
        node: whose service it is.
        process: that solves.
        reader, settings: see the attributes.

    Attributes:
        reader, settings: may be replaced between requests.
    """

    def __init__(self, node: Node, process: ServiceProcess, reader: CommandReader, settings: Settings) -> None:
        self.reader, self.settings = reader, settings
        self._clock, self._log = node.get_clock(), node.get_logger()
        self._process = process
        self._node = node
        self._thread: ServiceThread | None = None

    def open_when_ready(self) -> None:
        """To be called now and then: the service is there once its requests will be answered."""
        if self._thread is None and self._process.ready:
            self._thread = ServiceThread(self._node, SolveEquilibrium, "~/solve", self._on_request, self._on_fault)

    def stop(self) -> None:
        """Answer no more."""
        if self._thread is not None:
            self._thread.stop()

    def _on_request(self, request: SolveEquilibrium.Request, respond: Respond) -> None:
        joints, settings, response = self.reader.joints, self.settings, SolveEquilibrium.Response()
        header = messages.receipt_header(request.joints.header, self._clock, settings.frame_id)
        fill_failure(response, header)
        try:
            job = job_of(request, self.reader, settings.backbone_poses, settings.compute_budget)
        except BadRequest as error:
            response.status, response.message = BAD_INPUT, str(error)
            respond(lambda: response)
        else:
            self._process.ask(job, lambda solved: respond(lambda: filled(response, solved, joints, header)))

    def _on_fault(self, error: Exception) -> None:
        text = f"internal error, please report it: a request was not answered: {type(error).__name__}: {error}"
        self._log.error(text, throttle_duration_sec=LOG_PERIOD)


class BadRequest(ValueError):
    """A request that breaks a rule. The message is one line."""


def job_of(request: SolveEquilibrium.Request, reader: CommandReader, default_poses: int, budget: float) -> Job:
    """What a request asks for, within `budget` [s] from now; raises BadRequest."""
    poses = request.backbone_poses or default_poses
    force, moment = messages.vectors_of(request.tip_wrench)
    try:
        command = reader.read(request.joints.name, request.joints.position)
        check_wrench(force, moment)
    except RejectedCommand as rejection:
        raise BadRequest(f"{rejection.reason.value}: {rejection}") from rejection
    except RejectedWrench as rejection:
        raise BadRequest(f"{rejection.reason.value}: tip_wrench.{rejection}") from rejection
    if not 2 <= poses <= MAX_BACKBONE_POSES:
        raise BadRequest(f"backbone_poses: expected 0 or 2 to {MAX_BACKBONE_POSES}, got {poses}")
    start = "warm" if request.warm_start else "cold"
    return Job(0, command.alpha, command.D, Loads(force, moment), start, poses, time.monotonic() + budget)


def fill_failure(response: SolveEquilibrium.Response, header: Header) -> None:
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
