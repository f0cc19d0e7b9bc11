"""The energy's derivatives against differences, its basis, and its invariants."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from random_robots import random_D
from random_robots import random_robot

from ctr_pvs import EquilibriumSolver
from ctr_pvs.basis import TwistBasis
from ctr_pvs.models import Models
from ctr_pvs.sensitivity import Sensitivity


def random_energy(seed, tubes, degree=4):
    rng = np.random.default_rng([seed, tubes, 7])
    robot = random_robot(rng, tubes)
    while True:
        energy = Models(robot).energy(random_D(rng, robot), degree)
        if energy.n:
            return energy, rng.uniform(-2, 2, tubes), 0.2 * rng.standard_normal(energy.n)


@pytest.mark.parametrize("basis", [TwistBasis(9), TwistBasis(4, panels=3)])
def test_the_basis_is_orthonormal_and_integrates(basis):
    rule = basis.rule
    values = basis.tabulate(rule.x)[0]
    assert np.allclose(values.T @ (rule.weights[:, None] * values), np.eye(basis.size), atol=1e-13)
    x, h = np.linspace(0.05, 0.95, 7), 1e-6
    slope = (basis.tabulate(x + h)[1] - basis.tabulate(x - h)[1]) / (2 * h)
    assert slope == pytest.approx(basis.tabulate(x)[0], abs=1e-7)
    assert np.allclose(basis.tabulate(np.zeros(1))[1], 0.0, atol=1e-15)
    seams = np.array([1 / 3, 2 / 3])
    assert basis.tabulate(seams - 1e-13)[1] == pytest.approx(basis.tabulate(seams + 1e-13)[1], abs=1e-10)


@pytest.mark.parametrize("tubes", [2, 3, 4])
@pytest.mark.parametrize("seed", range(4))
def test_gradient_and_hessian_match_differences(tubes, seed):
    energy, alpha, q = random_energy(seed, tubes)
    gradient, hessian = energy.derivatives(q, alpha)
    assert gradient == pytest.approx(energy.gradient(q, alpha), abs=1e-15)
    assert np.allclose(hessian, hessian.T, atol=1e-12)
    h, rng = 1e-5, np.random.default_rng(seed)
    for _ in range(5):
        d = rng.standard_normal(energy.n)
        slope = (energy.value(q + h * d, alpha) - energy.value(q - h * d, alpha)) / (2 * h)
        assert slope == pytest.approx(gradient @ d, rel=1e-6, abs=1e-8)
        bend = (energy.gradient(q + h * d, alpha) - energy.gradient(q - h * d, alpha)) / (2 * h)
        assert bend == pytest.approx(hessian @ d, rel=1e-6, abs=1e-8)


def test_no_total_torque_in_any_state():
    """The unknown torques add up to zero over the tubes everywhere, whatever q is, in the guide and beyond."""
    for seed in range(6):
        energy, _, q = random_energy(seed, 4)
        field = energy.space.field(q)
        s = np.linspace(-0.01, energy.materials.domain.length, 50)
        assert np.abs(field.at(s).sum(axis=1)).max() < 1e-12 * max(1.0, np.abs(field.at(s)).max())


def test_field_and_coordinates_are_inverse():
    """q -> torque field -> q is the identity, also through a finer basis and through sampling in s."""
    energy, _, q = random_energy(3, 3)
    field = energy.space.field(q)
    assert energy.space.coordinates(field) == pytest.approx(q, abs=1e-12)
    finer = Models(energy.materials.robot).energy(energy.materials.domain.D, 9)
    again = energy.space.coordinates(finer.space.field(finer.space.coordinates(field)))
    assert again == pytest.approx(q, abs=1e-12)
    foreign = replace(field, topology=("other",))
    assert energy.space.coordinates(foreign) == pytest.approx(q, abs=1e-12)


def test_torsional_energy_is_the_plain_sum_of_squares():
    """q.q / 2 equals int T^2 / (2 GJ) over guide and sections."""
    energy, _, q = random_energy(5, 3)
    materials, field = energy.materials, energy.space.field(q)
    total = 0.5 * materials.guide_compliance @ field.guide**2
    x, w = np.polynomial.legendre.leggauss(20)
    for m in range(materials.domain.n_sections):
        start, length = materials.domain.boundaries[m], materials.domain.lengths[m]
        torque = field.at(start + length * (x + 1) / 2)
        present = materials.torsional[m] > 0
        assert np.all(torque[:, ~present] == 0.0)
        total += 0.5 * np.sum(0.5 * length * w[:, None] * torque[:, present] ** 2 / materials.torsional[m, present])
    assert total == pytest.approx(0.5 * q @ q, rel=1e-12)


@pytest.mark.parametrize("seed", range(8))
def test_sensitivity_of_the_equilibrium(seed):
    """The tangent of continuation: twist angles at fixed x of each section move as the implicit function theorem
    says."""
    rng = np.random.default_rng([seed, 3])
    robot = random_robot(rng, 2 + seed % 3)
    solver = EquilibriumSolver(robot, tolerance=1e-9)
    D, alpha = random_D(rng, robot), rng.uniform(-1.5, 1.5, robot.n_tubes)
    direction = rng.standard_normal(2 * robot.n_tubes) * np.repeat([1.0, 0.1], robot.n_tubes)
    alpha_rate, D_rate = np.split(direction, 2)
    here = solver.solve(alpha, D)
    assert here.success, here.message
    if here.degrees_of_freedom == 0:
        pytest.skip("nothing can twist in this scene")
    rates = Sensitivity(here.solution.energy, alpha, here.solution.q, alpha_rate[:, None], D_rate[:, None])
    h, x = 1e-5, np.array([0.2, 0.9])
    ahead, behind = (solver.solve(alpha + s * h * alpha_rate, D + s * h * D_rate) for s in (1, -1))
    if {here.shape.domain.topology} != {a.shape.domain.topology for a in (ahead, behind)}:
        pytest.skip("the difference would cross a kink")
    for m in range(here.shape.domain.n_sections):
        difference = (ahead.shape.angle(m, x) - behind.shape.angle(m, x)) / (2 * h)
        present = here.shape.materials.bending[m] > 0
        assert rates.angle_rate(m, x)[:, present, 0] == pytest.approx(difference[:, present], rel=1e-5, abs=1e-6)
