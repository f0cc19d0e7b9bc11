"""The force on the tip from what is measured: found again where it can be, and honest where it cannot."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ctr_pvs import EquilibriumSolver
from ctr_pvs import Loads
from ctr_pvs import Robot
from ctr_pvs import Segment
from ctr_pvs import Tube
from ctr_pvs import load_robot
from ctr_pvs.errors import FieldError

SEED = Path(__file__).resolve().parents[2] / "config" / "renda2021.yaml"
FORCE = (0.2, -0.3, 0.4)
ALPHA, D = [0.0, 1.0], [0.0935, 0.1705]


@pytest.fixture(scope="module")
def scene():
    solver = EquilibriumSolver(load_robot(SEED), 1e-7)
    return solver, solver.solve(ALPHA, D, loads=Loads(FORCE))


@pytest.mark.parametrize("what", [("torque", "force"), ("tip_position",), ("torque", "force", "tip_position")])
def test_what_the_model_told_is_found_again(scene, what):
    solver, answer = scene
    told = {"torque": answer.torque, "force": answer.force, "tip_position": answer.tip.position}
    found = solver.sense_tip_force(ALPHA, D, **{name: told[name] for name in what})
    assert found.success and not len(found.unseen)
    assert found.force == pytest.approx(FORCE, abs=1e-6)
    assert found.misfit < 1e-4
    assert np.linalg.eigvalsh(found.covariance).min() > 0.0


def test_the_covariance_is_that_of_noisy_measurements(scene):
    """Errors over their standard deviations, of 60 noisy tip positions: chi-square of three."""
    solver, answer = scene
    rng, std = np.random.default_rng(8), 1e-5
    squares = []
    for _ in range(60):
        noisy = answer.tip.position + std * rng.standard_normal(3)
        found = solver.sense_tip_force(ALPHA, D, tip_position=noisy, position_std=std, guess=FORCE)
        error = found.force - FORCE
        squares.append(error @ np.linalg.solve(found.covariance, error))
    assert 2.0 < np.mean(squares) < 4.2  # three standard deviations of a mean of 60 either side of 3


def test_a_direction_that_two_torques_cannot_see_is_named(scene):
    solver, answer = scene
    found = solver.sense_tip_force(ALPHA, D, torque=answer.torque)
    assert found.success and len(found.unseen) == 1 and "not seen" in found.message
    assert np.isinf(found.covariance[np.abs(found.unseen[0]) > 1e-6]).any()
    assert abs(found.force @ found.unseen[0]) < 0.2  # nothing pulls it that way from where it started
    assert solver.solve(ALPHA, D, loads=Loads(tuple(found.force))).torque == pytest.approx(answer.torque, abs=1e-6)


def test_a_straight_rod_hardly_feels_along_itself():
    """Its tip does not move along the rod for a small axial force, to first order: that direction is not seen."""
    rod = Robot("rod", (Tube("a", (Segment(0.25, 0.0187, 0.0138),)),))
    solver = EquilibriumSolver(rod, 1e-9)
    answer = solver.solve([0.0], [0.05], loads=Loads((0.0, 0.01, 0.0)))
    found = solver.sense_tip_force([0.0], [0.05], tip_position=answer.tip.position, largest_std=1.0)
    assert found.success and len(found.unseen) == 1
    assert found.force[1:] == pytest.approx([0.01, 0.0], abs=1e-5)


def test_known_loads_are_taken_along(scene):
    solver, _ = scene
    known = Loads((0.1, 0.0, 0.0), line_forces={1: (0.0, 0.0, -1.0)})
    answer = solver.solve(ALPHA, D, loads=Loads((0.3, -0.3, 0.4), line_forces={1: (0.0, 0.0, -1.0)}))
    found = solver.sense_tip_force(ALPHA, D, tip_position=answer.tip.position, loads=known)
    assert found.force == pytest.approx([0.2, -0.3, 0.4], abs=1e-6)


def test_the_warm_start_stays_as_it_is(scene):
    solver, answer = scene
    solver.solve(ALPHA, D)
    solver.sense_tip_force(ALPHA, D, tip_position=answer.tip.position)
    assert solver.follow(ALPHA, D).applied_loads is None


@pytest.mark.parametrize(
    "measurement",
    [{}, {"torque": [0.1]}, {"tip_position": [0.0, np.nan, 0.0]}, {"force": [0.0, 0.0], "force_std": 0.0}],
)
def test_what_is_no_measurement_is_refused(scene, measurement):
    with pytest.raises(FieldError):
        scene[0].sense_tip_force(ALPHA, D, **measurement)
