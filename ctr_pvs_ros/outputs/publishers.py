"""The topics that answer a command, and what each of them says."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from geometry_msgs.msg import PoseArray
from geometry_msgs.msg import PoseStamped
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy
from rclpy.qos import QoSProfile
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from std_msgs.msg import Float64MultiArray
from visualization_msgs.msg import MarkerArray

from ctr_pvs import Robot
from ctr_pvs_interfaces.msg import EquilibriumStatus
from ctr_pvs_ros.inputs.joints import Joints
from ctr_pvs_ros.outputs import messages
from ctr_pvs_ros.outputs.forms import Forms
from ctr_pvs_ros.outputs.markers import TubeMarkers
from ctr_pvs_ros.outputs.outcomes import Outcome
from ctr_pvs_ros.outputs.outcomes import StatusForms
from ctr_pvs_ros.outputs.outputs import Output
from ctr_pvs_ros.outputs.outputs import Outputs
from ctr_pvs_ros.outputs.outputs import Picture
from ctr_pvs_ros.outputs.outputs import Sent
from ctr_pvs_ros.outputs.transform import transform_outputs
from ctr_pvs_ros.parameters import Settings

LATE_JOINERS_SEE_THE_LAST = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
LAST_WORD = Duration(seconds=0.2)  # for viewers to hear that the tubes are gone


class Publishers(Outputs):
    """The outputs of a node that serves a robot."""

    def __init__(self, node: Node, robot: Robot, joints: Joints, settings: Settings) -> None:
        self._node = node
        frame = settings.frame_id
        forms, tubes = Forms(joints, frame), TubeMarkers(robot, frame)
        outputs: list[Output[Sent]] = [
            self._output(Float64, "stability_margin", lambda sent: forms.margin(sent.equilibrium)),
            self._output(JointState, "setpoint_js", lambda sent: forms.joints(sent.equilibrium, sent.stamp)),
            self._output(PoseStamped, "setpoint_cp", lambda sent: forms.tip(sent.equilibrium, sent.stamp)),
            self._output(PoseArray, "backbone", lambda sent: forms.backbone(sent.backbone, sent.stamp)),
        ]
        if settings.publish_backbone_s:
            outputs.append(
                self._output(Float64MultiArray, "backbone_s", lambda sent: messages.arc_length_of(sent.backbone))
            )
        if settings.publish_jacobian:
            outputs.append(self._output(Float64MultiArray, "jacobian", lambda sent: forms.jacobian(sent.equilibrium)))
        if settings.publish_tf:
            outputs += transform_outputs(node, frame, settings.tip_frame_id)
        status: Output[Outcome] = Output(
            node.create_publisher(EquilibriumStatus, "~/status", LATE_JOINERS_SEE_THE_LAST), StatusForms(frame).of
        )
        self._markers = node.create_publisher(MarkerArray, "markers", LATE_JOINERS_SEE_THE_LAST)
        picture = Picture(self._markers, lambda sent: tubes.of(sent.equilibrium, sent.stamp), tubes.none)
        super().__init__(outputs, status, picture)

    def _output(self, message_type: type, topic: str, encode: Callable[[Sent], Any]) -> Output[Sent]:
        return Output(self._node.create_publisher(message_type, topic, LATE_JOINERS_SEE_THE_LAST), encode)

    def clear(self) -> None:
        """Take the tubes away from viewers, who have a moment to hear of it."""
        super().clear()
        self._markers.wait_for_all_acked(LAST_WORD)
