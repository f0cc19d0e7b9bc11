"""Random sweeps, few of them: what the tracker of small steps says of the solver's answers."""

from __future__ import annotations

import numpy as np
import pytest

from bench.common.places import CONFIG
from bench.stability import random_sweeps
from bench.stability.sweep_judge import Judge
from ctr_pvs import EquilibriumSolver
from ctr_pvs import load_robot
from ctr_pvs.solve.path import CommandPath


@pytest.mark.parametrize("seed", [0, 2, 3])
def test_answers_of_quiet_sweeps_are_right(seed):
    assert random_sweeps.sweep(seed, 1 + seed % 2) == ("right", "")


@pytest.mark.soak
def test_no_answer_of_forty_sweeps_is_wrong():
    verdicts = [random_sweeps.sweep(seed, 1 + seed % 3)[0] for seed in range(40)]
    assert set(verdicts) <= {"right", "flagged snap", "honest failure"}
    assert verdicts.count("flagged snap") > 0 and verdicts.count("right") > 20


def test_the_judge_sees_the_fold_by_itself():
    """Fig. 4, partial overlap: the branch ends at 205.92 deg."""
    robot = load_robot(CONFIG / "renda2021.yaml")
    D, begin, end = np.array([0.0935, 0.1705]), np.radians([0.0, 190.0]), np.radians([0.0, 215.0])
    solver, judge = EquilibriumSolver(robot, 1e-6), Judge(robot, 1e-6)
    start = judge.place(solver.solve(begin, D).state)
    reached, t = judge.go(CommandPath(begin, D, end, D), start, 0.0)
    assert np.degrees(reached.alpha[1]) == pytest.approx(205.9216, abs=2e-3) and t < 1.0
    assert reached.energy.margin(reached.y, reached.alpha) > 0.0
