"""The node ctr_equilibrium: commands in on servo_jp, equilibria out; a service beside it."""

from __future__ import annotations

import signal

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseArray
from geometry_msgs.msg import PoseStamped
from rcl_interfaces.msg import SetParametersResult
from rclpy.clock import Clock
from rclpy.clock import ClockType
from rclpy.exceptions import ParameterException
from rclpy.executors import SingleThreadedExecutor
from rclpy.logging import get_logger
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy
from rclpy.qos import QoSProfile
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from std_msgs.msg import Float64MultiArray
from std_msgs.msg import Header

from ctr_pvs import CommandError
from ctr_pvs import EquilibriumSolver
from ctr_pvs import load_robot
from ctr_pvs_interfaces.srv import SolveEquilibrium
from ctr_pvs_ros import messages
from ctr_pvs_ros import parameters
from ctr_pvs_ros.commands import Command
from ctr_pvs_ros.commands import CommandReader
from ctr_pvs_ros.commands import Leniency
from ctr_pvs_ros.commands import RejectedCommand
from ctr_pvs_ros.parameters import ParameterError
from ctr_pvs_ros.report import Report
from ctr_pvs_ros.service import SolveService
from ctr_pvs_ros.stream import Answer
from ctr_pvs_ros.stream import Policy
from ctr_pvs_ros.stream import Stream

NODE_NAME = "ctr_equilibrium"
EXIT_BAD_INPUT = 2
# What a wrong parameter, robot file, or ROS argument (rclpy's RCLError is a RuntimeError) ends in.
START_FAULTS = (ParameterException, RuntimeError, ValueError)
LOG_PERIOD = 2.0  # s; at most one line of a kind in this time
WAKE_PERIOD = 0.1  # s; a signal is seen at the latest after this time

