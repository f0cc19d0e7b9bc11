"""The relaxed robot: the base angles at which no actuator needs to hold a torque.  Every cold start sets out from
there.

The relaxed state is a minimum of E over the twist *and* the base angles, at the commanded D.  Turning all tubes
together changes nothing, so tube 1 stays at 0.  Of several minima the one nearest to zero base angles is taken.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from ctr_pvs.energy import TorsionEnergy
from ctr_pvs.solve import newton
from ctr_pvs.twist import TorqueField

Array = NDArray[np.float64]

#: With more tubes than this the starts no longer try every combination of half turns.
MANY_TUBES = 4
#: Base angles closer than this [rad] are one state.
SAME_ANGLE = 1e-5
#: Where the gradient is no larger there is nothing to descend: tubes curved in one plane start out so.
LEVEL = 1e-9


@dataclass(frozen=True, eq=False)
class Relaxed:
    """alpha (N,) [rad] with alpha_1 = 0, the unknowns q (n,) there, and whether other relaxed states are as near to
    zero; the torque field there."""

    alpha: Array
    q: Array
    several: bool
    torques: TorqueField


def relaxed_state(energy: TorsionEnergy) -> Relaxed | None:
    """The relaxed state of ``energy`` nearest to zero base angles; None if the search finds no minimum."""
    tubes = energy.materials.robot.n_tubes
    if energy.n == 0:
        return Relaxed(np.zeros(tubes), np.zeros(0), False, energy.space.field(np.zeros(0)))
    joint = _JointEnergy(energy)
    minima = [found for start in _starts(energy) if (found := _minimum(joint, start)) is not None]
    if not minima:
        return None
    minima.sort(key=lambda found: (round(float(np.abs(found[0]).max()), 6), *(-found[0]).round(6)))
    alpha, q = minima[0]
    distance = np.abs(alpha).max()
    twins = [
        a for a, _ in minima[1:] if np.abs(a).max() < distance + SAME_ANGLE and np.abs(a - alpha).max() > SAME_ANGLE
    ]
    half_turn = bool(np.any(np.abs(np.abs(alpha) - np.pi) < SAME_ANGLE))  # +pi and -pi: one shape, two histories
    return Relaxed(alpha, q, bool(twins) or half_turn, energy.space.field(q))


def _starts(energy: TorsionEnergy) -> list[Array]:
    """Base angles to descend from, each once: zero, those that align the tubes' mean curvatures, half turns."""
    moments = np.sqrt(energy.coupling)[:, None] * energy.moment
    _, vectors = np.linalg.eigh(moments.T @ moments.conj())
    phase = vectors[:, -1]
    aligned = np.where(np.abs(phase) > 1e-9, np.angle(np.where(phase == 0, 1.0, phase).conj()), 0.0)
    aligned = wrapped(aligned - aligned[0])
    tubes = len(phase)
    turns = product((0.0, np.pi), repeat=tubes - 1) if tubes <= MANY_TUBES else [(0.0,) * (tubes - 1)]
    starts = [aligned + np.array([0.0, *turn]) for turn in turns]
    return starts if np.abs(aligned).max() < SAME_ANGLE else [np.zeros(tubes), *starts]


def _minimum(joint: _JointEnergy, start: Array) -> tuple[Array, Array] | None:
    """Descend E over (q, alpha_2 .. alpha_N) from ``start``; None unless it ends in a minimum."""
    energy = joint.energy
    x = joint.pack(np.zeros(energy.n), start)
    for _ in range(3):
        if np.abs(joint.gradient(x)).max() > LEVEL:
            # Not "trust-exact": scipy 1.11's can loop for ever on a singular Hessian.
            x = minimize(
                joint.value, x, jac=joint.gradient, hess=joint.hessian, method="trust-ncg", options={"gtol": LEVEL}
            ).x
        lowest, vectors = np.linalg.eigh(joint.hessian(x))
        if lowest[0] > -1e-9:
            break
        x = x + 0.1 * vectors[:, 0] * np.sign(vectors[np.argmax(np.abs(vectors[:, 0])), 0])  # leave the saddle
    else:
        return None
    q, alpha = joint.unpack(x)
    alpha = wrapped(alpha)
    polished = newton(energy, alpha, q)
    return (alpha, polished.q) if polished.converged else None


def wrapped(angle: Array) -> Array:
    """Angles in (-pi, pi]; a rounding error past -pi counts as +pi."""
    return np.pi - (np.mod(np.pi - angle + 1e-9, 2.0 * np.pi) - 1e-9)


class _JointEnergy:
    """E / E_0 as a function of x = (q / sqrt(E_0), alpha_2 .. alpha_N), E_0 a typical bending energy: all of order
    one."""

    def __init__(self, energy: TorsionEnergy) -> None:
        self.energy = energy
        self.unit = max(float(np.sum(energy.coupling[:, None] * np.abs(energy.moment) ** 2)), 1e-300)
        tubes = energy.materials.robot.n_tubes
        turns = np.broadcast_to(np.eye(tubes)[:, 1:], (len(energy.coupling), tubes, tubes - 1))
        self.directions = np.concatenate([energy.angle_map * np.sqrt(self.unit), turns], axis=2)

    def pack(self, q: Array, alpha: Array) -> Array:
        return np.concatenate([q / np.sqrt(self.unit), alpha[1:]])

    def unpack(self, x: Array) -> tuple[Array, Array]:
        return x[: self.energy.n] * np.sqrt(self.unit), np.concatenate([[0.0], x[self.energy.n :]])

    def value(self, x: Array) -> float:
        return self.energy.value(*self.unpack(x)) / self.unit

    def gradient(self, x: Array) -> Array:
        q, alpha = self.unpack(x)
        torque = self.energy.torque_density(self.energy.turned_moments(self.energy.angles(q, alpha)))
        gradient = np.tensordot(torque, self.directions, 2) / self.unit
        gradient[: self.energy.n] += x[: self.energy.n]
        return gradient

    def hessian(self, x: Array) -> Array:
        q, alpha = self.unpack(x)
        moments = self.energy.turned_moments(self.energy.angles(q, alpha))
        hessian = self.energy.curvature_form(moments, self.directions) / self.unit
        index = np.arange(self.energy.n)
        hessian[index, index] += 1.0
        return hessian
