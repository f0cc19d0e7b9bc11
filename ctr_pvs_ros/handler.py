"""Commands and loads in, equilibria out, and a status for each: what the node does with what it hears."""

from __future__ import annotations

import time
from collections.abc import Callable
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numpy as np
from builtin_interfaces.msg import Time
from geometry_msgs.msg import PoseStamped
from geometry_msgs.msg import WrenchStamped
from numpy.typing import NDArray
from rclpy.node import Node
from sensor_msgs.msg import JointState

from ctr_pvs import Loads
from ctr_pvs import Robot
from ctr_pvs_interfaces.msg import EquilibriumStatus
from ctr_pvs_ros.inputs.commands import Command
from ctr_pvs_ros.inputs.commands import CommandReader
from ctr_pvs_ros.inputs.commands import Leniency
from ctr_pvs_ros.inputs.commands import RejectedCommand
from ctr_pvs_ros.inputs.external_load import ExternalLoad
from ctr_pvs_ros.inputs.poses import PoseReason
from ctr_pvs_ros.inputs.poses import RejectedPose
from ctr_pvs_ros.inputs.poses import TipGoal
from ctr_pvs_ros.inputs.poses import read_pose
from ctr_pvs_ros.inputs.wrenches import RejectedWrench
from ctr_pvs_ros.inputs.wrenches import WrenchReader
from ctr_pvs_ros.outputs import messages
from ctr_pvs_ros.outputs import outcomes
from ctr_pvs_ros.outputs.diagnostics import Report
from ctr_pvs_ros.outputs.outputs import Sent
from ctr_pvs_ros.outputs.publishers import Publishers
from ctr_pvs_ros.outputs.serialized import stamp_bytes
from ctr_pvs_ros.parameters import Settings
from ctr_pvs_ros.stream import Policy
from ctr_pvs_ros.stream import Stream
from ctr_pvs_ros.stream import Tried
from ctr_pvs_ros.tip_servo import TipServo

if TYPE_CHECKING:
    from ctr_pvs import Equilibrium
    from ctr_pvs import EquilibriumSolver

NAN = float("nan")
LOG_PERIOD = 2.0  # s; at most one line of a kind in this time
COMMAND, WRENCH, POSE = EquilibriumStatus.COMMAND, EquilibriumStatus.WRENCH, EquilibriumStatus.POSE
#: The ways of poses never snap: who asks for a place of the tip asks for no leap.
HOLD = "hold"
LEAST_BUDGET = 1e-4  # s; a try that comes too late still ends as one that is out of time

Array = NDArray[np.float64]
Attempt = Callable[[Callable[[Array, Array], Tried]], Tried]


