"""Actuation loads by virtual work, of the boundary-value model's shape and of the full model: against differences of
the full model's energy, at kinks from either side."""

from __future__ import annotations

import numpy as np
import pytest
from bvp_shape import BvpShape
from bvp_shape import elastic_energy
from energy_differences import KINKS
from energy_differences import kink_robot
from random_robots import random_D
from random_robots import random_robot

from ctr_pvs.model.materials import Materials
from ctr_pvs.model.sections import piecewise_domain
from ctr_pvs.oracles.standard_model import solve_standard_bvp
from ctr_pvs.pvs.energy import FullEnergy
from ctr_pvs.pvs.solution import FullSolution
from ctr_pvs.pvs.solution import solve_full
from ctr_pvs.pvs.strain_basis import PolynomialBasis
from ctr_pvs.pvs.virtual_work import quadrature
from ctr_pvs.pvs.virtual_work import virtual_work_loads

DEGREE, NODES = 10, 18
ANGLE_STEP, LENGTH_STEP = 2e-3, 2e-5


def full(robot, alpha, D, near):
    """The full model's equilibrium next to the shape ``near``, of the same sections."""
    energy = FullEnergy(Materials(robot, piecewise_domain(robot, D)), alpha, PolynomialBasis(DEGREE), NODES)
    result = solve_full(energy, energy.project(near))
    assert result.converged
    return FullSolution(energy, result.q)


def energy_at(robot, command):
    alpha, D = np.split(command, 2)
    return full(robot, alpha, D, BvpShape(robot, alpha, D, tolerance=1e-4)).elastic_energy()


def difference(robot, alpha, D, index, step, shifts, factors):
    command = np.concatenate([alpha, D])
    values = [energy_at(robot, command + shift * step * np.eye(len(command))[index]) for shift in shifts]
    return float(np.dot(values, factors)) / step


def central(robot, alpha, D, index, step):
    return difference(robot, alpha, D, index, step, (-2, -1, 1, 2), np.array([1.0, -8.0, 8.0, -1.0]) / 12.0)


def one_sided(robot, alpha, D, tube, side):
    """Third order, per +D."""
    factors = np.array([-11.0, 18.0, -9.0, 2.0]) / 6.0
    return difference(robot, alpha, D, len(alpha) + tube, side * 1e-4, (0, 1, 2, 3), factors)


@pytest.mark.parametrize("tubes", [2, 3, 4])
@pytest.mark.parametrize("seed", range(2))
def test_loads_are_energy_derivatives(tubes, seed):
    rng = np.random.default_rng([seed, tubes, 31])
    robot = random_robot(rng, tubes)
    D, alpha = random_D(rng, robot), rng.uniform(-1.0, 1.0, tubes)
    shape = BvpShape(robot, alpha, D)
    loads = virtual_work_loads(shape, quadrature(shape, 24))
    own = full(robot, alpha, D, shape).loads()
    assert loads.torque == pytest.approx(own.torque, rel=1e-7, abs=1e-9)
    assert loads.force == pytest.approx(own.force, rel=1e-6, abs=1e-7)
    assert not own.kink.any() and np.array_equal(own.force_interval, np.column_stack([own.force, own.force]))
    assert loads.torque == pytest.approx(solve_standard_bvp(robot, alpha, D, guess=shape).torque, abs=1e-8)
    for j in range(tubes):
        torque, force = central(robot, alpha, D, j, ANGLE_STEP), central(robot, alpha, D, tubes + j, LENGTH_STEP)
        assert torque == pytest.approx(own.torque[j], rel=1e-6, abs=1e-9)
        assert force == pytest.approx(own.force[j], rel=1e-6, abs=1e-7)


@pytest.mark.parametrize("seed", range(6))
def test_sum_rules(seed):
    """Torques add up to nothing; forces to what the guide needs to straighten the curvature that leaves it."""
    rng = np.random.default_rng([seed, 98])
    robot = random_robot(rng, 2 + seed % 3)
    shape = BvpShape(robot, rng.uniform(-1.0, 1.0, robot.n_tubes), random_D(rng, robot))
    loads = virtual_work_loads(shape, quadrature(shape, 24))
    assert abs(loads.torque.sum()) < 1e-12
    expected = 0.5 * shape.materials.bending[0].sum() * abs(shape.curvature(0, np.zeros(1))[0]) ** 2
    assert loads.force.sum() == pytest.approx(expected, rel=1e-7, abs=1e-9)
    assert elastic_energy(shape) > shape.materials.straightening_energy.sum()


@pytest.mark.parametrize("name", KINKS)
def test_one_sided_forces_at_kinks(name):
    D, kinked = np.array(KINKS[name][0]), KINKS[name][1]
    robot, alpha = kink_robot(), np.array([0.1, 1.4, -0.9])
    shape = BvpShape(robot, alpha, D)
    loads = virtual_work_loads(shape, quadrature(shape, 24))
    assert np.flatnonzero(loads.kink).tolist() == kinked
    for tube in kinked:
        for side, expected in zip((-1, 1), loads.force_interval[tube], strict=True):
            if side > 0 and D[tube] + 3e-4 > robot.tubes[tube].length:
                assert expected == 0.0  # nothing left to pull in
                continue
            assert one_sided(robot, alpha, D, tube, side) == pytest.approx(expected, rel=2e-5, abs=2e-6)


def test_the_seeds_kink(seed_robot):
    """D_1 is the outer tube's straight length: the holding force is an interval, (K_1 9.9)^2 / (2 sum K) wide."""
    shape = BvpShape(seed_robot, np.radians([0.0, 100.0]), np.array([0.0935, 0.2085]))
    loads = virtual_work_loads(shape, quadrature(shape, 24))
    K1, K2 = (tube.segments[0].bending_stiffness for tube in seed_robot.tubes)
    low, high = loads.force_interval[0]
    assert loads.kink.tolist() == [True, False] and loads.force[0] == high
    assert high - low == pytest.approx((K1 * 9.9) ** 2 / (2 * (K1 + K2)), rel=1e-12)
    assert (low, high) == pytest.approx((0.3853, 2.0081), abs=5e-5)
