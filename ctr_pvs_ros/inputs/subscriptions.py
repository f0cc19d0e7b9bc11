"""What the node listens to. Where a command or a pose and a wrench wait at the same time, they are handed over
together, so that one solve answers both with the newest of each."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from geometry_msgs.msg import PoseStamped
from geometry_msgs.msg import WrenchStamped
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.subscription import Subscription
from sensor_msgs.msg import JointState

NEWEST_WINS = QoSProfile(depth=1)

Callback = Callable[..., None]


class Inputs:
    """Subscribes to servo_jp, servo_cp and, where asked to, to external_wrench.

    Args:
        node: that listens.
        handle: called with a command or a pose, or neither, and a wrench, or None.
        guarded: makes a callback one that never raises.
        wrenches: whether to listen to external_wrench.
    """

    def __init__(
        self,
        node: Node,
        handle: Callable[[JointState | PoseStamped | None, WrenchStamped | None], None],
        guarded: Callable[[Callback], Callback],
        wrenches: bool,
    ) -> None:
        self._handle = handle
        self._wrenches = None
        if wrenches:
            on_wrench = guarded(self._on_wrench)
            self._wrenches = node.create_subscription(WrenchStamped, "external_wrench", on_wrench, NEWEST_WINS)
        self._commands = node.create_subscription(JointState, "servo_jp", guarded(self._on_command), NEWEST_WINS)
        self._poses = node.create_subscription(PoseStamped, "servo_cp", guarded(self._on_command), NEWEST_WINS)

    def _on_command(self, command: JointState | PoseStamped) -> None:
        self._handle(command, _waiting(self._wrenches) if self._wrenches is not None else None)

    def _on_wrench(self, wrench: WrenchStamped) -> None:
        self._handle(_waiting(self._commands), wrench)


def _waiting(subscription: Subscription) -> Any | None:
    """The message that waits on a subscription, taken from it; None: none does. The executor, which may have noticed it
    already, then finds nothing there and goes on."""
    with subscription.handle:
        taken = subscription.handle.take_message(subscription.msg_type, subscription.raw)
    return None if taken is None else taken[0]
