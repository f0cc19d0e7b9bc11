"""A controller at a steady pace: commands go out serialized, answers are kept as they come in."""

from __future__ import annotations

import math
import struct
import time
from collections import defaultdict
from collections.abc import Callable
from collections.abc import Container
from dataclasses import dataclass

import numpy as np
from geometry_msgs.msg import PoseArray
from geometry_msgs.msg import PoseStamped
from geometry_msgs.msg import WrenchStamped
from numpy.typing import NDArray
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from rclpy.serialization import deserialize_message
from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64

from bench.node.timed_node import new_executor
from ctr_pvs_interfaces.msg import EquilibriumStatus
from ctr_pvs_ros.outputs.messages import numbers_of

JOINTS = ["outer_rotation", "outer_translation", "inner_rotation", "inner_translation"]
STAMPED = {"setpoint_js": JointState, "setpoint_cp": PoseStamped, "backbone": PoseArray}
#: Commands go back and forth between these angles of the inner tube [deg] in steps of 0.1 deg, partial overlap.
LOW, HIGH, STEP = 100.0, 110.0, 0.1
D = (0.0935, 0.1705)
#: What the tubes slide out with each step where they slide at all [m].
SLIDE = (3e-5, 1e-4)
#: On the tip [N], and how far it turns from one message to the next [rad].
FORCE, WRENCH_TURN = 0.5, 0.01
#: Poses go around a circle across the insertion axis, once a second: its radius [m], and the command it begins at.
RADIUS, BEGIN = 2e-3, (0.0, 0.09, 1.0, 0.17)
#: Offset of the stamp in a serialized message that begins with a header.
STAMP = struct.Struct("<4xi")
TIMEOUT = 20.0  # s
SETTLE = 0.5  # s, before and after a run
#: s; in the first seconds after a process has joined, Fast DDS looks at its port in shared memory, and now and then
#: that holds up a publisher for a third of a second (its issue 6535).
JOINING = 4.0


def wrench(number: int) -> bytes:
    """Serialized force on the tip, which turns about the insertion axis; its stamp is ``number`` seconds."""
    message = WrenchStamped()
    message.header.stamp.sec = number
    force, angle = message.wrench.force, WRENCH_TURN * number
    force.y, force.z = FORCE * math.cos(angle), FORCE * math.sin(angle)
    return serialize_message(message)


@dataclass(frozen=True)
class Run:
    """What came back: the fraction of messages answered, the age of each complete answer [s], from the message to the
    arrival of the last of its messages, and how far the tip then was from where a pose had asked it to be [m]."""

    rate: float
    answered: float
    ages: NDArray[np.float64]
    errors: NDArray[np.float64]

    def age(self, percent: float) -> float:
        """Percentile of the ages, us."""
        return 1e6 * float(np.percentile(self.ages, percent)) if len(self.ages) else float("nan")


def command(number: int, sliding: bool) -> bytes:
    """Serialized command; its stamp is ``number`` seconds."""
    steps = round((HIGH - LOW) / STEP)
    step = abs(number % (2 * steps) - steps)
    outer, inner = (place + sliding * step * slide for place, slide in zip(D, SLIDE, strict=True))
    message = JointState(name=JOINTS, position=[0.0, outer, math.radians(LOW + STEP * step), inner])
    message.header.stamp.sec = number
    return serialize_message(message)


def message_with(position: NDArray[np.float64], number: int) -> bytes:
    """Serialized pose; its stamp is ``number`` seconds."""
    message = PoseStamped()
    message.header.stamp.sec = number
    place = message.pose.position
    place.x, place.y, place.z = position.tolist()
    return serialize_message(message)


