"""Keeps the node's service at work: request after request whose path is too long for any budget, and snaps nowhere.

Prints a line when the first request is under way; when standard input ends, the longest time any request took.
"""

from __future__ import annotations

import os
import sys
import threading
import time

import rclpy
from rclpy.executors import SingleThreadedExecutor
from sensor_msgs.msg import JointState

from ctr_pvs_interfaces.srv import SolveEquilibrium

JOINTS = ["outer_rotation", "outer_translation", "inner_rotation", "inner_translation"]
NEAR, ENDLESS = [0.0, 0.17, 0.0, 0.2085], [0.0, 0.17, 1e6, 0.2085]


def main() -> None:
    rclpy.init(args=[])
    node = rclpy.create_node("service_load")
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    client = node.create_client(SolveEquilibrium, "ctr_equilibrium/solve")
    client.wait_for_service()
    longest = 0.0
    ended = threading.Event()
    threading.Thread(target=lambda: (sys.stdin.read(), ended.set()), daemon=True).start()
    near = SolveEquilibrium.Request(joints=JointState(name=JOINTS, position=NEAR))
    executor.spin_until_future_complete(client.call_async(near))
    request = SolveEquilibrium.Request(joints=JointState(name=JOINTS, position=ENDLESS), warm_start=True)
    print("begun", flush=True)
    while not ended.is_set():
        begin = time.perf_counter()
        executor.spin_until_future_complete(client.call_async(request))
        longest = max(longest, time.perf_counter() - begin)
    print(f"{longest:.3f} s", flush=True)
    os._exit(0)


if __name__ == "__main__":
    main()
