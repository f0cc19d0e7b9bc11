"""Clients that hear what became of each command: one that sends commands, one that only looks on."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Iterator
from collections.abc import Sequence
from dataclasses import dataclass

from geometry_msgs.msg import PoseStamped
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy
from rclpy.qos import QoSProfile
from sensor_msgs.msg import JointState

from ctr_pvs_interfaces.msg import EquilibriumStatus
from ctr_pvs_ros.client.client import NODE_NAME
from ctr_pvs_ros.client.client import Client
from ctr_pvs_ros.client.client import CommandClient
from ctr_pvs_ros.client.texts import answered

KEPT = 100  # messages; in a burst they come faster than they are read
ALL_AND_THE_LAST = QoSProfile(depth=KEPT, durability=DurabilityPolicy.TRANSIENT_LOCAL)
PATIENCE = 0.3  # s; by then the tip of an answer has come, or another message took its place
WAKE_PERIOD = 0.05  # s

Stamp = tuple[int, int]


@dataclass(frozen=True)
class Told:
    """What the node says of one command; tip and joints are None where it is not answered."""

    status: EquilibriumStatus
    tip: PoseStamped | None
    joints: JointState | None


class StatusClient(CommandClient):
    """Waits for what is told of each command."""

    def __init__(self, node: Node, name: str = NODE_NAME) -> None:
        super().__init__(node, [(PoseStamped, "setpoint_cp"), (JointState, "setpoint_js")], name)

    def command(self, names: Sequence[str], positions: Sequence[float], timeout: float) -> Told:
        """Send positions [rad and m] and wait for what becomes of them; raises NoReply."""
        heard = self.send(names, positions, timeout)
        return Told(heard[EquilibriumStatus], heard.get(PoseStamped), heard.get(JointState))


class StatusWatcher(Client):
    """Hears of every command and wrench of the equilibrium node `name` in the namespace of `node`."""

    def __init__(self, node: Node, name: str = NODE_NAME) -> None:
        super().__init__(node)
        self._pending: deque[tuple[float, EquilibriumStatus]] = deque()  # with the time when each came
        self._tips: dict[Stamp, PoseStamped] = {}
        self._statuses = node.create_subscription(
            EquilibriumStatus, f"{name}/status", self._on_status, ALL_AND_THE_LAST
        )
        node.create_subscription(PoseStamped, "setpoint_cp", self._on_tip, ALL_AND_THE_LAST)

    def wait_for_node(self, timeout: float) -> None:
        """Wait until the node is there; raises NoReply."""
        self.spin_until(
            lambda: self._statuses.get_publisher_count() > 0, timeout, f"publisher of {self._statuses.topic_name}"
        )

    def follow(self) -> Iterator[tuple[EquilibriumStatus, PoseStamped | None]]:
        """The last status, then every one as it comes, each with the tip that carries its stamp."""
        while True:
            self._executor.spin_once(timeout_sec=WAKE_PERIOD)
            while self._pending and self._complete(*self._pending[0]):
                _, status = self._pending.popleft()
                yield status, self._tips.get(_stamp_of(status))

    def _on_status(self, status: EquilibriumStatus) -> None:
        self._pending.append((time.monotonic(), status))

    def _on_tip(self, tip: PoseStamped) -> None:
        self._tips[_stamp_of(tip)] = tip
        if len(self._tips) > KEPT:
            self._tips.pop(next(iter(self._tips)))

    def _complete(self, came: float, status: EquilibriumStatus) -> bool:
        """Whether nothing more is to come of what came at that time."""
        return not answered(status) or _stamp_of(status) in self._tips or time.monotonic() - came > PATIENCE


def _stamp_of(message: EquilibriumStatus | PoseStamped) -> Stamp:
    return message.header.stamp.sec, message.header.stamp.nanosec
