"""A service whose requests are done as jobs in another process.

A request is read and checked in the node; its response is sent when the other process has answered, or is late, or has
died.
"""

from __future__ import annotations

from abc import ABC
from abc import abstractmethod
from collections.abc import Callable
from typing import Any
from typing import ClassVar

from geometry_msgs.msg import PoseStamped
from rclpy.node import Node
from std_msgs.msg import Header

from ctr_pvs.robot.loads import Loads
from ctr_pvs_ros.inputs.commands import Command
from ctr_pvs_ros.inputs.commands import CommandReader
from ctr_pvs_ros.inputs.commands import RejectedCommand
from ctr_pvs_ros.inputs.wrenches import RejectedWrench
from ctr_pvs_ros.inputs.wrenches import check_wrench
from ctr_pvs_ros.outputs import messages
from ctr_pvs_ros.parameters import Settings
from ctr_pvs_ros.service.jobs import BAD_INPUT
from ctr_pvs_ros.service.jobs import Job
from ctr_pvs_ros.service.jobs import Solved
from ctr_pvs_ros.service.service_process import ServiceProcess
from ctr_pvs_ros.service.service_thread import Respond
from ctr_pvs_ros.service.service_thread import ServiceThread

LOG_PERIOD = 2.0  # s

Fill = Callable[[Solved], Any]


class RequestService(ABC):
    """Answers requests.

    Args:
        node: whose service it is.
        process: that does the jobs.
        reader, settings: see the attributes.

    Attributes:
        reader, settings: may be replaced between requests.
    """

    #: Of the service.
    TYPE: ClassVar[Any]
    NAME: ClassVar[str]

    def __init__(self, node: Node, process: ServiceProcess, reader: CommandReader, settings: Settings) -> None:
        self.reader, self.settings = reader, settings
        self._clock, self._log = node.get_clock(), node.get_logger()
        self._process = process
        self._node = node
        self._thread: ServiceThread | None = None

    def open_when_ready(self) -> None:
        """To be called now and then: the service is there once its requests will be answered."""
        if self._thread is None and self._process.ready:
            self._thread = ServiceThread(self._node, self.TYPE, self.NAME, self._on_request, self._on_fault)

    def stop(self) -> None:
        """Answer no more."""
        if self._thread is not None:
            self._thread.stop()

    @abstractmethod
    def _begin(self, request: Any) -> tuple[Any, Fill]:
        """A response without a number that could be taken for an answer, and what makes it tell what came of the
        job."""

    @abstractmethod
    def _job(self, request: Any) -> Job:
        """What a request asks for; raises BadRequest."""

    def _on_request(self, request: Any, respond: Respond) -> None:
        response, filled = self._begin(request)
        try:
            job = self._job(request)
        except BadRequest as error:
            response.status, response.message = BAD_INPUT, str(error)
            respond(lambda: response)
        else:
            self._process.ask(job, lambda solved: respond(lambda: filled(solved)))

    def _on_fault(self, error: Exception) -> None:
        text = f"internal error, please report it: a request was not answered: {type(error).__name__}: {error}"
        self._log.error(text, throttle_duration_sec=LOG_PERIOD)


class BadRequest(ValueError):
    """A request that breaks a rule. The message is one line."""


def command_of(joints: Any, reader: CommandReader) -> Command:
    """The command of a JointState; raises BadRequest."""
    try:
        return reader.read(joints.name, joints.position)
    except RejectedCommand as rejection:
        raise BadRequest(f"{rejection.reason.value}: {rejection}") from rejection


def loads_of(tip_wrench: Any) -> Loads:
    """What acts on the tip; raises BadRequest."""
    force, moment = messages.vectors_of(tip_wrench)
    try:
        check_wrench(force, moment)
    except RejectedWrench as rejection:
        raise BadRequest(f"{rejection.reason.value}: tip_wrench.{rejection}") from rejection
    return Loads(force, moment)


def no_pose(header: Header) -> PoseStamped:
    """NaN."""
    nothing = PoseStamped(header=header)
    for part, names in ((nothing.pose.position, "xyz"), (nothing.pose.orientation, "xyzw")):
        for name in names:
            setattr(part, name, float("nan"))
    return nothing