NEWEST_WINS = QoSProfile(depth=1)
LATE_JOINERS_SEE_THE_LAST = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class EquilibriumNode(Node):
    """Serves the equilibria of one robot.

    Raises:
        ParameterException, ValueError: its parameters or its robot file do not allow it; the message is one line.
    """

    def __init__(self) -> None:
        super().__init__(NODE_NAME)
        parameters.declare(self)
        self._settings = parameters.read(self)
        self._robot = load_robot(self._settings.robot_file)
        self._reader = CommandReader(self._robot)
        self._stream = Stream(self._new_solver())
        self._service = SolveService(self._reader, self._new_solver())
        self._report = Report()
        initial = self._initial_command()

        self._joints = self._output(JointState, "setpoint_js")
        self._tip = self._output(PoseStamped, "setpoint_cp")
        self._backbone = self._output(PoseArray, "backbone")
        self._margin = self._output(Float64, "stability_margin")
        self._arc_length = self._output(Float64MultiArray, "backbone_s") if self._settings.publish_backbone_s else None
        self._diagnostics = self.create_publisher(DiagnosticArray, "/diagnostics", 1)
        self.create_subscription(JointState, "servo_jp", self._on_command, NEWEST_WINS)
        self.create_service(SolveEquilibrium, "~/solve", self._on_solve)
        # Diagnostics go on while simulated time stands still.
        self.create_timer(1.0, self._publish_diagnostics, clock=Clock(clock_type=ClockType.STEADY_TIME))
        self.add_on_set_parameters_callback(self._on_set_parameters)
        self.add_post_set_parameters_callback(self._after_set_parameters)

        if initial is not None:
            self._solve(initial, Header(stamp=self.get_clock().now().to_msg(), frame_id=self._settings.frame_id))
        self.get_logger().info(f"serving robot {self._robot.name!r} from {self._settings.robot_file}")

    def _new_solver(self) -> EquilibriumSolver:
        settings = self._settings
        return EquilibriumSolver(
            self._robot, tolerance=settings.tolerance, fidelity=settings.fidelity, force_model=settings.force_model
        )

    def _output(self, message_type: type, topic: str) -> Publisher:
        return self.create_publisher(message_type, topic, LATE_JOINERS_SEE_THE_LAST)

    def _initial_command(self) -> Command | None:
        values = self._settings.initial_command
        if not values:
            return None
        count = len(self._robot.tubes)
        if len(values) != 2 * count:
            rule = f"{count} rotations and {count} translations"
            raise ParameterError(f"parameter initial_command: expected {rule}, got {len(values)} numbers")
        try:
            return Command(*self._robot.check_command(values[:count], values[count:]))
        except CommandError as error:
            raise ParameterError(f"parameter initial_command: {error}") from error

    def _on_command(self, message: JointState) -> None:
        header, header_age = self._header_for(message.header)
        self._report.received(header_age)
        settings = self._settings
        leniency = Leniency(settings.merge_partial, settings.clamp_to_limits, settings.accept_nameless)
        try:
            command = self._reader.read(message.name, message.position, leniency, self._stream.last)
            self._solve(command, header)
        except RejectedCommand as rejection:
            self._report.rejected(rejection)
            self.get_logger().warning(
                f"command rejected: {rejection.reason.value}: {rejection}", throttle_duration_sec=LOG_PERIOD
            )

    def _header_for(self, header: Header) -> tuple[Header, float | None]:
        """The header of all that answers a message, and the message's age at receipt [s]; None: it had a zero stamp."""
        now = self.get_clock().now()
        sent = header.stamp.sec * 1_000_000_000 + header.stamp.nanosec
        if sent == 0:
            return Header(stamp=now.to_msg(), frame_id=self._settings.frame_id), None
        return Header(stamp=header.stamp, frame_id=self._settings.frame_id), (now.nanoseconds - sent) * 1e-9

    def _solve(self, command: Command, header: Header) -> None:
        settings = self._settings
        policy = Policy(settings.on_snap, settings.margin_warn, settings.margin_stop)
        answer = self._stream.follow(command, policy, settings.compute_budget)
        if answer.verdict.publish:
            self._publish(answer, header)
        self._report.answered(command, answer)
        if command.notes:
            text = "command clamped: " + "; ".join(command.notes)
            self.get_logger().warning(text, throttle_duration_sec=LOG_PERIOD)
        if not answer.verdict.publish:
            self.get_logger().error(answer.verdict.remark, throttle_duration_sec=LOG_PERIOD)
        elif answer.verdict.remark:
            self.get_logger().warning(answer.verdict.remark, throttle_duration_sec=LOG_PERIOD)

    def _publish(self, answer: Answer, header: Header) -> None:
        equilibrium = answer.equilibrium
        backbone = equilibrium.backbone(self._settings.backbone_poses)
        self._margin.publish(Float64(data=float(equilibrium.stability_margin)))
        self._joints.publish(messages.joint_state_of(equilibrium, self._reader.names, Header(stamp=header.stamp)))
        self._tip.publish(messages.tip_of(equilibrium, header))
        self._backbone.publish(messages.backbone_of(backbone, header))
        if self._arc_length is not None:
            self._arc_length.publish(messages.arc_length_of(backbone))

    def _on_solve(
        self, request: SolveEquilibrium.Request, response: SolveEquilibrium.Response
    ) -> SolveEquilibrium.Response:
        header, _ = self._header_for(request.joints.header)
        settings = self._settings
        return self._service.answer(request, response, header, settings.backbone_poses, settings.compute_budget)

    def _publish_diagnostics(self) -> None:
        name = f"{self.get_fully_qualified_name().lstrip('/')}: equilibrium"
        status = self._report.status(name, self._robot.name, self._settings.command_timeout)
        header = Header(stamp=self.get_clock().now().to_msg())
        self._diagnostics.publish(DiagnosticArray(header=header, status=[status]))

    def _on_set_parameters(self, changed: list[Parameter]) -> SetParametersResult:
        try:
            parameters.read(self, {parameter.name: parameter.value for parameter in changed})
        except ParameterError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _after_set_parameters(self, changed: list[Parameter]) -> None:
        self._settings = parameters.read(self)
        if any(parameter.name == "on_snap" for parameter in changed):
            self._stream.release()


def main(args: list[str] | None = None) -> int:
    """Entry point of the executable equilibrium_node; returns its exit code."""
    # Python's own handler instead of rclpy's, so that either signal also ends a solve that is under way.
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.default_int_handler)
    try:
        try:
            rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
            node = EquilibriumNode()
        except START_FAULTS as error:
            get_logger(NODE_NAME).fatal(f"not started: {error}")
            return EXIT_BAD_INPUT
        _spin(node)
    except KeyboardInterrupt:
        pass
    finally:
        # A second signal must not turn a clean end into a failure.
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, signal.SIG_IGN)
        rclpy.try_shutdown()
    return 0


def _spin(node: Node) -> None:
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    while rclpy.ok():
        executor.spin_once(timeout_sec=WAKE_PERIOD)


if __name__ == "__main__":
    raise SystemExit(main())
