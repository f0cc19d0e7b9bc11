"""Between ROS messages and what the solver knows; pure conversions."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from geometry_msgs.msg import Point
from geometry_msgs.msg import Pose
from geometry_msgs.msg import PoseArray
from geometry_msgs.msg import PoseStamped
from geometry_msgs.msg import Quaternion
from geometry_msgs.msg import Wrench
from numpy.typing import NDArray
from rclpy.clock import Clock
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray
from std_msgs.msg import Header
from std_msgs.msg import MultiArrayDimension

from ctr_pvs import Backbone
from ctr_pvs.robot.loads import Vector
from ctr_pvs_ros.inputs.joints import Joints

if TYPE_CHECKING:
    from ctr_pvs import Equilibrium


def receipt_header(header: Header, clock: Clock, frame_id: str) -> Header:
    """The header of what answers a message with `header`: its stamp, or for a zero stamp the time now."""
    stamp = header.stamp
    if stamp.sec == 0 and stamp.nanosec == 0:
        stamp = clock.now().to_msg()
    return Header(stamp=stamp, frame_id=frame_id)


def vectors_of(wrench: Wrench) -> tuple[Vector, Vector]:
    """Force [N] and moment [N m] of a Wrench."""
    force, moment = wrench.force, wrench.torque
    return (force.x, force.y, force.z), (moment.x, moment.y, moment.z)


def numbers_of(pose: Pose) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Position [m] and quaternion xyzw of a Pose."""
    p, q = pose.position, pose.orientation
    return (p.x, p.y, p.z), (q.x, q.y, q.z, q.w)


def pose_of(position: NDArray[np.float64], orientation: NDArray[np.float64]) -> Pose:
    """A Pose from position (3,) [m] and unit quaternion (4,) xyzw."""
    x, y, z = position.tolist()
    qx, qy, qz, qw = orientation.tolist()
    return Pose(position=Point(x=x, y=y, z=z), orientation=Quaternion(x=qx, y=qy, z=qz, w=qw))


def joint_state_of(equilibrium: Equilibrium, joints: Joints, header: Header) -> JointState:
    """The solved command as position [rad and m], torque and force as effort [N m and N]; in the order of `joints`."""
    return JointState(
        header=header,
        name=list(joints.names),
        position=joints.in_turn(equilibrium.alpha, equilibrium.D),
        effort=joints.in_turn(equilibrium.torque, equilibrium.force),
    )


def tip_of(equilibrium: Equilibrium, header: Header) -> PoseStamped:
    """The tip, m."""
    return PoseStamped(header=header, pose=pose_of(equilibrium.tip.position, equilibrium.tip.orientation))


def backbone_of(backbone: Backbone, header: Header) -> PoseArray:
    """The backbone from the orifice to the tip, m."""
    poses = [pose_of(*row) for row in zip(backbone.position, backbone.orientation, strict=True)]
    return PoseArray(header=header, poses=poses)


def arc_length_of(backbone: Backbone) -> Float64MultiArray:
    """The arc length of each backbone pose beyond the orifice, m."""
    message = Float64MultiArray(data=backbone.s.tolist())
    count = len(message.data)
    message.layout.dim = [MultiArrayDimension(label="s", size=count, stride=count)]
    return message
