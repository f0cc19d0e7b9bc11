"""TF of the tip: one transform from the orifice to it, with the stamp of the answer."""

from __future__ import annotations

import struct

from geometry_msgs.msg import Quaternion
from geometry_msgs.msg import Transform
from geometry_msgs.msg import TransformStamped
from geometry_msgs.msg import Vector3
from rclpy.node import Node
from rclpy.qos import QoSProfile
from std_msgs.msg import Header

from ctr_pvs_ros.outputs.forms import PER_POSE
from ctr_pvs_ros.outputs.outputs import Beacon
from ctr_pvs_ros.outputs.outputs import Output
from ctr_pvs_ros.outputs.outputs import Sent
from ctr_pvs_ros.outputs.serialized import STAMP
from ctr_pvs_ros.outputs.serialized import Form
from ctr_pvs_ros.outputs.serialized import placeholders

TF = QoSProfile(depth=100)  # as every broadcaster has it


def transform_outputs(node: Node, frame_id: str, tip_frame_id: str) -> list[Output[Sent]]:
    """The topic /tf; none where its message is not installed, which is said."""
    try:
        from tf2_msgs.msg import TFMessage
    except ImportError:
        node.get_logger().warning("publish_tf is set, but tf2_msgs is not installed (ROS 2 has it): no TF of the tip")
        return []
    x, y, z, qx, qy, qz, qw = numbers = placeholders(PER_POSE)
    there = Transform(translation=Vector3(x=x, y=y, z=z), rotation=Quaternion(x=qx, y=qy, z=qz, w=qw))
    header = Header(stamp=STAMP, frame_id=frame_id)
    message = TFMessage(transforms=[TransformStamped(header=header, child_frame_id=tip_frame_id, transform=there)])
    form = Form(message, (STAMP, numbers))

    def encode(sent: Sent) -> bytes:
        tip = sent.equilibrium.tip
        return form.fill(sent.stamp, struct.pack("=7d", *tip.position, *tip.orientation))

    return [Beacon(node.create_publisher(TFMessage, "/tf", TF), encode)]
