"""Actuation loads are the derivatives of the total energy: by differences, one-sided at kinks, and their sum rules."""

from __future__ import annotations

import numpy as np
import pytest
from energy_differences import ANGLE_STEP
from energy_differences import KINKS
from energy_differences import LENGTH_STEP
from energy_differences import derivative
from energy_differences import kink_robot
from energy_differences import one_sided
from random_robots import random_D
from random_robots import random_robot

from ctr_pvs import EquilibriumSolver

TORQUE_FLOOR, FORCE_FLOOR = 1e-9, 1e-7  # N m, N


def distance_to_kinks(robot, D):
    """Smallest distance [m] between any two events, and of any to the orifice."""
    places = np.sort(np.concatenate([[0.0], *(t.breaks[1:] - d for t, d in zip(robot.tubes, D, strict=True))]))
    return np.diff(places).min()


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("tubes", [2, 3, 4])
def test_loads_are_energy_derivatives(tubes, seed):
    rng = np.random.default_rng([seed, tubes])
    robot = random_robot(rng, tubes)
    D, alpha = random_D(rng, robot), rng.uniform(-2.0, 2.0, tubes)
    while distance_to_kinks(robot, D) < 4 * LENGTH_STEP:
        D = random_D(rng, robot)
    solver = EquilibriumSolver(robot, tolerance=1e-8)
    answer = solver.solve(alpha, D)
    assert answer.success, answer.message
    compared = 0
    for j in range(tubes):
        torque = derivative(solver, alpha, D, j, ANGLE_STEP)
        assert torque == pytest.approx(answer.torque[j], rel=1e-6, abs=TORQUE_FLOOR)
        force = derivative(solver, alpha, D, tubes + j, LENGTH_STEP)
        if force is not None:
            assert force == pytest.approx(answer.force[j], rel=1e-6, abs=FORCE_FLOOR)
            compared += 1
    assert compared >= 1
    assert np.array_equal(answer.force_interval, np.column_stack([answer.force, answer.force])) and not answer.kink


@pytest.mark.parametrize("seed", range(30))
def test_sum_rules(seed):
    """Torques add up to nothing; forces to what the guide needs to straighten the curvature that leaves it."""
    rng = np.random.default_rng([seed, 99])
    robot = random_robot(rng, 2 + seed % 3)
    D, alpha = random_D(rng, robot), rng.uniform(-2.0, 2.0, robot.n_tubes)
    answer = EquilibriumSolver(robot, tolerance=1e-10).solve(alpha, D)
    assert answer.success, answer.message
    assert abs(answer.torque.sum()) < 1e-12
    if answer.kink or not answer.shape.domain.n_sections:
        return
    stiffness = answer.shape.materials.bending[0].sum()
    expected = 0.5 * stiffness * abs(answer.shape.curvature(0, np.zeros(1))[0]) ** 2
    assert answer.force.sum() == pytest.approx(expected, rel=1e-10, abs=1e-10)


def test_the_seeds_kink(seed_robot):
    """D_1 is the outer tube's straight length: the holding force is an interval, (K_1 9.9)^2 / (2 sum K) wide."""
    solver = EquilibriumSolver(seed_robot, tolerance=1e-9)
    alpha, D = np.radians([0.0, 100.0]), np.array([0.0935, 0.2085])
    answer = solver.solve(alpha, D)
    K1, K2 = (tube.segments[0].bending_stiffness for tube in seed_robot.tubes)
    low, high = answer.force_interval[0]
    assert answer.kink and answer.loads.kink.tolist() == [True, False]
    assert high - low == pytest.approx((K1 * 9.9) ** 2 / (2 * (K1 + K2)), rel=1e-12)
    assert (low, high) == pytest.approx((0.3853, 2.0081), abs=5e-5)
    assert answer.force[0] == high
    for tube in (0, 1):
        assert one_sided(solver, alpha, D, tube, -1) == pytest.approx(answer.force_interval[tube, 0], rel=1e-6)
        assert one_sided(solver, alpha, D, tube, 1) == pytest.approx(answer.force_interval[tube, 1], rel=1e-6)


@pytest.mark.parametrize("name", KINKS)
def test_one_sided_forces_at_kinks(name):
    D, kinked = np.array(KINKS[name][0]), KINKS[name][1]
    solver = EquilibriumSolver(kink_robot(), tolerance=1e-9)
    alpha = np.array([0.1, 1.4, -0.9])
    answer = solver.solve(alpha, D)
    assert answer.success, answer.message
    assert np.flatnonzero(answer.loads.kink).tolist() == kinked
    for tube in range(3):
        for side, expected in zip((-1, 1), answer.force_interval[tube], strict=True):
            if side > 0 and D[tube] + 3e-4 > solver.robot.tubes[tube].length:
                assert expected == 0.0  # nothing left to pull in
                continue
            assert one_sided(solver, alpha, D, tube, side) == pytest.approx(expected, rel=2e-5, abs=2e-6)


def test_a_rounding_error_does_not_decide_the_kink(seed_robot):
    """Within the fixed geometric tolerance of 1e-12 m the answer is that of the exact place."""
    answers = [
        EquilibriumSolver(seed_robot, tolerance=1e-8).solve([0.0, 1.0], [0.0935 + shift, 0.2085])
        for shift in (-5e-13, 0.0, 5e-13)
    ]
    for answer in answers:
        assert answer.force_interval == pytest.approx(answers[1].force_interval, abs=1e-9)
        assert answer.kink


def test_work_over_a_closed_loop_is_nothing(seed_robot):
    """Loads are the gradient of one scalar: Gauss-integrated work round a loop in (alpha, D) vanishes."""
    solver = EquilibriumSolver(seed_robot, tolerance=1e-9)
    corners = [([0.0, 0.4], [0.080, 0.200]), ([0.3, 1.6], [0.080, 0.200]), ([0.3, 1.6], [0.088, 0.212])]
    corners = [np.concatenate(corner) for corner in corners]
    nodes, weights = np.polynomial.legendre.leggauss(14)
    work = 0.0
    for a, b in zip(corners, [*corners[1:], corners[0]], strict=True):
        for x, w in zip(nodes, weights, strict=True):
            answer = solver.solve(*np.split(a + (b - a) * (x + 1) / 2, 2))
            work += 0.5 * w * float(np.concatenate([answer.torque, answer.force]) @ (b - a))
    assert abs(work) < 1e-9
