"""Play in the stream of commands: what reaches the tubes depends on the path, and only there."""

from __future__ import annotations

import copy
from dataclasses import replace

import numpy as np
import pytest

from ctr_pvs import EquilibriumSolver
from ctr_pvs.robot.play import PlayWidths

D = [0.0535, 0.12]


@pytest.fixture
def loose(seed_robot):
    return EquilibriumSolver(replace(seed_robot, play=PlayWidths((0.0, 0.2), (0.0, 2e-3))))


def test_a_turn_back_has_to_cross_the_slot(loose, seed_robot):
    tight = EquilibriumSolver(seed_robot)
    loose.solve([0.0, 0.0], D)
    answer = loose.solve([0.0, 0.5], D)
    assert answer.alpha.tolist() == [0.0, 0.5] and answer.command_at_tubes[0] == pytest.approx([0.0, 0.4])
    assert answer.tip.position == pytest.approx(tight.solve([0.0, 0.4], D).tip.position, abs=2e-5)
    back = loose.solve([0.0, 0.35], D)  # within the slot: nothing moves
    assert back.tip.position == pytest.approx(answer.tip.position, abs=1e-9)
    assert loose.solve([0.0, 0.0], D).command_at_tubes[0] == pytest.approx([0.0, 0.1])


def test_a_copy_has_a_history_of_its_own(loose):
    """As of the node's stream, whose withheld answers leave no trace."""
    loose.solve([0.0, 0.0], D)
    tried = copy.copy(loose)
    assert tried.solve([0.0, 0.5], D).command_at_tubes[0] == pytest.approx([0.0, 0.4])
    assert loose.solve([0.0, 0.05], D).command_at_tubes[0] == pytest.approx([0.0, 0.0])


def test_sliding_and_lengths_are_those_of_the_tubes(loose, seed_robot):
    loose.solve([0.0, 0.0], D)
    answer = loose.solve([0.0, 0.0], [0.0535, 0.125])
    assert answer.command_at_tubes[1] == pytest.approx([0.0535, 0.124]) and answer.D[1] == 0.125
    assert answer.length == pytest.approx(seed_robot.tubes[1].length - 0.124)
    assert answer.backbone(5).position[-1] == pytest.approx(answer.tip.position, abs=1e-9)


def test_starts_without_a_path_know_no_play(loose, seed_robot):
    loose.solve([0.0, 0.0], D)
    assert loose.solve([0.0, 0.5], D, start="cold").command_at_tubes[0].tolist() == [0.0, 0.5]
    loose.reset()
    assert loose.solve([0.0, 0.7], D).command_at_tubes[0].tolist() == [0.0, 0.7]
    batch, tight = (EquilibriumSolver(robot).solve_batch([[0.0, 0.5]], [D]) for robot in (loose.robot, seed_robot))
    assert np.array_equal(batch.tip_position, tight.tip_position)


def test_tubes_stay_in_order_and_within_reach(seed_robot):
    solver = EquilibriumSolver(replace(seed_robot, play=PlayWidths(D=(0.03, 0.0))))
    solver.solve([0.0, 0.0], [0.05, 0.09])
    answer = solver.solve([0.0, 0.0], [0.02, 0.03])  # the outer tube would lag behind the inner one's base
    assert answer.success
    assert answer.command_at_tubes[1][0] <= answer.command_at_tubes[1][1]


def test_a_command_that_fails_moves_nothing(loose):
    loose.solve([0.0, 0.0], D)
    answer = loose.solve([0.0, 40.0], D, budget=1e-9)
    assert not answer.success
    assert loose.solve([0.0, 0.05], D).command_at_tubes[0][1] == 0.0


def test_a_robot_without_play_answers_its_command(seed_robot):
    answer = EquilibriumSolver(seed_robot).solve([0.0, 0.5], D)
    assert answer.command_at_tubes[0] is answer.alpha and answer.command_at_tubes[1] is answer.D
