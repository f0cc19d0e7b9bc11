"""The fields of an equilibrium along the robot, read off a state of the kernel."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.answer.engine import Engine
from ctr_pvs.answer.state import State
from ctr_pvs.model.materials import Materials
from ctr_pvs.model.materials import shared_curvature
from ctr_pvs.model.sections import piecewise_domain
from ctr_pvs.model.shape import Shape

Array = NDArray[np.float64]


class TorsionShape(Shape):
    """The shape of a ``state``: curvature follows the twist point by point, eq. (26)."""

    def __init__(self, engine: Engine, state: State) -> None:
        super().__init__(Materials(engine.robot, piecewise_domain(engine.robot, state.D)), state.alpha)
        self.engine, self.state = engine, state
        self.twists = state.twists

    def places(self, m: int, x: Array) -> Array:
        """Arc lengths (g,) [m] of the places x (g,) in [0, 1] of section m."""
        start, end = self.domain.boundaries[m : m + 2]
        return np.ascontiguousarray(start + x * (end - start))

    def angle(self, m: int, x: Array) -> Array:
        return self.engine.angles(self.state.vector, self.places(m, x))[0]

    def twist_rate(self, m: int, x: Array) -> Array:
        torque = self.engine.angles(self.state.vector, self.places(m, x))[1]
        stiffness = self.materials.torsional[m]
        return np.divide(torque, stiffness, out=np.zeros_like(torque), where=stiffness > 0.0)

    def curvature(self, m: int, x: Array) -> NDArray[np.complex128]:
        kappa = self.materials.pre_curvature(m, self.places(m, x))
        stiffness = self.materials.bending[m]
        return shared_curvature(stiffness, stiffness * kappa * np.exp(1j * self.angle(m, x)))

    def panels(self, m: int) -> int:
        start, end = self.domain.boundaries[m : m + 2]
        middle = self._elements[:, :2].mean(axis=1)
        return int(np.count_nonzero((middle > start) & (middle < end)))

    @cached_property
    def _elements(self) -> Array:
        return self.engine.elements(self.state.vector)

    @cached_property
    def angle_at_boundaries(self) -> Array:
        return self.engine.angles(self.state.vector, self.domain.boundaries)[0]
