"""One proven step from state to state: a certificate that holds, degrees that depend on the command alone."""

from __future__ import annotations

import copy

import numpy as np
import pytest
from dense_energies import energy_of_answer
from dense_energies import solved_for
from random_robots import random_D
from random_robots import random_robot

from ctr_pvs import EquilibriumSolver
from ctr_pvs import Robot
from ctr_pvs import Segment
from ctr_pvs import Status
from ctr_pvs import Tube
from ctr_pvs.answer.degrees import settled
from ctr_pvs.answer.state import State
from ctr_pvs.kernel.walk.step import OK
from ctr_pvs.solve.dense import DenseEnergy
from ctr_pvs.solve.equilibria import stationary
from ctr_pvs.solve.path import NO_LOADS

PARTIAL = np.array([0.0935, 0.1705])


def test_the_tangent_is_the_rate_of_the_equilibrium(seed_robot):
    solver = EquilibriumSolver(seed_robot, tolerance=1e-8)
    alpha, step = np.array([0.2, 1.7]), np.array([0.0, 1e-5])
    here = solver.solve(alpha, PARTIAL)
    ahead, behind = (solver.solve(alpha + sign * step, PARTIAL).state.unknowns for sign in (1.0, -1.0))
    counts = solved_for(here._engine, here.state)
    rate = ((ahead - behind) / (2.0 * step[1]))[counts]
    energy, y, h = energy_of_answer(here), here.state.unknowns, 1e-5
    mixed = (energy.gradient(y, alpha + h * step / step[1]) - energy.gradient(y, alpha - h * step / step[1])) / (2 * h)
    tangent = -np.linalg.solve(energy.hessian(y, alpha)[np.ix_(counts, counts)], mixed[counts])
    assert tangent == pytest.approx(rate, rel=1e-5, abs=1e-9)


def test_a_small_step_takes_one_newton_step_and_a_longer_one_few(seed_robot):
    """The first is the tangent prediction; what it leaves is of second order."""
    for angle, most in ((1e-4, 1), (1e-2, 3), (0.5, 6)):
        solver = EquilibriumSolver(seed_robot, tolerance=1e-8)
        solver.solve([0.0, 1.2], PARTIAL)
        assert solver.solve([0.0, 1.2 + angle], PARTIAL).iterations <= most


@pytest.mark.parametrize("seed", range(12))
def test_a_state_put_down_at_other_degrees_is_the_same_equilibrium(seed):
    """Fields are carried from degree to degree: found at a high one, settled on those that the tolerance asks for."""
    rng = np.random.default_rng([seed, 78])
    robot = random_robot(rng, 2 + seed % 3, 1.5)
    D, alpha = random_D(rng, robot), rng.uniform(-2.0, 2.0, robot.n_tubes)
    answer = EquilibriumSolver(robot, 1e-7, fidelity="torsion").solve(alpha, D)
    assert answer.success, answer.message
    engine = answer._engine
    energy = DenseEnergy(engine, D, 14)
    start = np.linalg.lstsq(
        energy.angle_map.reshape(-1, energy.n),
        (engine.angles(answer.state.vector, energy.place)[0] - alpha).ravel(),
        rcond=None,
    )[0]
    y, _ = stationary(energy, alpha, start, 0.1)
    fine = energy.state(y, alpha)
    code, vector = settled(engine, fine.vector, NO_LOADS, False)
    assert code == OK
    s = np.linspace(0.0, answer.length, 40)
    assert engine.angles(vector, s)[0] == pytest.approx(engine.angles(answer.state.vector, s)[0], abs=1e-10)
    assert State(vector, robot.n_tubes).tip[:3] == pytest.approx(answer.tip.position, abs=1e-10)


def test_the_margin_is_that_of_the_finer_energy(seed_robot):
    solver = EquilibriumSolver(seed_robot, tolerance=1e-6)
    for degrees in (30, 150, 200, 205.5):
        answer = solver.solve([0.0, np.radians(degrees)], PARTIAL)
        least = energy_of_answer(answer).eigenvalues(answer.state.unknowns, answer.alpha)[0]
        assert answer.stability_margin == pytest.approx(min(1.0, least), abs=1e-12)


@pytest.mark.parametrize("tolerance", [1e-3, 1e-5, 1e-7])
def test_level_and_degrees_have_no_history(seed_robot, tolerance):
    """The same command reached in many ways: the same level, unknowns and answer."""
    command = np.array([0.1, 1.2]), np.array([0.09, 0.19])
    ways = [
        [],
        [([0.1, 1.19], command[1])],
        [([0.0, 2.5], PARTIAL), ([0.1, 2.0], command[1])],
        [([0.0, 0.0], [0.0935, 0.2085]), ([0.1, 1.2], [0.09, 0.2])],
    ]
    answers = []
    for way in ways:
        solver = EquilibriumSolver(seed_robot, tolerance)
        for alpha, D in way:
            assert solver.solve(alpha, D).success
        answers.append(solver.solve(*command))
    first = answers[0]
    for answer in answers[1:]:
        assert (answer.fidelity, answer.degrees_of_freedom) == (first.fidelity, first.degrees_of_freedom)
        assert answer.tip.position == pytest.approx(first.tip.position, abs=1e-11)


