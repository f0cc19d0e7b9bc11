"""The node ctr_equilibrium: its parameters, what it is made of, its diagnostics and its end.

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

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped
from geometry_msgs.msg import WrenchStamped
from rcl_interfaces.msg import SetParametersResult
from rclpy.clock import Clock
from rclpy.clock import ClockType
from rclpy.node import Node
from rclpy.parameter import Parameter
from sensor_msgs.msg import JointState
from std_msgs.msg import Header

from ctr_pvs.robot.plausibility import implausible
from ctr_pvs_ros import parameters
from ctr_pvs_ros.handler import LOG_PERIOD
from ctr_pvs_ros.handler import Handler
from ctr_pvs_ros.inputs.commands import Command
from ctr_pvs_ros.inputs.commands import CommandReader
from ctr_pvs_ros.inputs.commands import RejectedCommand
from ctr_pvs_ros.inputs.joints import Joints
from ctr_pvs_ros.inputs.subscriptions import Inputs
from ctr_pvs_ros.outputs.publishers import Publishers
from ctr_pvs_ros.parameters import ParameterError
from ctr_pvs_ros.parameters import Settings
from ctr_pvs_ros.service.inverse_service import InverseService
from ctr_pvs_ros.service.jobs import SolverOptions
from ctr_pvs_ros.service.jobs import robot_of
from ctr_pvs_ros.service.service_process import ServiceProcess
from ctr_pvs_ros.service.solve_service import SolveService

if TYPE_CHECKING:
    from ctr_pvs.kernel.compiler import Background

NODE_NAME = "ctr_equilibrium"
CATCH_UP_PERIOD = 0.05  # s; late joiners wait no longer, and markers move no faster
TWIN_LOG_PERIOD = 60.0  # s
LOADING_TIME = 1.0  # s; kernels that are being loaded when the node ends are waited for so long


class EquilibriumNode(Node):
    """Serves the equilibria of one robot.

    Args:
        options: of rclpy's Node.

    Attributes:
        handler: answers commands; who spins the node should stop where it is interrupted.
        compiling: the process that compiles the kernels, if that is still to be done.

    Raises:
        ParameterException, RuntimeError, ValueError: its parameters, its middleware or its robot file do not allow it;
            the message is one line.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__(NODE_NAME, **options)
        unknown = parameters.declare(self)
        self._settings = settings = parameters.read(self)
        self._robot = robot_of(settings.robot_file)
        self._joints = Joints.of(self._robot, settings.joint_prefix, settings.translation_sign)
        reader = self._new_reader(settings)
        initial = self._initial_command(reader)
        solver_options = SolverOptions(settings.robot_file, settings.tolerance, settings.fidelity, settings.force_model)
        solver = solver_options.new_solver()

        self._outputs = Publishers(self, self._robot, self._joints, settings)
        self._diagnostics = self.create_publisher(DiagnosticArray, "/diagnostics", 1)
        self._process = ServiceProcess(solver_options, self._on_service_trouble)
        self.handler = handler = Handler(self, reader, settings, solver, self._outputs)
        self._asked = (
            SolveService(self, self._process, reader, settings),
            InverseService(self, self._process, reader, settings, lambda: handler.last_answer),
        )
        self._tell_of_the_robot()
        if initial is not None:
            self._guarded(self.handler.start_with)(initial)
        self._inputs = Inputs(self, self._on_messages, self._guarded, settings.use_external_wrench)
        # Both go on while simulated time stands still.
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._diagnostics_due: float | None = None  # since when, on a steady clock [s]
        self.create_timer(CATCH_UP_PERIOD, self._guarded(self._catch_up), clock=steady)
        self.create_timer(1.0, self._guarded(self._look_round), clock=steady)
        self.add_on_set_parameters_callback(self._on_set_parameters)
        self.add_post_set_parameters_callback(self._after_set_parameters)
        self.compiling = self._compile()
        if unknown:
            self.get_logger().warning(f"no such parameters, passed over: {', '.join(unknown)}")
        self.get_logger().info(f"serving robot {self._robot.name!r} from {settings.robot_file}")

    def destroy_node(self) -> None:
        """Also takes the markers away, and ends the processes of the services and the compiler."""
        stopping = threading.Thread(target=self.compiling.stop)  # which takes its time, as do the others
        stopping.start()
        self._outputs.clear()
        for service in self._asked:
            service.stop()
        self._process.stop()
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

    def _tell_of_the_robot(self) -> None:
        """What looks as if it were in another unit."""
        remarks = implausible(self._robot)
        self.handler.report.about_robot(remarks)
        for remark in remarks:
            self.get_logger().warning(f"{self._settings.robot_file}: {remark}")

    def _on_compiled(self, outcome: str) -> None:
        """In a thread of its own, once it is known whether kernels run compiled from now on."""
        self._process.look_for_kernels()
        self.get_logger().info(outcome)

    def _on_service_trouble(self, text: str) -> None:
        """In a thread of its own."""
        self.handler.report.warn(text)
        self.get_logger().error(text)

    def _new_reader(self, settings: Settings) -> CommandReader:
        try:
            return CommandReader(self._robot, self._joints, settings.rotation_limits, settings.translation_limits)
        except ValueError as error:
            raise ParameterError(f"parameters rotation_limits, translation_limits: {error}") from error

    def _initial_command(self, reader: CommandReader) -> Command | None:
        values = self._settings.initial_command
        if not values:
            return None
        count = len(self._robot.tubes)
        if len(values) != 2 * count:
            rule = f"{count} rotations and {count} translations"
            raise ParameterError(f"parameter initial_command: expected {rule}, got {len(values)} numbers")
        try:
            return reader.read_in_turn(values)
        except RejectedCommand as error:
            raise ParameterError(f"parameter initial_command: {error}") from error

    def _guarded(self, callback: Callable[..., None]) -> Callable[..., None]:
        """A callback that tells of its failures instead of ending the node with them."""

        def guarded(*arguments: Any) -> None:
            try:
                callback(*arguments)
            except KeyboardInterrupt:  # the executor would log it as an error on its way out
                self.handler.interrupted = True
            except Exception as error:
                self.handler.report.fault(f"{type(error).__name__}: {error}")
                where = "".join(traceback.format_exc())
                self.get_logger().error(f"internal error, please report it: {where}", throttle_duration_sec=LOG_PERIOD)

        return guarded

    def _on_messages(self, command: JointState | PoseStamped | None, wrench: WrenchStamped | None) -> None:
        self.handler.answer(command, wrench)
        # Diagnostics take longer than an answer. Begun here, they cost a command only if they last until the second
        # one from now comes, which would overtake the first.
        if self._diagnostics_due is not None:
            self._publish_diagnostics()

    def _catch_up(self) -> None:
        # Diagnostics first: should an output fail here, they are what tells of it.
        if self._diagnostics_due is not None and time.monotonic() - self._diagnostics_due > CATCH_UP_PERIOD:
            self._publish_diagnostics()  # no command has come meanwhile
        for service in self._asked:
            service.open_when_ready()
        self._outputs.catch_up()

    def _look_round(self) -> None:
        me = (self.get_name(), self.get_namespace())
        if self.get_node_names_and_namespaces().count(me) > 1:
            text = f"another node is called {self.get_fully_qualified_name()}, too: both answer each command"
            self.handler.report.warn(text)
            self.get_logger().warning(text, throttle_duration_sec=TWIN_LOG_PERIOD)
        if self._diagnostics.get_subscription_count() > 0:
            self._diagnostics_due = time.monotonic()

    def _publish_diagnostics(self) -> None:
        self._diagnostics_due = None
        name = f"{self.get_fully_qualified_name().lstrip('/')}: equilibrium"
        settings = self._settings
        status = self.handler.report.status(name, self._robot.name, settings.command_timeout, settings.wrench_timeout)
        header = Header(stamp=self.get_clock().now().to_msg())
        self._diagnostics.publish(DiagnosticArray(header=header, status=[status]))

    def _on_set_parameters(self, changed: list[Parameter]) -> SetParametersResult:
        try:
            self._new_reader(parameters.read(self, {parameter.name: parameter.value for parameter in changed}))
        except ParameterError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _after_set_parameters(self, changed: list[Parameter]) -> None:
        settings = self._settings = parameters.read(self)
        reader = self._new_reader(settings)
        for part in (self.handler, *self._asked):
            part.reader, part.settings = reader, settings
        if any(parameter.name == "on_snap" for parameter in changed):
            self.handler.release()
