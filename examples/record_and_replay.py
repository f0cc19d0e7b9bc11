#!/usr/bin/env python3
"""Record a session to a rosbag2 file, and replay it to a fresh node: the same bag in, the same bits out.

    python3 examples/record_and_replay.py record session --namespace /left      # until Ctrl-C; start it with the node
    python3 examples/record_and_replay.py replay session --namespace /again     # exit code 1 where an answer differs

The bag is read and written by the PyPI package rosbags (pip install rosbags), so no rosbag2 is needed; `ros2 bag` takes
the file where there is one. A replay sends the commands that were answered, one after the other, each when the one
before has its answer: time plays no part in it, and the outputs are compared to the last bit of every number, stamps
included. Commands that were refused, or overtaken by a newer one, left no trace in the node and are left out. So are
those without a stamp of their own: their answers carry the time of receipt.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import defaultdict
from collections.abc import Callable
from pathlib import Path

import rclpy
from geometry_msgs.msg import PoseArray
from geometry_msgs.msg import PoseStamped
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy
from rclpy.qos import QoSProfile
from rclpy.serialization import deserialize_message
from rclpy.subscription import Subscription
from rosbags.rosbag2 import Reader
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer
from rosbags.typesys import Stores
from rosbags.typesys import get_typestore
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from std_msgs.msg import Float64MultiArray

COMMAND, TIP = "servo_jp", "setpoint_cp"
OUTPUTS = {
    "setpoint_js": JointState,
    TIP: PoseStamped,
    "backbone": PoseArray,
    "stability_margin": Float64,
    "backbone_s": Float64MultiArray,
}
COMMANDS_IN = QoSProfile(depth=1000)
ANSWERS = QoSProfile(depth=1000, durability=DurabilityPolicy.TRANSIENT_LOCAL)
REPLY_TIMEOUT = 10.0  # s
OPTIONAL_OUTPUTS = 0.5  # s; backbone_s may be there or not, so it has a while to be found, and is not waited for

Bag = list[tuple[str, bytes]]  # topic without namespace, serialised message; in the order of receipt


def stamp_of(kind: type, message: bytes) -> tuple[int, int]:
    """The stamp of a serialised message with a header: s, ns."""
    stamp = deserialize_message(message, kind).header.stamp
    return stamp.sec, stamp.nanosec


def same(kind: type, one: bytes, other: bytes) -> bool:
    """Whether two serialised messages say the same; the bytes between their fields, which say nothing, may differ."""
    # The text of a message tells every number to its last bit, and minus zero from zero.
    return one == other or repr(deserialize_message(one, kind)) == repr(deserialize_message(other, kind))


class Recorder:
    """Writes everything that is said on the node's topics, as it stands on the wire, into an mcap bag."""

    def __init__(self, ros: Node, path: Path) -> None:
        self.answers = 0
        self._heard: dict[str, Subscription] = {}
        types = get_typestore(Stores.ROS2_JAZZY)
        self._writer = Writer(path, version=9, storage_plugin=StoragePlugin.MCAP)
        self._writer.open()
        for topic, kind in {COMMAND: JointState, **OUTPUTS}.items():
            name = f"{kind.__module__.split('.')[0]}/msg/{kind.__name__}"
            connection = self._writer.add_connection(ros.resolve_topic_name(topic), name, typestore=types)
            qos = COMMANDS_IN if topic == COMMAND else ANSWERS
            self._heard[topic] = ros.create_subscription(kind, topic, self._keep(connection, topic), qos, raw=True)

    @property
    def complete(self) -> bool:
        """Whether the node and somebody who commands it have been found; backbone_s is there only when asked for."""
        return all(heard.get_publisher_count() > 0 for topic, heard in self._heard.items() if topic != "backbone_s")

    def _keep(self, connection: object, topic: str) -> Callable[[bytes], None]:
        def keep(message: bytes) -> None:
            self._writer.write(connection, time.time_ns(), message)
            self.answers += topic == TIP

        return keep

    def close(self) -> None:
        """Complete the file."""
        self._writer.close()


def read(path: Path) -> Bag:
    """All messages of a bag that one node's session was recorded into."""
    with Reader(path) as reader:
        return [(connection.topic.rpartition("/")[2], bytes(data)) for connection, _, data in reader.messages()]


def answered_commands(bag: Bag) -> list[bytes]:
    """The commands with a stamp of their own that were answered, in the order of the answers."""
    commands = {stamp_of(JointState, data): data for topic, data in bag if topic == COMMAND}
    stamps = [stamp_of(PoseStamped, data) for topic, data in bag if topic == TIP]
    return [commands[stamp] for stamp in stamps if stamp in commands and stamp != (0, 0)]


