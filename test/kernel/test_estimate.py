"""The estimate of the tip's error against the error."""

from __future__ import annotations

import numpy as np
import pytest
from random_robots import random_D
from random_robots import random_robot

from ctr_pvs import EquilibriumSolver
from ctr_pvs.kernel.sections import INTEGRATION_SHARE

EXACT = 1e-10
ROUNDING = 1e-12  # m


@pytest.mark.parametrize("tolerance", [1e-3, 1e-4, 1e-5, 1e-6, 1e-8])
def test_the_estimate_is_no_less_than_the_error(tolerance):
    """Of the tip and of the whole backbone, on a hundred random scenes of all levels."""
    compared = 0
    for seed in range(20):
        rng = np.random.default_rng([seed, 91])
        robot = random_robot(rng, 2 + seed % 3, strength=(0.3, 1.0, 2.0)[seed % 3])
        solver, exact = EquilibriumSolver(robot, tolerance), EquilibriumSolver(robot, EXACT)
        for _ in range(5):
            command = rng.uniform(-2.0, 2.0, robot.n_tubes), random_D(rng, robot)
            a, b = (one.solve(*command, start="cold") for one in (solver, exact))
            assert a.success and b.success, (a.message, b.message)
            assert len(a.snaps) == len(b.snaps)
            assert a.error_estimate <= tolerance
            assert np.linalg.norm(a.tip.position - b.tip.position) <= a.error_estimate + EXACT
            apart = np.linalg.norm(a.backbone(40).position - b.backbone(40).position, axis=1)
            assert apart.max() <= max(a.error_estimate, tolerance) + EXACT
            compared += 1
    assert compared == 100


def test_the_estimate_is_not_far_too_large():
    """But for the share of the tolerance that integration may take it is about twice the error, where there is one."""
    ratios, tolerance = [], 1e-5
    for seed in range(60):
        rng = np.random.default_rng([seed, 92])
        robot = random_robot(rng, 2 + seed % 3)
        command = rng.uniform(-2.0, 2.0, robot.n_tubes), random_D(rng, robot)
        a = EquilibriumSolver(robot, tolerance).solve(*command)
        error = np.linalg.norm(a.tip.position - EquilibriumSolver(robot, EXACT).solve(*command).tip.position)
        if error > 30.0 * EXACT:
            ratios.append((a.error_estimate - INTEGRATION_SHARE * tolerance) / error)
    assert len(ratios) >= 15 and min(ratios) >= 1.0 and np.median(ratios) < 4.0
