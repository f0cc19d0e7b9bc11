"""The boundary-value model under loads: converged values, beams in closed form, unloaded tubes, its own word."""

from __future__ import annotations

import ast

import numpy as np
import pytest
from conftest import ROOT
from elastica import side_force_elastica
from loaded_cases import CASES
from loaded_cases import Case
from loaded_cases import robot_of
from long_runs import some
from random_robots import random_D
from random_robots import random_robot
from scipy.optimize import brentq
from scipy.special import ellipe
from scipy.special import ellipk

from ctr_pvs import Robot
from ctr_pvs import Segment
from ctr_pvs import Tube
from ctr_pvs.errors import LoadError
from ctr_pvs.oracles.loaded_equations import LoadedProblem
from ctr_pvs.oracles.loaded_forces import axial_forces
from ctr_pvs.oracles.loaded_forces import force
from ctr_pvs.oracles.loaded_forces import force_interval
from ctr_pvs.oracles.loaded_model import CONVERGED
from ctr_pvs.oracles.loaded_model import LoadedShooting
from ctr_pvs.oracles.loaded_model import solve_loaded
from ctr_pvs.oracles.loaded_path import along_path
from ctr_pvs.oracles.loaded_path import relaxed_angles
from ctr_pvs.oracles.standard_model import solve_standard_shooting
from ctr_pvs.robot.loads import Loads
from ctr_pvs.robot.loads import PointForce

K, GJ, LENGTH, GUIDE = 0.02, 0.015, 0.2, 0.05
#: A straight rod of LENGTH beyond the orifice.
ROD = Robot("rod", (Tube("rod", (Segment(LENGTH + GUIDE, K, GJ),), inner_diameter=0.0, outer_diameter=0.002),))


def rod(loads: Loads, **options):
    return solve_loaded(ROD, [0.0], [GUIDE], loads, **options)


@pytest.mark.parametrize("case", some(CASES, {0, 9, 13, 16, 17}), ids=lambda case: case.name)
def test_converged_cases(case: Case):
    """Along the way of a cold start: pose, angles, torques, forces at and behind the orifice."""
    solution, values = along_path(case.robot, case.alpha, case.D, case.loads, case.relaxed), case.values
    assert solution.success and solution.status == CONVERGED and solution.residual < 1e-10
    tip = values["tip"]
    assert np.linalg.norm(solution.tip - tip["position"]) < 1e-11
    assert abs(abs(solution.orientation @ tip["orientation"]) - 1.0) < 1e-14
    assert solution.problem.leader == tip["tube"] - 1
    assert solution.psi_tip == pytest.approx(values["psi_tip"], abs=1e-10)
    assert solution.torque == pytest.approx(values["torque"], abs=1e-11)
    assert solution.base_force == pytest.approx(values["internal_force"], abs=1e-14)
    assert solution.base_moment == pytest.approx(values["internal_moment"], abs=1e-10)
    assert force_interval(solution) == pytest.approx(np.array(values["force_interval"]), abs=1e-9)
    assert force(solution) == pytest.approx(values["force"], abs=1e-9)
    assert axial_forces(solution) == pytest.approx(values["axial_force_of_tubes"], abs=1e-9)
    reaction = force(solution).sum() - solution.base_force[0]
    assert reaction == pytest.approx(values["guide_axial_reaction"], abs=1e-9)


@pytest.mark.parametrize("case", some([CASES[0], *CASES[-2:]], {0, 2}), ids=lambda case: case.name)
def test_the_relaxed_robot(case: Case):
    assert relaxed_angles(case.robot, case.D) == pytest.approx(case.relaxed, abs=1e-9)


def test_elastica_under_a_side_force():
    for angle in (0.2, 0.8, 1.3):  # of the tip
        P, along, away = side_force_elastica(angle, LENGTH, K)
        for y, z in ((0.0, 1.0), (0.6, -0.8)):
            solution = along_path(ROD, [0.0], [GUIDE], Loads(tip_force=(0.0, y * P, z * P)), [0.0])
            assert solution.success
            assert solution.tip == pytest.approx([along, y * away, z * away], abs=1e-11)
            assert solution.base_moment == pytest.approx([0.0, -z * P * along, y * P * along], abs=1e-10)


def test_euler_load_and_what_follows():
    """The straight rod's conditions become singular at pi^2 K / (4 L^2); beyond, the elastica L sqrt(P/K) = K(p)."""

    def stiffness(P: float) -> float:
        """Of the tip's bending moment against the orifice's, in either plane."""
        problem = LoadedProblem(ROD, [0.0], [GUIDE], Loads(tip_force=(-P, 0.0, 0.0)))
        _, slope = LoadedShooting(problem, 1e-12).linearised(np.zeros(3))
        assert slope == pytest.approx(np.array([[0, 0, 1], [slope[1, 0], 0, 0], [0, slope[1, 0], 0]]), abs=1e-11)
        return float(slope[1, 0])

    euler = np.pi**2 * K / (4.0 * LENGTH**2)
    assert brentq(stiffness, 0.5 * euler, 2.0 * euler, xtol=1e-13) == pytest.approx(euler, rel=1e-9)
    angle = 1.0
    p = np.sin(0.5 * angle)
    P = K * (ellipk(p**2) / LENGTH) ** 2
    bent = rod(Loads(tip_force=(-P, 0.0, 0.1)))
    for side in (0.01, 1e-3, 0.0):
        bent = rod(Loads(tip_force=(-P, 0.0, side)), guess=bent)
    assert bent.success and euler < P
    along = LENGTH * (2.0 * ellipe(p**2) / ellipk(p**2) - 1.0)
    away = 2.0 * p * LENGTH / ellipk(p**2)  # to either side
    assert [bent.tip[0], abs(bent.tip[2])] == pytest.approx([along, away], abs=1e-9)