class Handler:
    """Answers commands and wrenches one by one.

    Args:
        node: for its clock and its log.
        reader, settings: see the attributes.
        solver: of the stream, and of nothing else.
        outputs: where answers and statuses go.

    Attributes:
        reader, settings: may be replaced between commands.
        report: the account of what came.
        interrupted: set where a signal asks the node to end.
        solving: whether a solve is under way.
    """

    def __init__(
        self, node: Node, reader: CommandReader, settings: Settings, solver: EquilibriumSolver, outputs: Publishers
    ) -> None:
        self.reader, self.settings = reader, settings
        self.interrupted = self.solving = False
        self._clock, self._log = node.get_clock(), node.get_logger()
        self._stream = Stream(solver)
        self._wrench_reader = WrenchReader(settings.frame_id, settings.tip_frame_id)
        self._load: ExternalLoad[Time] = ExternalLoad()
        self._outputs = outputs
        self._tip_servo: tuple[tuple[Robot, float, float], TipServo] | None = None
        self.report = Report(self._load if settings.use_external_wrench else None)

    @property
    def last_answer(self) -> Equilibrium | None:
        """The last one that went out."""
        return self._stream.answer

    def release(self) -> None:
        """Accept commands again after a snap under on_snap = stop."""
        self._stream.release()

    def answer(self, command: JointState | PoseStamped | None, wrench: WrenchStamped | None) -> None:
        """Solve once for all that came. The answer has the command's stamp; the wrench's, where it alone is good."""
        if wrench is not None:
            self._on_wrench(wrench)
        if isinstance(command, PoseStamped):
            self._on_pose(command)
        elif command is not None:
            self._on_command(command)
        load, last = self._load, self._stream.last
        # A load is kept for the command to come while there is no answer yet, or commands are refused after a snap.
        if load.unanswered is not None and last is not None and not self._stream.stopped:
            self._solve(lambda try_out: try_out(last.alpha, last.D), load.unanswered, WRENCH)

    def start_with(self, command: Command) -> None:
        """Answer a command that no message brought."""
        self._follow(command, self._clock.now().to_msg())

    def _on_wrench(self, message: WrenchStamped) -> None:
        stamp, _ = self._stamp_for(message.header.stamp)
        try:
            wrench = self._wrench_reader.read(message.header.frame_id, *messages.vectors_of(message.wrench))
        except RejectedWrench as rejection:
            self._load.rejected(rejection)
            self._outputs.tell(outcomes.refused(stamp, WRENCH, rejection))
            self._log.warning(
                f"wrench rejected: {rejection.reason.value}: {rejection}; the last load is held",
                throttle_duration_sec=LOG_PERIOD,
            )
        else:
            self._load.accept(wrench, stamp, self._stream.orientation)

    def _on_command(self, message: JointState) -> None:
        settings = self.settings
        leniency = Leniency(
            settings.merge_partial,
            settings.clamp_to_limits,
            settings.accept_nameless,
            settings.ignore_unknown_joints,
            settings.unwrap_rotations,
        )
        if self.reader.is_for_others(message.name, leniency):
            self.report.for_others()
            return
        stamp, age = self._stamp_for(message.header.stamp)
        self.report.received(age)
        try:
            self._follow(self.reader.read(message.name, message.position, leniency, self._stream.last), stamp)
        except RejectedCommand as rejection:
            self._refuse(stamp, COMMAND, rejection)

    def _on_pose(self, message: PoseStamped) -> None:
        """One step of the tip towards a pose, set out from the last answer."""
        stamp, age = self._stamp_for(message.header.stamp)
        self.report.received(age)
        settings, last = self.settings, self.last_answer
        try:
            numbers = messages.numbers_of(message.pose)
            goal = read_pose(message.header.frame_id, *numbers, settings.frame_id, settings.servo_cp_goal)
            if last is None:
                raise RejectedPose(PoseReason.NO_START, "the tip is nowhere yet: expected a command on servo_jp first")
            command = self._solve(lambda try_out: self._servo().step(last, goal, try_out), stamp, POSE, goal=goal)
        except (RejectedCommand, RejectedPose) as rejection:
            self._refuse(stamp, POSE, rejection)
        else:
            self.report.accepted(command)

    def _servo(self) -> TipServo:
        """For the limits and rates that hold."""
        of = (self.reader.robot, self.settings.rotation_rate, self.settings.translation_rate)
        if self._tip_servo is None or self._tip_servo[0] != of:
            self._tip_servo = of, TipServo(*of)
        return self._tip_servo[1]

    def _refuse(self, stamp: Time, trigger: int, rejection: RejectedCommand | RejectedPose) -> None:
        self.report.rejected(rejection)
        self._outputs.tell(outcomes.refused(stamp, trigger, rejection))
        kind = "pose" if trigger == POSE else "command"
        self._log.warning(f"{kind} rejected: {rejection.reason.value}: {rejection}", throttle_duration_sec=LOG_PERIOD)

    def _stamp_for(self, stamp: Time) -> tuple[Time, float | None]:
        """The stamp of all that answers a message, and the message's age at receipt [s]; None: it had a zero stamp."""
        now = self._clock.now()
        sent = stamp.sec * 1_000_000_000 + stamp.nanosec
        if sent == 0:
            return now.to_msg(), None
        return stamp, (now.nanoseconds - sent) * 1e-9

    def _follow(self, command: Command, stamp: Time) -> None:
        """Answer a new command."""
        hint = "; ".join(command.notes + command.hints)
        self._solve(lambda try_out: try_out(command.alpha, command.D), stamp, COMMAND, hint)
        self.report.accepted(command)
        if hint:
            self._log.warning(f"command accepted, but {hint}", throttle_duration_sec=LOG_PERIOD)

    def _solve(
        self, attempt: Attempt, stamp: Time, trigger: int, hint: str = "", goal: TipGoal | None = None
    ) -> Command:
        """Solve under the load that acts, and let the answer go where it may; returns the command that was solved for.

        A wrench that waits is answered along. All tries of an attempt share one budget.
        """
        settings, loads = self.settings, self._load.loads
        if self._load.unanswered is not None:
            trigger |= WRENCH
        on_snap = HOLD if goal is not None and settings.on_snap == "follow" else settings.on_snap
        policy = Policy(on_snap, settings.margin_warn, settings.margin_stop)
        with self._failures_told(stamp, trigger):
            tried = self._interruptible(attempt, loads)
            answer = self._stream.settle(tried, policy)
            self._load.solved(self._stream.orientation)
            if answer.verdict.publish:
                stamped = stamp_bytes(stamp.sec, stamp.nanosec)
                self._outputs.publish(Sent(answer.equilibrium, stamped, settings.backbone_poses))
        off = NAN if goal is None or not answer.equilibrium.success else goal.distance(answer.equilibrium)
        self._outputs.tell(outcomes.solved(stamp, trigger, answer, loads, hint, off))
        self.report.answered(answer)
        if not answer.verdict.publish:
            self._log.error(answer.verdict.remark, throttle_duration_sec=LOG_PERIOD)
        elif answer.verdict.remark:
            self._log.warning(answer.verdict.remark, throttle_duration_sec=LOG_PERIOD)
        return tried.command

    def _interruptible(self, attempt: Attempt, loads: Loads | None) -> Tried:
        deadline = time.monotonic() + self.settings.compute_budget

        def try_out(alpha: Array, D: Array) -> Tried:
            return self._stream.try_out(Command(alpha, D), max(deadline - time.monotonic(), LEAST_BUDGET), loads)

        self.solving = True
        try:
            if self.interrupted:  # the signal came before there was a solve for it to end
                raise KeyboardInterrupt
            return attempt(try_out)
        finally:
            self.solving = False

    @contextmanager
    def _failures_told(self, stamp: Time, trigger: int) -> Iterator[None]:
        """A fault of the node itself is told of as the outcome, and goes on to who logs it."""
        try:
            yield
        except (RejectedCommand, RejectedPose):
            raise
        except Exception as error:
            self._outputs.tell(outcomes.broken(stamp, trigger, f"{type(error).__name__}: {error}"))
            raise
