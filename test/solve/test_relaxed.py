"""The relaxed robot, where cold starts set out, and the paths that begin there."""

from __future__ import annotations

import numpy as np
import pytest
from random_robots import random_D
from random_robots import random_robot

from ctr_pvs import EquilibriumSolver
from ctr_pvs import Robot
from ctr_pvs import Segment
from ctr_pvs import Tube
from ctr_pvs.answer.engine import Engine
from ctr_pvs.answer.state import State
from ctr_pvs.kernel.walk.step import MORE
from ctr_pvs.kernel.walk.step import OK
from ctr_pvs.solve.dense import DenseEnergy

STRAIGHT = Segment(0.02, 0.02, 0.015)
DEGREE = 6


def relaxed(robot: Robot, D: np.ndarray) -> tuple[State, bool, DenseEnergy]:
    """The relaxed state, whether others are as near to zero base angles, and the energy whose minimum it is."""
    engine = Engine(robot, 1e-5)
    code, vector = engine.relaxed(D, DEGREE)
    assert code in (OK, MORE)
    return State(vector, robot.n_tubes), code == MORE, DenseEnergy(engine, D, DEGREE)


def pair(first: complex, second: complex, length: float = 0.05) -> Robot:
    tubes = (Tube(n, (STRAIGHT, Segment(length, 0.02, 0.015, (k,)))) for n, k in (("a", first), ("b", second)))
    return Robot("pair", tuple(tubes))


@pytest.mark.parametrize("plane", [0.0, 0.4, 1.9, -2.6, np.pi])
def test_two_tubes_relax_with_their_curvatures_aligned(plane):
    """Pre-curvature planes that differ by some angle: the relaxed inner base angle takes it back, +pi standing for
    -pi."""
    found, several, _ = relaxed(pair(10.0, 10.0 * np.exp(1j * plane)), np.array([0.01, 0.01]))
    expected = np.pi if plane == np.pi else -plane
    assert found.alpha == pytest.approx([0.0, expected], abs=1e-6)
    assert several == (plane == np.pi)


@pytest.mark.parametrize("seed", range(12))
def test_the_relaxed_state_has_no_torques_and_is_a_minimum(seed):
    rng = np.random.default_rng([seed, 31])
    robot = random_robot(rng, 2 + seed % 4, strength=1.4)
    found, _, energy = relaxed(robot, random_D(rng, robot))
    torque = energy.torque_density(energy.turned_moments(energy.angles(found.unknowns, found.alpha))).sum(axis=0)
    unit = np.sum(energy.coupling[:, None] * np.abs(energy.moment) ** 2)
    assert np.abs(torque).max(initial=0.0) < 1e-6 * max(unit, 1e-12)
    assert energy.eigenvalues(found.unknowns, found.alpha).min(initial=1.0) > 0.0
    assert energy.engine.margin(found.vector) > 0.0
    for _ in range(20):  # no nearby set of base angles has less energy
        alpha = found.alpha + 0.02 * rng.standard_normal(robot.n_tubes)
        assert energy.value(found.unknowns, alpha) >= energy.value(found.unknowns, found.alpha) - 1e-12 * unit


def test_a_cold_start_from_opposed_tubes_says_that_it_chose():
    """Opposite pre-curvatures relax at a half turn to either side; the answer says that a choice was made."""
    robot = pair(12.0, -12.0, length=0.12)
    answer = EquilibriumSolver(robot).solve([0.0, 0.5], [0.01, 0.01])
    assert answer.success and "several relaxed states" in answer.message
    assert answer.stability_margin > 0.0


def test_a_descent_from_zero_twist_would_take_the_wrong_branch(seed_robot, reference):
    """At 220 deg of Fig. 4 the followed branch has theta_2 = 51 deg at the outer tip; minimising E from zero twist
    does not find it.  A cold start must."""
    row = next(row for row in reference["fig4_full"]["rows"] if row["alpha2_deg"] == 220)
    solver = EquilibriumSolver(seed_robot, tolerance=1e-8)
    answer = solver.solve([0.0, np.radians(220)], reference["fig4_full"]["D"])
    assert np.linalg.norm(answer.tip.position - row["tip_m"]) < 2e-8
    mirrored = solver.solve([0.0, np.radians(220 - 360)], reference["fig4_full"]["D"], start="cold")
    assert np.linalg.norm(mirrored.tip.position - row["tip_m"]) > 0.02
