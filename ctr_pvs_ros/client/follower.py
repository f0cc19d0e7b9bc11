"""What a running node publishes, on a page: the other end of ``ctr_client view``."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped
from geometry_msgs.msg import Vector3
from rclpy.node import Node
from sensor_msgs.msg import JointState
from visualization_msgs.msg import Marker
from visualization_msgs.msg import MarkerArray

from ctr_pvs.answer.backbone import Pose
from ctr_pvs.cli.live.followed import FollowedPage
from ctr_pvs.cli.live.followed import Told
from ctr_pvs.cli.live.mesh import Solid
from ctr_pvs_interfaces.msg import EquilibriumStatus
from ctr_pvs_ros.client.client import LATCHED
from ctr_pvs_ros.client.client import NODE_NAME
from ctr_pvs_ros.client.client import SOME
from ctr_pvs_ros.client.client import Client
from ctr_pvs_ros.client.texts import answered
from ctr_pvs_ros.client.texts import status_in_words
from ctr_pvs_ros.client.words import ROTATION

#: Seconds without a word after which the page says so: diagnostics come once a second.
SILENCE = 3.0
#: How often the page changes at most [s]; for so many looks the other messages of an answer may be on their way.
PERIOD, PATIENCE = 0.05, 4
#: Messages of a topic that are kept, to find those of one answer among them.
KEPT = 100

Stamp = tuple[int, int]
Kept = dict[Stamp, Any]


class Follower(Client):
    """Hears the equilibrium node ``name`` in the namespace of ``node``.

    Attributes:
        name: the node's, in full.
    """

    def __init__(self, node: Node, name: str = NODE_NAME) -> None:
        super().__init__(node)
        self.name = f"{node.get_namespace().rstrip('/')}/{name}"
        self._heard_at = time.monotonic()
        self._markers: MarkerArray | None = None  # not drawn yet
        self._looks = 0
        self._due, self._silence = time.monotonic(), 0
        self._outcome: EquilibriumStatus | None = None  # not told yet
        self._kept: dict[type, Kept] = {PoseStamped: {}, JointState: {}, EquilibriumStatus: {}}
        node.create_subscription(MarkerArray, "markers", self._on_markers, LATCHED)
        node.create_subscription(PoseStamped, "setpoint_cp", self._keep, SOME)
        node.create_subscription(JointState, "setpoint_js", self._keep, SOME)
        node.create_subscription(EquilibriumStatus, f"{name}/status", self._on_status, SOME)
        node.create_subscription(DiagnosticArray, "/diagnostics", self._on_diagnostics, 10)

    def show_on(self, page: FollowedPage) -> None:
        """Keeps the page up to date, until it is interrupted."""
        while True:
            self.look(page)

    def look(self, page: FollowedPage) -> None:
        """Handles what has come, and shows it where it is time to."""
        self._executor.spin_once(timeout_sec=PERIOD)
        now = time.monotonic()
        if now < self._due:
            return
        self._due = now + PERIOD
        if self._outcome is not None:
            page.outcome(status_in_words(self._outcome), answered(self._outcome))
            self._outcome = None
        self._draw(page)
        quiet = now - self._heard_at
        silence = int(quiet) if quiet >= SILENCE else 0
        if silence != self._silence:
            self._silence = silence
            page.silent(silence or None)

    def _on_markers(self, markers: MarkerArray) -> None:
        self._heard_at = time.monotonic()
        self._markers, self._looks = markers, 0

    def _on_status(self, status: EquilibriumStatus) -> None:
        self._heard_at = time.monotonic()
        self._outcome = status
        if answered(status):
            self._keep(status)

    def _keep(self, message: PoseStamped | JointState | EquilibriumStatus) -> None:
        self._heard_at = time.monotonic()
        kept = self._kept[type(message)]
        stamp = _stamp(message)
        kept.pop(stamp, None)
        kept[stamp] = message
        if len(kept) > KEPT:
            kept.pop(next(iter(kept)))

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        who = f"{self.name}: equilibrium".lstrip("/")
        if any(status.name == who for status in message.status):
            self._heard_at = time.monotonic()

    def _draw(self, page: FollowedPage) -> None:
        """The newest tubes, with the other messages of the same answer."""
        if self._markers is None:
            return
        if any(marker.action == Marker.DELETEALL for marker in self._markers.markers):
            self._markers = None
            page.wipe()
            return
        self._looks += 1
        stamp = _stamp(self._markers.markers[0])
        found = [kept.get(stamp) for kept in self._kept.values()]
        if None in found and self._looks <= PATIENCE:
            return
        tip, joints, status = (
            message or next(reversed(kept.values()), None)
            for message, kept in zip(found, self._kept.values(), strict=True)
        )
        if tip is not None:
            page.show(_told(self._markers, tip, joints, status))
            self._markers = None


def _told(markers: MarkerArray, tip: PoseStamped, joints: JointState | None, status: EquilibriumStatus | None) -> Told:
    place, turn = tip.pose.position, tip.pose.orientation
    force = Vector3() if status is None else status.applied_wrench.force
    return Told(
        tuple(_solids(markers)),
        Pose(np.array([place.x, place.y, place.z]), np.array([turn.x, turn.y, turn.z, turn.w])),
        np.array([force.x, force.y, force.z]),
        math.nan if status is None else status.stability_margin,
        math.nan if status is None else status.snap_reserve,
        [] if joints is None else [*map(_joint, joints.name, joints.position, joints.effort)],
    )


def _solids(markers: MarkerArray) -> Iterator[Solid]:
    """Each tube as it was published: three corners to each triangle."""
    for marker in markers.markers:
        if marker.action == Marker.ADD:
            corners = np.array([(point.x, point.y, point.z) for point in marker.points])
            colour = tuple(round(255.0 * share) for share in (marker.color.r, marker.color.g, marker.color.b))
            yield Solid(f"tube {marker.id + 1}", colour, corners, np.arange(len(corners)).reshape(-1, 3))


def _joint(name: str, position: float, effort: float) -> tuple[str, str, str]:
    if name.endswith(ROTATION):
        return name, f"{math.degrees(position):.2f}°", f"{1e3 * effort:.2f} mN m"
    return name, f"{1e3 * position:.2f} mm", f"{effort:.3f} N"


def _stamp(message: Any) -> Stamp:
    return message.header.stamp.sec, message.header.stamp.nanosec
