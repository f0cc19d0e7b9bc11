"""The field's boundary-value model: against reference values, the package's solver, itself, and scipy's own word."""

from __future__ import annotations

import ast
import subprocess
import sys

import numpy as np
import pytest
from conftest import ROOT
from judges_of_shape import tip_position
from random_robots import random_D
from random_robots import random_robot

from ctr_pvs import CommandError
from ctr_pvs import EquilibriumSolver
from ctr_pvs import Robot
from ctr_pvs import Segment
from ctr_pvs import Tube
from ctr_pvs import load_robot
from ctr_pvs.oracles import standard_model
from ctr_pvs.oracles.standard_model import Collocation
from ctr_pvs.oracles.standard_model import Problem
from ctr_pvs.oracles.standard_model import Shooting
from ctr_pvs.oracles.standard_model import StandardSolution
from ctr_pvs.oracles.standard_model import solve_standard_bvp
from ctr_pvs.oracles.standard_model import solve_standard_shooting

FIG2 = "renda2021_fig2.yaml"


def solve(method: str, robot: Robot, alpha, D, before: StandardSolution | None = None) -> StandardSolution:
    """By either method, warm from the solution before if there is one."""
    if method == "bvp":
        return solve_standard_bvp(robot, alpha, D, guess=before)
    return solve_standard_shooting(robot, alpha, D, guess=None if before is None else before.torque)


def relative_angle(solution: StandardSolution, s: list[float]) -> np.ndarray:
    """theta_2 (g,) [deg] of a two-tube robot at arc lengths s (g,) [m]."""
    return np.degrees(np.diff(solution.angles_at(np.array(s)), axis=1)[:, 0])


@pytest.mark.parametrize("method", ["bvp", "shooting"])
@pytest.mark.parametrize("sweep", ["fig4_full", "fig4_partial"])
def test_the_seeds_sweeps(seed_robot, reference, sweep, method):
    """All rows of Fig. 4, warm: tip to 2e-9 m (the file's own digits: 1e-9), angles 1e-7 deg, torque 1e-9 N m."""
    D, solution = reference[sweep]["D"], None
    for row in reference[sweep]["rows"]:
        solution = solve(method, seed_robot, [0.0, np.radians(row["alpha2_deg"])], D, solution)
        assert solution.success, solution.message
        assert np.linalg.norm(solution.tip - row["tip_m"]) < 2e-9
        theta = relative_angle(solution, [0.0, seed_robot.tubes[0].length - D[0]])
        assert theta == pytest.approx([row["theta2_orifice_deg"], row["theta2_outer_tip_deg"]], abs=1e-7)
        assert solution.torque == pytest.approx([-row["torque2_Nm"], row["torque2_Nm"]], abs=1e-9)


@pytest.mark.parametrize("method", ["bvp", "shooting"])
def test_fig2_lower_branch(reference, method):
    """Hard coupling, turned to 180 deg in steps of 20: 1e-7 deg and 1e-10 m."""
    robot, row, solution = load_robot(ROOT / "config" / FIG2), reference["fig2"], None
    for angle in np.radians(np.arange(0, 181, 20)):
        solution = solve(method, robot, [0.0, angle], [0.0, 0.0], solution)
        assert solution.success, solution.message
    assert relative_angle(solution, [0.14]) == pytest.approx([row["theta2_outer_tip_deg"]], abs=1e-7)
    assert np.linalg.norm(solution.tip - row["tip_m"]) < 1e-10


