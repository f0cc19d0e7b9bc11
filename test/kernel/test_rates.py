"""Rates of the tip with the command, by differences of tips that are solved again: at ends, kinks, and with bare bases
too."""

from __future__ import annotations

import numpy as np
import pytest
from energy_differences import KINKS
from energy_differences import kink_robot
from random_robots import random_D
from random_robots import random_robot
from scipy.spatial.transform import Rotation

from ctr_pvs import EquilibriumSolver
from ctr_pvs import Robot
from ctr_pvs import Segment
from ctr_pvs import Tube

STEP = 2e-5  # rad, m


def moved(solver, alpha, D, index, shift):
    """The tip's pose where one actuator is ``shift`` away."""
    command = np.concatenate([alpha, D])
    command[index] += shift
    answer = solver.solve(*np.split(command, 2))
    assert answer.success, answer.message
    return answer.tip


def twist_between(a, b):
    """Motion (6,) from the pose a to the pose b in base axes."""
    turn = Rotation.from_quat(b.orientation) * Rotation.from_quat(a.orientation).inv()
    return np.concatenate([b.position - a.position, turn.as_rotvec()])


def difference(solver, alpha, D, index, side):
    """(6,) of fourth order in the middle for ``side`` 0, of third order to one side otherwise."""
    here = moved(solver, alpha, D, index, 0.0)
    if side == 0:
        shifts, factors = (-2, -1, 1, 2), np.array([1.0, -8.0, 8.0, -1.0]) / 12.0
    else:
        shifts, factors = (1, 2, 3), side * np.array([18.0, -9.0, 2.0]) / 6.0
    step = STEP if side == 0 else side * STEP
    motions = [twist_between(here, moved(solver, alpha, D, index, k * step)) for k in shifts]
    return factors @ np.array(motions) / STEP


def bare_robot(kind):
    """Three tubes without straight leads: constant, polynomial or helical pre-curvature from the base on."""
    laws = {
        "constant": (((9.0 + 2.0j,), 0.0), ((4.0 - 3.0j,), 0.0), ((11.0j,), 0.0)),
        "polynomial": (((9.0, 40.0),), ((4.0, 90.0 - 30.0j),), ((2.0j, 60.0, 300.0j),)),
        "helical": (((9.0 + 2.0j,), 12.0), ((4.0 - 3.0j,), -9.0), ((11.0j,), 20.0)),
    }[kind]
    sizes = ((0.08, 0.05), (0.11, 0.03), (0.14, 0.02))
    tubes = [
        Tube(name, (Segment(length, K, K / 1.3, *law),))
        for name, (length, K), law in zip("abc", sizes, laws, strict=True)
    ]
    return Robot(kind, tuple(tubes))


@pytest.mark.parametrize("D", [[0.0, 0.0, 0.0], [0.0, 0.02, 0.051], [0.0, 0.045, 0.1], [0.01, 0.02, 0.03]])
@pytest.mark.parametrize("kind", ["constant", "polynomial", "helical"])
def test_bases_on_the_orifice(kind, D):
    """A tube whose base is on the orifice has no guide; drawn in by dD it gets one of length dD, which is compliant."""
    robot, alpha, D = bare_robot(kind), np.array([0.3, 1.4, -0.8]), np.array(D)
    solver = EquilibriumSolver(robot, 1e-10, fidelity="torsion")
    jacobian = solver.solve(alpha, D).jacobian
    lengths = np.array([tube.length for tube in robot.tubes])
    ends = np.append(0.0, np.sort(lengths - D))
    assert np.diff(ends).min() > 5 * STEP or not D.any()
    for index in range(6):
        j = index - 3
        side = 1 if j >= 0 and D[j] == 0.0 else 0
        if j >= 0 and j + 1 < 3 and D[j] + 4 * STEP > D[j + 1]:
            continue  # the next tube's base is in the way
        expected = difference(solver, alpha, D, index, side)
        assert jacobian[:, index] == pytest.approx(expected, rel=2e-6, abs=2e-6), index


def test_all_bases_on_the_orifice_drawn_in_together():
    """The sum of the columns of D is what one common slide does."""
    robot, alpha, D = bare_robot("constant"), np.array([0.3, 1.4, -0.8]), np.zeros(3)
    solver = EquilibriumSolver(robot, 1e-10, fidelity="torsion")
    here = solver.solve(alpha, D)
    motions = [twist_between(here.tip, solver.solve(alpha, D + k * STEP).tip) for k in (1, 2, 3)]
    expected = np.array([18.0, -9.0, 2.0]) / 6.0 @ np.array(motions) / STEP
    assert here.jacobian[:, 3:].sum(axis=1) == pytest.approx(expected, rel=2e-6, abs=2e-6)


@pytest.mark.parametrize("seed", range(8))
def test_at_any_command(seed):
    rng = np.random.default_rng([seed, 23])
    robot = random_robot(rng, 1 + seed % 4)
    n = robot.n_tubes
    alpha, D = rng.uniform(-1.5, 1.5, n), random_D(rng, robot)
    solver = EquilibriumSolver(robot, 1e-10, fidelity="torsion")
    here = solver.solve(alpha, D)
    assert here.success, here.message
    places = np.sort(np.concatenate([[0.0], *(t.breaks[1:] - d for t, d in zip(robot.tubes, D, strict=True))]))
    near_a_kink = np.diff(places).min() < 5 * STEP
    for index in range(n if near_a_kink else 2 * n):
        expected = difference(solver, alpha, D, index, 0)
        assert here.jacobian[:, index] == pytest.approx(expected, rel=2e-6, abs=2e-6)


@pytest.mark.parametrize("name", ["boundary of a on the orifice", "boundaries of b and c on the orifice"])
def test_at_a_kink_on_the_orifice_it_holds_towards_retraction(name):
    robot, alpha, D = kink_robot(), np.array([0.1, 1.4, -0.9]), np.array(KINKS[name][0])
    solver = EquilibriumSolver(robot, 1e-10, fidelity="torsion")
    jacobian = solver.solve(alpha, D).jacobian
    for j in range(3):
        expected = difference(solver, alpha, D, 3 + j, 1)
        assert jacobian[:, 3 + j] == pytest.approx(expected, rel=5e-6, abs=5e-6)


@pytest.mark.parametrize("seed", range(4))
def test_without_twist_rates_are_those_of_the_untwisted_state(seed):
    rng = np.random.default_rng([seed, 24])
    robot = random_robot(rng, 2 + seed % 2, strength=0.5)
    alpha, D = rng.uniform(-0.5, 0.5, robot.n_tubes), random_D(rng, robot)
    solver = EquilibriumSolver(robot, 1.0, fidelity="torsionless")
    here = solver.solve(alpha, D)
    assert here.success, here.message
    for index in range(robot.n_tubes):
        expected = difference(solver, alpha, D, index, 0)
        assert here.jacobian[:, index] == pytest.approx(expected, rel=2e-6, abs=2e-6)


def test_taking_no_twist_does_not_mean_that_none_would_come(seed_robot):
    """Aligned tubes stand untwisted; turned a little they twist, and the rates of the tip know it."""
    D = [0.0935, 0.2085]
    answer = EquilibriumSolver(seed_robot, 1e-5).solve([0.0, 0.0], D)
    exact = EquilibriumSolver(seed_robot, 1e-10, fidelity="torsion").solve([0.0, 0.0], D)
    assert answer.jacobian[:, :2] == pytest.approx(exact.jacobian[:, :2], rel=1e-2, abs=1e-3)
