"""The executable equilibrium_node: arguments, signals, the executor, and the exit code."""

from __future__ import annotations

import gc
import signal
import sys

import rclpy
from rclpy.exceptions import ParameterException
from rclpy.executors import Executor
from rclpy.executors import SingleThreadedExecutor
from rclpy.logging import get_logger
from rclpy.signals import SignalHandlerOptions

from ctr_pvs_ros.arguments import check_parameters_given
from ctr_pvs_ros.node import NODE_NAME
from ctr_pvs_ros.node import EquilibriumNode

EXIT_BAD_INPUT = 2
# What a wrong parameter, robot file, or ROS argument (rclpy's RCLError is a RuntimeError) ends in.
START_FAULTS = (ParameterException, RuntimeError, ValueError)
WAKE_PERIOD = 0.1  # s; a signal is seen at the latest after this time
SWITCH_INTERVAL = 5e-5  # s; the stream waits no longer for a thread that makes a response


def main(args: list[str] | None = None) -> int:
    """Entry point of the executable equilibrium_node; returns its exit code."""
    node = None

    def end(number: int, frame: object) -> None:
        """Instead of rclpy's handler: either signal also ends a solve that is under way. Elsewhere the executor would
        log an exception, so there the node ends as soon as the executor comes round."""
        if node is None:
            raise KeyboardInterrupt
        node.handler.interrupted = True
        if node.handler.solving:
            raise KeyboardInterrupt

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, end)
    try:
        try:
            rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
            node = EquilibriumNode()
            check_parameters_given(sys.argv if args is None else args, node)
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
        if node is not None:
            node.destroy_node()
        rclpy.try_shutdown()
    return 0


def _spin(node: EquilibriumNode) -> None:
    # What is there by now stays: the garbage collector need not look through it again while commands wait.
    gc.collect()
    gc.freeze()
    sys.setswitchinterval(SWITCH_INTERVAL)
    executor = new_executor()
    executor.add_node(node)
    while rclpy.ok() and not node.handler.interrupted:
        executor.spin_once(timeout_sec=WAKE_PERIOD)


def new_executor() -> Executor:
    """The quickest one there is: docs/node_latency.md. The first rclpy of Jazzy has no EventsExecutor."""
    try:
        from rclpy.experimental.events_executor import EventsExecutor
    except ImportError:
        return SingleThreadedExecutor()
    return EventsExecutor()


if __name__ == "__main__":
    raise SystemExit(main())
