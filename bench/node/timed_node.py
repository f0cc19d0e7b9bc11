"""The node with a stopwatch, and an echo node that solves nothing; each runs in a process of its own.

    python3 -m bench.node.timed_node node|loaded|objects|echo events|single|multi FILE

Until SIGINT; then FILE has, as JSON, the times [s] from the entry of the command callback to the end of the last
publish, with the parts of them, and u.
"""

from __future__ import annotations

import gc
import json
import signal
import struct
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import rclpy
from geometry_msgs.msg import PoseArray
from geometry_msgs.msg import PoseStamped
from rclpy.executors import Executor
from rclpy.executors import MultiThreadedExecutor
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.serialization import serialize_message
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from std_msgs.msg import Header

from bench.common.clock import unit
from bench.common.places import CONFIG
from ctr_pvs import EquilibriumSolver
from ctr_pvs import load_robot
from ctr_pvs_ros.executable import SWITCH_INTERVAL
from ctr_pvs_ros.handler import Handler
from ctr_pvs_ros.inputs.joints import Joints
from ctr_pvs_ros.inputs.subscriptions import NEWEST_WINS
from ctr_pvs_ros.node import EquilibriumNode
from ctr_pvs_ros.outputs import messages
from ctr_pvs_ros.outputs.outputs import Output
from ctr_pvs_ros.outputs.outputs import Sent
from ctr_pvs_ros.outputs.publishers import LATE_JOINERS_SEE_THE_LAST
from ctr_pvs_ros.stream import Stream

ROBOT = CONFIG / "renda2021.yaml"
THREADS = 2  # of the MultiThreadedExecutor

#: u is measured so often and the least is taken: the client is still at work beside it.
MEASUREMENTS = 50

Times = dict[str, list[float]]


def new_executor(kind: str) -> Executor:
    """By its name on the command line."""
    if kind == "single":
        return SingleThreadedExecutor()
    if kind == "multi":
        return MultiThreadedExecutor(THREADS)
    from rclpy.experimental.events_executor import EventsExecutor

    return EventsExecutor()


def timed(function: Callable[..., Any], times: list[float]) -> Callable[..., Any]:
    """``function``, which adds to ``times`` how long each call took [s]."""

    def measured(*arguments: Any) -> Any:
        begin = time.perf_counter()
        result = function(*arguments)
        times.append(time.perf_counter() - begin)
        return result

    return measured


def timed_node(times: Times) -> Node:
    """The production node; only this process's copies of its functions are wrapped."""
    for owner, name, part in (
        (Handler, "answer", "in all"),
        (Stream, "try_out", "solve"),
        (Output, "publish", "publish"),
    ):
        setattr(owner, name, _method(getattr(owner, name), times[part]))
    return EquilibriumNode()


def _method(function: Callable[..., Any], times: list[float]) -> Callable[..., Any]:
    def method(self: Any, *arguments: Any) -> Any:
        begin = time.perf_counter()
        try:
            return function(self, *arguments)
        finally:
            times.append(time.perf_counter() - begin)

    return method


def with_objects(node: Node) -> Node:
    """The node with messages made of Python objects, as one would write it first."""
    kept = node._outputs._outputs

    def header(sent: Sent) -> Header:
        result = Header(frame_id="ctr_base")
        result.stamp.sec, result.stamp.nanosec = struct.unpack("=iI", sent.stamp)
        return result

    joints = node._joints
    kept[0].encode = lambda sent: Float64(data=float(sent.equilibrium.stability_margin))
    kept[1].encode = lambda sent: messages.joint_state_of(sent.equilibrium, joints, header(sent))
    kept[2].encode = lambda sent: messages.tip_of(sent.equilibrium, header(sent))
    kept[3].encode = lambda sent: messages.backbone_of(sent.backbone, header(sent))
    return node


def echo_node(times: Times) -> Node:
    """Answers every command with one prepared answer under the command's stamp: what the middleware costs."""
    node = rclpy.create_node("ctr_equilibrium")
    robot = load_robot(ROBOT)
    equilibrium = EquilibriumSolver(robot).solve([0.0, 1.0], [0.0935, 0.1705])
    header = Header(frame_id="ctr_base")
    outputs = [
        (Float64, "stability_margin", Float64(data=1.0)),
        (JointState, "setpoint_js", messages.joint_state_of(equilibrium, Joints.of(robot), header)),
        (PoseStamped, "setpoint_cp", messages.tip_of(equilibrium, header)),
        (PoseArray, "backbone", messages.backbone_of(equilibrium.backbone(60), header)),
    ]
    ready = []
    for kind, topic, message in outputs:
        publisher = node.create_publisher(kind, topic, LATE_JOINERS_SEE_THE_LAST)
        ready.append((publisher, serialize_message(message), kind is not Float64))

    def answer(command: bytes) -> None:
        stamp = command[4:12]
        for publisher, message, stamped in ready:
            publisher.publish(message[:4] + stamp + message[12:] if stamped else message)

    callback = timed(answer, times["in all"])
    node.create_subscription(JointState, "servo_jp", callback, NEWEST_WINS, raw=True)
    return node


def main() -> None:
    what, executor_kind, path = sys.argv[1:]
    signal.signal(signal.SIGINT, signal.default_int_handler)
    parameters = {"robot_file": str(ROBOT), "use_external_wrench": str(what == "loaded").lower()}
    given = [word for name, value in parameters.items() for word in ("-p", f"{name}:={value}")]
    rclpy.init(args=["timed", "--ros-args", *given], signal_handler_options=SignalHandlerOptions.NO)
    times: Times = {"in all": [], "solve": [], "publish": []}
    node = echo_node(times) if what == "echo" else timed_node(times)
    if what == "objects":
        with_objects(node)
    gc.collect()
    gc.freeze()
    sys.setswitchinterval(SWITCH_INTERVAL)  # as the executable does
    executor = new_executor(executor_kind)
    executor.add_node(node)
    handler = getattr(node, "handler", None)
    try:
        while not getattr(handler, "interrupted", False):
            executor.spin_once(timeout_sec=0.1)
    except KeyboardInterrupt:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    Path(path).write_text(json.dumps({"times": times, "u": min(unit() for _ in range(MEASUREMENTS))}))
    node.destroy_node()
    rclpy.try_shutdown()


if __name__ == "__main__":
    main()
