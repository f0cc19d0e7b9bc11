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
from std_msgs.msg import Header

from ctr_pvs import Backbone
from ctr_pvs_ros.commands import joint_positions
from ctr_pvs_ros.messages import pose_of
from ctr_pvs_ros.serialized import STAMP
from ctr_pvs_ros.serialized import Form
from ctr_pvs_ros.serialized import placeholders

if TYPE_CHECKING:
    from ctr_pvs import Equilibrium

PER_POSE = 7  # position and quaternion


class NotFinite(ValueError):
    """A number that must never go out."""

    def __init__(self, what: str) -> None:
        super().__init__(f"{what}: the solver returned numbers that are not finite")


class Forms:
    """Serializes answers for one robot. Stamps are bytes, see ``serialized.stamp_bytes``.

    Every function raises NotFinite rather than pass on a NaN or an infinity.
    """

    def __init__(self, joint_names: tuple[str, ...], frame_id: str) -> None:
        self._frame_id = frame_id
        count = len(joint_names)
        positions, efforts = placeholders(count), placeholders(count, run=1)
        joints = JointState(header=Header(stamp=STAMP), name=list(joint_names), position=positions, effort=efforts)
        self._joints = Form(joints, (STAMP, positions, efforts))
        self._doubles = struct.Struct(f"={count}d")
        numbers = placeholders(PER_POSE)
        self._tip = Form(PoseStamped(header=self._header(), pose=_pose(numbers)), (STAMP, numbers))
        self._margin = Form(Float64(data=placeholders(1)[0]), (placeholders(1),))
        self._backbone = lru_cache(maxsize=1)(self._backbone_form)

    def margin(self, equilibrium: Equilibrium) -> bytes:
        """std_msgs/Float64: the stability margin."""
        return self._margin.fill(struct.pack("=d", _finite(float(equilibrium.stability_margin), "margin")))

    def joints(self, equilibrium: Equilibrium, stamp: bytes) -> bytes:
        """sensor_msgs/JointState: the solved command [rad and m], with torque and force as effort [N m and N]."""
        effort = joint_positions(equilibrium.torque, equilibrium.force)
        _finite(sum(effort), "loads")
        position = joint_positions(equilibrium.alpha, equilibrium.D)
        return self._joints.fill(stamp, self._doubles.pack(*position), self._doubles.pack(*effort))

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


def _pose(numbers: list[float]) -> Pose:
    return pose_of(np.array(numbers[:3]), np.array(numbers[3:]))


def _finite(value: float, what: str) -> float:
    """``value``, or NotFinite; a sum is finite only where all its terms are."""
    if not math.isfinite(value):
        raise NotFinite(what)
    return value