class PacedClient:
    """Sends through ``node`` and listens with raw subscribers, so that decoding is not what is measured.

    sliding : whether commands also move the tubes' bases.
    loaded : whether a wrench goes out halfway between any two commands.
    status : whether it also listens to ~/status.
    posing : whether poses for the tip go out in place of commands; then it listens to ~/status, too.
    """

    def __init__(
        self, node: Node, sliding: bool = False, loaded: bool = False, status: bool = False, posing: bool = False
    ) -> None:
        self._sliding, self._posing = sliding, posing
        self._topics = STAMPED | ({"ctr_equilibrium/status": EquilibriumStatus} if status or posing else {})
        self._statuses: list[bytes] = []
        self._tip = np.zeros(3)
        self._arrivals: dict[int, list[float]] = defaultdict(list)
        self._margins = 0
        every = QoSProfile(depth=100)
        for topic, kind in self._topics.items():
            keep = self._keep_status if kind is EquilibriumStatus else self._keep
            node.create_subscription(kind, topic, keep, every, raw=True)
        node.create_subscription(Float64, "stability_margin", self._count, every, raw=True)
        self._publisher = node.create_publisher(JointState, "servo_jp", 1)
        self._poses = node.create_publisher(PoseStamped, "servo_cp", 1) if posing else None
        self._tips = node.create_subscription(PoseStamped, "setpoint_cp", self._keep_tip, 1) if posing else None
        self._node = node
        self._wrenches = node.create_publisher(WrenchStamped, "external_wrench", 1) if loaded else None
        self._executor = new_executor("events")
        self._executor.add_node(node)
        self._next = 1

    def _keep(self, message: bytes) -> None:
        self._arrivals[STAMP.unpack_from(message)[0]].append(time.perf_counter())

    def _keep_status(self, message: bytes) -> None:
        self._keep(message)
        self._statuses.append(message)

    def _keep_tip(self, message: PoseStamped) -> None:
        self._tip = np.array(numbers_of(message.pose)[0])

    def _count(self, message: bytes) -> None:
        self._margins += 1

    def spin_until(self, done: Callable[[], bool], timeout: float = TIMEOUT) -> None:
        """Handle messages until ``done``; raises TimeoutError after ``timeout`` [s]."""
        end = time.monotonic() + timeout
        while not done():
            if time.monotonic() > end:
                raise TimeoutError("no answer from the node")
            self._executor.spin_once(timeout_sec=0.02)

    def spin_for(self, seconds: float) -> None:
        """Handle messages for a while."""
        end = time.monotonic() + seconds
        self.spin_until(lambda: time.monotonic() > end, seconds + 1.0)

    def connect(self) -> None:
        """Wait for the node, and for the answer to a first command."""
        self.spin_until(lambda: self._publisher.get_subscription_count() > 0)
        self.spin_for(SETTLE)
        first = command(self._number(), self._sliding)
        if self._posing:
            first = serialize_message(JointState(name=JOINTS, position=BEGIN))
        self._publisher.publish(first)
        self.spin_until(lambda: any(len(arrivals) == len(self._topics) for arrivals in self._arrivals.values()))
        self.spin_for(JOINING)
        if self._tips is not None:  # decoding is not to be measured
            self._node.destroy_subscription(self._tips)

    def _number(self) -> int:
        self._next += 1
        return self._next - 1

    def _message(self, number: int, count: int, rate: float) -> tuple[Publisher, int, bytes]:
        """The one of that number, ``count`` messages after the first."""
        if self._poses is None:
            return self._publisher, number, command(number, self._sliding)
        angle = 2.0 * math.pi * count / rate
        place = self._tip + RADIUS * np.array([0.0, math.cos(angle) - 1.0, math.sin(angle)])
        return self._poses, number, message_with(place, number)

    def _errors(self, sent: Container[int]) -> NDArray[np.float64]:
        statuses = [
            deserialize_message(each, EquilibriumStatus)
            for each in self._statuses
            if STAMP.unpack_from(each)[0] in sent
        ]
        return np.array([status.tip_distance for status in statuses if status.outcome == EquilibriumStatus.ACCEPTED])

    def run(self, rate: float, count: int) -> Run:
        """``count`` commands, ``rate`` a second. A message that is late is not made up for by a hurried one."""
        messages = []
        for index, number in enumerate(self._number() for _ in range(count)):
            messages.append(self._message(number, index, rate))
            if self._wrenches is not None:
                number = self._number()
                messages.append((self._wrenches, number, wrench(number)))
        pace = rate * len(messages) / count
        self.spin_for(SETTLE)
        margins = self._margins
        sent = {}
        due = time.perf_counter()
        for publisher, number, message in messages:
            while (left := due - time.perf_counter()) > 0.0:
                self._executor.spin_once(timeout_sec=left)
            due = max(due, time.perf_counter() - 0.5 / pace) + 1.0 / pace
            sent[number] = time.perf_counter()
            publisher.publish(message)
        self.spin_for(SETTLE)
        complete = {
            number: self._arrivals[number] for number in sent if len(self._arrivals[number]) == len(self._topics)
        }
        ages = np.array([max(arrivals) - sent[number] for number, arrivals in complete.items()])
        return Run(rate, min(len(complete), self._margins - margins) / len(sent), ages, self._errors(sent))
