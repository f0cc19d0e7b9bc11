"""The judge of loaded sweeps: its virtual work against differences, its states and folds against converged ones."""

from __future__ import annotations

import ast

import numpy as np
import pytest
from conftest import ROOT
from loaded_cases import CASES
from loaded_cases import REFERENCE
from loaded_cases import Case
from loaded_cases import robot_of
from long_runs import some
from random_robots import random_D
from random_robots import random_robot

from bench.loaded.loaded_galerkin import LONGEST
from bench.loaded.loaded_galerkin import Galerkin
from bench.loaded.loaded_judge import LoadedJudge
from bench.loaded.loaded_judge import LoadedPath
from bench.loaded.loaded_judge import Place
from bench.loaded.loaded_judge import mixed
from bench.loaded.loaded_judge import resampled
from ctr_pvs.oracles.loaded_model import solve_loaded
from ctr_pvs.robot.loads import Loads
from ctr_pvs.robot.loads import PointForce

NONE = Loads()
D_OF = {"full": np.array([0.0935, 0.2085]), "partial": np.array([0.0935, 0.1705])}


def turned_place(case: Case) -> Place:
    """Where a cold start is before the loads."""
    judge = LoadedJudge(case.robot)
    path = LoadedPath(case.relaxed, case.D, NONE, case.alpha, case.D, NONE)
    place, t = judge.go(path, judge.solve(case.relaxed, case.D))
    assert t == 1.0
    return place


def random_state(case: Case, loads: Loads) -> tuple[Galerkin, np.ndarray]:
    """No equilibrium, but bent and twisted as robots are."""
    model = Galerkin(case.robot, case.D, loads, 8)
    x = resampled(turned_place(case), model) + 0.002 * np.random.default_rng(7).normal(size=model.n)
    return model, x


@pytest.mark.parametrize("name", ["seed_part_60_point", "seed_off_100_all", "three_tubes_wrench", "linear_force"])
def test_virtual_work_against_differences(name):
    """Forces: the residual is the slope of the potential, the tangent symmetric.  Moments too: the tangent is the
    residual's slope."""
    case = next(case for case in CASES if case.name == name)
    forces = tuple(PointForce(load.tube, load.X, load.force) for load in case.loads.point_forces)
    only_forces = Loads(case.loads.tip_force, point_forces=forces, line_forces=case.loads.line_forces)
    h = 1e-4
    for loads in (only_forces, case.loads):
        model, x = random_state(case, loads)
        fields = model.fields(x, case.alpha)
        residual, tangent = model.residual(x, fields), model.tangent(fields)
        for i in np.random.default_rng(3).choice(model.n, 25, replace=False):
            step = h * np.eye(model.n)[i]
            ends = [model.residual(x + d, model.fields(x + d, case.alpha)) for d in (-step, step)]
            assert tangent[:, i] == pytest.approx((ends[1] - ends[0]) / (2.0 * h), abs=1e-7)
            if loads is only_forces:
                energies = [model.potential(x + d, case.alpha) for d in (-step, step)]
                assert residual[i] == pytest.approx((energies[1] - energies[0]) / (2.0 * h), abs=1e-9)
        if loads is only_forces:
            assert tangent == pytest.approx(tangent.T, abs=1e-9)
    if case.loads.has_moments:
        assert np.abs(tangent - tangent.T).max() > 1e-4


@pytest.mark.parametrize("case", some(CASES, {0, 9, 13, 16}), ids=lambda case: case.name)
def test_converged_cases(case: Case):
    """As a cold start goes: turned unloaded, then loaded; the margin is in the reference's own metric."""
    judge = LoadedJudge(case.robot)
    place, t = judge.go(LoadedPath(case.alpha, case.D, NONE, case.alpha, case.D, case.loads), turned_place(case))
    assert t == 1.0
    assert np.linalg.norm(place.tip - case.values["tip"]["position"]) < 1e-12
    assert place.psi_ends == pytest.approx(case.values["psi_tip"], abs=1e-10)
    assert place.stable and place.least_stiffness == pytest.approx(case.values["margin"], abs=1e-11)


def fold_on(path: LoadedPath, place, judge: LoadedJudge) -> float:
    reached, t = judge.go(path, place, finest=1e-5)
    assert t < 1.0 and 0.0 < reached.least_stiffness < 1e-3
    return t


def turned(degrees: float) -> np.ndarray:
    return np.array([0.0, np.radians(degrees)])


