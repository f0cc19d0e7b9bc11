"""examples/two_arms.launch.xml, really executed; only where launch is installed (test/node reads it as data)."""

import os
import signal
import subprocess
import sys
from pathlib import Path

from geometry_msgs.msg import PoseStamped

from ros.test_launch import LAUNCH  # skipped where launch_ros is not installed, and says so

EXAMPLE = Path(__file__).parents[2] / "examples" / "two_arms.launch.xml"


def test_two_arms_are_served_side_by_side(graph, find_node):
    process = subprocess.Popen([sys.executable, "-c", LAUNCH, str(EXAMPLE)], start_new_session=True)
    try:
        left, right = find_node("/left"), find_node("/right")
        tips = [arm.subscribe(PoseStamped, "setpoint_cp") for arm in (left, right)]
        for arm in (left, right):
            arm.diagnostics()
        assert [len(messages) for messages in tips] == [1, 0]  # only the left arm has an initial command
        assert tips[0][0].header.frame_id == "left_base"
        assert right.get_parameter("frame_id") == "right_base"
        assert right.get_parameter("robot_file").endswith("three_tubes.yaml")
    finally:
        os.killpg(process.pid, signal.SIGINT)  # as Ctrl-C in a terminal does: launch and the nodes alike
        assert process.wait(10.0) == 0
