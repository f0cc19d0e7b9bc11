"""The backbone that pvs integrates for itself, against scipy's integrator, a helix, and coarse tolerances."""

from __future__ import annotations

import numpy as np
import pytest
from bvp_shape import BvpShape
from judges_of_shape import integrate_rod
from random_robots import random_D
from random_robots import random_robot

from ctr_pvs import Robot
from ctr_pvs import Segment
from ctr_pvs import Tube
from ctr_pvs.model.materials import Materials
from ctr_pvs.model.sections import piecewise_domain
from ctr_pvs.pvs.energy import FullEnergy
from ctr_pvs.pvs.frames import bishop_frames
from ctr_pvs.pvs.frames import tip_position
from ctr_pvs.pvs.solution import FullShape
from ctr_pvs.pvs.strain_basis import PolynomialBasis


def wild_shape(seed):
    """Strains that are no equilibrium, up to some turns along the robot."""
    rng = np.random.default_rng([seed, 12])
    robot = random_robot(rng, 1 + seed % 4)
    domain = piecewise_domain(robot, random_D(rng, robot))
    energy = FullEnergy(Materials(robot, domain), rng.uniform(-2.0, 2.0, robot.n_tubes), PolynomialBasis(3))
    return FullShape(energy, 5.0 * rng.standard_normal(energy.n))


def laws(shape):
    return [
        (length, lambda x, m=m, length=length: complex(shape.curvature(m, np.array([x / length]))[0]))
        for m, length in enumerate(shape.domain.lengths.tolist())
    ]


@pytest.mark.parametrize("seed", range(8))
def test_frames_are_those_of_the_integrated_equation(seed):
    shape = wild_shape(seed)
    s = np.unique(np.concatenate([np.linspace(0.0, shape.domain.length, 23), shape.domain.boundaries]))
    expected = integrate_rod(laws(shape), s)
    found = bishop_frames(shape, s, 1e-13)
    assert found[0] == pytest.approx(expected[0], abs=1e-10)
    assert found[1] == pytest.approx(expected[1], abs=1e-11)
    assert found[0].swapaxes(1, 2) @ found[0] == pytest.approx(np.tile(np.eye(3), (len(s), 1, 1)), abs=1e-12)
    assert tip_position(shape, 1e-13) == pytest.approx(found[1][-1], abs=1e-13)
    order = np.random.default_rng(seed).permutation(len(s))
    assert bishop_frames(shape, s[order], 1e-13)[1] == pytest.approx(found[1][order], abs=1e-15)


@pytest.mark.parametrize("tolerance", [1e-3, 1e-6, 1e-9])
def test_the_tolerance_is_met(tolerance):
    for seed in range(4):
        shape = wild_shape(seed)
        s = np.linspace(0.0, shape.domain.length, 9)
        error = bishop_frames(shape, s, tolerance)[1] - bishop_frames(shape, s, 1e-13)[1]
        assert np.abs(error).max() <= tolerance


def test_many_turns_in_one_section():
    """A tube of constant curvature: a circle, walked round forty times."""
    robot = Robot("ring", (Tube("a", (Segment(1.0, 0.05, 0.04, (80.0 * np.pi + 0.3,)),)),))
    energy = FullEnergy(Materials(robot, piecewise_domain(robot, np.zeros(1))), np.zeros(1), PolynomialBasis(1))
    shape, kappa = FullShape(energy, np.zeros(energy.n)), 80.0 * np.pi + 0.3
    s = np.linspace(0.0, 1.0, 31)
    circle = np.column_stack([np.sin(kappa * s), np.zeros(31), np.cos(kappa * s) - 1.0]) / kappa
    assert bishop_frames(shape, s, 1e-12)[1] == pytest.approx(circle, abs=1e-12)


def test_with_nothing_out_there_is_the_orifice():
    robot = Robot("pair", tuple(Tube(name, (Segment(0.2, 0.05, 0.04, (3.0,)),)) for name in "ab"))
    energy = FullEnergy(Materials(robot, piecewise_domain(robot, np.full(2, 0.2))), np.zeros(2), PolynomialBasis(1))
    shape = FullShape(energy, np.zeros(energy.n))
    assert np.array_equal(tip_position(shape, 1e-9), np.zeros(3))


@pytest.mark.parametrize(("angle", "sweep"), [(60, "fig4_full"), (200, "fig4_full"), (200, "fig4_partial")])
def test_the_seeds_tips(seed_robot, reference, angle, sweep):
    """From the boundary-value model's curvature to the reference's tip: no part of the solver is in between."""
    row = next(row for row in reference[sweep]["rows"] if row["alpha2_deg"] == angle)
    shape = BvpShape(seed_robot, [0.0, np.radians(angle)], reference[sweep]["D"])
    assert np.linalg.norm(tip_position(shape, 1e-10) - row["tip_m"]) < 2e-9
