"""A client that sends commands at a pace of its own and keeps account of the answers; for the robustness tests."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import rclpy
from geometry_msgs.msg import PoseArray
from geometry_msgs.msg import PoseStamped
from geometry_msgs.msg import Vector3
from geometry_msgs.msg import Wrench
from geometry_msgs.msg import WrenchStamped
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy
from rclpy.qos import QoSProfile
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64

from ctr_pvs.robot.loads import ZERO
from ctr_pvs.robot.loads import Vector

# What must never stand in the log of a node that is only misused. rcl and Fast DDS write errors of their own kind.
FAULTS = ("Traceback", "Exception", "Error:", "RCLError", "bad_alloc", "terminate called")
JOINTS = ["outer_rotation", "outer_translation", "inner_rotation", "inner_translation"]
# From the one to the other the inner tube turns so often that following it takes longer than any of these tests. The
# outer one reaches out so little that nothing snaps on the way: a path of very many snaps would be given up early.
NEAR, ENDLESS = [0.0, 0.17, 0.0, 0.2085], [0.0, 0.17, 1e6, 0.2085]

EVERY_ANSWER = QoSProfile(depth=1000, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def joint_state(names: list[str], positions: list[float], stamp: int = 0) -> JointState:
    """A command with a stamp in ns."""
    message = JointState(name=names, position=positions)
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, 1_000_000_000)
    return message


def wrench_message(force: Vector, moment: Vector = ZERO, frame: str = "ctr_base", stamp: int = 0) -> WrenchStamped:
    """A wrench with a stamp in ns."""
    message = WrenchStamped(wrench=wrench(force, moment))
    message.header.frame_id = frame
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, 1_000_000_000)
    return message


def wrench(force: Vector, moment: Vector) -> Wrench:
    """A force [N] and a moment [N m]."""
    vectors = (Vector3(**dict(zip("xyz", vector, strict=True))) for vector in (force, moment))
    return Wrench(**dict(zip(("force", "torque"), vectors, strict=True)))


def stamp_of(message: Any) -> int:
    """The stamp of a message with a header, ns."""
    return message.header.stamp.sec * 1_000_000_000 + message.header.stamp.nanosec


def numbers_of(message: Any) -> list[float]:
    """All numbers of an answer."""
    match message:
        case Float64():
            return [message.data]
        case JointState():
            return [*message.position, *message.velocity, *message.effort]
        case PoseStamped():
            return numbers_of_pose(message.pose)
        case PoseArray():
            return [number for pose in message.poses for number in numbers_of_pose(pose)]
    raise TypeError(type(message))


def numbers_of_pose(pose: Any) -> list[float]:
    """Position and orientation."""
    p, q = pose.position, pose.orientation
    return [p.x, p.y, p.z, q.x, q.y, q.z, q.w]


def faults_in(log: Path) -> list[str]:
    """The lines of a node's log that tell of an exception."""
    lines = log.read_text(encoding="utf-8", errors="replace").splitlines()
    return [line for line in lines if any(fault in line for fault in FAULTS)]


def rejections(values: dict[str, str]) -> dict[str, int]:
    """The counts by reason of a diagnostics status."""
    told = values["rejected by reason"]
    return {reason: int(count) for reason, count in (part.split(": ") for part in told.split(", ") if part)}


def resident_memory(pid: int) -> float:
    """RSS of a process [MB]."""
    for line in Path(f"/proc/{pid}/status").read_text(encoding="ascii").splitlines():
        if line.startswith("VmRSS:"):
            return int(line.split()[1]) / 1024.0
    raise ProcessLookupError(pid)


def waiting_time(pid: int) -> float:
    """How long a process has stood in line for a processor [s]; its main thread, which is the one that answers."""
    return int(Path(f"/proc/{pid}/schedstat").read_text(encoding="ascii").split()[1]) * 1e-9


def children(pid: int) -> list[int]:
    """The processes that a process has started."""
    return [int(child) for child in Path(f"/proc/{pid}/task/{pid}/children").read_text(encoding="ascii").split()]


class Load:
    """Publishes on a node's servo_jp and hears its answers.

    Attributes:
        sent: stamp [ns] -> time.monotonic() at which a command went out.
        answered: stamp [ns] -> time.monotonic() at which its tip came.
        not_finite: descriptions of answers with a number that is not finite.
    """

    def __init__(self, namespace: str, backbone: bool = True) -> None:
        self.ros = rclpy.create_node("load", namespace=namespace)
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self.ros)
        self._publisher = self.ros.create_publisher(JointState, "servo_jp", 1)
        self.sent: dict[int, float] = {}
        self.answered: dict[int, float] = {}
        self.not_finite: list[str] = []
        outputs = {"setpoint_js": JointState, "setpoint_cp": PoseStamped, "stability_margin": Float64}
        if backbone:
            outputs["backbone"] = PoseArray
        for topic, kind in outputs.items():
            self.ros.create_subscription(kind, topic, self._keep(topic), EVERY_ANSWER)
        self.spin_until(lambda: self.listeners > 0, 10.0)

    def _keep(self, topic: str) -> Callable[[Any], None]:
        def keep(message: Any) -> None:
            if topic == "setpoint_cp":
                self.answered.setdefault(stamp_of(message), time.monotonic())
            if not all(map(math.isfinite, numbers_of(message))):
                self.not_finite.append(f"{topic}: {message}")

        return keep

    @property
    def listeners(self) -> int:
        """How many have been found that hear the commands."""
        return self._publisher.get_subscription_count()

    def send(self, message: JointState) -> None:
        """Publish a command and remember when."""
        self.sent[stamp_of(message)] = time.monotonic()
        self._publisher.publish(message)

    def send_bytes(self, serialised: bytes) -> None:
        """Publish what may be no JointState at all."""
        self._publisher.publish(serialised)

    def spin_to(self, when: float) -> None:
        """Hear answers until time.monotonic() is `when`."""
        while (left := when - time.monotonic()) > 0.0:
            self._executor.spin_once(timeout_sec=left)

    def spin_until(self, done: Callable[[], bool], timeout: float) -> bool:
        """Hear answers until `done`; whether it came to that within `timeout` [s]."""
        deadline = time.monotonic() + timeout
        while not done():
            if time.monotonic() > deadline:
                return False
            self._executor.spin_once(timeout_sec=0.02)
        return True

    def close(self) -> None:
        """Leave the graph."""
        self._executor.shutdown()
        self.ros.destroy_node()