@pytest.mark.parametrize("overlap", ["full", "partial"])
def test_the_planar_branch_loses_stability_sideways(overlap):
    """The state stays, in its plane; what ends is its stability."""
    judge, D = LoadedJudge(robot_of("seed")), D_OF[overlap]
    path = LoadedPath(turned(0), D, NONE, turned(0), D, Loads(tip_force=(0.0, 0.0, 10.0)))
    load = 10.0 * fold_on(path, judge.solve(turned(0), D), judge)
    assert load == pytest.approx(REFERENCE["folds"]["sideways_at_0_deg_up_N"][overlap], abs=1e-5)


@pytest.mark.parametrize("fold", some(REFERENCE["folds"]["snap_at_load_N"], {0}))
def test_snaps_at_growing_load(fold):
    judge, D, alpha = LoadedJudge(robot_of("seed")), np.array(fold["D"]), turned(fold["alpha2_deg"])
    place, t = judge.go(LoadedPath(turned(0), D, NONE, alpha, D, NONE), judge.solve(turned(0), D))
    assert t == 1.0
    path = LoadedPath(alpha, D, NONE, alpha, D, Loads(tip_force=tuple(fold["direction"])))
    assert fold_on(path, place, judge) == pytest.approx(fold["load"], abs=2e-6)


@pytest.mark.parametrize("fold", some(REFERENCE["folds"]["snap_at_angle_deg"], {0}))
def test_snaps_on_turning_under_load(fold):
    judge, D, loads = LoadedJudge(robot_of("seed")), np.array(fold["D"]), Loads(tip_force=tuple(fold["force"]))
    place, t = judge.go(LoadedPath(turned(0), D, NONE, turned(0), D, loads), judge.solve(turned(0), D))
    assert t == 1.0
    path = LoadedPath(turned(0), D, loads, turned(330), D, loads)
    assert 330.0 * fold_on(path, place, judge) == pytest.approx(fold["alpha2_deg"], abs=1e-3)


@pytest.mark.parametrize("seed", some(range(6), {0, 1}))
def test_random_robots_against_the_boundary_value_model(seed):
    """Every kind of load, while all turns and slides: the judge's end solves the equations of the other method."""
    rng = np.random.default_rng([seed, 13])
    robot = random_robot(rng, 2 + seed % 2)
    D, D_end = random_D(rng, robot), random_D(rng, robot)
    alpha, alpha_end = rng.uniform(-0.7, 0.7, (2, robot.n_tubes))
    inner = robot.n_tubes - 1
    X = max(D[inner], D_end[inner]) + 0.01
    point = PointForce(inner, min(X, robot.tubes[inner].length), (0.1, 0.2, -0.1), (0.001, 0.0, 0.002))
    loads = Loads((0.1, -0.2, 0.1), (0.0, 0.004, -0.002), (point,), {0: (0.0, 0.0, -1.0)})
    judge = LoadedJudge(robot)
    start = judge.solve(alpha, D)
    if start is None or not start.stable:
        pytest.skip("this robot, turned at once, is not where a path begins")
    place, t = judge.go(LoadedPath(alpha, D, NONE, alpha_end, D_end, loads), start)
    assert t == 1.0
    guess = solve_loaded(robot, alpha_end, D_end, NONE)
    for share in np.linspace(0.2, 1.0, 5):
        guess = solve_loaded(robot, alpha_end, D_end, loads.scaled(share), guess, 1e-10)
    assert guess.success
    assert np.linalg.norm(guess.tip - place.tip) < 1e-8
    assert place.psi_ends == pytest.approx(guess.psi_tip, abs=1e-7)


def test_poses_of_another_method_lead_to_its_state():
    case = next(case for case in CASES if case.name == "seed_off_60_outer_tip")
    judge = LoadedJudge(case.robot)
    place, _ = judge.go(LoadedPath(case.alpha, case.D, NONE, case.alpha, case.D, case.loads), turned_place(case))
    solution = solve_loaded(case.robot, case.alpha, case.D, case.loads)
    found = judge.placed(case.alpha, case.D, case.loads, solution.angles_at, solution.frames)
    assert np.linalg.norm(found.tip - place.tip) < 1e-11 and found.apart(place) < 1e-9
    # The poses tell the state: what is left to Newton's method is rounding and the polynomials' own error.
    assert judge.placed(case.alpha, case.D, case.loads, solution.angles_at, solution.frames, room=1e-6) is not None


def test_coefficients_move_to_another_domain():
    """Resampled onto pieces of another D and other loads, the fields are the same where both have them."""
    case = next(case for case in CASES if case.name == "linear_force")
    place = turned_place(case)
    finer = Loads(point_forces=(PointForce(1, 0.2, (0.0, 1e-3, 0.0)), PointForce(0, 0.07, (0.0, 1e-3, 0.0))))
    model = Galerkin(case.robot, case.D, finer, 8)
    moved = resampled(place, model)
    fields = model.fields(moved, case.alpha)
    assert model.P > place.model.P
    assert model.tip(fields) == pytest.approx(place.tip, abs=1e-10)
    assert model.psi_ends(moved, case.alpha) == pytest.approx(place.psi_ends, abs=1e-9)


