"""Answers at the `full` level: the seed's model with all strains free, read off its own shape.

Without external loads the torsion level is its limit, so what only the limit tells (snap reserve, Jacobian) is the
limit's.
"""

from __future__ import annotations

import math
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.answer.backbone import Backbone
from ctr_pvs.answer.backbone import Pose
from ctr_pvs.answer.equilibrium import Equilibrium
from ctr_pvs.model.shape import Shape
from ctr_pvs.pvs.frames import bishop_frames
from ctr_pvs.pvs.refine import INTEGRATION_SHARE
from ctr_pvs.pvs.refine import Refined
from ctr_pvs.pvs.virtual_work import Loads

Array = NDArray[np.float64]


class FullEquilibrium(Equilibrium):
    """An ``Equilibrium`` whose fields are those of ``refined``; the state it keeps is that of the torsion level."""

    refined: Refined

    @property
    def degrees_of_freedom(self) -> int:
        return self.refined.solution.degrees_of_freedom

    @property
    def residual(self) -> float:
        return self.refined.residual

    @property
    def error_estimate(self) -> float:
        return self.refined.estimate

    @property
    def reason(self) -> str:
        return "full: asked for; degrees were raised until two successive tips agreed"

    @property
    def shape(self) -> Shape:
        return self.refined.solution.shape

    @property
    def tip(self) -> Pose:
        poses = self.backbone_at(np.array([self.length]))
        return Pose(poses.position[0], poses.orientation[0])

    def backbone(self, n: int) -> Backbone:
        return self.backbone_at(np.linspace(0.0, self.length, self._enough(n)))

    def backbone_at(self, s: Array) -> Backbone:
        return self._poses(s, self.shape.leader)

    def tube_backbone(self, tube: int, n: int) -> Backbone:
        end = max(0.0, float(self._engine.robot.tubes[tube].length - self.command_at_tubes[1][tube]))
        return self._poses(np.linspace(0.0, min(end, self.length), self._enough(n)), tube)

    def _poses(self, s: Array, tube: int) -> Backbone:
        """Poses of the material of ``tube`` at increasing arc lengths ``s`` (g,) [m]."""
        rotation, position = bishop_frames(self.shape, s, INTEGRATION_SHARE * self.tolerance)
        rolls = self.shape.angles_held(s)[:, tube] if self.shape.domain.n_sections else self.shape.angles_at(s)[:, tube]
        rolls[s <= 0.0] = self.shape.angle_at_boundaries[0, tube]
        orientation = np.empty((len(s), 4))
        for index, (frame, roll) in enumerate(zip(rotation, rolls.tolist(), strict=True)):
            orientation[index] = _turned(_quaternion(frame), roll)
            if index and orientation[index] @ orientation[index - 1] < 0.0:
                orientation[index] = -orientation[index]
        return Backbone(s, position, orientation)

    @cached_property
    def _virtual_work(self) -> Loads:
        return self.refined.solution.loads()

    def _computed_loads(self) -> tuple[Loads, float]:
        return self._virtual_work, self.refined.solution.elastic_energy()

    @property
    def torque(self) -> Array:
        return self.loads.torque

    @cached_property
    def stability_margin(self) -> float:
        """A basis is optimistic: the smaller of its own and the limit's."""
        return min(self.refined.solution.stability_margin(), self._engine.margin(self.state.vector))


def _quaternion(R: Array) -> Array:
    """Unit quaternion x, y, z, w (4,) of a rotation (3, 3), by its largest component."""
    squares = np.array([1 + R[0, 0] - R[1, 1] - R[2, 2], 1 - R[0, 0] + R[1, 1] - R[2, 2],
                        1 - R[0, 0] - R[1, 1] + R[2, 2], 1 + R[0, 0] + R[1, 1] + R[2, 2]])  # fmt: skip
    largest = int(np.argmax(squares))
    mixed = np.array([
        [squares[0], R[0, 1] + R[1, 0], R[0, 2] + R[2, 0], R[2, 1] - R[1, 2]],
        [R[0, 1] + R[1, 0], squares[1], R[1, 2] + R[2, 1], R[0, 2] - R[2, 0]],
        [R[0, 2] + R[2, 0], R[1, 2] + R[2, 1], squares[2], R[1, 0] - R[0, 1]],
        [R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1], squares[3]],
    ])  # fmt: skip
    quaternion = mixed[largest] / (2.0 * math.sqrt(squares[largest]))
    return np.asarray(quaternion if quaternion[3] >= 0.0 else -quaternion)


def _turned(q: Array, roll: float) -> Array:
    """``q`` (4,) turned by ``roll`` [rad] about its own x axis."""
    c, s = math.cos(0.5 * roll), math.sin(0.5 * roll)
    x, y, z, w = q
    return np.array([x * c + w * s, y * c + z * s, z * c - y * s, w * c - x * s])
