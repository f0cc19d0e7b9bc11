#!/usr/bin/env python3
"""Command a running node and read its tip from plain Python: no ROS here, only DDS (pip install cyclonedds).

    python3 examples/dds_client.py outer_rotation=0 outer_translation=0.0935 inner_rotation=1 inner_translation=0.2085

ROS 2 topics are DDS topics: /servo_jp is rt/servo_jp, and the message types below are the ROS ones written out. The
node runs on Fast DDS and this client on Eclipse Cyclone DDS, so it also shows that the two understand each other.
Prints the tip as one line of JSON; exit code 1 when no answer comes.
"""

# No "from __future__ import annotations": cyclonedds reads the types of the messages from their annotations.
import argparse
import json
import os
import time
from dataclasses import dataclass
from dataclasses import field

from cyclonedds.core import Policy
from cyclonedds.core import Qos
from cyclonedds.core import ReadCondition
from cyclonedds.core import WaitSet
from cyclonedds.domain import Domain
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import float64
from cyclonedds.idl.types import int32
from cyclonedds.idl.types import sequence
from cyclonedds.idl.types import uint32
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

# What ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST means to a ROS node: loopback only, peers found without multicast.
LOCALHOST = """
<CycloneDDS><Domain Id="any">
  <General><AllowMulticast>false</AllowMulticast>
    <Interfaces><NetworkInterface name="lo"/></Interfaces></General>
  <Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>32</MaxAutoParticipantIndex>
    <Peers><Peer address="localhost"/></Peers></Discovery>
</Domain></CycloneDDS>
"""
OUTPUT = Qos(  # as the node offers it: also the answer from before we came, and only the last one
    Policy.Reliability.Reliable(duration(milliseconds=100)),
    Policy.Durability.TransientLocal,
    Policy.History.KeepLast(1),
)
COMMAND = Qos(
    Policy.Reliability.Reliable(duration(milliseconds=100)),
    Policy.Durability.Volatile,
    Policy.History.KeepLast(1),
    Policy.DataRepresentation(use_cdrv0_representation=True),  # the encoding that ROS 2 speaks
)


@dataclass
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    """builtin_interfaces/Time."""

    sec: int32 = 0
    nanosec: uint32 = 0


@dataclass
class Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    """std_msgs/Header."""

    stamp: Time = field(default_factory=Time)
    frame_id: str = ""


@dataclass
class JointState(IdlStruct, typename="sensor_msgs::msg::dds_::JointState_"):
    """sensor_msgs/JointState."""

    header: Header = field(default_factory=Header)
    name: sequence[str] = field(default_factory=list)
    position: sequence[float64] = field(default_factory=list)
    velocity: sequence[float64] = field(default_factory=list)
    effort: sequence[float64] = field(default_factory=list)


@dataclass
class Point(IdlStruct, typename="geometry_msgs::msg::dds_::Point_"):
    """geometry_msgs/Point."""

    x: float64
    y: float64
    z: float64


@dataclass
class Quaternion(IdlStruct, typename="geometry_msgs::msg::dds_::Quaternion_"):
    """geometry_msgs/Quaternion."""

    x: float64
    y: float64
    z: float64
    w: float64


@dataclass
class Pose(IdlStruct, typename="geometry_msgs::msg::dds_::Pose_"):
    """geometry_msgs/Pose."""

    position: Point
    orientation: Quaternion


@dataclass
class PoseStamped(IdlStruct, typename="geometry_msgs::msg::dds_::PoseStamped_"):
    """geometry_msgs/PoseStamped."""

    header: Header
    pose: Pose


class Client:
    """One DDS participant beside the node: commands out, tips in."""

    def __init__(self, domain: int, namespace: str = "", localhost: bool = False) -> None:
        # Kept: the settings hold as long as the Domain object lives.
        self._domain = Domain(domain, LOCALHOST) if localhost else None
        participant = DomainParticipant(domain)
        prefix = f"rt/{namespace.strip('/')}".rstrip("/")
        self._commands = DataWriter(
            participant, Topic(participant, f"{prefix}/servo_jp", JointState, qos=COMMAND), COMMAND
        )
        self._tips = DataReader(participant, Topic(participant, f"{prefix}/setpoint_cp", PoseStamped), OUTPUT)
        self._news = WaitSet(participant)
        self._news.attach(ReadCondition(self._tips, 0))

    def wait_for_node(self, timeout: float) -> bool:
        """Whether the node has been found, both ways, within `timeout` [s]."""
        deadline = time.monotonic() + timeout
        while time.monotonic() < deadline:
            if self._commands.get_matched_subscriptions() and self._tips.get_matched_publications():
                return True
            time.sleep(0.01)
        return False

    def command(self, joints: dict[str, float], timeout: float) -> PoseStamped | None:
        """Send positions by joint name [rad and m], and the tip that answers them; None: none within `timeout` [s]."""
        sec, nanosec = divmod(time.time_ns(), 1_000_000_000)
        header = Header(stamp=Time(sec, nanosec))
        self._commands.write(JointState(header=header, name=list(joints), position=list(joints.values())))
        deadline = time.monotonic() + timeout
        while time.monotonic() < deadline:
            for tip in self._tips.take(N=10):
                if isinstance(tip, PoseStamped) and tip.header.stamp == header.stamp:
                    return tip
            self._news.wait(duration(milliseconds=50))
        return None


def _joint(text: str) -> tuple[str, float]:
    name, _, value = text.partition("=")
    return name, float(value)


def main() -> int:
    """Send one command and print what comes back; returns the exit code."""
    parser = argparse.ArgumentParser(description="Send one command to a running node and print the tip.")
    parser.add_argument("joints", nargs="+", type=_joint, metavar="JOINT=POSITION", help="rad and m")
    parser.add_argument("--namespace", default="", help="namespace of the node")
    parser.add_argument("--timeout", type=float, default=10.0, help="s, to find the node and again for the answer")
    arguments = parser.parse_args()
    localhost = os.environ.get("ROS_AUTOMATIC_DISCOVERY_RANGE") == "LOCALHOST"
    client = Client(int(os.environ.get("ROS_DOMAIN_ID", "0")), arguments.namespace, localhost)
    if not client.wait_for_node(arguments.timeout):
        print("no node found; are ROS_DOMAIN_ID and --namespace those of the node?")
        return 1
    tip = client.command(dict(arguments.joints), arguments.timeout)
    if tip is None:
        print("no answer: the command was refused or not solved; /diagnostics tells why")
        return 1
    position, turn = tip.pose.position, tip.pose.orientation
    answer = {
        "frame_id": tip.header.frame_id,
        "position": [position.x, position.y, position.z],
        "orientation": [turn.x, turn.y, turn.z, turn.w],
    }
    print(json.dumps(answer))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