@pytest.mark.parametrize("tolerance", [1e-3, 1e-4, 1e-6])
def test_small_steps_up_and_down_find_the_same_levels(seed_robot, tolerance):
    """Where twist is large the untwisted state is not even looked at; that shows in no level on the way back."""
    solver, levels = EquilibriumSolver(seed_robot, tolerance), []
    angles = np.radians(0.1 * np.arange(250))
    for angle in [*angles, *angles[::-1]]:
        levels.append(solver.solve([0.0, angle], PARTIAL).fidelity)
    assert levels[:250] == levels[:249:-1]
    assert set(levels) == {"torsionless", "torsion"}


@pytest.mark.parametrize(
    ("tolerance", "levels", "fewest"),
    [(1e-4, {"torsionless", "torsion"}, 3), (1e-5, {"torsion"}, 2), (1e-7, {"torsion"}, 3)],
)
def test_degree_changes_do_not_make_the_stream_jump(seed_robot, tolerance, levels, fewest):
    """Along a path on which level or degrees change, the answer stays within the tolerance of the exact one."""
    solver, exact = EquilibriumSolver(seed_robot, tolerance), EquilibriumSolver(seed_robot, 1e-9)
    seen, before = set(), np.zeros(3)
    for t in np.linspace(0.0, 1.0, 120):
        command = [0.0, -0.15 + 1.5 * t], [0.09, 0.145 + 0.06 * t]
        answer = solver.solve(*command)
        error = answer.tip.position - exact.solve(*command).tip.position
        assert np.linalg.norm(error) <= min(tolerance, answer.error_estimate)
        if seen:
            assert np.linalg.norm(error - before) <= tolerance
        seen.add((answer.fidelity, answer.degrees_of_freedom))
        before = error
    assert len(seen) >= fewest and levels == {level for level, _ in seen}


def test_auto_takes_the_untwisted_state_only_where_it_may(seed_robot):
    """Aligned tubes need no twist; opposed ones stand untwisted too, but not stably, and twist."""
    robot = Robot(
        "opposed",
        tuple(Tube(name, (Segment(0.2, 0.02, 0.015, (14.0,)),)) for name in ("outer", "inner")),
    )
    solver = EquilibriumSolver(robot, 1e-4)
    aligned = solver.solve([0.0, 0.0], [0.0, 0.0], start="cold")
    assert (aligned.fidelity, aligned.degrees_of_freedom) == ("torsionless", 0) and "twist" in aligned.reason
    opposed = solver.solve([0.0, np.pi], [0.0, 0.0], start="cold")
    assert opposed.fidelity == "torsion" and opposed.success and opposed.stability_margin > 0.0
    assert abs(np.diff(opposed.twist(np.array([0.2])))[0, 0]) < 3.0
    uncoupled = EquilibriumSolver(seed_robot).solve([0.0, 1.0], [0.1858, 0.3])
    assert (uncoupled.fidelity, uncoupled.degrees_of_freedom) == ("torsionless", 0)


def test_every_answer_says_why(seed_robot):
    for tolerance in (1e-2, 1e-6):
        for level in ("auto", "torsion", "torsionless", "full"):
            answer = EquilibriumSolver(seed_robot, tolerance, fidelity=level).solve([0.0, 0.3], PARTIAL)
            assert answer.reason.startswith(answer.fidelity) and "\n" not in answer.reason
            assert level in ("auto", answer.fidelity)
            assert np.isfinite(answer.error_estimate)


def test_one_step_and_many_end_on_one_branch(seed_robot):
    """A step that is taken at once is one that following the path confirms; others go the long way to the same end."""
    rng = np.random.default_rng(3)
    one = EquilibriumSolver(seed_robot, 1e-7)
    one.solve([0.0, 0.0], PARTIAL)
    for _ in range(40):
        alpha, D = np.array([0.0, rng.uniform(-3.4, 3.4)]), np.array([0.0935, 0.1705]) + rng.uniform(-0.02, 0.02)
        start = one._last
        answer = one.solve(alpha, D)
        many = EquilibriumSolver(seed_robot, 1e-7)
        many._last = copy.copy(start)
        for t in np.linspace(0.0, 1.0, 60)[1:]:
            small = many.solve(start.alpha + t * (alpha - start.alpha), start.D + t * (D - start.D))
            assert small.status in (Status.OK, Status.SNAP)
        assert small.tip.position == pytest.approx(answer.tip.position, abs=1e-8)
