"""A state of one model level, from which every output of an answer is read."""

from __future__ import annotations

from abc import ABC
from abc import abstractmethod
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.actuation import Loads
from ctr_pvs.actuation import virtual_work_loads
from ctr_pvs.backbone import Backbone
from ctr_pvs.backbone import poses
from ctr_pvs.backbone_plan import backbone_plan
from ctr_pvs.energy import TorsionEnergy
from ctr_pvs.jacobian import tip_jacobian
from ctr_pvs.pieces import Piece
from ctr_pvs.pieces import State
from ctr_pvs.serving import Served
from ctr_pvs.serving_loads import PreparedLoads
from ctr_pvs.shape import Shape
from ctr_pvs.shape import TorsionlessShape
from ctr_pvs.shape import TorsionShape
from ctr_pvs.stability import rechecked_margin
from ctr_pvs.stability import relaxed_gain
from ctr_pvs.stability import snap_reserve

Array = NDArray[np.float64]


class Solution(ABC):
    """What an ``Equilibrium`` asks of the model level it was solved with.

    degrees_of_freedom : unknowns solved for; shape : the fields along the robot.
    """

    shape: Shape

    @property
    @abstractmethod
    def degrees_of_freedom(self) -> int: ...

    def pieces(self, tolerance: float, tube: int | None = None) -> list[Piece]:
        """The backbone for an integration error of ``tolerance`` [m]; rolls are those of ``tube``, the leader if
        None."""
        return self.shape.pieces(tolerance, tube)

    def backbone(self, pieces: list[Piece], states: list[State], tolerance: float, count: int) -> Backbone:
        """``count`` poses at equal spacing from the orifice to the tip of ``pieces``, which ``tolerance`` [m] gave;
        ``states`` : where each piece starts, and where the last one ends."""
        return poses(pieces, np.linspace(0.0, self.shape.domain.length, count))

    @abstractmethod
    def loads(self) -> Loads:
        """Actuation loads by virtual work."""

    @abstractmethod
    def elastic_energy(self) -> float:
        """Energy [J], straightening in the guide counted."""

    @abstractmethod
    def stability_margin(self) -> float:
        """Smallest eigenvalue of the energy Hessian relative to torsional stiffness, clipped at 1."""

    @abstractmethod
    def snap_reserve(self) -> float:
        """1 at the relaxed robot, 0 at a fold, falling smoothly."""

    @abstractmethod
    def tip_jacobian(self, tolerance: float) -> Array:
        """(6, 2 N) rates of the tip; ``tolerance`` [m] of the backbone's integration."""


class TorsionSolution(Solution):
    """An equilibrium q (n,) of ``energy`` under base angles ``alpha`` (N,)."""

    def __init__(self, energy: TorsionEnergy, alpha: Array, q: Array) -> None:
        self.energy, self.alpha, self.q = energy, alpha, q
        self.shape: TorsionShape = TorsionShape(energy.space, alpha, q)

    @property
    def degrees_of_freedom(self) -> int:
        return self.energy.n

    def loads(self) -> Loads:
        return virtual_work_loads(self.shape, self.energy.all_nodes)

    def elastic_energy(self) -> float:
        return self.energy.value(self.q, self.alpha) + self.energy.constant()

    def stability_margin(self) -> float:
        return rechecked_margin(self.energy, self.q, self.alpha)

    def snap_reserve(self) -> float:
        return snap_reserve(self.energy, self.q, self.alpha, relaxed_gain(self.energy))

    def tip_jacobian(self, tolerance: float) -> Array:
        return tip_jacobian(self.energy, self.shape, tolerance)


class ServedSolution(TorsionSolution):
    """What a prepared model has solved.  Outputs read all its unknowns, those that only check being zero."""

    def __init__(self, served: Served) -> None:
        self.served = served
        self.energy, self.alpha = served.model.energy, served.alpha

    @cached_property
    def q(self) -> Array:  # type: ignore[override]
        return self.served.q

    @cached_property
    def shape(self) -> TorsionShape:  # type: ignore[override]
        return TorsionShape(self.energy.space, self.alpha, self.q)

    @property
    def degrees_of_freedom(self) -> int:
        return self.served.model.n

    def pieces(self, tolerance: float, tube: int | None = None) -> list[Piece]:
        return backbone_plan(self.served.model, tolerance, tube).pieces(self.served.z)

    def backbone(self, pieces: list[Piece], states: list[State], tolerance: float, count: int) -> Backbone:
        return backbone_plan(self.served.model, tolerance, None).backbone(self.served.z, pieces, states, count)

    def snap_reserve(self) -> float:
        gain = self.served.model.prepare("relaxed gain", lambda model: relaxed_gain(model.energy))
        return snap_reserve(self.energy, self.q, self.alpha, gain)

    def loads(self) -> Loads:
        return self.served.model.prepare("loads", PreparedLoads).loads(self.served.z)

    def elastic_energy(self) -> float:
        return self.served.model.prepare("loads", PreparedLoads).energy(self.served.z)

    def stability_margin(self) -> float:
        """Of the finer model that checks: a basis is optimistic."""
        return self.served.model.margin(self.served)


class TorsionlessSolution(ServedSolution):
    """No twist anywhere: eq. (28)-(31).  The margin is that of the twist it neglects."""

    @cached_property
    def shape(self) -> TorsionlessShape:  # type: ignore[override]
        return TorsionlessShape(self.energy.space, self.alpha, self.q)

    def loads(self) -> Loads:
        return self.served.model.prepare("loads", PreparedLoads).loads(self.served.z, twists=False)

    @property
    def degrees_of_freedom(self) -> int:
        return 0
