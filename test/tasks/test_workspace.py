"""Random commands, and the room that points fill."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import ROOT
from random_robots import random_robot

from ctr_pvs import Limits
from ctr_pvs import Robot
from ctr_pvs import Segment
from ctr_pvs import Tube
from ctr_pvs import load_robot
from ctr_pvs.tasks.workspace import fitting_edge
from ctr_pvs.tasks.workspace import random_commands
from ctr_pvs.tasks.workspace import volume


def straight(lengths, limits=None) -> Robot:
    tubes = tuple(Tube(f"t{j}", (Segment(length, 0.02, 0.015),)) for j, length in enumerate(lengths))
    return Robot("straight", tubes, limits or Limits())


def test_the_robot_takes_every_command():
    robots = [load_robot(ROOT / "config" / "three_tubes.yaml"), load_robot(ROOT / "config" / "renda2021.yaml")]
    for robot in (*robots, random_robot(np.random.default_rng(5), 3)):
        commands = random_commands(robot, 400, 1)
        assert commands.shape == (400, 2 * robot.n_tubes)
        for row in commands:
            alpha, D = robot.check_command(row[: robot.n_tubes], row[robot.n_tubes :])
            assert np.array_equal(np.concatenate([alpha, D]), row)


def test_a_seed_means_the_same_commands(seed_robot):
    first, again, other = (random_commands(seed_robot, 50, seed) for seed in (3, 3, 4))
    assert first.tobytes() == again.tobytes()
    assert not (first == other).any()


def test_uniform_over_what_the_limits_leave():
    """Of three ordered uniform numbers, the means are 1/4, 2/4, 3/4; rotations fill their limits, or one turn."""
    robot = straight([0.2, 0.2, 0.2], Limits(alpha=(None, (0.0, 12.0), (-1.0, 0.0))))
    commands = random_commands(robot, 20_000, 2)
    assert commands[:, 3:].mean(axis=0) == pytest.approx([0.05, 0.1, 0.15], abs=2e-3)
    for column, (low, high) in enumerate(((-np.pi, np.pi), (0.0, 12.0), (-1.0, 0.0))):
        angles = commands[:, column]
        assert low <= angles.min() < low + 0.01 * (high - low) and high >= angles.max() > high - 0.01 * (high - low)
        assert angles.mean() == pytest.approx((low + high) / 2.0, abs=0.02 * (high - low))


def test_limits_that_leave_a_point_or_only_just_touch():
    robot = straight([0.2, 0.2], Limits(D=((0.1, 0.2), (0.05, 0.1))))
    assert random_commands(robot, 5, 0)[:, 2:].tolist() == [[0.1, 0.1]] * 5


def test_the_volume_of_a_box():
    points = np.random.default_rng(0).uniform([0.0, -0.02, 0.0], [0.04, 0.02, 0.02], (40_000, 3))
    room = volume(points, 0.005)
    assert room.cubes == room.half == 8 * 8 * 4
    assert room.volume == pytest.approx(0.04 * 0.04 * 0.02)
    assert (room.once, room.points) == (0, 40_000)


def test_few_points_are_told_by_cubes_with_one():
    points = np.array([[0.001, 0.0, 0.0], [0.002, 0.0, 0.0], [-0.001, 0.0, 0.0], [0.1, 0.1, 0.1]])
    room = volume(points, 0.005)
    assert (room.cubes, room.once, room.half) == (3, 2, 2)  # the orifice is a corner: 1 and -1 mm are two cubes


@pytest.mark.parametrize(("side", "edge"), [(0.1, 0.005), (0.099, 0.002), (0.2, 0.01), (0.39, 0.01), (1e-6, 5e-8)])
def test_an_edge_that_fits(side, edge):
    assert fitting_edge(np.array([[0.0, 0.0, 0.0], [side, 0.1 * side, 0.0]])) == pytest.approx(edge)


def test_an_edge_without_extent():
    assert fitting_edge(np.zeros((0, 3))) == fitting_edge(np.ones((3, 3))) == 1e-3
