"""Designs for targets: rates against differences of another search, known robots found again, limits kept."""

from __future__ import annotations

import pickle
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from design_scenes import KNOWN

from bench.design.known_designs import robot_off
from bench.design.known_designs import targets_of
from ctr_pvs import EquilibriumSolver
from ctr_pvs import load_robot
from ctr_pvs.errors import TableError
from ctr_pvs.robot.dimensions import largest_strain
from ctr_pvs.tasks.aim import tangent_of
from ctr_pvs.tasks.design.design import design
from ctr_pvs.tasks.design.parameters import chosen
from ctr_pvs.tasks.design.reach import Made
from ctr_pvs.tasks.design.reach import Problem
from ctr_pvs.tasks.design.reach import rates
from ctr_pvs.tasks.design.room import DesignLimits
from ctr_pvs.tasks.design.room import Room
from ctr_pvs.tasks.design.stage import blank
from ctr_pvs.tasks.design.stage import stage
from ctr_pvs.tasks.design.targets import Targets
from ctr_pvs.tasks.design.targets import read_targets


def problem_of(robot, targets, vary=("length", "curvature"), limits=None):
    room = Room(robot, chosen(robot, vary), limits or DesignLimits())
    return Problem(room, tuple(targets.aims(1e-6, 1e-4)), 1e-8)


def tried(problem, shares):
    made = Made(problem, problem.room.robot_at(shares))
    made.go_on(blank(problem, shares).commands)
    return made


def check(found):
    """What it tells holds for a fresh solver, and limits are kept."""
    solver = EquilibriumSolver(found.robot, 1e-8)
    for place, told in zip(found.targets.position, found.after.targets, strict=True):
        alpha, D = found.robot.check_command(told.alpha, told.D)
        answer = solver.solve(alpha, D, start="cold")
        assert np.linalg.norm(answer.tip.position - place) == pytest.approx(told.distance, abs=1e-6)
        assert answer.stability_margin >= found.limits.margin - 1e-6
        assert not told.reached or told.distance <= 1e-6
    strains = [largest_strain(tube) for tube in found.robot.tubes]
    assert all(strain is None or strain <= found.limits.strain * (1.0 + 1e-9) for strain in strains)


def test_rates_are_differences_of_the_distances_that_inverse_kinematics_leaves():
    """By the search of single targets, which finds the closest commands in its own way."""
    vary = ("length", "curvature", "inner_diameter", "outer_diameter")
    far = Targets(np.array([[0.27, 0.02, -0.03], [0.25, 0.1, 0.05], [0.22, -0.12, 0.1], [0.24, 0.03, -0.1]]))
    problem = problem_of(KNOWN, far, vary, DesignLimits(0.2))
    shares = np.full(len(problem.room.parameters), 0.45)
    told, h = rates(problem, shares, tried(problem, shares)), 2e-3

    def distances(shares):
        solver = EquilibriumSolver(problem.room.robot_at(shares), 1e-9)
        return np.array([solver.inverse(place).distance for place in far.position])

    assert distances(shares).min() > 1e-3
    for k, step in enumerate(h * np.eye(len(shares))):
        difference = (distances(shares + step) - distances(shares - step)) / (2.0 * h)
        assert told[:, k] == pytest.approx(difference, abs=1e-4), problem.room.parameters[k].name


def test_a_robot_for_targets_of_a_known_one():
    found = design(robot_off(KNOWN, 3), targets_of(KNOWN, 3, 8), starts=2)
    assert found.before.reached < 8
    assert found.success and found.after.worst <= 1e-6 and not found.stopped
    check(found)


def test_the_executor_changes_nothing_and_its_tasks_can_be_sent_away():
    targets, begin = targets_of(KNOWN, 2, 4), robot_off(KNOWN, 2)
    with ThreadPoolExecutor(1) as one, ThreadPoolExecutor(3) as three:
        first, second = (design(begin, targets, starts=3, seed=5, executor=pool) for pool in (one, three))
    assert first.values.tolist() == second.values.tolist()
    problem = problem_of(begin, targets)
    draft = blank(problem, np.full(6, 0.5))
    sent = pickle.loads(pickle.dumps(stage(*pickle.loads(pickle.dumps((problem, draft))))))
    assert sent.shares.tolist() == stage(problem, draft).shares.tolist()


def test_a_strain_that_the_known_robot_breaks_is_kept_and_what_is_left_told():
    targets, strain = targets_of(KNOWN, 3, 8), 0.0055
    assert largest_strain(KNOWN.tubes[1]) > strain
    few = ["curvature", "length:inner:2=0.5x,1.05x"]
    found = design(KNOWN, targets, few, DesignLimits(strain), starts=2)
    assert not found.success and found.after.worst > 1e-4
    check(found)
    assert max(map(largest_strain, found.robot.tubes)) == pytest.approx(strain, rel=1e-6) and found.at_bound.any()
    assert found.before.reached == 8  # what breaks it reaches all


def test_tangents():
    solver = EquilibriumSolver(KNOWN, 1e-8)
    answers = [solver.solve([0.0, turn], [0.03, 0.12], start="cold") for turn in (0.3, 1.0)]
    tangents = [tangent_of(answer.tip.orientation) for answer in answers]
    targets = Targets(np.array([answer.tip.position for answer in answers]), np.array(tangents))
    found = design(robot_off(KNOWN, 4), targets, starts=2)
    assert found.success and max(target.angle for target in found.after.targets) <= 1e-4
    check(found)


def test_stopped_before_anything_was_tried():
    lines = []
    found = design(KNOWN, targets_of(KNOWN, 5, 3), starts=2, progress=lines.append, stopped=lambda: True)
    assert found.stopped and found.tried == 0 and found.robot.tubes[0].length == pytest.approx(KNOWN.tubes[0].length)
    assert lines and lines[0].startswith("before: ")


@pytest.mark.parametrize(
    ("rows", "part"),
    [
        (np.empty((0, 3)), "1 to 1000 of them"),
        ([[0.1, np.nan, 0.0]], "position, row 1"),
        ([[0.1, 0.0, 0.0], [-0.01, 0.0, 0.0]], "x, row 2: expected x of 0 or more"),
        ([[0.1, 0.0]], "3 columns"),
    ],
)
def test_targets_that_cannot_be_meant(rows, part):
    with pytest.raises(TableError, match=part):
        Targets(np.array(rows))


def test_targets_in_other_units(tmp_path):
    file = tmp_path / "targets.csv"
    file.write_text("x,y,z,tx,ty,tz\n100,0,20,1,0,0\n")
    targets = read_targets(file, mm=True)
    assert targets.position.tolist() == [[0.1, 0.0, 0.02]] and targets.tangent.tolist() == [[1.0, 0.0, 0.0]]
    with pytest.raises(TableError, match="in mm"):
        design(KNOWN, read_targets(file))


@pytest.mark.soak
@pytest.mark.parametrize("seed", range(8))
def test_twenty_targets_of_robots_that_snap(seed):
    known = load_robot("renda2021")
    found = design(robot_off(known, seed), targets_of(known, seed, 20), seed=seed)
    assert found.success, found.after.distances
    check(found)


@pytest.mark.soak
@pytest.mark.parametrize("seed", range(3))
def test_twenty_targets_of_three_tubes(seed):
    known = load_robot("three_tubes")
    begin = robot_off(known, seed)
    found = design(begin, targets_of(known, seed, 20), starts=4, seed=seed)
    assert found.success, found.after.distances
    check(found)
