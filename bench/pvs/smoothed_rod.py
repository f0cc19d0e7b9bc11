"""Newton's law for the axial force in two tubes whose jumps are smoothed: a check on dE/dD that knows no energy.

Nothing here uses the package's energy, basis, quadrature or solver; only the robot's numbers.  Along the overlap,

    T_j' = K_j Im[conj(k) c_j]          torque about the tangent
    N_j' = -Re[conj(k) M_j']            axial force
    M_j  = K_j (k - c_j),  c_j = exp(i psi_j) kappa*_j,  GJ_j psi_j' = T_j

with the backbone's curvature k from the balance of moments, k = g sum K_j c_j / sum K_j.  Three jumps become ramps of
width w:

* the mouth of the guide: g rises from 0 to 1 (a straight guide whose stiffness falls from infinity to nothing);
* tube 1's tip: its K_1 fades to 0, so that the curvature runs into tube 2's own;
* jumps of pre-curvature within a tube.

Then everything is smooth, no force is concentrated anywhere, and N_j in the guide is the force that holds tube j
along +D.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import newton

from ctr_pvs import Robot
from ctr_pvs import Tube

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

#: Places closer than this [m] are one.
SAME_PLACE = 1e-12

TIGHT = {"method": "DOP853", "rtol": 1e-11, "atol": 1e-13}


@dataclass(frozen=True)
class AxialForces:
    """force : (2,) [N] that holds each tube along +D.  s (g,) [m], axial (2, g) [N]: N_j along the overlap."""

    force: Array
    s: Array
    axial: Array


def smoothed_forces(robot: Robot, alpha: Array, D: Array, width: float, tip_angle: float) -> AxialForces:
    """Axial forces at base rotations ``alpha`` (2,) and positions ``D`` (2,), jumps smoothed over ``width`` [m].

    tip_angle : psi_2 - psi_1 [rad] at tube 1's tip, about: the shooting starts from it.

    Stiffnesses must be constant along each tube, and tube 1 must end inside tube 2.
    """
    rod = _SmoothedRod(robot, np.asarray(D, dtype=float), width)
    command = float(alpha[1] - alpha[0])
    found = newton(lambda angle: rod.base_angle(angle) - command, tip_angle, x1=tip_angle + 1e-4, tol=1e-12)
    return rod.forces(float(found))


class _SmoothedRod:
    def __init__(self, robot: Robot, D: Array, width: float) -> None:
        self.tubes, self.D, self.width = robot.tubes, D, width
        self.K = np.array([tube.segments[0].bending_stiffness for tube in robot.tubes])
        self.GJ = np.array([tube.segments[0].torsional_stiffness for tube in robot.tubes])
        self.end = robot.tubes[0].length - D[0]

    def places(self) -> list[float]:
        """Where ramps begin and end, from tube 1's tip back to the orifice."""
        half = 0.5 * self.width
        breaks = np.concatenate([tube.breaks - base for tube, base in zip(self.tubes, self.D, strict=True)])
        inner = np.concatenate([breaks - half, breaks + half]).tolist()
        inside = {s for s in (self.width, self.end - self.width, *inner) if SAME_PLACE < s < self.end - SAME_PLACE}
        places = [self.end]
        for s in (*sorted(inside, reverse=True), 0.0):
            if places[-1] - s > SAME_PLACE:
                places.append(s)
        return places

    def rates(self, s: float, y: Array) -> Array:
        """d/ds of (psi_1, psi_2, T_1, T_2, N_1, N_2)."""
        psi, torque = y[:2], y[2:4]
        twist = torque / self.GJ
        kappa, kappa_rate = self.pre_curvature(s)
        c = np.exp(1j * psi) * kappa
        c_rate = np.exp(1j * psi) * (kappa_rate + 1j * twist * kappa)
        fade, fade_rate = ramp((s - self.end) / self.width + 1.0, self.width)
        K, K_rate = self.K * [1.0 - fade, 1.0], self.K * [-fade_rate, 0.0]
        free, free_rate = (K @ c) / K.sum(), (K_rate @ c + K @ c_rate) / K.sum() - (K @ c) * K_rate.sum() / K.sum() ** 2
        mouth, mouth_rate = ramp(s / self.width, self.width)
        k, k_rate = mouth * free, mouth_rate * free + mouth * free_rate
        moment_rate = K_rate * (k - c) + K * (k_rate - c_rate)
        return np.concatenate([twist, K * (np.conj(k) * c).imag, -(np.conj(k) * moment_rate).real])

    def pre_curvature(self, s: float) -> tuple[ComplexArray, ComplexArray]:
        """kappa*_j [1/m] and its derivative [1/m^2] (2,) at s, jumps smoothed."""
        both = [
            _smooth_pre_curvature(tube, s + base, self.width) for tube, base in zip(self.tubes, self.D, strict=True)
        ]
        return np.array([value for value, _ in both]), np.array([rate for _, rate in both])

    def integrate(self, tip_angle: float, dense: int = 2) -> tuple[Array, Array]:
        """s (g,) and y (6, g) from tube 1's tip, where no torque and no axial force is left, back to the orifice."""
        y = np.array([0.0, tip_angle, 0.0, 0.0, 0.0, 0.0])
        s_all, y_all = [], []
        for a, b in itertools.pairwise(self.places()):
            run = solve_ivp(self.rates, (a, b), y, t_eval=np.linspace(a, b, dense), **TIGHT)
            y = run.y[:, -1]
            s_all.append(run.t)
            y_all.append(run.y)
        return np.concatenate(s_all), np.concatenate(y_all, axis=1)

    def base_angle(self, tip_angle: float) -> float:
        """alpha_2 - alpha_1 [rad] that leads to ``tip_angle``."""
        psi, torque = np.split(self.integrate(tip_angle)[1][:4, -1], 2)
        alpha = psi - torque * self.D / self.GJ
        return float(alpha[1] - alpha[0])

    def forces(self, tip_angle: float) -> AxialForces:
        s, y = self.integrate(tip_angle, dense=60)
        return AxialForces(y[4:, -1], s[::-1], y[4:, ::-1])


def ramp(x: float, width: float) -> tuple[float, float]:
    """A step from 0 to 1 over x in [0, 1], twice differentiable, and its rate along s where x = s / width."""
    x = min(max(x, 0.0), 1.0)
    return x**3 * (10.0 - 15.0 * x + 6.0 * x * x), 30.0 * x * x * (1.0 - x) ** 2 / width


def _smooth_pre_curvature(tube: Tube, X: float, width: float) -> tuple[complex, complex]:
    """kappa* and its derivative: each segment's law runs on, and takes over from the one before by a ramp."""
    value, rate = complex(tube.segments[0].pre_curvature(X)), complex(tube.segments[0].pre_curvature_rate(X))
    for boundary, before, after, start in zip(
        tube.breaks[1:], tube.segments, tube.segments[1:], tube.breaks[:-2], strict=False
    ):
        share, share_rate = ramp((X - boundary) / width + 0.5, width)
        if share or share_rate:
            jump = complex(after.pre_curvature(X - boundary) - before.pre_curvature(X - start))
            jump_rate = complex(after.pre_curvature_rate(X - boundary) - before.pre_curvature_rate(X - start))
            value, rate = value + share * jump, rate + share_rate * jump + share * jump_rate
    return value, rate
