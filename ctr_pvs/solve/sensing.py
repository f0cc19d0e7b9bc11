"""The force on the tip, from what is measured: actuator torques and forces, or where the tip is.

Weighted least squares on the model, by Gauss-Newton with its exact derivatives.  A measurement need not see every
direction of the force: an insertion force hardly feels what acts across a straight tip.  Such directions are named, the
answer has no part along them, and its covariance is infinite there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from numpy.typing import NDArray

from ctr_pvs.answer.equilibrium import Equilibrium
from ctr_pvs.errors import FieldError

Array = NDArray[np.float64]

MOST_STEPS = 30
#: A step shorter than this, in standard deviations of what is seen, ends the iteration.
SETTLED = 1e-6
#: Tries to halve a step that does not bring the model nearer to the measurement.
HALVINGS = 12


@dataclass(frozen=True, eq=False)
class Measured:
    """What was measured at one command: values and standard deviations, each None or as many numbers as named.

    torque (N,) [N m] and force (N,) [N] : of the actuators, along +alpha and +D.  position (3,) [m] : of the tip.
    """

    torque: Array | None
    force: Array | None
    position: Array | None
    torque_std: Array
    force_std: Array
    position_std: Array

    def residual(self, answer: Equilibrium) -> Array:
        """(m,) measured less told by the model, in standard deviations."""
        parts = []
        if self.torque is not None:
            parts.append((self.torque - answer.torque) / self.torque_std)
        if self.force is not None:
            parts.append((self.force - answer.force) / self.force_std)
        if self.position is not None:
            parts.append((self.position - answer.tip.position) / self.position_std)
        return np.concatenate(parts)

    def jacobian(self, answer: Equilibrium) -> Array:
        """(m, 3) how what the model tells changes with the force on the tip [1/N], in standard deviations."""
        N, parts = len(answer.D), []
        if self.torque is not None:
            parts.append(answer.load_jacobian[:N, :3] / self.torque_std[:, None])
        if self.force is not None:
            parts.append(answer.load_jacobian[N:, :3] / self.force_std[:, None])
        if self.position is not None:
            parts.append(answer.compliance[:3, :3] / self.position_std[:, None])
        return np.concatenate(parts)


@dataclass(frozen=True, eq=False)
class SensedForce:
    """A force on the tip, and what is known of it.

    force : (3,) [N], base axes.  covariance : (3, 3) [N^2], infinite entries where a direction is not seen.
    unseen : (k, 3) unit vectors of the directions whose standard deviation would be above ``largest_std``.
    misfit : root mean square of what is left between measurement and model, in standard deviations; about 1 or less
    where the model and the deviations are right.  equilibrium : of the model under this force.
    """

    success: bool
    message: str
    force: Array
    covariance: Array
    unseen: Array
    misfit: float
    iterations: int
    equilibrium: Equilibrium


def measured(
    tubes: int,
    torque: ArrayLike | None,
    force: ArrayLike | None,
    position: ArrayLike | None,
    torque_std: ArrayLike,
    force_std: ArrayLike,
    position_std: ArrayLike,
) -> Measured:
    """The arguments of ``EquilibriumSolver.sense_tip_force``, checked."""
    if torque is None and force is None and position is None:
        raise FieldError("torque, force, tip_position", None, "at least one of them, measured")
    return Measured(
        _vector("torque", torque, tubes),
        _vector("force", force, tubes),
        _vector("tip_position", position, 3),
        _deviations("torque_std", torque_std, tubes),
        _deviations("force_std", force_std, tubes),
        _deviations("position_std", position_std, 3),
    )


def sense(
    solve: Callable[[Array], Equilibrium], told: Measured, start: Array, largest_std: float
) -> SensedForce:  # fmt: skip
    """Fits the force on the tip to what was measured; ``solve`` gives the equilibrium under a force (3,) [N]."""
    force, answer = start.copy(), solve(start)
    unseen, covariance = np.eye(3), np.full((3, 3), np.inf)
    for step in range(1, MOST_STEPS + 1):
        if not answer.success:
            return _told(False, f"no equilibrium to compare with: {answer.message}", force, np.eye(3), covariance, told,
                         step, answer)  # fmt: skip
        residual = told.residual(answer)
        left, sizes, right = np.linalg.svd(told.jacobian(answer), full_matrices=False)
        sizes = np.concatenate([sizes, np.zeros(3 - len(sizes))])
        left, right = left[:, :3], np.linalg.qr(right.T, mode="complete")[0].T if len(right) < 3 else right
        seen = sizes * largest_std > 1.0
        along = (left.T @ residual)[seen[: left.shape[1]]] / sizes[seen]
        move = right[seen].T @ along
        covariance = _covariance(right, sizes, seen)
        unseen = right[~seen]
        if np.linalg.norm(sizes[seen] * along) < SETTLED:
            return _told(True, _seen(unseen), force, unseen, covariance, told, step, answer)
        force, better = _nearer(solve, told, force, move, residual)
        if better is None:
            return _told(True, _seen(unseen), force, unseen, covariance, told, step, answer)
        answer = better
    return _told(False, f"no rest after {MOST_STEPS} steps", force, unseen, covariance, told, MOST_STEPS, answer)


def _nearer(
    solve: Callable[[Array], Equilibrium], told: Measured, force: Array, move: Array, residual: Array
) -> tuple[Array, Equilibrium | None]:
    """The force moved by ``move``, or by a part of it that brings the model nearer; None with it if none does."""
    before = float(residual @ residual)
    for halving in range(HALVINGS):
        there = force + move * 0.5**halving
        answer = solve(there)
        if answer.success:
            after = told.residual(answer)
            if float(after @ after) < before:
                return there, answer
    return force, None


def _covariance(right: Array, sizes: Array, seen: NDArray[np.bool_]) -> Array:
    """(3, 3) [N^2]; infinite where a direction that is not seen takes part."""
    covariance = (right[seen].T / sizes[seen] ** 2) @ right[seen]
    hidden = right[~seen]
    if len(hidden):
        takes_part = np.abs(hidden).max(axis=0) > 1e-9
        covariance[np.ix_(takes_part, takes_part)] = np.inf
    return np.asarray(covariance)


def _seen(unseen: Array) -> str:
    if not len(unseen):
        return "all directions are seen"
    directions = "; ".join("(" + ", ".join(f"{x:.3f}" for x in row) + ")" for row in unseen)
    return f"not seen, and left at 0 from where it started: {directions}"


def _told(
    success: bool, message: str, force: Array, unseen: Array, covariance: Array, told: Measured, steps: int,
    answer: Equilibrium,
) -> SensedForce:  # fmt: skip
    misfit = float(np.sqrt(np.mean(told.residual(answer) ** 2))) if answer.success else float("nan")
    return SensedForce(success, message, force, covariance, unseen, misfit, steps, answer)


def _vector(name: str, value: ArrayLike | None, count: int) -> Array | None:
    if value is None:
        return None
    array = np.asarray(value)
    if array.shape != (count,) or array.dtype.kind not in "iuf" or not np.isfinite(array).all():
        raise FieldError(name, value, f"{count} finite numbers")
    return array.astype(np.float64)


def _deviations(name: str, value: ArrayLike, count: int) -> Array:
    array = np.asarray(value)
    if array.shape not in ((), (count,)) or array.dtype.kind not in "iuf" or not (array > 0.0).all():
        raise FieldError(name, value, f"a standard deviation above 0, or {count} of them")
    return np.broadcast_to(array.astype(np.float64), (count,))