def test_a_seam_is_no_point_load():
    """A load that divides a section into as many pieces as its seam did, elsewhere, makes other pieces of it."""
    case = next(case for case in CASES if case.name == "seed_full_60_pull")
    place = turned_place(case)
    edges = place.model.domain.boundaries
    m = next(m for m, length in enumerate(np.diff(edges)) if LONGEST < length < 1.5 * LONGEST)
    inner = case.robot.n_tubes - 1
    at = float(edges[m] + np.diff(edges)[m] / 3.0 + case.D[inner])
    model = Galerkin(case.robot, case.D, Loads(point_forces=(PointForce(inner, at, (0.0, 1e-3, 0.0)),)), 6)
    assert model.P == place.model.P and model.signature != place.model.signature
    moved = resampled(place, model)
    assert model.tip(model.fields(moved, case.alpha)) == pytest.approx(place.tip, abs=1e-8)


def test_paths_mix_their_loads():
    a = Loads((1.0, 0.0, 0.0), point_forces=(PointForce(0, 0.1, (0.0, 1.0, 0.0)),), line_forces={1: (0.0, 0.0, 2.0)})
    b = Loads((0.0, 2.0, 0.0), point_forces=(PointForce(0, 0.1, (0.0, 0.0, 4.0)), PointForce(1, 0.2, (1.0, 0.0, 0.0))))
    half = mixed(a, b, 0.25)
    assert half.tip_force == (0.75, 0.5, 0.0) and half.line_forces == {1: (0.0, 0.0, 1.5)}
    assert half.point_forces == (PointForce(0, 0.1, (0.0, 0.75, 1.0)), PointForce(1, 0.2, (0.25, 0.0, 0.0)))
    path = LoadedPath(np.zeros(2), D_OF["full"], a, np.array([1.0, 0.0]), D_OF["full"], b)
    assert path.at(0.0)[2] is a and path.at(1.0)[2] is b and path.steps == 51


def test_the_judge_shares_no_solver_with_the_package():
    for name in ("gauss_points", "loaded_galerkin", "loaded_judge"):
        for node in ast.walk(ast.parse((ROOT / "bench" / "loaded" / f"{name}.py").read_text())):
            if isinstance(node, ast.ImportFrom) and node.module.startswith("ctr_pvs"):
                assert node.module == "ctr_pvs" or node.module.split(".")[1] in {"robot", "model"}


def test_the_tips_moment_goes_over_to_the_tube_that_passes():
    """Where another tube comes to reach farthest, the tip's moment jumps to it: a change of load, not a fold."""
    robot, loads = robot_of("seed"), Loads((0.1, 0.0, 0.2), (0.01, 0.004, -0.003))
    judge, alpha = LoadedJudge(robot), turned(30)
    D, D_end = np.array([0.09, 0.2]), np.array([0.04, 0.18])
    place = judge.solve(alpha, D)
    place, t = judge.go(LoadedPath(alpha, D, NONE, alpha, D, loads), place)
    assert t == 1.0
    reached, t = judge.go(LoadedPath(alpha, D, loads, alpha, D_end, loads), place)
    assert t == 1.0 and reached.stable and (place.model.leader, reached.model.leader) == (1, 0)
    guess = None
    for share in np.linspace(0.0, 1.0, 5):
        guess = solve_loaded(robot, alpha, D_end, loads.scaled(share), guess)
    assert guess.success and np.linalg.norm(guess.tip - reached.tip) < 1e-9


def test_tubes_that_end_at_the_orifice_only_twist():
    robot, loads = robot_of("seed"), Loads((0.0, 0.2, 0.1))
    judge, alpha, D = LoadedJudge(robot), turned(20), np.array([robot.tubes[0].length, 0.2])
    bare = judge.solve(alpha, D)
    place, t = judge.go(LoadedPath(alpha, D, NONE, alpha, D, loads), bare)
    solution = solve_loaded(robot, alpha, D, loads)
    assert t == 1.0 and solution.success and np.linalg.norm(solution.tip - place.tip) < 1e-10
    assert place.psi_ends == pytest.approx(solution.psi_tip, abs=1e-10) and place.psi_ends[0] == alpha[0]
    inside = judge.solve(alpha, [tube.length for tube in robot.tubes])
    assert not inside.tip.any() and inside.stable and inside.psi_ends == pytest.approx(alpha)
    assert judge.solve(alpha, D, start=inside, room=5.0).apart(bare) < 1e-9
