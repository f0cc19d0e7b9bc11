"""The `full` level to a tolerance, from the shape of the boundary-value model."""

from __future__ import annotations

import numpy as np
import pytest
from bvp_shape import BvpShape
from bvp_shape import elastic_energy
from conftest import ROOT
from random_robots import random_D
from random_robots import random_robot

from ctr_pvs import load_robot
from ctr_pvs.pvs.frames import tip_position
from ctr_pvs.pvs.refine import FULL_DEGREES
from ctr_pvs.pvs.refine import refine_full
from ctr_pvs.pvs.strain_basis import PolynomialBasis


@pytest.mark.parametrize("tolerance", [1e-3, 1e-5, 1e-8])
def test_the_seeds_robot_within_every_tolerance(seed_robot, reference, tolerance):
    row = next(row for row in reference["fig4_full"]["rows"] if row["alpha2_deg"] == 260)
    shape = BvpShape(seed_robot, [0.0, np.radians(260)], reference["fig4_full"]["D"])
    refined = refine_full(shape, tolerance)
    assert refined is not None and refined.estimate <= tolerance and refined.residual < 1e-9
    assert np.linalg.norm(tip_position(refined.solution.shape, 1e-10) - row["tip_m"]) <= tolerance
    assert refined.solution.loads().torque[1] == pytest.approx(row["torque2_Nm"], abs=100 * tolerance)
    assert refined.iterations >= 2 and refined.solution.stability_margin() > 0.0


def test_a_finer_tolerance_takes_a_higher_degree(seed_robot, reference):
    shape = BvpShape(seed_robot, [0.0, 4.0], reference["fig4_full"]["D"])
    degrees = []
    for tolerance in (1e-3, 1e-6, 1e-9):
        basis = refine_full(shape, tolerance).solution.energy.space.basis
        assert isinstance(basis, PolynomialBasis)
        degrees.append(basis.degree)
    assert degrees == sorted(degrees) and degrees[0] < degrees[-1] and degrees[0] > FULL_DEGREES[0]


@pytest.mark.parametrize("tubes", [1, 2, 3, 4])
def test_random_robots(tubes):
    rng = np.random.default_rng([tubes, 77])
    robot = random_robot(rng, tubes)
    shape = BvpShape(robot, rng.uniform(-1.0, 1.0, tubes), random_D(rng, robot))
    refined = refine_full(shape, 1e-8)
    assert refined is not None and refined.estimate <= 1e-8
    away = tip_position(refined.solution.shape, 1e-10) - tip_position(shape, 1e-10)
    assert np.linalg.norm(away) < 2e-8
    assert refined.solution.elastic_energy() == pytest.approx(elastic_energy(shape), rel=1e-8)


def test_no_number_of_degrees_is_enough_for_nothing():
    """A tolerance below rounding: all degrees are tried, and the estimate says what was reached."""
    robot = load_robot(ROOT / "config" / "renda2021_fig2.yaml")
    refined = refine_full(BvpShape(robot, [0.0, 2.0], [0.0, 0.0]), 1e-30)
    assert refined.solution.energy.space.basis.degree == FULL_DEGREES[-1]
    assert 1e-30 < refined.estimate < 1e-12
