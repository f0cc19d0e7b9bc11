"""The node ctr_equilibrium: commands and loads in, equilibria out; a service beside it.

What solves is imported when the first solver is made, after the robot file and the commands in parameters have been
found right: it brings the compiler along, which takes longer than all the rest of a start.
"""

from __future__ import annotations

import threading
import time
import traceback
from collections.abc import Callable
from typing import TYPE_CHECKING
from typing import Any

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import WrenchStamped
from rcl_interfaces.msg import SetParametersResult
from rclpy.clock import Clock
from rclpy.clock import ClockType
from rclpy.node import Node
from rclpy.parameter import Parameter
from sensor_msgs.msg import JointState
from std_msgs.msg import Header

import ctr_pvs
from ctr_pvs import load_robot
from ctr_pvs_ros import messages
from ctr_pvs_ros import parameters
from ctr_pvs_ros.commands import Command
from ctr_pvs_ros.commands import CommandReader
from ctr_pvs_ros.commands import Leniency
from ctr_pvs_ros.commands import RejectedCommand
from ctr_pvs_ros.commands import narrowed
from ctr_pvs_ros.external_load import ExternalLoad
from ctr_pvs_ros.inputs import Inputs
from ctr_pvs_ros.outputs import Sent
from ctr_pvs_ros.parameters import ParameterError
from ctr_pvs_ros.parameters import Settings
from ctr_pvs_ros.publishers import Publishers
from ctr_pvs_ros.report import Report
from ctr_pvs_ros.serialized import stamp_bytes
from ctr_pvs_ros.service_process import ServiceProcess
from ctr_pvs_ros.stream import Policy
from ctr_pvs_ros.stream import Stream
from ctr_pvs_ros.wrenches import RejectedWrench
from ctr_pvs_ros.wrenches import WrenchReader

if TYPE_CHECKING:
    from ctr_pvs import EquilibriumSolver
    from ctr_pvs.kernel.compiler import Background

NODE_NAME = "ctr_equilibrium"
LOG_PERIOD = 2.0  # s; at most one line of a kind in this time
CATCH_UP_PERIOD = 0.05  # s; late joiners wait no longer, and markers move no faster
LOADING_TIME = 1.0  # s; kernels that are being loaded when the node ends are waited for so long