def test_zero_twist_leads_to_the_unstable_equilibrium():
    """Fig. 2 at 180 deg, cold: both stay on the saddle, and solve_bvp calls it a success.  (root may not: its tolerance
    is relative, and the torques are zero.)"""
    for method in ("bvp", "shooting"):
        solution = solve(method, load_robot(ROOT / "config" / FIG2), [0.0, np.pi], [0.0, 0.0])
        assert solution.success or method == "shooting"
        assert relative_angle(solution, [0.14]) == pytest.approx([180.0], abs=1e-9)
        assert np.abs(solution.torque).max() < 1e-12 and solution.residual < 1e-12


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("tubes", [1, 2, 3, 4])
def test_random_robots_against_the_package(tubes, seed):
    """Both methods, cold and from the equilibrium's own fields: tip to 1e-8 m, angles 1e-7 rad, torque 1e-8 N m."""
    rng = np.random.default_rng([seed, tubes])
    robot = random_robot(rng, tubes)
    D, alpha = random_D(rng, robot), rng.uniform(-2.0, 2.0, tubes)
    answer = EquilibriumSolver(robot, tolerance=1e-9).solve(alpha, D)
    assert answer.success, answer.message
    s = np.linspace(0.0, answer.shape.domain.length, 40)
    for solution in (
        solve_standard_bvp(robot, alpha, D),
        solve_standard_bvp(robot, alpha, D, guess=answer.shape),
        solve_standard_shooting(robot, alpha, D),
        solve_standard_shooting(robot, alpha, D, guess=answer.torque),
    ):
        assert solution.success, solution.message
        assert np.linalg.norm(solution.tip - answer.tip.position) < 1e-8
        assert np.allclose(solution.angles_at(s), answer.twist(s), rtol=0.0, atol=1e-7, equal_nan=True)
        assert solution.torque == pytest.approx(answer.torque, abs=1e-8)
        assert solution.torque.sum() == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("tubes", [2, 3, 4])
def test_collocation_and_shooting_agree(tubes):
    """Strong coupling, each by its own cold start: wherever both succeed on one branch they agree to 1e-8 rad."""
    compared = 0
    for seed in range(5):
        rng = np.random.default_rng([seed, tubes, 9])
        robot = random_robot(rng, tubes, strength=1.5)
        D, alpha = random_D(rng, robot), rng.uniform(-1.5, 1.5, tubes)
        a = solve_standard_bvp(robot, alpha, D)
        b = solve_standard_shooting(robot, alpha, D, guess=a.torque)
        assert a.success and b.success
        s = np.linspace(0.0, max(tube.length - base for tube, base in zip(robot.tubes, D, strict=True)), 30)
        assert np.allclose(a.angles_at(s), b.angles_at(s), rtol=0.0, atol=1e-8, equal_nan=True)
        assert np.linalg.norm(a.tip - b.tip) < 1e-10
        assert np.linalg.norm(b.tip - tip_position(robot, D, b.angles_at(np.zeros(1))[0], -b.torque)) < 1e-10
        compared += int(np.abs(a.torque).max() > 1e-4)
    assert compared >= 3  # not all of them without twist


def test_accuracy_follows_the_tolerance(seed_robot, reference):
    """Every option reaches the solver: finer asks for more evaluations and comes closer; so does the other scheme."""
    D, row = reference["fig4_full"]["D"], reference["fig4_full"]["rows"][9]
    alpha = [0.0, np.radians(row["alpha2_deg"])]
    exact = solve_standard_shooting(seed_robot, alpha, D, rtol=1e-12)

    def errors(solutions):
        return [abs(solution.torque[1] - exact.torque[1]) for solution in solutions]

    bvp = [solve_standard_bvp(seed_robot, alpha, D, tolerance=t) for t in (1e-3, 1e-6, 1e-9)]
    shot = [solve_standard_shooting(seed_robot, alpha, D, rtol=t, integrator="RK45") for t in (1e-3, 1e-6, 1e-9)]
    for solutions in (bvp, shot):
        assert errors(solutions) == sorted(errors(solutions), reverse=True)
        assert errors(solutions)[-1] < 1e-9
        work = [solution.evaluations for solution in solutions]
        nodes = [solution.nodes for solution in solutions]
        assert work == sorted(work) and nodes == sorted(nodes)
    few, many = (solve_standard_bvp(seed_robot, alpha, D, tolerance=1e-3, first_nodes=n).nodes for n in (11, 31))
    assert few < many
    by_lm = solve_standard_shooting(seed_robot, alpha, D, method="lm")
    assert by_lm.success and by_lm.torque == pytest.approx(exact.torque, abs=1e-9)


