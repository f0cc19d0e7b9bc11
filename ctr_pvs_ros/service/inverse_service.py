"""The service ~/inverse: inverse kinematics on request."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

from geometry_msgs.msg import PoseStamped
from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import Header

from ctr_pvs_interfaces.msg import InverseSolution
from ctr_pvs_interfaces.srv import SolveInverse
from ctr_pvs_ros.inputs.commands import CommandReader
from ctr_pvs_ros.inputs.joints import Joints
from ctr_pvs_ros.inputs.poses import GOALS
from ctr_pvs_ros.inputs.poses import RejectedPose
from ctr_pvs_ros.inputs.poses import TipGoal
from ctr_pvs_ros.inputs.poses import read_pose
from ctr_pvs_ros.outputs import messages
from ctr_pvs_ros.parameters import Settings
from ctr_pvs_ros.service.inverse_jobs import InverseJob
from ctr_pvs_ros.service.inverse_jobs import Solution
from ctr_pvs_ros.service.jobs import Solved
from ctr_pvs_ros.service.request_service import BadRequest
from ctr_pvs_ros.service.request_service import Fill
from ctr_pvs_ros.service.request_service import RequestService
from ctr_pvs_ros.service.request_service import command_of
from ctr_pvs_ros.service.request_service import loads_of
from ctr_pvs_ros.service.request_service import no_pose
from ctr_pvs_ros.service.service_process import ServiceProcess

if TYPE_CHECKING:
    from ctr_pvs import Equilibrium

REACHED = "reached"
LONGEST = 60.0  # s, as of compute_budget


class InverseService(RequestService):
    """Answers SolveInverse requests.

    Args:
        node, process, reader, settings: see RequestService.
        last_answer: of the stream, where searches begin that name no start.
    """

    TYPE, NAME = SolveInverse, "~/inverse"

    def __init__(
        self,
        node: Node,
        process: ServiceProcess,
        reader: CommandReader,
        settings: Settings,
        last_answer: Callable[[], Equilibrium | None],
    ) -> None:
        super().__init__(node, process, reader, settings)
        self._last_answer = last_answer

    def _begin(self, request: SolveInverse.Request) -> tuple[SolveInverse.Response, Fill]:
        header = messages.receipt_header(request.target.header, self._clock, self.settings.frame_id)
        response = SolveInverse.Response(solution=no_solution(header))
        return response, partial(filled, response, joints=self.reader.joints, header=header)

    def _job(self, request: SolveInverse.Request) -> InverseJob:
        return job_of(request, self.reader, self.settings, self._last_answer())


def job_of(
    request: SolveInverse.Request, reader: CommandReader, settings: Settings, here: Equilibrium | None
) -> InverseJob:
    """What a request asks for, within its time from now, from `here` where it says no other place; raises
    BadRequest."""
    named = request.start.name or request.start.position
    return InverseJob(
        goal=_goal_of(request, settings.frame_id),
        start=command_of(request.start, reader) if named else here,
        loads=loads_of(request.tip_wrench),
        limits=reader.robot.limits,
        within=_positive("within", request.within),
        within_angle=_positive("within_angle", request.within_angle),
        margin_floor=_checked("margin_floor", request.margin_floor, "0 to below 1", 0.0 <= request.margin_floor < 1.0),
        every=request.all,
        deadline=time.monotonic() + _time_of(request, settings.compute_budget),
    )


def _goal_of(request: SolveInverse.Request, frame_id: str) -> TipGoal:
    if request.goal not in GOALS:
        raise BadRequest(f"goal: expected one of {', '.join(GOALS)}, got {request.goal[:40]!r}")
    numbers = messages.numbers_of(request.target.pose)
    try:
        return read_pose(request.target.header.frame_id, *numbers, frame_id, request.goal)
    except RejectedPose as rejection:
        raise BadRequest(f"{rejection.reason.value}: target.{rejection}") from rejection


def _time_of(request: SolveInverse.Request, default: float) -> float:
    limit = request.time_limit
    return _checked("time_limit", limit, f"0 to {LONGEST:g} s", 0.0 <= limit <= LONGEST) or default


def _positive(name: str, value: float) -> float:
    return _checked(name, value, "a number above 0", 0.0 < value < math.inf)


def _checked(name: str, value: float, rule: str, good: bool) -> float:
    if not good:
        raise BadRequest(f"{name}: expected {rule}, got {value:g}")
    return value


def no_solution(header: Header) -> InverseSolution:
    """No number that could be taken for one."""
    nan = math.nan
    return InverseSolution(
        command=JointState(header=header), tip=no_pose(header), distance=nan, angle=nan, stability_margin=nan
    )


def filled(response: SolveInverse.Response, solved: Solved, joints: Joints, header: Header) -> SolveInverse.Response:
    """A response that said nothing yet, with what came of its job."""
    response.status, response.message, response.solve_time = solved.status, solved.message, solved.time
    response.success = solved.status == REACHED
    if solved.numbers is not None:
        response.iterations = solved.numbers.iterations
        response.solution, *response.others = (
            _solution_of(solution, joints, header) for solution in solved.numbers.solutions
        )
    return response


def _solution_of(solution: Solution, joints: Joints, header: Header) -> InverseSolution:
    count = len(solution.alpha)
    return InverseSolution(
        command=JointState(
            header=header,
            name=list(joints.names),
            position=joints.in_turn(solution.alpha, solution.D),
            effort=joints.in_turn(solution.torque, solution.force),
        ),
        tip=PoseStamped(header=header, pose=messages.pose_of(solution.tip.position, solution.tip.orientation)),
        distance=solution.distance,
        angle=solution.angle,
        stability_margin=solution.stability_margin,
        way=[value for step in solution.way for value in joints.in_turn(step[:count], step[count:])],
        way_stability_margin=solution.way_stability_margin.tolist(),
    )
