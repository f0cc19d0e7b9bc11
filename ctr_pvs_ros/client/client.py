"""Clients of the node: its services, and commands in lock step, each of which waits for everything that answers it."""

from __future__ import annotations

import time
from collections.abc import Callable
from collections.abc import Mapping
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from builtin_interfaces.msg import Time
from geometry_msgs.msg import PoseArray
from geometry_msgs.msg import PoseStamped
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy
from rclpy.qos import QoSProfile
from sensor_msgs.msg import JointState

from ctr_pvs_interfaces.msg import EquilibriumStatus
from ctr_pvs_interfaces.srv import SolveEquilibrium
from ctr_pvs_interfaces.srv import SolveInverse
from ctr_pvs_ros.client.texts import answered

NODE_NAME = "ctr_equilibrium"
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
SOME = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class NoReply(RuntimeError):
    """The node did not answer in time, or said that it will not."""


@dataclass(frozen=True)
class Reply:
    """The node's answer to one command; reply_time [s] runs from the command to the last of the four messages."""

    joints: JointState
    tip: PoseStamped
    backbone: PoseArray
    stability_margin: float
    reply_time: float


class Client:
    """Handles the messages of `node`, a node of the client's own, while something is waited for."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(node)

    def spin_until(self, done: Callable[[], bool], timeout: float, what: str) -> None:
        """Handle messages until `done`; raises NoReply naming `what` after `timeout` [s]."""
        deadline = time.monotonic() + timeout
        while not done():
            if time.monotonic() > deadline:
                raise NoReply(f"no {what} within {timeout:g} s")
            self._executor.spin_once(timeout_sec=0.05)


class ServiceClient(Client):
    """Calls the services of the equilibrium node `name` in the namespace of `node`."""

    def __init__(self, node: Node, name: str = NODE_NAME) -> None:
        super().__init__(node)
        self._solve = node.create_client(SolveEquilibrium, f"{name}/solve")
        self._inverse = node.create_client(SolveInverse, f"{name}/inverse")

    def wait_for_services(self, timeout: float) -> None:
        """Wait until the services are there; raises NoReply."""
        for service in (self._solve, self._inverse):
            self.spin_until(service.service_is_ready, timeout, f"service {service.service_name}")

    def solve(self, request: SolveEquilibrium.Request, timeout: float) -> SolveEquilibrium.Response:
        """Call ~/solve, once it is there; raises NoReply."""
        return self._called(self._solve, request, timeout)

    def inverse(self, request: SolveInverse.Request, timeout: float) -> SolveInverse.Response:
        """Call ~/inverse, once it is there; raises NoReply."""
        return self._called(self._inverse, request, timeout)

    def _called(self, service: Any, request: Any, timeout: float) -> Any:
        self.spin_until(service.service_is_ready, timeout, f"service {service.service_name}")
        future = service.call_async(request)
        self.spin_until(future.done, timeout, "service reply")
        return future.result()


class CommandClient(ServiceClient):
    """Sends commands to the equilibrium node `name` in the namespace of `node`, one after the other.

    What is kept of each topic is the message with the command's stamp: others may command and load the node, too.

    Args:
        outputs: type and topic of the answers that are waited for, beside the status.
    """

    def __init__(self, node: Node, outputs: Sequence[tuple[type, str]], name: str = NODE_NAME) -> None:
        super().__init__(node, name)
        self._stamp = Time()
        self._heard: dict[type, Any] = {}
        self._command = node.create_publisher(JointState, "servo_jp", 1)
        self._topics = [
            node.create_subscription(kind, topic, self._keep, SOME)
            for kind, topic in ((EquilibriumStatus, f"{name}/status"), *outputs)
        ]

    def _keep(self, message: Any) -> None:
        if message.header.stamp == self._stamp:
            self._heard[type(message)] = message

    def wait_for_node(self, timeout: float) -> None:
        """Wait until every topic has found the node; raises NoReply."""
        node = self._topics[0].topic_name.rpartition("/")[0]
        self.spin_until(self._connected, timeout, f"node {node}")

    def _connected(self) -> bool:
        return self._command.get_subscription_count() > 0 and all(
            topic.get_publisher_count() > 0 for topic in self._topics
        )

    def send(self, names: Sequence[str], positions: Sequence[float], timeout: float) -> dict[type, Any]:
        """Send positions [rad and m], stamped now, and wait for what becomes of them; raises NoReply.

        Returns:
            The messages by type: the status, and the outputs where there are any.
        """
        message = JointState(name=list(names), position=list(positions))
        message.header.stamp = self._stamp = self._node.get_clock().now().to_msg()
        self._heard.clear()
        self._command.publish(message)
        told = dict(zip(names, positions, strict=True))
        self.spin_until(self._complete, timeout, f"reply to {told}")
        return self._heard

    def _complete(self) -> bool:
        """Whether all outputs have come, or the status that says that none will."""
        status = self._heard.get(EquilibriumStatus)
        return status is not None and (not answered(status) or len(self._heard) == len(self._topics))


class LockStepClient(CommandClient):
    """Waits for all that answers each command."""

    def __init__(self, node: Node) -> None:
        super().__init__(node, [(JointState, "setpoint_js"), (PoseStamped, "setpoint_cp"), (PoseArray, "backbone")])

    def command(self, joints: Mapping[str, float], timeout: float) -> Reply:
        """Send positions by joint name [rad and m] and wait for the reply; raises NoReply."""
        sent = time.perf_counter()
        heard = self.send(list(joints), list(joints.values()), timeout)
        reply_time = time.perf_counter() - sent
        status = heard[EquilibriumStatus]
        if not answered(status):
            raise NoReply(f"no reply to {dict(joints)}: {status.reason}: {status.message}")
        return Reply(heard[JointState], heard[PoseStamped], heard[PoseArray], status.stability_margin, reply_time)
