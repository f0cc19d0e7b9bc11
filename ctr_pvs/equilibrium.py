"""The answer to one command: an equilibrium and everything derived from it, each computed when first asked for."""

from __future__ import annotations

from dataclasses import dataclass
from dataclasses import field
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.actuation import Loads
from ctr_pvs.backbone import Backbone
from ctr_pvs.backbone import Pose
from ctr_pvs.backbone import chain
from ctr_pvs.backbone import poses
from ctr_pvs.backbone import tip_pose
from ctr_pvs.continuation import State
from ctr_pvs.lazy import lazy
from ctr_pvs.pieces import Piece
from ctr_pvs.pieces import State as PieceState
from ctr_pvs.pvs.printed_loads import printed_forces
from ctr_pvs.refine import INTEGRATION_SHARE
from ctr_pvs.serve import Position
from ctr_pvs.shape import Shape
from ctr_pvs.shape import TorsionShape
from ctr_pvs.snap import Snap
from ctr_pvs.solution import Solution
from ctr_pvs.status import NoEquilibriumError
from ctr_pvs.status import Status

Array = NDArray[np.float64]


@dataclass(eq=False)
class Equilibrium:
    """What came of one command.

    alpha, D : (N,) the command [rad], [m].
    status, message : the outcome, in one word and in one line; ``success`` is true for "ok" and "snap".
    fidelity : model level; degrees_of_freedom : number of unknowns solved for.
    known_estimate : of the tip error, where it was needed to solve; see ``error_estimate``.
    residual : bound of the twist [rad] that the unbalanced torque left after the solve would cause; NaN without an
        equilibrium.
    iterations : Newton iterations spent on the way from the start to this answer.
    snaps : the snaps on the way, each with its place on the path, the states before and after, and the energy released.

    Shapes and loads raise ``NoEquilibriumError`` where there is no equilibrium.  Where the tolerance was missed they
    are there, while ``success`` is false.
    """

    alpha: Array
    D: Array
    status: Status
    message: str
    tolerance: float
    fidelity: str
    force_model: str = "virtual_work"
    known_estimate: float = np.nan
    residual: float = np.nan
    iterations: int = 0
    source: Position | Solution | None = field(default=None, repr=False)
    snaps: tuple[Snap, ...] = field(default=(), repr=False)

    @property
    def success(self) -> bool:
        return self.status.success

    @property
    def degrees_of_freedom(self) -> int:
        return self._solved.degrees_of_freedom

    @lazy
    def error_estimate(self) -> float:
        """Estimated tip error [m]: what two more polynomial degrees would change, and what integration may add.  NaN
        without an equilibrium."""
        if isinstance(self.source, Position):
            return self.source.estimate + self.integration_tolerance
        return self.known_estimate

    @property
    def reason(self) -> str:
        """Why this level and these polynomial degrees, in one line."""
        if isinstance(self.source, Position):
            return self.source.reason
        return f"{self.fidelity}: asked for; degrees were raised until two successive tips agreed"

    @lazy
    def solution(self) -> Solution | None:
        """The state that all outputs are read from."""
        return self.source.solution if isinstance(self.source, Position) else self.source

    @property
    def state(self) -> State:
        """alpha, D and torques, for those who follow paths (``continuation``)."""
        assert isinstance(self._solved.shape, TorsionShape)
        return State(self.alpha, self.D, self._solved.shape.torques)

    @property
    def _solved(self) -> Solution:
        if self.solution is None:
            raise NoEquilibriumError(f"no equilibrium to show ({self.status.value}): {self.message}")
        return self.solution

    @property
    def shape(self) -> Shape:
        """Twist and curvature fields."""
        return self._solved.shape

    @lazy
    def tip(self) -> Pose:
        """Pose of the far end: material frame of the tube that reaches farthest (ties: the innermost)."""
        return tip_pose(self._pieces, self._states[-1])

    @lazy
    def _pieces(self) -> list[Piece]:
        return self._solved.pieces(self.integration_tolerance)

    @lazy
    def _states(self) -> list[PieceState]:
        return chain(self._pieces)

    def backbone(self, n: int) -> Backbone:
        """``n`` >= 2 poses at equal spacing from the orifice to the tip; x is the tangent, roll that of ``tip``."""
        if n < 2:
            raise ValueError(f"n: expected at least 2 poses (orifice and tip), got {n}")
        return self._solved.backbone(self._pieces, self._states, self.integration_tolerance, n)

    def backbone_at(self, s: Array) -> Backbone:
        """Poses at increasing arc lengths ``s`` (g,) [m] between 0 and the robot's length."""
        return poses(self._pieces, s)

    def tube_backbone(self, tube: int, n: int) -> Backbone:
        """``n`` >= 2 poses of one tube's material frame from the orifice to its own tip; ``tube`` counts from 0."""
        end = max(0.0, float(self.shape.materials.robot.tubes[tube].length - self.D[tube]))
        s = np.linspace(0.0, min(end, self.shape.domain.length), n)
        return poses(self._solved.pieces(self.integration_tolerance, tube), s)

    @property
    def integration_tolerance(self) -> float:
        """Share of the tolerance [m] that integrating the backbone may use."""
        return INTEGRATION_SHARE * self.tolerance

    def twist(self, s: Array) -> Array:
        """psi (g, N) [rad] of each tube at arc lengths ``s`` (g,) [m]; NaN past a tube's tip."""
        return self.shape.angles_at(np.asarray(s, dtype=float))

    @lazy
    def loads(self) -> Loads:
        """Actuation loads: by virtual work, or with the forces of eq. (41) where that force model was asked for."""
        loads = self._solved.loads()
        if self.force_model == "renda2021":
            # By eq. (42) the seed's forces point along +x; on the +D axis they are the negatives.
            force = -printed_forces(self.shape)
            loads = replace(loads, force=force, force_interval=np.column_stack([force, force]))
        return loads

    @property
    def torque(self) -> Array:
        """(N,) dE/dalpha [N m]: what the actuators supply along +alpha."""
        return self.loads.torque

    @property
    def force(self) -> Array:
        """(N,) dE/dD towards +D [N]; insertion force, as surgeons count it, is its negative."""
        return self.loads.force

    @property
    def force_interval(self) -> Array:
        """(N, 2) dE/dD towards -D and towards +D [N]; equal away from kinks."""
        return self.loads.force_interval

    @property
    def kink(self) -> bool:
        """True if some D_j sits on a kink of the energy, where the holding force is an interval."""
        return bool(self.loads.kink.any())

    @lazy
    def energy(self) -> float:
        """Elastic energy [J], straightening in the guide counted."""
        return self._solved.elastic_energy()

    @lazy
    def stability_margin(self) -> float:
        """Smallest eigenvalue of the energy Hessian relative to torsional stiffness, clipped at 1; NaN without
        equilibrium."""
        return float("nan") if self.solution is None else self.solution.stability_margin()

    @lazy
    def snap_reserve(self) -> float:
        """Early warning: 1 at the relaxed robot, 0 at a fold, falling smoothly where the margin still stands at 1."""
        return self._solved.snap_reserve()

    @lazy
    def jacobian(self) -> Array:
        """(6, 2 N) rates of the tip: position [m] and rotation [rad] in base axes, by alpha [1/rad] then D [1/m]."""
        return self._solved.tip_jacobian(self.integration_tolerance)
