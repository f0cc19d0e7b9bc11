"""Independent ways to know an equilibrium: integration of the field's boundary-value model from the tips to the bases.

For given twist angles at the tubes' tips, where torques vanish, the torsion equations of N overlapping tubes,

    (GJ_i psi_i')' = (K_i / sum K) Im[conj(sum_j K_j exp(i psi_j) kappa*_j) exp(i psi_i) kappa*_i],

integrate backwards to the bases without any root finding: the base angles alpha come out.  An equilibrium is right
if those are the commanded ones.  Nothing here uses the package's energy, basis or quadrature.
"""

from __future__ import annotations

import itertools

import numpy as np
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from ctr_pvs import Robot

TIGHT = {"rtol": 1e-12, "atol": 1e-13, "method": "DOP853"}


def _places(robot: Robot, D: np.ndarray) -> np.ndarray:
    """All segment boundaries and tips beyond the orifice, and the orifice, in order."""
    places = np.concatenate([tube.breaks - base for tube, base in zip(robot.tubes, D, strict=True)])
    return np.unique(np.concatenate([[0.0], places[places > 1e-12]]))


def _materials(robot: Robot, D: np.ndarray, middle: float):
    """(tube, segment, abscissa of the segment's start in s) of every tube present at ``middle``."""
    for index, (tube, base) in enumerate(zip(robot.tubes, D, strict=True)):
        if middle < tube.length - base:
            segment = int(np.searchsorted(tube.breaks, middle + base, side="right")) - 1
            yield index, tube.segments[segment], tube.breaks[segment] - base


def _field(robot: Robot, D: np.ndarray, middle: float):
    """Functions of (s, psi): total moment over stiffness, k, and the torque rates of all tubes."""
    present = list(_materials(robot, D, middle))
    stiffness = sum(segment.bending_stiffness for _, segment, _ in present)

    def moments(s, psi):
        return {j: g.bending_stiffness * np.exp(1j * psi[j]) * g.pre_curvature(s - start) for j, g, start in present}

    def curvature(s, psi):
        return sum(moments(s, psi).values()) / stiffness

    def rates(s, psi):
        pull = moments(s, psi)
        total = np.conj(sum(pull.values()))
        out = np.zeros(len(psi))
        for j, b in pull.items():
            out[j] = (total * b).imag / stiffness
        return out

    return present, curvature, rates


def base_angles(robot: Robot, D: np.ndarray, tip_angles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """alpha (N,) and base torques GJ psi' (N,) that belong to ``tip_angles`` (N,) at the tubes' own tips."""
    psi, torque = np.array(tip_angles, dtype=float), np.zeros(robot.n_tubes)
    places = _places(robot, D)
    for a, b in zip(places[-2::-1], places[:0:-1], strict=True):
        present, _, rates = _field(robot, D, 0.5 * (a + b))
        compliance = np.zeros(robot.n_tubes)
        for j, segment, _ in present:
            compliance[j] = 1.0 / segment.torsional_stiffness

        def slope(s, y, rates=rates, compliance=compliance):
            n = len(compliance)
            return np.concatenate([y[n:] * compliance, rates(s, y[:n])])

        end = solve_ivp(slope, (b, a), np.concatenate([psi, torque]), **TIGHT).y[:, -1]
        psi, torque = end[: robot.n_tubes], end[robot.n_tubes :]
    guide = np.zeros(robot.n_tubes)
    for j, (tube, base) in enumerate(zip(robot.tubes, D, strict=True)):
        for start, segment in zip(tube.breaks, tube.segments, strict=False):
            guide[j] += np.clip(base - start, 0.0, segment.length) / segment.torsional_stiffness
    return psi - guide * torque, torque


def tip_position(robot: Robot, D: np.ndarray, orifice_angles: np.ndarray, base_torque: np.ndarray) -> np.ndarray:
    """Tip (3,) [m] by integrating torsion and the Bishop frame forwards from the orifice as one initial-value
    problem."""
    n = robot.n_tubes
    state = np.concatenate([orifice_angles, base_torque, np.eye(3).ravel(), np.zeros(3)])
    places = _places(robot, D)
    for a, b in itertools.pairwise(places):
        present, curvature, rates = _field(robot, D, 0.5 * (a + b))
        compliance = np.zeros(n)
        for j, segment, _ in present:
            compliance[j] = 1.0 / segment.torsional_stiffness

        def slope(s, y, curvature=curvature, rates=rates, compliance=compliance):
            k = curvature(s, y[:n])
            turn = np.array([[0, -k.imag, k.real], [k.imag, 0, 0], [-k.real, 0, 0]])
            frame = y[2 * n : 2 * n + 9].reshape(3, 3)
            return np.concatenate([y[n : 2 * n] * compliance, rates(s, y[:n]), (frame @ turn).ravel(), frame[:, 0]])

        state = solve_ivp(slope, (a, b), state, **TIGHT).y[:, -1]
    return state[-3:]


def integrate_rod(laws, s):
    """Rotations (n, 3, 3) and positions (n, 3) at ``s`` of rods with curvature laws ((length, k(s)), ..), by DOP853."""
    state, start = np.concatenate([np.eye(3).ravel(), np.zeros(3)]), 0.0
    rows = np.empty((len(s), 12))
    for length, k in laws:

        def slope(x, y, k=k):
            turn = np.array([[0, -k(x).imag, k(x).real], [k(x).imag, 0, 0], [-k(x).real, 0, 0]])
            frame = y[:9].reshape(3, 3)
            return np.concatenate([(frame @ turn).ravel(), frame[:, 0]])

        run = solve_ivp(slope, (0.0, length), state, rtol=1e-12, atol=1e-14, method="DOP853", dense_output=True)
        here = (s >= start) & (s <= start + length + 1e-15)
        rows[here] = run.sol(np.minimum(s[here] - start, length)).T
        state, start = run.y[:, -1], start + length
    return rows[:, :9].reshape(-1, 3, 3), rows[:, 9:]


def rolls(psi):
    return Rotation.from_rotvec(psi[:, None] * np.array([1.0, 0.0, 0.0]))
