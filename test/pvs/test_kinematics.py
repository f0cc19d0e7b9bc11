"""Sliding kinematics, eq. (21)-(23) and (36)-(40), against differences of poses of material points."""

from __future__ import annotations

import numpy as np
import pytest
from random_robots import random_D
from random_robots import random_robot
from scipy.integrate import solve_ivp
from scipy.linalg import logm

from ctr_pvs.model.materials import Materials
from ctr_pvs.model.sections import piecewise_domain
from ctr_pvs.pvs.energy import FullEnergy
from ctr_pvs.pvs.frames import bishop_frames
from ctr_pvs.pvs.kinematics import Motion
from ctr_pvs.pvs.kinematics import growing_section_twist
from ctr_pvs.pvs.kinematics import strain_jacobian
from ctr_pvs.pvs.se3 import adjoint
from ctr_pvs.pvs.se3 import coadjoint
from ctr_pvs.pvs.se3 import hat
from ctr_pvs.pvs.se3 import homogeneous
from ctr_pvs.pvs.se3 import inverse
from ctr_pvs.pvs.se3 import roll
from ctr_pvs.pvs.se3 import small_adjoint
from ctr_pvs.pvs.se3 import small_coadjoint
from ctr_pvs.pvs.solution import FullShape
from ctr_pvs.pvs.strain_basis import PolynomialBasis

BASIS = PolynomialBasis(2)


def vee(matrix):
    return np.array([matrix[2, 1], matrix[0, 2], matrix[1, 0], *matrix[:3, 3]])


def full_energy(robot, alpha, D):
    return FullEnergy(Materials(robot, piecewise_domain(robot, D)), alpha, BASIS)


def material_pose(robot, alpha, D, q, tube, X):
    """Pose (4, 4) of a material frame, straight from the shape."""
    shape = FullShape(full_energy(robot, alpha, D), q)
    s = X - D[tube]
    if s < 0.0:
        frame = np.eye(4)
        frame[0, 3] = s
        guided = [n for n, sec in enumerate(shape.energy.space.sections) if not sec.bends and tube in sec.tubes]
        for number in guided:
            section = shape.energy.space.sections[number]
            x = (s - section.start) / section.length
            if 0.0 <= x <= 1.0:
                psi = alpha[tube] + shape.energy.space.maps(number, np.array([x])).angle[0, tube] @ q
                return frame @ roll(psi)
        raise AssertionError("the place is on no guided section")
    rotations, positions = bishop_frames(shape, np.array([0.0, s]), 1e-13)
    return homogeneous(rotations[-1], positions[-1]) @ roll(shape.angles_at(np.array([s]))[0, tube])


@pytest.mark.parametrize("seed", range(10))
def test_material_twists_match_differences(seed):
    """Any tube, in the guide and beyond, under simultaneous rates of alpha, D and p."""
    rng = np.random.default_rng([seed, 41])
    robot = random_robot(rng, 2 + seed % 2)
    alpha, D = rng.uniform(-1, 1, robot.n_tubes), random_D(rng, robot)
    energy = full_energy(robot, alpha, D)
    q = 2.0 * rng.standard_normal(energy.n)
    alpha_rate, D_rate = rng.standard_normal(robot.n_tubes), 0.1 * rng.standard_normal(robot.n_tubes)
    q_rate = rng.standard_normal(energy.n)
    motion = Motion(energy, q, alpha_rate[:, None], D_rate[:, None], q_rate[:, None])
    h = 1e-6
    compared = 0
    for tube, material in enumerate(robot.tubes):
        for share in (0.03, 0.4, 0.8, 0.97):
            X = share * material.length
            here = material_pose(robot, alpha, D, q, tube, X)
            steps = [(alpha + s * h * alpha_rate, D + s * h * D_rate, q + s * h * q_rate) for s in (1, -1)]
            if len({full_energy(robot, *step[:2]).n for step in steps} | {energy.n}) > 1:
                continue  # a section appears or vanishes in between
            ahead, behind = (material_pose(robot, *step, tube, X) for step in steps)
            body = vee(logm(inverse(behind) @ ahead).real) / (2 * h)
            twists = motion.material_twists(tube, X)
            assert twists.body[:, 0] == pytest.approx(body, rel=1e-5, abs=1e-6)
            assert adjoint(here) @ twists.body[:, 0] == pytest.approx(twists.spatial[:, 0], abs=1e-12)
            compared += 1
    assert compared >= 4


def test_strain_jacobian_collects_single_coordinates():
    rng = np.random.default_rng(2)
    robot = random_robot(rng, 3)
    alpha, D = rng.uniform(-1, 1, 3), random_D(rng, robot)
    energy = full_energy(robot, alpha, D)
    q = rng.standard_normal(energy.n)
    X = 0.9 * robot.tubes[2].length
    jacobian = strain_jacobian(energy, q, 2, X)
    h = 1e-5
    for column in rng.integers(0, energy.n, 8):
        shift = np.zeros(energy.n)
        shift[column] = h
        ahead, behind = (material_pose(robot, alpha, D, q + s * shift, 2, X) for s in (1, -1))
        assert jacobian[:, column] == pytest.approx(vee(logm(inverse(behind) @ ahead).real) / (2 * h), abs=1e-7)


def test_growing_section():
    """Eq. (36) and (37): a section that changes strain while both its ends move through the material."""

    def strain(X, t=0.0):
        return np.array([3 * np.cos(9 * X + t), 8 * X + t, 5 * np.sin(20 * X - 2 * t), 1.0, 0.0, 0.0])

    def rate(X):
        return np.array([-3 * np.sin(9 * X), 1.0, -10 * np.cos(20 * X), 0.0, 0.0, 0.0])

    def tip(t):
        def slope(X, y):
            xi = strain(X, t)
            step = np.zeros((4, 4))
            step[:3, :3], step[:3, 3] = hat(xi[:3]), xi[3:]
            return (y.reshape(4, 4) @ step).ravel()

        span = (0.05 + 0.3 * t, 0.21 - 0.4 * t)
        return solve_ivp(slope, span, np.eye(4).ravel(), method="DOP853", rtol=1e-13, atol=1e-15).y[:, -1].reshape(4, 4)

    h = 1e-5
    difference = vee(logm(inverse(tip(-h)) @ tip(h)).real) / (2 * h)
    found = growing_section_twist(strain, rate, (0.05, 0.21), (0.3, -0.4))
    assert found == pytest.approx(difference, rel=1e-7, abs=1e-8)


def test_adjoints():
    """Appendix A: Ad*_g = Ad_(g^-1)^T, ad* = -ad^T, Ad of a product, and ad as the derivative of Ad."""
    rng = np.random.default_rng(3)
    g, f = roll(0.7), roll(-1.1)
    g[:3, 3], f[:3, 3] = rng.standard_normal(3), rng.standard_normal(3)
    assert np.allclose(coadjoint(g), adjoint(inverse(g)).T)
    assert np.allclose(adjoint(g @ f), adjoint(g) @ adjoint(f))
    xi, eta = rng.standard_normal(6), rng.standard_normal(6)
    assert np.allclose(small_coadjoint(xi), -small_adjoint(xi).T)
    assert np.allclose(small_adjoint(xi) @ eta, -small_adjoint(eta) @ xi)