def test_a_guess_selects_the_branch(reference):
    """Fig. 2, 180 deg: from either mirror branch back to it; a guess for a shorter robot serves too."""
    robot = load_robot(ROOT / "config" / FIG2)
    lower = EquilibriumSolver(robot, tolerance=1e-9).solve([0.0, np.pi], [0.0, 0.0])
    theta = reference["fig2"]["theta2_outer_tip_deg"]
    for sign, expected in ((1.0, theta), (-1.0, 360.0 - theta)):
        by_shooting = solve_standard_shooting(robot, [0.0, np.pi], [0.0, 0.0], guess=sign * lower.torque)
        by_collocation = solve_standard_bvp(robot, [0.0, np.pi], [0.0, 0.0], guess=by_shooting)
        for solution in (by_shooting, by_collocation):
            assert solution.success
            assert relative_angle(solution, [0.14]) == pytest.approx([expected], abs=1e-7)
    shorter = solve_standard_bvp(robot, [0.0, 2.0], [0.02, 0.03])
    longer = solve_standard_bvp(robot, [0.0, 2.0], [0.01, 0.01], guess=shorter)
    cold = solve_standard_bvp(robot, [0.0, 2.0], [0.01, 0.01])
    assert longer.success and longer.torque == pytest.approx(cold.torque, abs=1e-9)


def _problem(seed: int) -> Problem:
    """Three tubes with polynomial and helical curvature, several sections."""
    rng = np.random.default_rng(seed)
    robot = random_robot(rng, 3)
    return Problem(robot, rng.uniform(-2.0, 2.0, 3), random_D(rng, robot))


def _differences(function, at: np.ndarray) -> np.ndarray:
    """Central differences, (values, unknowns)."""
    steps = 1e-6 * np.eye(len(at))
    return np.column_stack([(function(at + step) - function(at - step)) / 2e-6 for step in steps])


@pytest.mark.parametrize("seed", range(4))
def test_jacobians_against_differences(seed):
    """Of the equations and conditions of collocation, and of a shot by its variational equations."""
    problem = _problem(seed)
    system = Collocation(problem)
    rng = np.random.default_rng([seed, 1])
    x, y = np.array([0.0, 0.3, 1.0]), rng.normal(size=(system.n, 3))
    jacobian = system.jacobian(x, y)
    for i in range(len(x)):

        def rates(column: np.ndarray, i: int = i) -> np.ndarray:
            return system.rates(x[i : i + 1], column[:, None])[:, 0]

        assert np.allclose(jacobian[:, :, i], _differences(rates, y[:, i]), atol=1e-7)
    start, end = rng.normal(size=(2, system.n))
    at_start, at_end = system.conditions_jacobian(start, end)
    assert np.allclose(at_start, _differences(lambda v: system.conditions(v, end), start), atol=1e-7)
    assert np.allclose(at_end, _differences(lambda v: system.conditions(start, v), end), atol=1e-7)
    assert np.linalg.matrix_rank(np.hstack([at_start, at_end])) == system.n

    shooting = Shooting(problem, 1e-12, "DOP853")
    free = 0.1 * rng.normal(size=shooting.n)
    assert np.allclose(shooting.jacobian(free), _differences(shooting.residual, free), rtol=1e-6, atol=1e-7)


@pytest.mark.parametrize("method", ["hybr", "lm"])
def test_scipys_word_is_passed_on_past_a_fold(seed_robot, reference, monkeypatch, method):
    """No equilibrium is left on this branch: whatever root says is said, and what torque remains is shown."""
    said = []
    root = standard_model.root
    monkeypatch.setattr(standard_model, "root", lambda *args, **kwargs: said.append(root(*args, **kwargs)) or said[-1])
    D, fold = reference["fig4_full"]["D"], reference["fig4_full"]["fold_alpha2_deg"]
    before = EquilibriumSolver(seed_robot, tolerance=1e-8).solve([0.0, np.radians(fold - 0.01)], D)
    solution = solve_standard_shooting(seed_robot, [0.0, np.radians(fold + 1.0)], D, guess=before.torque, method=method)
    assert (solution.success, solution.status, solution.message) == (said[0].success, said[0].status, said[0].message)
    assert solution.residual > 1e-5  # N m, on either account: "lm" calls its least residual a success


