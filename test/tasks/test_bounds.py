"""Steps within limits, lengths and order: the best there is, judged by its optimality conditions."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import nnls

from ctr_pvs import Limits
from ctr_pvs import load_robot
from ctr_pvs.errors import FieldError
from ctr_pvs.tasks.bounds import Bounds


@pytest.fixture(scope="module")
def bounds():
    return Bounds(load_robot("three_tubes"), None)


def random_command(rng, bounds):
    """Some of them on bounds, and tubes with one place."""
    N = bounds.tubes
    share = np.clip(rng.uniform(-0.3, 1.3, 2 * N), 0.0, 1.0)
    both = bounds.low + share * (bounds.high - bounds.low)
    return both[:N], np.maximum.accumulate(both[N:])


def test_steps_are_the_best_within_the_bounds(bounds):
    """Feasible, and the gradient is a sum of outward normals of the bounds that it rests on, none pulled at."""
    rng = np.random.default_rng(1)
    on_bounds = 0
    for _ in range(300):
        x = bounds.scaled(*random_command(rng, bounds))
        root = rng.standard_normal((3, len(x)))
        hessian = root.T @ root + 10.0 ** rng.uniform(-6, 0) * np.eye(len(x))
        gradient = rng.standard_normal(len(x))
        d = bounds.step(x, hessian, gradient)
        room = bounds.right - bounds.rows @ (x + d)
        assert room.min() > -1e-9
        tight = bounds.rows[room < 1e-8]
        down = -(gradient + hessian @ d)
        if len(tight):
            on_bounds += 1
            assert nnls(tight.T, down)[1] < 1e-7
        else:
            assert np.abs(down).max() < 1e-8
    assert on_bounds > 100


def test_a_command_survives_scaling_and_stays_within(bounds):
    rng = np.random.default_rng(2)
    for _ in range(50):
        alpha, D = random_command(rng, bounds)
        again = bounds.command(bounds.scaled(alpha, D))
        assert again[0] == pytest.approx(alpha, abs=1e-14) and again[1] == pytest.approx(D, abs=1e-15)
        wild = bounds.command(bounds.scaled(alpha, D) + rng.normal(0.0, 3.0, 6))
        assert bounds.contains(*wild)
        bounds.robot.check_command(*wild)


def test_the_tighter_of_two_limits_counts_and_order_passes_it_on():
    robot = load_robot("three_tubes")
    limits = Limits(alpha=(None, (-1.0, 8.0), None), D=(None, (0.05, 0.3), None))
    bounds = Bounds(robot, limits)
    assert bounds.low.tolist() == [-6.3, -1.0, -12.6, 0.0, 0.05, 0.05]
    assert bounds.high.tolist() == [6.3, 6.3, 12.6, 0.14, 0.21, 0.3]
    with pytest.raises(FieldError, match="leave a command"):
        Bounds(robot, Limits(alpha=((7.0, 8.0), None, None)))


def test_what_presses_is_named(bounds):
    x = bounds.scaled(np.array([0.0, 6.3, 0.0]), np.array([0.1, 0.1, 0.2]))
    by_limits, names = bounds.pressing(x, np.array([0.0, -1.0, 0.0, 0.0, 0.0, 0.0]))
    assert by_limits and names == ["alpha[1] <= 6.3"]
    by_limits, names = bounds.pressing(x, np.array([0.0, 0.0, 0.0, -1.0, 1.0, 0.0]))
    assert not by_limits and names == ["D[0] <= D[1]"]


def test_turns_keep_to_the_limits():
    robot = load_robot("three_tubes")
    bounds = Bounds(robot, Limits(alpha=((-1.0, 1.0), None, None)))
    assert bounds.turn_within(np.zeros(3), 0.5) == pytest.approx(0.5)
    assert bounds.turn_within(np.zeros(3), 0.5 + 2.0 * np.pi) == pytest.approx(0.5)
    assert bounds.turn_within(np.zeros(3), 2.0) == pytest.approx(1.0)  # the nearest there is
    wide = Bounds(robot, None)
    assert wide.turn_within(np.array([5.0, 0.0, 0.0]), 3.0) == pytest.approx(3.0 - 2.0 * np.pi)
