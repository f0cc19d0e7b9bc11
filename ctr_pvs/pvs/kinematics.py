"""Velocities of sliding tubes: eq. (21)-(23) and (36)-(40), for any number of tubes and sections of the `full` level.

Generalised coordinates are alpha, D and the strain coordinates p; bases are functions of the place x = (s - s_m) / h
in their section.  A boundary that belongs to tube j moves with -dD_j, so sections grow from the base and from the
tip (36), and a material point of a tube slides through them.  Twists are six-vectors, angular part first; P motions are
treated at once.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from ctr_pvs.model.sections import SAME_PLACE
from ctr_pvs.pvs.energy import FullEnergy
from ctr_pvs.pvs.frames import bishop_frames
from ctr_pvs.pvs.se3 import adjoint
from ctr_pvs.pvs.se3 import hat
from ctr_pvs.pvs.se3 import homogeneous
from ctr_pvs.pvs.se3 import inverse
from ctr_pvs.pvs.se3 import roll
from ctr_pvs.pvs.solution import FullShape

Array = NDArray[np.float64]

#: The backbone is integrated for this error [m]; rates are compared with differences in tests.
INTEGRATION = 1e-12


@dataclass(frozen=True, eq=False)
class Twists:
    """Velocity of one material frame for P motions: body (6, P) in its own axes, spatial (6, P) at the base frame."""

    body: Array
    spatial: Array


class Motion:
    """P simultaneous motions of a state q (n,) of ``energy``: rates of alpha and D (N, P), of p (n, P)."""

    def __init__(self, energy: FullEnergy, q: Array, alpha_rate: Array, D_rate: Array, q_rate: Array) -> None:
        self.energy, self.q = energy, q
        self.shape = FullShape(energy, q)
        self.alpha_rate, self.D_rate, self.q_rate = alpha_rate, D_rate, q_rate
        self.sections = energy.space.sections
        self.start_rate = [self._boundary_rate(section.start) for section in self.sections]
        self.length_rate = [
            self._boundary_rate(section.start + section.length) - start
            for section, start in zip(self.sections, self.start_rate, strict=True)
        ]

    def _boundary_rate(self, s: float) -> Array:
        """(P,) motion of the boundary at ``s``: with the tube that has a break there, none for the orifice."""
        if abs(s) > SAME_PLACE:
            domain = self.energy.materials.domain
            for tube, base in enumerate(domain.D):
                if np.abs(self.energy.materials.robot.tubes[tube].breaks - base - s).min() <= 2 * SAME_PLACE:
                    rate: Array = -self.D_rate[tube]
                    return rate
        return np.zeros(self.D_rate.shape[1])

    def angle_rate(self, number: int, x: Array) -> Array:
        """(g, N, P) d psi at the fixed places ``x`` of section ``number``."""
        space = self.energy.space
        maps = space.maps(number, x)
        rate = self.alpha_rate + maps.angle @ self.q_rate
        before = np.zeros(self.alpha_rate.shape)
        for earlier in range(number):
            twist = (space.maps(earlier, np.ones(1)).angle - space.maps(earlier, np.zeros(1)).angle)[0] @ self.q
            before = before + twist[:, None] * self.length_rate[earlier] / self.sections[earlier].length
        inside = (maps.angle - space.maps(number, np.zeros(1)).angle) @ self.q
        return rate + before + inside[:, :, None] * self.length_rate[number] / self.sections[number].length

    def strain_rate(self, number: int, x: Array) -> Array:
        """(g, 6, P) d(h xi) of the Bishop frame at the fixed places ``x`` of section ``number``."""
        section = self.sections[number]
        k = self.shape.curvature(section.index, x)
        turn = np.exp(1j * self.shape.angle(section.index, x)[:, section.lead])
        if len(section.tubes) == 1:  # its own rest shape slides through the section
            s = section.start + section.length * x
            steepness = self.energy.materials.pre_curvature_rate(section.index, s)[:, section.lead] * turn
            motion = self.start_rate[number] + x[:, None] * self.length_rate[number] + self.D_rate[section.lead]
            own = steepness[:, None] * motion
        else:
            bent = self.energy.space.maps(number, x).curvature @ self.q_rate
            own = (bent[:, 0] + 1j * bent[:, 1]) * turn[:, None]
        k_rate = own + 1j * k[:, None] * self.angle_rate(number, x)[:, section.lead]
        swing = section.length * k_rate + k[:, None] * self.length_rate[number]
        out = np.zeros((len(x), 6, swing.shape[1]))
        out[:, 1], out[:, 2], out[:, 3] = swing.real, swing.imag, self.length_rate[number]
        return out

    def material_twists(self, tube: int, X: float) -> Twists:
        """Velocity of tube ``tube``'s material frame at its abscissa ``X`` [m] (eq. 37, 40)."""
        s = X - self.energy.materials.domain.D[tube]
        number = self._section_of(tube, s)
        section = self.sections[number]
        x = np.array([(s - section.start) / section.length])
        slip = -self.D_rate[tube] - self.start_rate[number] - x[0] * self.length_rate[number]
        turning = self.angle_rate(number, x)[0, tube]
        turning = turning + (self.energy.space.maps(number, x).rate[0, tube] @ self.q) * slip
        if section.bends:
            frame, spatial = self._frame_twist(number, float(x[0]))
            k = self.shape.curvature(section.index, x)[0]
            tangent = np.array([0.0, k.real, k.imag, 1.0, 0.0, 0.0])
            spatial = spatial + adjoint(frame) @ tangent[:, None] * slip
        else:  # in the guide frames only translate along x
            frame = np.eye(4)
            frame[0, 3] = s
            spatial = np.zeros((6, slip.size))
            spatial[3] = -self.D_rate[tube]
        psi = float(self.energy.alpha[tube] + self.energy.space.maps(number, x).angle[0, tube] @ self.q)
        own = frame @ roll(np.array(psi))
        axis = np.zeros((6, 1))
        axis[0] = 1.0
        spatial = spatial + adjoint(own) @ axis * turning
        return Twists(adjoint(inverse(own)) @ spatial, spatial)

    def _section_of(self, tube: int, s: float) -> int:
        for number, section in enumerate(self.sections):
            if tube in section.tubes and section.start <= s <= section.start + section.length:
                return number
        raise ValueError(f"X: expected a place on tube {tube} between its base and its tip, got s = {s:g} m")

    def _frame_twist(self, number: int, x: float) -> tuple[Array, Array]:
        """Bishop frame (4, 4) and its spatial twist (6, P) at the fixed place ``x`` of section ``number``."""
        rule = self.energy.rule
        pieces = [(m, 1.0) for m in range(number) if self.sections[m].bends] + [(number, x)]
        places = [self.sections[m].start + self.sections[m].length * part * rule.x for m, part in pieces]
        section = self.sections[number]
        stops = np.concatenate([np.zeros(1), *places, [section.start + x * section.length]])
        frames = homogeneous(*bishop_frames(self.shape, stops, INTEGRATION))
        spatial = np.zeros((6, self.alpha_rate.shape[1]))
        start = 1
        for m, part in pieces:
            here = adjoint(frames[start : start + len(rule.x)])
            spatial += part * np.einsum("g,gij,gjp->ip", rule.weights, here, self.strain_rate(m, part * rule.x))
            start += len(rule.x)
        return frames[-1], spatial


