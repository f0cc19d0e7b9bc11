"""The answers as serialized messages: the same as those of ``messages``, without the Python objects."""

from __future__ import annotations

import math
import struct
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from geometry_msgs.msg import Pose
from geometry_msgs.msg import PoseArray
from geometry_msgs.msg import PoseStamped
from numpy.typing import NDArray
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from std_msgs.msg import Float64MultiArray
from std_msgs.msg import Header
from std_msgs.msg import MultiArrayDimension
from std_msgs.msg import MultiArrayLayout

from ctr_pvs import Backbone
from ctr_pvs_ros.inputs.joints import Joints
from ctr_pvs_ros.outputs.messages import pose_of
from ctr_pvs_ros.outputs.serialized import STAMP
from ctr_pvs_ros.outputs.serialized import Form
from ctr_pvs_ros.outputs.serialized import placeholders

if TYPE_CHECKING:
    from ctr_pvs import Equilibrium

PER_POSE = 7  # position and quaternion
RATES = 6  # of a position and a rotation


class NotFinite(ValueError):
    """A number that must never go out."""

    def __init__(self, what: str) -> None:
        super().__init__(f"{what}: the solver returned numbers that are not finite")


class Forms:
    """Serializes answers for one robot. Stamps are bytes, see ``serialized.stamp_bytes``.

    Every function raises NotFinite rather than pass on a NaN or an infinity.
    """

    def __init__(self, joints: Joints, frame_id: str) -> None:
        self._frame_id = frame_id
        self._in_turn = joints.in_turn
        names = list(joints.names)
        count = len(names)
        positions, efforts = placeholders(count), placeholders(count, run=1)
        joint_state = JointState(header=Header(stamp=STAMP), name=names, position=positions, effort=efforts)
        self._joints = Form(joint_state, (STAMP, positions, efforts))
        self._doubles = struct.Struct(f"={count}d")
        numbers = placeholders(PER_POSE)
        self._tip = Form(PoseStamped(header=self._header(), pose=_pose(numbers)), (STAMP, numbers))
        rates = placeholders(RATES * count)
        self._jacobian = Form(Float64MultiArray(layout=_layout(names), data=rates), (rates,))
        self._margin = Form(Float64(data=placeholders(1)[0]), (placeholders(1),))
        self._backbone = lru_cache(maxsize=1)(self._backbone_form)

    def margin(self, equilibrium: Equilibrium) -> bytes:
        """std_msgs/Float64: the stability margin."""
        return self._margin.fill(struct.pack("=d", _finite(float(equilibrium.stability_margin), "margin")))

    def joints(self, equilibrium: Equilibrium, stamp: bytes) -> bytes:
        """sensor_msgs/JointState: the solved command [rad and m], with torque and force as effort [N m and N]."""
        effort = self._in_turn(equilibrium.torque, equilibrium.force)
        _finite(sum(effort), "loads")
        position = self._in_turn(equilibrium.alpha, equilibrium.D)
        return self._joints.fill(stamp, self._doubles.pack(*position), self._doubles.pack(*effort))

    def jacobian(self, equilibrium: Equilibrium) -> bytes:
        """std_msgs/Float64MultiArray: rates of the tip [m and rad], row by row, by the joints [rad and m] in turn."""
        of_alpha, of_D = np.split(equilibrium.jacobian, 2, axis=1)
        rates: NDArray[np.float64] = np.array([self._in_turn(*row) for row in zip(of_alpha, of_D, strict=True)])
        _finite(float(rates.sum()), "jacobian")
        return self._jacobian.fill(rates.tobytes())

    def tip(self, equilibrium: Equilibrium, stamp: bytes) -> bytes:
        """geometry_msgs/PoseStamped: the tip, m."""
        tip = equilibrium.tip
        numbers = tip.position.tolist() + tip.orientation.tolist()
        _finite(sum(numbers), "tip")
        return self._tip.fill(stamp, struct.pack("=7d", *numbers))

    def backbone(self, backbone: Backbone, stamp: bytes) -> bytes:
        """geometry_msgs/PoseArray: the backbone from the orifice to the tip, m."""
        poses: NDArray[np.float64] = np.concatenate((backbone.position, backbone.orientation), axis=1)
        _finite(float(poses.sum()), "backbone")
        return self._backbone(len(poses)).fill(stamp, poses.tobytes())

    def _backbone_form(self, count: int) -> Form:
        numbers = placeholders(PER_POSE * count)
        rows = np.reshape(numbers, (count, PER_POSE))
        return Form(PoseArray(header=self._header(), poses=[_pose(row) for row in rows.tolist()]), (STAMP, numbers))

    def _header(self) -> Header:
        return Header(stamp=STAMP, frame_id=self._frame_id)


def _layout(joint_names: list[str]) -> MultiArrayLayout:
    """Of 6 rows, each with an entry for every joint; the labels say what they are."""
    count = len(joint_names)
    rows = MultiArrayDimension(label="x y z rx ry rz", size=RATES, stride=RATES * count)
    return MultiArrayLayout(dim=[rows, MultiArrayDimension(label=" ".join(joint_names), size=count, stride=count)])


def _pose(numbers: list[float]) -> Pose:
    return pose_of(np.array(numbers[:3]), np.array(numbers[3:]))


def _finite(value: float, what: str) -> float:
    """``value``, or NotFinite; a sum is finite only where all its terms are."""
    if not math.isfinite(value):
        raise NotFinite(what)
    return value
