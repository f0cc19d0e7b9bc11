"""Collocation of the boundary-value model under loads: another way to the same numbers, and scipy's own word."""

from __future__ import annotations

import numpy as np
import pytest
from loaded_cases import CASES
from loaded_cases import Case
from long_runs import some

from ctr_pvs.oracles.loaded_collocation import solve_loaded_bvp
from ctr_pvs.oracles.loaded_path import along_path

BY_NAME = {case.name: case for case in CASES}


@pytest.mark.parametrize("case", some(CASES, {1, 9, 13, 17}), ids=lambda case: case.name)
def test_converged_cases(case: Case):
    """From 70 % of the loads: tip to 1e-10 m, torques to 1e-9 N m, angles to 1e-8 rad."""
    guess = along_path(case.robot, case.alpha, case.D, case.loads.scaled(0.7), case.relaxed, 1e-8)
    solution = solve_loaded_bvp(case.robot, case.alpha, case.D, case.loads, guess)
    assert solution.success and solution.status == 0 and solution.residual < 1e-8
    assert np.linalg.norm(solution.tip - case.values["tip"]["position"]) < 1e-10
    assert solution.torque == pytest.approx(case.values["torque"], abs=1e-9)
    assert solution.base_moment == pytest.approx(case.values["internal_moment"], abs=1e-9)
    assert solution.psi_tip == pytest.approx(case.values["psi_tip"], abs=1e-8)


def test_it_starts_from_a_straight_robot_too():
    case = BY_NAME["seed_full_0_up"]
    solution = solve_loaded_bvp(case.robot, case.alpha, case.D, case.loads)
    assert solution.success and np.linalg.norm(solution.tip - case.values["tip"]["position"]) < 1e-10


def test_scipys_word_is_passed_on():
    """Too few nodes: a failure, with the state it stopped in."""
    case = BY_NAME["rod_elastica"]
    solution = solve_loaded_bvp(case.robot, case.alpha, case.D, case.loads, max_nodes=20)
    assert not solution.success and solution.status == 1 and "nodes" in solution.message
    assert solution.residual > 1e-8 and np.isfinite(solution.tip).all()


def test_nothing_out_is_refused():
    case = BY_NAME["rod_elastica"]
    with pytest.raises(ValueError, match="nothing is beyond the orifice"):
        solve_loaded_bvp(case.robot, case.alpha, [case.robot.tubes[0].length])