def strain_jacobian(energy: FullEnergy, q: Array, tube: int, X: float) -> Array:
    """J_j (6, n) of eq. (23): body twist of tube ``tube`` at ``X`` [m] per rate of q, with alpha and D held.

    Columns of B_1 coordinates are Ad^-1 S_1 (21), those of B_theta coordinates J_theta (22) carried along.
    """
    still = np.zeros((len(energy.alpha), energy.n))
    return Motion(energy, q, still, still, np.eye(energy.n)).material_twists(tube, X).body


def growing_section_twist(
    strain: Callable[[float], Array],
    strain_rate: Callable[[float], Array],
    interval: tuple[float, float],
    interval_rate: tuple[float, float],
) -> Array:
    """Eq. (37): body twist (6,) at the tip of a rod section on [a(t), b(t)] with g(a) = I.

    strain, strain_rate : xi (6,) and its time derivative as functions of the material abscissa X [m];
    interval, interval_rate : (a, b) [m] and their rates.
    """
    a, b = interval

    def slope(X: float, y: Array) -> Array:
        g = y[:16].reshape(4, 4)
        xi = strain(X)
        step = np.zeros((4, 4))
        step[:3, :3], step[:3, 3] = hat(xi[:3]), xi[3:]
        return np.concatenate([(g @ step).ravel(), adjoint(g) @ strain_rate(X)])

    start = np.concatenate([np.eye(4).ravel(), np.zeros(6)])
    end = solve_ivp(slope, (a, b), start, method="DOP853", rtol=1e-12, atol=1e-14).y[:, -1]
    back = adjoint(inverse(end[:16].reshape(4, 4)))
    twist: Array = back @ (end[16:] - strain(a) * interval_rate[0]) + strain(b) * interval_rate[1]
    return twist