def test_scipys_word_is_passed_on_by_collocation(seed_robot, reference, monkeypatch):
    """Too few nodes: a failure, with the state it stopped in.  Past the fold: whatever solve_bvp says."""
    D = reference["fig4_full"]["D"]
    failed = solve_standard_bvp(seed_robot, [0.0, 3.0], D, max_nodes=20)
    assert not failed.success and failed.status == 1 and "nodes" in failed.message
    assert failed.residual > 1e-8 and np.isfinite(failed.tip).all()

    said = []
    solve_bvp = standard_model.solve_bvp
    monkeypatch.setattr(
        standard_model, "solve_bvp", lambda *args, **kwargs: said.append(solve_bvp(*args, **kwargs)) or said[-1]
    )
    fold = reference["fig4_full"]["fold_alpha2_deg"]
    before = EquilibriumSolver(seed_robot, tolerance=1e-8).solve([0.0, np.radians(fold - 0.01)], D)
    for beyond in (0.1, 20.0):
        solution = solve_standard_bvp(seed_robot, [0.0, np.radians(fold + beyond)], D, guess=before.shape)
        word = said[-1]
        assert (solution.success, solution.status, solution.message) == (word.success, word.status, word.message)
        assert solution.nodes == len(word.x) and solution.residual == word.rms_residuals.max()


def test_tubes_inside_the_guide():
    """A tube that ends at the orifice only follows its base; with nothing out there is nothing to solve."""
    segment = Segment(0.1, 0.05, 0.04, (10.0,))
    robot = Robot("trio", tuple(Tube(name, (segment,)) for name in "abc"))
    for method in ("bvp", "shooting"):
        inside = solve(method, robot, [0.0, 1.0, 2.0], [0.1, 0.1, 0.1])
        assert inside.success and np.array_equal(inside.tip, np.zeros(3)) and not inside.torque.any()
        assert np.array_equal(inside.angles_at(np.zeros(1)), [[0.0, 1.0, 2.0]])
        assert np.isnan(inside.angles_at(np.array([0.01]))).all()

        single = solve(method, robot, [0.0, 1.0, 2.0], [0.04, 0.1, 0.1])
        turned = 10.0 * 0.06
        assert single.success
        assert single.tip == pytest.approx([np.sin(turned) / 10, 0.0, -(1 - np.cos(turned)) / 10], abs=1e-12)
        expected = [[0.0, 1.0, 2.0], [0.0, np.nan, np.nan], [np.nan] * 3]
        assert np.allclose(single.angles_at(np.array([0.0, 0.06, 0.061])), expected, atol=1e-14, equal_nan=True)
        assert single.angles_at(np.zeros(0)).shape == (0, 3)


@pytest.mark.parametrize("method", ["bvp", "shooting"])
def test_a_bad_command_is_refused(seed_robot, method):
    for alpha, D in [([0.0, np.nan], [0.1, 0.2]), ([0.0], [0.1, 0.2]), ([0.0, 1.0], [0.2, 0.1])]:
        with pytest.raises(CommandError):
            solve(method, seed_robot, alpha, D)


def test_it_stands_apart_from_the_solver_it_checks():
    """It uses robot, sections and materials only, and what the package serves does not load it."""
    used = set()
    for name in ("standard_model", "standard_equations"):
        for node in ast.walk(ast.parse((ROOT / "ctr_pvs" / "oracles" / f"{name}.py").read_text())):
            if isinstance(node, ast.ImportFrom) and node.module.startswith("ctr_pvs"):
                used.add(node.module)
            assert not (isinstance(node, ast.Import) and any(alias.name.startswith("ctr_pvs") for alias in node.names))
    names = ("robot.robot", "model.sections", "model.materials", "oracles.standard_equations")
    assert used == {f"ctr_pvs.{name}" for name in names}
    code = "import sys, ctr_pvs; assert not [name for name in sys.modules if 'standard_' in name]"
    assert subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=False).returncode == 0
