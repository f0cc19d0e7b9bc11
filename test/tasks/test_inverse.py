"""Inverse kinematics: targets are tips of random commands; ways and ends are judged by solvers that know nothing of the
search."""

from __future__ import annotations

import math
import time

import numpy as np
import pytest

from ctr_pvs import EquilibriumSolver
from ctr_pvs import InverseStatus
from ctr_pvs import Limits
from ctr_pvs import Loads
from ctr_pvs import NoEquilibriumError
from ctr_pvs import Robot
from ctr_pvs import Status
from ctr_pvs import load_robot
from ctr_pvs.errors import FieldError
from ctr_pvs.tasks.aim import tangent_of
from ctr_pvs.tasks.bounds import Bounds
from ctr_pvs.tasks.table import Table

TOLERANCE, FLOOR = 1e-7, 0.1


def random_answer(rng, robot, loads=None, bounds=None, floor=FLOOR):
    """The answer of a cold start at a random command with margin above the floor."""
    bounds = bounds or Bounds(robot, None)
    N, solver = robot.n_tubes, EquilibriumSolver(robot, TOLERANCE)
    while True:
        alpha = np.append(0.0, rng.uniform(-2.5, 2.5, N - 1)) + rng.uniform(-3.0, 3.0)
        D = np.maximum.accumulate(rng.uniform(bounds.low[N:], bounds.high[N:]))
        if not bounds.contains(alpha, D):
            continue
        answer = solver.solve(alpha, D, start="cold", loads=loads)
        if answer.status is Status.OK and answer.stability_margin > floor:
            return answer


def check_way(robot, result, loads=None, floor=FLOOR):
    """Along the way with a fresh solver: no snap, no margin below the floor, and at its end the tip that was told."""
    fresh = EquilibriumSolver(robot, TOLERANCE)
    for step in result.way:
        answer = fresh.solve(step.alpha, step.D, loads=loads)
        assert answer.status is Status.OK and answer.stability_margin >= floor - 1e-6
        assert step.margin == pytest.approx(answer.stability_margin, abs=1e-4)
    assert answer.tip.position == pytest.approx(result.equilibrium.tip.position, abs=3e-7)
    assert (answer.alpha == result.alpha).all() and (answer.D == result.D).all()


@pytest.mark.parametrize(("name", "count"), [("renda2021", 12), ("three_tubes", 8)])
def test_tips_of_random_commands_are_reached(name, count):
    rng, robot = np.random.default_rng(3), load_robot(name)
    solver, start = EquilibriumSolver(robot, TOLERANCE), Bounds(robot, None).centre()
    for _ in range(count):
        target = random_answer(rng, robot).tip.position
        result = solver.inverse(target, start=start)
        assert result.success and result.status is InverseStatus.REACHED, result.message
        assert result.distance < 1e-6
        assert np.linalg.norm(result.equilibrium.tip.position - target) == pytest.approx(result.distance)
        assert result.way[0].alpha == pytest.approx(start[0]) and pytest.approx(start[1]) == result.way[0].D
        robot.check_command(result.alpha, result.D)
        check_way(robot, result)


def test_a_cold_solve_at_the_command_has_its_tip_at_the_target():
    """Not all commands: a way may lead to another branch than a cold start's, and past half a turn it often does."""
    rng, robot = np.random.default_rng(4), load_robot("three_tubes")
    solver = EquilibriumSolver(robot, TOLERANCE)
    for _ in range(6):
        target = random_answer(rng, robot).tip.position
        result = solver.inverse(target)
        cold = EquilibriumSolver(robot, 1e-8).solve(result.alpha, result.D, start="cold")
        assert cold.status is Status.OK
        assert np.linalg.norm(cold.tip.position - target) < 2e-6


def test_tangents_of_three_tubes_are_reached():
    rng, robot = np.random.default_rng(5), load_robot("three_tubes")
    solver = EquilibriumSolver(robot, TOLERANCE)
    for _ in range(4):
        tip = random_answer(rng, robot).tip
        tangent = tangent_of(tip.orientation)
        result = solver.inverse(tip.position, tangent)
        assert result.success, result.message
        assert result.distance < 1e-6 and result.angle < 1e-4
        assert tangent_of(result.equilibrium.tip.orientation) @ tangent > 1.0 - 1e-8
        check_way(robot, result)