def outputs(bag: Bag) -> dict[str, list[bytes]]:
    """What was said on each output since the first command; before it there is only an answer from an earlier life."""
    begin = next((index for index, (topic, _) in enumerate(bag) if topic == COMMAND), len(bag))
    said: dict[str, list[bytes]] = defaultdict(list)
    for topic, data in bag[begin:]:
        if topic in OUTPUTS:
            said[topic].append(data)
    return said


class Player:
    """Sends serialised commands in lock step and keeps what comes back."""

    def __init__(self, ros: Node) -> None:
        self.heard: Bag = []
        self._ros = ros
        self._publisher = ros.create_publisher(JointState, COMMAND, 1)
        for topic, kind in OUTPUTS.items():
            ros.create_subscription(kind, topic, self._keep(topic), ANSWERS, raw=True)

    def _keep(self, topic: str) -> Callable[[bytes], None]:
        return lambda message: self.heard.append((topic, message))

    def wait_for_node(self) -> None:
        """Wait until commands find a reader."""
        self._spin_until(lambda: self._publisher.get_subscription_count() > 0, "node")

    def play(self, commands: list[bytes], said: dict[str, list[bytes]]) -> None:
        """Send all commands, each once every output of the one before has come; raises TimeoutError."""
        for count, command in enumerate(commands, start=1):
            self.heard.append((COMMAND, command))
            self._publisher.publish(command)
            self._spin_until(
                lambda count=count: all(len(outputs(self.heard)[topic]) >= count for topic in said), f"answer {count}"
            )

    def _spin_until(self, done: Callable[[], bool], what: str) -> None:
        deadline = time.monotonic() + REPLY_TIMEOUT
        while not done():
            if time.monotonic() > deadline:
                raise TimeoutError(f"no {what} within {REPLY_TIMEOUT:g} s")
            rclpy.spin_once(self._ros, timeout_sec=0.1)


def spin_for(ros: Node, seconds: float) -> None:
    """Handle messages for a while."""
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        rclpy.spin_once(ros, timeout_sec=0.1)


def record(ros: Node, path: Path, answers: int) -> int:
    """Record until so many answers have come (0: until Ctrl-C); returns the exit code."""
    recorder = Recorder(ros, path)
    print("waiting for the node and for somebody who commands it", flush=True)
    try:
        while not recorder.complete:
            rclpy.spin_once(ros, timeout_sec=0.1)
        spin_for(ros, OPTIONAL_OUTPUTS)
        print(f"recording to {path}", flush=True)
        while not answers or recorder.answers < answers:
            rclpy.spin_once(ros, timeout_sec=0.1)
        spin_for(ros, 0.5)  # what belongs to the last answer
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        recorder.close()
    print(f"{recorder.answers} answers recorded")
    return 0


def replay(ros: Node, path: Path) -> int:
    """Replay a bag to the node and compare; returns the exit code."""
    bag = read(path)
    commands, said = answered_commands(bag), outputs(bag)
    if len(commands) < sum(topic == TIP for topic, _ in bag):
        print("some answers have no stamped command in this bag: what follows them may differ in its last digits")
    player = Player(ros)
    player.wait_for_node()
    try:
        player.play(commands, said)
    except TimeoutError as error:
        print(f"replay failed: {error}", file=sys.stderr)
        return 1
    again = outputs(player.heard)
    different = 0
    for topic, messages in said.items():
        kind = OUTPUTS[topic]
        unlike = sum(not same(kind, *pair) for pair in zip(messages, again[topic], strict=False))
        unlike += abs(len(messages) - len(again[topic]))
        print(f"{topic}: {len(messages)} messages, {unlike} different")
        different += unlike
    print(f"{len(commands)} commands replayed;", "all outputs bit-identical" if not different else "outputs differ")
    return 1 if different or not commands else 0


def main() -> int:
    """Entry point; returns the exit code."""
    parser = argparse.ArgumentParser(description="Record a node's session to a rosbag2 file, or replay it.")
    parser.add_argument("mode", choices=("record", "replay"))
    parser.add_argument("bag", type=Path, help="folder of the bag")
    parser.add_argument("--namespace", default="", help="namespace of the node")
    parser.add_argument("--answers", type=int, default=0, help="record: stop after so many; 0: on Ctrl-C")
    arguments = parser.parse_args()
    rclpy.init(args=[])
    ros = rclpy.create_node("record_and_replay", namespace=arguments.namespace)
    try:
        if arguments.mode == "record":
            return record(ros, arguments.bag, arguments.answers)
        return replay(ros, arguments.bag)
    finally:
        rclpy.try_shutdown()


if __name__ == "__main__":
    raise SystemExit(main())
