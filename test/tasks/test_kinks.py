"""Kinks: where the rates of the tip jump, and that they do not along them."""

from __future__ import annotations

import numpy as np
import pytest

from ctr_pvs import EquilibriumSolver
from ctr_pvs import load_robot
from ctr_pvs.tasks.bounds import Bounds

TOLERANCE = 1e-9
ASIDE = 1e-7  # m


@pytest.mark.parametrize("name", ["renda2021", "three_tubes"])
def test_rates_jump_across_a_kink_and_not_along_it(name):
    """Those of the position, at random places on each kink, looked at from both sides."""
    rng, robot = np.random.default_rng(2), load_robot(name)
    bounds, solver = Bounds(robot, None), EquilibriumSolver(robot, TOLERANCE)
    N, kinks, jumps, looked_at = robot.n_tubes, bounds.kinks, [], 0
    for kink, row in enumerate(kinks.rows):
        for _ in range(40):
            alpha = rng.uniform(-1.0, 1.0, N)
            D = np.maximum.accumulate(rng.uniform(bounds.low[N:], bounds.high[N:]))
            x = kinks.onto(bounds.scaled(alpha, D), kink)
            assert kinks.off(x, kink) == pytest.approx(0.0, abs=1e-12) and kinks.near(x)
            aside = row * ASIDE / bounds.unit
            sides = [x + sign * aside for sign in (1.0, -1.0)]
            two_at_once = np.sort(np.abs(kinks.rows @ x - kinks.right))[1] < 1e-3
            if two_at_once or any((bounds.rows @ place > bounds.right).any() for place in sides):
                continue
            answers = [solver.solve(*bounds.command(place), start="cold") for place in sides]
            if not all(answer.success and answer.stability_margin > 0.2 for answer in answers):
                continue
            looked_at += 1
            one, other = (answer.jacobian[:3] * bounds.scale for answer in answers)
            jump = np.abs(one - other).max()
            along = (one - other) @ (np.eye(2 * N) - np.outer(row, row) / (row @ row))
            assert np.abs(along).max() < 1e-3 * np.abs(one).max() + 1e-6
            jumps.append(jump)
    assert looked_at > 50
    assert np.max(jumps) > 1e-3  # m for 30 mm: nothing would be held up without
