"""The answer to one command: an equilibrium and everything derived from it, each computed when first asked for."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.answer.backbone import Backbone
from ctr_pvs.answer.backbone import Pose
from ctr_pvs.answer.degrees import settled
from ctr_pvs.answer.engine import Engine
from ctr_pvs.answer.shape import TorsionShape
from ctr_pvs.answer.state import Snap
from ctr_pvs.answer.state import State
from ctr_pvs.answer.status import NoEquilibriumError
from ctr_pvs.answer.status import Status
from ctr_pvs.kernel.walk.step import OK
from ctr_pvs.model.packing import with_tip_point
from ctr_pvs.model.shape import Shape
from ctr_pvs.pvs.printed_loads import printed_forces
from ctr_pvs.pvs.virtual_work import Loads
from ctr_pvs.robot.loads import Loads as ExternalLoads

Array = NDArray[np.float64]

#: Degree at which the relaxed robot is looked for.
RELAXED_DEGREE = 5


@lru_cache(maxsize=16)
def spaced(n: int) -> Array:
    """``n`` numbers at equal spacing from 0 to 1; read-only, as every caller gets the same."""
    numbers = np.linspace(0.0, 1.0, n)
    numbers.flags.writeable = False
    return numbers


class Wrench(NamedTuple):
    """force (3,) [N] and moment (3,) [N m]."""

    force: Array
    moment: Array


class Equilibrium:
    """What came of one command.

    alpha, D : (N,) the command [rad], [m]; command_at_tubes : what of it reaches the tubes, (alpha, D), other than the
    command where the robot has play.
    status, message : the outcome, in one word and in one line; ``success`` is true for "ok" and "snap".
    tolerance : of the tip [m]; fidelity : model level.
    applied_loads : the external loads that act, None where none does; ``loads`` are those of the actuators.
    iterations : Newton steps spent on the way from the start to this answer.
    snaps : the snaps on the way, each with its place on the path, the states before and after, and the energy released.

    Shapes and loads raise ``NoEquilibriumError`` where there is no equilibrium.  Where the tolerance was missed they
    are there, while ``success`` is false.  Answers can be pickled.
    """

    def __init__(
        self,
        engine: Engine,
        alpha: Array,
        D: Array,
        status: Status,
        message: str,
        fidelity: str,
        force_model: str = "virtual_work",
        state: State | None = None,
        iterations: int = 0,
        snaps: tuple[Snap, ...] = (),
        loads: ExternalLoads | None = None,
        margin: float | None = None,
    ) -> None:
        self._engine, self.alpha, self.D = engine, alpha, D
        self.command_at_tubes = alpha, D
        self.status, self.message = status, message
        self.tolerance, self.fidelity, self.force_model = engine.tolerance, fidelity, force_model
        self._state, self.iterations, self.snaps = state, iterations, snaps
        self._loads: Loads | None = None
        self._margin = margin
        self.applied_loads = loads

    def __getstate__(self) -> dict[str, object]:
        """A copy, as another thread may be asking for what is computed late."""
        return self.__dict__.copy()

    @property
    def success(self) -> bool:
        return self.status.success

    @property
    def state(self) -> State:
        """The equilibrium as the kernel knows it: what a path can set out from."""
        if self._state is None:
            raise NoEquilibriumError(f"no equilibrium to show ({self.status.value}): {self.message}")
        return self._state

    @property
    def degrees_of_freedom(self) -> int:
        """Number of unknowns solved for."""
        return self.state.solved_for if self.state.twists else 0

    @property
    def residual(self) -> float:
        """Bound of the twist [rad] that the unbalanced torque left after the solve would cause; NaN without an
        equilibrium."""
        return float("nan") if self._state is None else self._state.residual

    @property
    def error_estimate(self) -> float:
        """Estimated tip error [m]: what two more polynomial degrees would change, and what integration may add.  NaN
        without an equilibrium."""
        return float("nan") if self._state is None else self._state.estimate

    @property
    def reason(self) -> str:
        """Why this level and these polynomial degrees, in one line."""
        if self.degrees_of_freedom == 0 and self.state.twists:
            return f"{self.fidelity}: no two curved tubes overlap, so nothing twists"
        moved = f"would move no point of the backbone by more than {self.error_estimate:.1e} m"
        if not self.state.twists:
            return f"torsionless: twist {moved}"
        elements = self._engine.elements(self.state.vector)
        degrees = "/".join(f"{degree:.0f}" for degree in elements[elements[:, 2] > 0.0, 3])
        where = (
            "where curved tubes overlap" if self.applied_loads is None else "where loads act or curved tubes overlap"
        )
        where = f"polynomials of degree {degrees} {where}"
        return f"{self.fidelity}: {self.degrees_of_freedom} unknowns, {where}; two more {moved}"

    @cached_property
    def shape(self) -> Shape:
        """Twist and curvature fields."""
        return TorsionShape(self._engine, self.state)

    @property
    def tip(self) -> Pose:
        """Pose of the far end: material frame of the tube that reaches farthest (ties: the innermost)."""
        tip = self.state.tip
        return Pose(tip[:3].copy(), tip[3:].copy())

    def backbone(self, n: int) -> Backbone:
        """``n`` >= 2 poses at equal spacing from the orifice to the tip; x is the tangent, roll that of ``tip``."""
        s = spaced(self._enough(n)) * self.length
        return Backbone(s, *self._engine.poses(self.state.vector, s))

    def backbone_at(self, s: Array) -> Backbone:
        """Poses at increasing arc lengths ``s`` (g,) [m] between 0 and the robot's length."""
        s = np.ascontiguousarray(s, dtype=np.float64)
        return Backbone(s, *self._engine.poses(self.state.vector, s))

    def tube_backbone(self, tube: int, n: int) -> Backbone:
        """``n`` >= 2 poses of one tube's material frame from the orifice to its own tip; ``tube`` counts from 0."""
        end = max(0.0, float(self._engine.robot.tubes[tube].length - self.command_at_tubes[1][tube]))
        s = spaced(self._enough(n)) * min(end, self.length)
        return Backbone(s, *self._engine.poses(self.state.vector, s, tube))

    @staticmethod
    def _enough(n: int) -> int:
        if n < 2:
            raise ValueError(f"n: expected at least 2 poses (orifice and tip), got {n}")
        return n

    @property
    def length(self) -> float:
        """Arc length [m] from the orifice to the farthest tip."""
        return self._engine.robot.length_beyond(self.command_at_tubes[1])

    def twist(self, s: Array) -> Array:
        """psi (g, N) [rad] of each tube at arc lengths ``s`` (g,) [m]; NaN past a tube's tip."""
        return self.shape.angles_at(np.asarray(s, dtype=float))

    @property
    def loads(self) -> Loads:
        """Actuation loads: by virtual work, or with the forces of eq. (41) where that force model was asked for."""
        if self._loads is None:
            loads, self._energy = self._computed_loads()
            if self.force_model == "renda2021":
                # By eq. (42) the seed's forces point along +x; on the +D axis they are the negatives.
                force = -printed_forces(self.shape)
                loads = replace(loads, force=force, force_interval=np.column_stack([force, force]))
            self._loads = loads
        return self._loads

    def _computed_loads(self) -> tuple[Loads, float]:
        """Loads by virtual work, and the elastic energy [J]."""
        numbers = self._numbers
        return Loads(numbers[0], numbers[1], numbers[2:0:-1].T, numbers[3] > 0.0), float(numbers[4, 0])

    @cached_property
    def _numbers(self) -> Array:
        return self._engine.loads(self.state.vector)

    @property
    def torque(self) -> Array:
        """(N,) dE/dalpha [N m]: what the actuators supply along +alpha."""
        return self.state.torque

    @property
    def force(self) -> Array:
        """(N,) dE/dD towards +D [N]; insertion force, as surgeons count it, is its negative."""
        return self.loads.force

    @property
    def force_interval(self) -> Array:
        """(N, 2) dE/dD towards -D and towards +D [N]; equal away from kinks."""
        return self.loads.force_interval

    @property
    def force_interval_reversed(self) -> NDArray[np.bool_]:
        """(N,) true where D_j sits on a concave kink of the energy: the force towards -D is larger than that towards
        +D, and no constant force holds the tube there."""
        interval = self.loads.force_interval
        return np.asarray(self.loads.kink & (interval[:, 0] > interval[:, 1]))

    @property
    def kink(self) -> bool:
        """True if some D_j sits on a kink of the energy, where the holding force is an interval."""
        return bool(self.loads.kink.any())

    @property
    def energy(self) -> float:
        """Elastic energy [J], straightening in the guide counted."""
        _ = self.loads
        return self._energy

    @property
    def potential(self) -> float:
        """Elastic energy less the work of the external forces on their way from a straight robot [J]; NaN where a
        moment acts: a dead moment has no potential."""
        if self.applied_loads is None:
            return self.energy
        return float("nan") if self.applied_loads.has_moments else float(self._numbers[4, 0] - self._numbers[5, 0])

    @property
    def base_wrench(self) -> Wrench:
        """Force [N] and moment [N m] about the orifice that the part beyond it exerts there, base axes: n(0+), m(0+).
        The guide's reaction is the negative, and ``|k(0+)|^2 sum K / 2`` along +x on the robot more."""
        wrench = self._engine.base_wrench(self.state.vector)
        return Wrench(wrench[:3], wrench[3:])

    @property
    def stability_margin(self) -> float:
        """Smallest eigenvalue of the energy Hessian relative to torsional stiffness, clipped at 1; NaN without
        equilibrium."""
        if self._margin is None:
            self._margin = float("nan") if self._state is None else self._engine.margin(self._state.vector)
        return self._margin

    @cached_property
    def snap_reserve(self) -> float:
        """Early warning: what is left of det(d alpha / d psi_tip), as a share of its value at the relaxed robot of the
        same D.

        1 at the relaxed robot, 0 at a fold, falling smoothly in between, while the margin stays at 1 until a snap is
        near. It says how much less the tips' rotations are held by the bases (Gilbert, Hendrick, Webster, T-RO 2016).
        NaN if no relaxed state was found.
        """
        return self._engine.relaxed_gain(self.command_at_tubes[1], RELAXED_DEGREE) / float(
            np.linalg.det(self._rates[1])
        )

    @cached_property
    def _all_rates(self) -> tuple[Array, Array, Array]:
        """Of the tip (6, 2 N + 6), of the tubes' ends (N, N), and of torques and forces (2 N, 6)."""
        return _stable(self._engine.rates(self.state.vector))

    @property
    def _rates(self) -> tuple[Array, Array]:
        return self._all_rates[0][:, : 2 * len(self.D)], self._all_rates[1]

    @cached_property
    def _load_rates(self) -> tuple[Array, Array]:
        """Rates of the tip (6, 6) and of torques and forces (2 N, 6) with force and moment on the tip."""
        loads = with_tip_point(self._engine.robot, self.command_at_tubes[1], self.state.loads)
        if len(loads) == len(self.state.loads):
            rates, _, actuation = self._all_rates
        else:  # bending is not free up to the tip
            code, vector = settled(self._engine, self.state.vector, loads, False)
            rates, _, actuation = _stable(self._engine.rates(vector) if code == OK else (code, *3 * (np.empty(0),)))
        return rates[:, 2 * len(self.D) :], actuation

    @property
    def compliance(self) -> Array:
        """(6, 6) rates of the tip, position [m] and rotation [rad] in base axes, by force [N] and moment [N m] on it,
        at held bases.  Symmetric unless a moment acts."""
        return self._load_rates[0]

    @property
    def load_jacobian(self) -> Array:
        """(2 N, 6) how torques [N m], then forces [N], change with force [N] and moment [N m] on the tip; without
        moments it is minus the transpose of ``jacobian``.  At a kink it holds towards +D."""
        return self._load_rates[1]

    @property
    def jacobian(self) -> Array:
        """(6, 2 N) rates of the tip: position [m] and rotation [rad] in base axes, by alpha [1/rad] then D [1/m].

        Rotation is that of the leading tube's material frame.  At a kink of the energy in D_j its column is one-sided:
        with an end of a segment on the orifice it holds towards +D; ends of two tubes on one place move with their
        mean.
        """
        return self._rates[0]


def _stable(rates: tuple[int, Array, Array, Array]) -> tuple[Array, Array, Array]:
    code, tip, ends, actuation = rates
    if code != OK:
        raise NoEquilibriumError("an unstable equilibrium has no rates: the robot would not stay on it")
    return tip, ends, actuation
