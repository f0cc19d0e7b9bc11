"""The launch file, really executed; only where launch is installed (test/node reads it as data everywhere)."""

import os
import signal
import subprocess
import sys

import pytest
from geometry_msgs.msg import PoseStamped

from ctr_pvs_ros.process import share_file

pytest.importorskip("launch_ros", reason="launch_ros is not installed: the launch file is checked as data only")

LAUNCH = """
import sys
from launch import LaunchDescription, LaunchService
from launch.actions import IncludeLaunchDescription
from launch.launch_description_sources import AnyLaunchDescriptionSource
arguments = [tuple(argument.split(":=")) for argument in sys.argv[2:]]
launch = IncludeLaunchDescription(AnyLaunchDescriptionSource(sys.argv[1]), launch_arguments=arguments)
service = LaunchService()
service.include_launch_description(LaunchDescription([launch]))
sys.exit(service.run())
"""


@pytest.mark.parametrize(
    ("name", "initial_command"),
    [("command", "[0.0, 0.5, 0.0935, 0.2085]"), ("whole_numbers", "[0, 1, 0, 0]"), ("no_command", "[]")],
)
def test_the_launch_file_starts_the_node(graph, find_node, name, initial_command):
    given = initial_command != "[]"
    file = str(share_file("launch", "equilibrium.launch.xml"))
    arguments = [f"namespace:={name}", f"initial_command:={initial_command}", "frame_id:=1", "publish_tf:=true"]
    process = subprocess.Popen([sys.executable, "-c", LAUNCH, file, *arguments], start_new_session=True)
    try:
        peer = find_node(f"/{name}")
        tips = peer.subscribe(PoseStamped, "setpoint_cp")
        peer.diagnostics()
        assert len(tips) == given
        assert peer.get_parameter("frame_id") == "1" and peer.get_parameter("tip_frame_id") == "ctr_tip"
    finally:
        os.killpg(process.pid, signal.SIGINT)  # as Ctrl-C in a terminal does: launch and the node alike
        assert process.wait(10.0) == 0
