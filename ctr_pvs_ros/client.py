"""A client in lock step with the node: send one command, wait for everything that answers it."""

from __future__ import annotations

import time
from collections.abc import Callable
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from geometry_msgs.msg import PoseArray
from geometry_msgs.msg import PoseStamped
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy
from rclpy.qos import QoSProfile
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64

from ctr_pvs_interfaces.srv import SolveEquilibrium

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class NoReply(RuntimeError):
    """The node did not answer in time."""


@dataclass(frozen=True)
class Reply:
    """The node's answer to one command; reply_time [s] runs from the command to the last of the four messages."""

    joints: JointState
    tip: PoseStamped
    backbone: PoseArray
    stability_margin: float
    reply_time: float


class LockStepClient:
    """Sends commands through `node`, whose namespace is that of the equilibrium node."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(node)
        self._latest: dict[str, Any] = {}
        self._command = node.create_publisher(JointState, "servo_jp", 1)
        self._outputs = [
            node.create_subscription(kind, topic, self._keep(topic), LATCHED)
            for topic, kind in (
                ("setpoint_js", JointState),
                ("setpoint_cp", PoseStamped),
                ("backbone", PoseArray),
                ("stability_margin", Float64),
            )
        ]
        self._solve = node.create_client(SolveEquilibrium, "ctr_equilibrium/solve")

    def _keep(self, topic: str) -> Callable[[Any], None]:
        def keep(message: Any) -> None:
            self._latest[topic] = message

        return keep

    def spin_until(self, done: Callable[[], bool], timeout: float, what: str) -> None:
        """Handle messages until `done`; raises NoReply naming `what` after `timeout` [s]."""
        deadline = time.monotonic() + timeout
        while not done():
            if time.monotonic() > deadline:
                raise NoReply(f"no {what} within {timeout:g} s")
            self._executor.spin_once(timeout_sec=0.05)

    def wait_for_node(self, timeout: float) -> None:
        """Wait until every topic has found the node."""
        self.spin_until(self._connected, timeout, "equilibrium node")

    def _connected(self) -> bool:
        return self._command.get_subscription_count() > 0 and all(
            self._node.count_publishers(output.topic_name) > 0 for output in self._outputs
        )

    def command(self, joints: Mapping[str, float], timeout: float) -> Reply:
        """Send positions by joint name [rad and m], stamped now, and wait for the reply; raises NoReply."""
        message = JointState(name=list(joints), position=list(joints.values()))
        message.header.stamp = self._node.get_clock().now().to_msg()
        self._latest.clear()
        sent = time.perf_counter()
        self._command.publish(message)
        self.spin_until(lambda: self._answers(message), timeout, f"reply to {dict(joints)}")
        reply_time = time.perf_counter() - sent
        latest = self._latest
        return Reply(
            latest["setpoint_js"],
            latest["setpoint_cp"],
            latest["backbone"],
            latest["stability_margin"].data,
            reply_time,
        )

    def _answers(self, command: JointState) -> bool:
        """Whether all outputs have come, those with a header with the command's stamp."""
        latest = self._latest
        return len(latest) == len(self._outputs) and all(
            latest[topic].header.stamp == command.header.stamp for topic in ("setpoint_js", "setpoint_cp", "backbone")
        )

    def solve(self, request: SolveEquilibrium.Request, timeout: float) -> SolveEquilibrium.Response:
        """Call the service, once it is there; raises NoReply."""
        self.spin_until(self._solve.service_is_ready, timeout, "service")
        future = self._solve.call_async(request)
        self.spin_until(future.done, timeout, "service reply")
        return future.result()