def test_orientations_near_the_start_are_reached():
    """Six numbers for six: solutions are isolated, here one is near."""
    rng, robot = np.random.default_rng(6), load_robot("three_tubes")
    solver = EquilibriumSolver(robot, TOLERANCE)
    for _ in range(3):
        answer = random_answer(rng, robot, floor=0.9)
        alpha, D = answer.alpha + rng.uniform(-0.05, 0.05, 3), answer.D + 0.001
        result = solver.inverse(
            answer.tip.position, orientation=answer.tip.orientation, start=Bounds(robot, None).clamped(alpha, D)
        )
        assert result.success, result.message
        assert abs(result.equilibrium.tip.orientation @ answer.tip.orientation) > 1.0 - 1e-8
        check_way(robot, result)


@pytest.mark.parametrize("name", ["renda2021", "three_tubes"])
def test_tips_under_a_load_are_reached(name):
    rng, robot, loads = np.random.default_rng(7), load_robot(name), Loads(tip_force=(0.0, 0.15, -0.1))
    solver, start = EquilibriumSolver(robot, TOLERANCE), Bounds(robot, None).centre()
    for _ in range(5):
        target = random_answer(rng, robot, loads).tip.position
        result = solver.inverse(target, start=start, loads=loads)
        assert result.success, result.message
        assert result.equilibrium.applied_loads == loads
        check_way(robot, result, loads)


def test_limits_are_kept_and_told():
    robot, rng = load_robot("renda2021"), np.random.default_rng(8)
    limits = Limits(alpha=((-1.0, 1.0), (-2.0, 2.0)), D=((0.05, 0.12), (0.1, 0.2)))
    bounds, solver = Bounds(robot, limits), EquilibriumSolver(robot, TOLERANCE)
    bounded = Robot(robot.name, robot.tubes, limits)
    for _ in range(6):
        result = solver.inverse(random_answer(rng, robot, bounds=bounds).tip.position, limits=limits)
        assert result.success, result.message
        for step in result.way:
            bounded.check_command(step.alpha, step.D)
    out = solver.inverse([0.29, 0.0, 0.0], limits=limits)  # the tip would have to come farther than D may
    assert out.status is InverseStatus.LIMITS and not out.success
    bounded.check_command(out.alpha, out.D)
    assert "D[1] >= 0.1" in out.message


def test_the_closest_point_of_a_target_out_of_reach():
    """No farther off than the best of many commands."""
    robot, rng = load_robot("renda2021"), np.random.default_rng(9)
    solver, bounds = EquilibriumSolver(robot, 1e-6), Bounds(robot, None)
    share = rng.random((3000, 4))
    alpha = 2.0 * np.pi * share[:, :2]
    D = np.maximum.accumulate(bounds.low[2:] + share[:, 2:] ** 2 * (bounds.high[2:] - bounds.low[2:]), axis=1)
    batch = solver.solve_batch(alpha, D)
    for target in ([0.35, 0.05, 0.0], [0.02, 0.09, 0.02], [-0.03, 0.0, 0.01]):
        result = solver.inverse(target)
        best = np.nanmin(np.linalg.norm(batch.tip_position - target, axis=1))
        assert result.status is InverseStatus.CLOSEST and not result.success
        assert 1e-3 < result.distance < best
        assert f"{1e3 * result.distance:.6g} mm off" in result.message
        check_way(robot, result)


def test_the_floor_of_the_margin_is_kept():
    """With a high floor, ways lead around strained commands or end before them."""
    robot, rng = load_robot("renda2021"), np.random.default_rng(10)
    solver = EquilibriumSolver(robot, TOLERANCE)
    for _ in range(6):
        result = solver.inverse(random_answer(rng, robot).tip.position, margin_floor=0.9)
        assert min(step.margin for step in result.way) >= 0.9
        check_way(robot, result, floor=0.9)


def test_all_solutions_differ_and_meet_the_target():
    robot, rng = load_robot("renda2021"), np.random.default_rng(11)
    solver = EquilibriumSolver(robot, TOLERANCE)
    target = random_answer(rng, robot).tip.position
    result = solver.inverse(target, all=True)
    every = [result, *result.others]
    assert len(every) >= 2
    margins = [one.equilibrium.stability_margin for one in every]
    assert margins == sorted(margins, reverse=True)
    for one in every:
        assert one.success and one.distance < 1e-6
        check_way(robot, one)
    for index, one in enumerate(every):
        for other in every[:index]:
            turn = np.abs((one.alpha - other.alpha + np.pi) % (2.0 * np.pi) - np.pi).max()
            assert turn > 0.1 or np.abs(one.D - other.D).max() > 0.003