def test_small_loads_bend_as_linear_beams():
    L, small = LENGTH, 1e-5
    weight = 8000.0 * np.pi / 4.0 * 0.002**2
    heavy = Robot("heavy", (Tube("rod", ROD.tubes[0].segments, 0.0, 0.002, density=8000.0),))
    place = 0.08
    cases = [
        (Loads(tip_force=(0.0, small, 0.0)), [0.0, small * L**3 / (3 * K), 0.0]),
        (Loads(tip_moment=(0.0, small, 0.0)), [0.0, 0.0, -small * L**2 / (2 * K)]),
        (Loads(line_forces={0: (0.0, 0.0, small)}), [0.0, 0.0, small * L**4 / (8 * K)]),
        (Loads(gravity=(0.0, small, 0.0)), [0.0, weight * small * L**4 / (8 * K), 0.0]),
        (
            Loads(point_forces=(PointForce(0, GUIDE + place, (0.0, 0.0, small)),)),
            [0.0, 0.0, small * place**2 * (3 * L - place) / (6 * K)],
        ),
        (
            Loads(point_forces=(PointForce(0, GUIDE + place, moment=(0.0, 0.0, small)),)),
            [0.0, small * place * (2 * L - place) / (2 * K), 0.0],
        ),
    ]
    for loads, moved in cases:
        tip = solve_loaded(heavy, [0.0], [GUIDE], loads).tip - [L, 0.0, 0.0]
        assert tip[1:] == pytest.approx(moved[1:], rel=1e-6, abs=1e-14) and np.abs(moved).max() > 1e-9
    twisted = rod(Loads(tip_moment=(0.01, 0.0, 0.0)))
    assert twisted.psi_tip == pytest.approx([0.01 * (L + GUIDE) / GJ], rel=1e-12)
    assert twisted.torque == pytest.approx([-0.01], rel=1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_without_loads_it_is_the_standard_model(seed):
    rng = np.random.default_rng([seed, 31])
    robot = random_robot(rng, 2 + seed % 3)
    D, alpha = random_D(rng, robot), rng.uniform(-1.5, 1.5, robot.n_tubes)
    standard, solution = solve_standard_shooting(robot, alpha, D), solve_loaded(robot, alpha, D)
    assert standard.success and solution.success
    assert np.linalg.norm(standard.tip - solution.tip) < 1e-9
    assert solution.torque == pytest.approx(standard.torque, abs=1e-9)
    s = np.linspace(0.0, solution.problem.domain.length, 20)[1:]
    assert np.allclose(solution.angles_at(s), standard.angles_at(s), rtol=0.0, atol=1e-8, equal_nan=True)


def test_what_is_told_along_the_robot_balances():
    """Frames are rotations, the centreline is their tangents' integral, m.t is the sum of the torques."""
    case = next(case for case in CASES if case.name == "seed_off_100_all")
    solution = along_path(case.robot, case.alpha, case.D, case.loads, case.relaxed)
    s = np.linspace(0.01, 0.02, 2001)
    R, r = solution.frames(s), solution.centreline(s)
    assert R.swapaxes(1, 2) @ R == pytest.approx(np.broadcast_to(np.eye(3), R.shape), abs=1e-9)
    assert np.trapezoid(R[:, :, 0], s, axis=0) == pytest.approx(r[-1] - r[0], abs=1e-8)
    for stretch in solution.stretches:
        y = stretch.end
        assert y[stretch.piece.torque].sum() == pytest.approx(y[12:15] @ y[:9].reshape(3, 3)[:, 0], abs=1e-11)
    assert solution.moment(np.array([0.0]))[0] == pytest.approx(solution.base_moment, abs=1e-15)


@pytest.mark.soak
def test_past_a_fold_it_says_so():
    """Full overlap at 275 deg: the branch ends at 0.459388 N towards -y."""
    robot, command = robot_of("seed"), ([0.0, np.radians(275.0)], [0.0935, 0.2085])
    assert along_path(robot, *command, Loads(tip_force=(0.0, -0.45, 0.0)), [0.0, 0.0], rtol=1e-9).success
    beyond = along_path(robot, *command, Loads(tip_force=(0.0, -0.5, 0.0)), [0.0, 0.0], rtol=1e-9)
    assert not beyond.success and "ends at 0.91" in beyond.message


def test_loads_that_cannot_act_are_refused():
    for X in (0.04, GUIDE, 0.3):
        with pytest.raises(LoadError) as refused:
            rod(Loads(point_forces=(PointForce(0, X, (0.0, 1.0, 0.0)),)))
        assert "X" in refused.value.field and refused.value.value == X


def test_a_robot_in_the_guide_carries_nothing():
    solution = solve_loaded(ROD, [0.3], [LENGTH + GUIDE], Loads(tip_force=(0.0, 1.0, 0.0)))
    assert solution.success and not solution.tip.any() and solution.psi_tip == pytest.approx([0.3])
    assert force_interval(solution) == pytest.approx(np.zeros((1, 2))) and not axial_forces(solution).any()


def test_it_shares_no_solver_with_the_package():
    allowed = {"errors", "robot", "model", "oracles"}
    for path in (ROOT / "ctr_pvs" / "oracles").glob("loaded_*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom) and node.module.startswith("ctr_pvs"):
                assert node.module.split(".")[1] in allowed