class EquilibriumNode(Node):
    """Serves the equilibria of one robot.

    Args:
        options: of rclpy's Node.

    Attributes:
        interrupted: whether a signal asks it to end; who spins it should stop.
        solving: whether a solve of the stream is under way.
        compiling: the process that compiles the kernels, if that is still to be done.

    Raises:
        ParameterException, RuntimeError, ValueError: its parameters, its middleware or its robot file do not allow it;
            the message is one line.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__(NODE_NAME, **options)
        self.interrupted = self.solving = False
        parameters.declare(self)
        self._settings = parameters.read(self)
        self._robot = load_robot(self._settings.robot_file)
        self._reader = self._new_reader(self._settings)
        initial = self._initial_command()
        self._stream = Stream(self._new_solver())
        self._wrench_reader = WrenchReader(self._settings.frame_id, self._settings.tip_frame_id)
        self._load: ExternalLoad[Time] = ExternalLoad()
        self._report = Report(self._load if self._settings.use_external_wrench else None)

        self._outputs = Publishers(self, self._robot, self._settings)
        self._diagnostics = self.create_publisher(DiagnosticArray, "/diagnostics", 1)
        self._service = ServiceProcess(self, self._settings)
        if initial is not None:
            self._guarded(self._follow)(initial, self.get_clock().now().to_msg())
        self._inputs = Inputs(self, self._on_messages, self._guarded, self._settings.use_external_wrench)
        # Both go on while simulated time stands still.
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._diagnostics_due: float | None = None  # since when, on a steady clock [s]
        self.create_timer(CATCH_UP_PERIOD, self._guarded(self._catch_up), clock=steady)
        self.create_timer(1.0, self._guarded(self._look_round), clock=steady)
        self.add_on_set_parameters_callback(self._on_set_parameters)
        self.add_post_set_parameters_callback(self._after_set_parameters)
        self.compiling = self._compile()
        self.get_logger().info(f"serving robot {self._robot.name!r} from {self._settings.robot_file}")

    def destroy_node(self) -> None:
        """Also takes the markers away, and ends the processes of the service and the compiler."""
        stopping = threading.Thread(target=self.compiling.stop)  # which takes its time, as do the others
        stopping.start()
        self._outputs.clear()
        self._service.stop()
        stopping.join()
        self.compiling.wait(LOADING_TIME)
        super().destroy_node()

    def _compile(self) -> Background:
        """See to it that the kernels run compiled, now or later; say so if it is later, or never."""
        from ctr_pvs.kernel import compiler

        compiling = compiler.compile_in_background(self._on_compiled)
        if compiler.mode() == "interpreted":
            meanwhile = " (under way, beside the node)" if compiling.running else ""
            self.get_logger().warning(f"{compiler.why()}{meanwhile}")
        return compiling

    def _on_compiled(self, outcome: str) -> None:
        """In a thread of its own, once it is known whether kernels run compiled from now on."""
        self._service.update(self._settings)  # which is when the service's process looks for them, too
        self.get_logger().info(outcome)

    def _new_solver(self) -> EquilibriumSolver:
        settings = self._settings
        return ctr_pvs.EquilibriumSolver(
            self._robot, tolerance=settings.tolerance, fidelity=settings.fidelity, force_model=settings.force_model
        )

    def _new_reader(self, settings: Settings) -> CommandReader:
        try:
            return CommandReader(narrowed(self._robot, settings.rotation_limits, settings.translation_limits))
        except ValueError as error:
            raise ParameterError(f"parameters rotation_limits, translation_limits: {error}") from error

    def _initial_command(self) -> Command | None:
        values = self._settings.initial_command
        if not values:
            return None
        count = len(self._robot.tubes)
        if len(values) != 2 * count:
            rule = f"{count} rotations and {count} translations"
            raise ParameterError(f"parameter initial_command: expected {rule}, got {len(values)} numbers")
        try:
            return self._reader.check(values[:count], values[count:])
        except RejectedCommand as error:
            raise ParameterError(f"parameter initial_command: {error}") from error

    def _guarded(self, callback: Callable[..., None]) -> Callable[..., None]:
        """A callback that tells of its failures instead of ending the node with them."""

        def guarded(*arguments: Any) -> None:
            try:
                callback(*arguments)
            except KeyboardInterrupt:  # the executor would log it as an error on its way out
                self.interrupted = True
            except Exception as error:
                self._report.fault(f"{type(error).__name__}: {error}")
                where = "".join(traceback.format_exc())
                self.get_logger().error(f"internal error, please report it: {where}", throttle_duration_sec=LOG_PERIOD)

        return guarded

    def _on_messages(self, joints: JointState | None, wrench: WrenchStamped | None) -> None:
        self._answer(joints, wrench)
        # Diagnostics take longer than an answer. Begun here, they cost a command only if they last until the second
        # one from now comes, which would overtake the first.
        if self._diagnostics_due is not None:
            self._publish_diagnostics()

    def _answer(self, joints: JointState | None, wrench: WrenchStamped | None) -> None:
        """Solve once for all that came. The answer has the command's stamp; the wrench's, where it alone is good."""
        if wrench is not None:
            self._on_wrench(wrench)
        if joints is not None:
            self._on_command(joints)
        load, last = self._load, self._stream.last
        # A load is kept for the command to come while there is no answer yet, or commands are refused after a snap.
        if load.unanswered is not None and last is not None and not self._stream.stopped:
            self._solve(last, load.unanswered)

    def _on_wrench(self, message: WrenchStamped) -> None:
        stamp, _ = self._stamp_for(message.header.stamp)
        try:
            wrench = self._wrench_reader.read(message.header.frame_id, *messages.vectors_of(message.wrench))
        except RejectedWrench as rejection:
            self._load.rejected(rejection)
            self.get_logger().warning(
                f"wrench rejected: {rejection.reason.value}: {rejection}; the last load is held",
                throttle_duration_sec=LOG_PERIOD,
            )
        else:
            self._load.accept(wrench, stamp, self._stream.orientation)

    def _on_command(self, message: JointState) -> None:
        stamp, age = self._stamp_for(message.header.stamp)
        self._report.received(age)
        settings = self._settings
        leniency = Leniency(settings.merge_partial, settings.clamp_to_limits, settings.accept_nameless)
        try:
            self._follow(self._reader.read(message.name, message.position, leniency, self._stream.last), stamp)
        except RejectedCommand as rejection:
            self._report.rejected(rejection)
            self.get_logger().warning(
                f"command rejected: {rejection.reason.value}: {rejection}", throttle_duration_sec=LOG_PERIOD
            )

    def _stamp_for(self, stamp: Time) -> tuple[Time, float | None]:
        """The stamp of all that answers a message, and the message's age at receipt [s]; None: it had a zero stamp."""
        now = self.get_clock().now()
        sent = stamp.sec * 1_000_000_000 + stamp.nanosec
        if sent == 0:
            return now.to_msg(), None
        return stamp, (now.nanoseconds - sent) * 1e-9

    def _follow(self, command: Command, stamp: Time) -> None:
        """Answer a new command."""
        self._solve(command, stamp)
        self._report.accepted(command)
        if command.notes:
            text = "command clamped: " + "; ".join(command.notes)
            self.get_logger().warning(text, throttle_duration_sec=LOG_PERIOD)

    def _solve(self, command: Command, stamp: Time) -> None:
        """Solve under the load that acts, and let the answer go where it may."""
        settings = self._settings
        policy = Policy(settings.on_snap, settings.margin_warn, settings.margin_stop)
        self.solving = True
        try:
            if self.interrupted:  # the signal came before there was a solve for it to end
                raise KeyboardInterrupt
            answer = self._stream.follow(command, policy, settings.compute_budget, self._load.loads)
        finally:
            self.solving = False
        self._load.solved(self._stream.orientation)
        if answer.verdict.publish:
            stamped = stamp_bytes(stamp.sec, stamp.nanosec)
            self._outputs.publish(Sent(answer.equilibrium, stamped, settings.backbone_poses))
        self._report.answered(answer)
        if not answer.verdict.publish:
            self.get_logger().error(answer.verdict.remark, throttle_duration_sec=LOG_PERIOD)
        elif answer.verdict.remark:
            self.get_logger().warning(answer.verdict.remark, throttle_duration_sec=LOG_PERIOD)

    def _catch_up(self) -> None:
        # Diagnostics first: should an output fail here, they are what tells of it.
        if self._diagnostics_due is not None and time.monotonic() - self._diagnostics_due > CATCH_UP_PERIOD:
            self._publish_diagnostics()  # no command has come meanwhile
        self._outputs.catch_up()

    def _look_round(self) -> None:
        if self._service.revive():
            self.get_logger().error("the service's process ended unexpectedly and was started again")
        if self._diagnostics.get_subscription_count() > 0:
            self._diagnostics_due = time.monotonic()

    def _publish_diagnostics(self) -> None:
        self._diagnostics_due = None
        name = f"{self.get_fully_qualified_name().lstrip('/')}: equilibrium"
        settings = self._settings
        status = self._report.status(name, self._robot.name, settings.command_timeout, settings.wrench_timeout)
        header = Header(stamp=self.get_clock().now().to_msg())
        self._diagnostics.publish(DiagnosticArray(header=header, status=[status]))

    def _on_set_parameters(self, changed: list[Parameter]) -> SetParametersResult:
        try:
            self._new_reader(parameters.read(self, {parameter.name: parameter.value for parameter in changed}))
        except ParameterError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _after_set_parameters(self, changed: list[Parameter]) -> None:
        self._settings = parameters.read(self)
        self._reader = self._new_reader(self._settings)
        self._service.update(self._settings)
        if any(parameter.name == "on_snap" for parameter in changed):
            self._stream.release()