def test_all_solutions_of_a_target_out_of_reach_are_its_closest_point():
    robot = load_robot("renda2021")
    solver = EquilibriumSolver(robot, 1e-6)
    one, every = (solver.inverse([0.35, 0.05, 0.0], all=each) for each in (False, True))
    assert every.status is InverseStatus.CLOSEST and every.others == ()
    assert every.distance < 1.001 * one.distance


def test_a_table_of_starts_that_is_not_finished_in_time_is_gone_on_with():
    robot = load_robot("renda2021")
    solver, bounds = EquilibriumSolver(robot, 1e-6), Bounds(robot, None)
    at_once, bit_by_bit = Table(solver, bounds), Table(solver, bounds)
    at_once.fill(math.inf)
    sizes = [0]
    while len(bit_by_bit.x) < len(at_once.x):
        bit_by_bit.fill(time.monotonic() + 1e-3)
        sizes.append(len(bit_by_bit.x))
    assert len(set(sizes)) > 3 and sizes == sorted(sizes)
    for name in ("x", "position", "orientation"):
        assert (getattr(bit_by_bit, name) == getattr(at_once, name)).all()


def test_the_search_sets_out_from_the_last_answer_and_leaves_it():
    robot = load_robot("renda2021")
    solver = EquilibriumSolver(robot, TOLERANCE)
    here = solver.solve([0.1, 1.2], [0.08, 0.19])
    target = EquilibriumSolver(robot, TOLERANCE).solve([0.2, 1.0], [0.075, 0.19]).tip.position
    result = solver.inverse(target)
    assert result.success and (result.way[0].alpha == here.alpha).all() and (result.way[0].D == here.D).all()
    assert len(result.way) <= 6  # it is near
    again = solver.solve([0.1, 1.2], [0.08, 0.19])
    assert again.tip.position == pytest.approx(here.tip.position, abs=1e-12)
    on = solver.inverse(target, start=result.equilibrium)
    assert on.success and len(on.way) == 1 and on.iterations == 0


def test_a_search_that_runs_out_of_time_says_so_with_the_nearest():
    solver = EquilibriumSolver(load_robot("three_tubes"), TOLERANCE)
    solver.solve([0.0, 0.5, 1.0], [0.05, 0.1, 0.15])
    begin = time.monotonic()
    result = solver.inverse([0.02, 0.2, 0.1], budget=1e-4)
    assert time.monotonic() - begin < 2.0
    assert result.status is InverseStatus.TIMEOUT and not result.success and len(result.way) >= 1
    assert result.distance > 0.01


def test_a_start_without_an_equilibrium_and_wrong_words_are_refused():
    robot = load_robot("renda2021")
    solver = EquilibriumSolver(robot, TOLERANCE, fidelity="torsionless")
    with pytest.raises(NoEquilibriumError):
        solver.inverse([0.1, 0.0, 0.0], start=([0.0, np.pi], [0.0935, 0.2085]))  # untwisted, it is unstable there
    good = EquilibriumSolver(robot, TOLERANCE)
    with pytest.raises(FieldError, match="margin_floor"):
        good.inverse([0.1, 0.0, 0.0], margin_floor=1.5)
    with pytest.raises(FieldError, match="within"):
        good.inverse([0.1, 0.0, 0.0], within=0.0)
    with pytest.raises(FieldError, match="budget"):
        good.inverse([0.1, 0.0, 0.0], budget=-1.0)
    with pytest.raises(ValueError, match="alpha"):
        good.inverse([0.1, 0.0, 0.0], start=([0.0], [0.05, 0.1]))


def test_a_single_tube_reaches_what_lies_on_its_surface():
    robot = load_robot("renda2021")
    one = Robot("one", robot.tubes[:1])
    solver = EquilibriumSolver(one, TOLERANCE)
    target = solver.solve([2.0], [0.1]).tip.position
    result = solver.inverse(target, start=([0.0], [0.15]))
    assert result.success, result.message
    assert pytest.approx([0.1], abs=1e-5) == result.D
