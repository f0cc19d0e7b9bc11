"""Torques and insertion forces under loads against the work they do: along short ways of random robots."""

from __future__ import annotations

import numpy as np
import pytest
from long_runs import some
from random_robots import random_D
from random_robots import random_robot

from ctr_pvs import Robot
from ctr_pvs.model.basis import gauss_legendre
from ctr_pvs.oracles.loaded_equations import FRAME
from ctr_pvs.oracles.loaded_equations import PLACE
from ctr_pvs.oracles.loaded_forces import force
from ctr_pvs.oracles.loaded_forces import force_interval
from ctr_pvs.oracles.loaded_model import LoadedSolution
from ctr_pvs.oracles.loaded_model import solve_loaded
from ctr_pvs.robot.loads import Loads
from ctr_pvs.robot.loads import PointForce

RULE = gauss_legendre(20)


def potential(solution: LoadedSolution) -> float:
    """Pi [J]: the elastic energy less the work of the forces."""
    problem, loads = solution.problem, solution.problem.loads
    energy = elastic_energy(solution) - float(np.dot(loads.tip_force, solution.tip))
    for load in loads.point_forces:
        place = solution.centreline([load.X - problem.D[load.tube]])[0]
        energy -= float(np.dot(load.force, place))
    for stretch in solution.stretches:
        piece = stretch.piece
        for x, weight in zip(RULE.x, piece.length * RULE.weights, strict=True):
            energy -= weight * float(
                piece.line_force.sum(axis=0) @ stretch.between(piece.start + piece.length * x)[PLACE]
            )
    return energy


def elastic_energy(solution: LoadedSolution) -> float:
    """J, of twist, of bending beyond the orifice, of straightening in the guide."""
    problem = solution.problem
    energy = float(problem.materials.straightening_energy.sum())
    energy += 0.5 * float(problem.guide_compliance @ solution.base_torque**2)
    for stretch in solution.stretches:
        piece = stretch.piece
        for x, weight in zip(RULE.x, piece.length * RULE.weights, strict=True):
            s = piece.start + piece.length * x
            y = stretch.between(s)
            k_y, k_z, c_y, c_z = piece.curvature(s, y[:, None])
            bent = piece.bending[:, None] * ((k_y - c_y) ** 2 + (k_z - c_z) ** 2)
            twisted = y[piece.torque] ** 2 / piece.torsional
            energy += 0.5 * weight * float(bent.sum() + twisted.sum())
    return energy


def scene(seed: int, moments: bool = False) -> tuple[Robot, np.ndarray, np.ndarray, Loads]:
    """A random robot of two to four tubes with a tip force, forces on two tubes and along one."""
    rng = np.random.default_rng([seed, 77])
    robot = random_robot(rng, 2 + seed % 3)
    D, alpha = random_D(rng, robot), rng.uniform(-1.0, 1.0, robot.n_tubes)
    points = []
    for j in (0, robot.n_tubes - 1):
        X = D[j] + rng.uniform(0.2, 0.8) * (robot.tubes[j].length - D[j])
        moment = rng.normal(0.0, 0.004, 3) if moments else np.zeros(3)
        points.append(PointForce(j, X, tuple(rng.normal(0.0, 0.15, 3)), tuple(moment)))
    tip_moment = rng.normal(0.0, 0.004, 3) if moments else np.zeros(3)
    lines = {0: tuple(rng.normal(0.0, 1.0, 3))}
    return robot, alpha, D, Loads(tuple(rng.normal(0.0, 0.2, 3)), tuple(tip_moment), tuple(points), lines)


def solve(robot: Robot, alpha, D, loads: Loads, guess: LoadedSolution | None = None) -> LoadedSolution:
    solution = solve_loaded(robot, alpha, D, loads, guess, rtol=1e-12)
    assert solution.success, solution.message
    return solution


@pytest.mark.parametrize("seed", some(range(3), {0, 1}))
def test_they_are_the_slopes_of_the_potential(seed):
    """Forces only: dPi/dalpha and dPi/dD by differences of four points."""
    robot, alpha, D, loads = scene(seed)
    here = solve(robot, alpha, D, loads)
    h, weights = 1e-4, {-2: 1.0, -1: -8.0, 1: 8.0, 2: -1.0}
    for j in range(robot.n_tubes):
        step = h * np.eye(robot.n_tubes)[j]
        turned = sum(w * potential(solve(robot, alpha + i * step, D, loads, here)) for i, w in weights.items())
        slid = sum(w * potential(solve(robot, alpha, D + i * step, loads, here)) for i, w in weights.items())
        assert here.torque[j] == pytest.approx(turned / (12.0 * h), abs=1e-8)
        assert force(here)[j] == pytest.approx(slid / (12.0 * h), abs=1e-7)


def loads_work(before: LoadedSolution, after: LoadedSolution) -> float:
    """Work [J] of the tip's wrench and the point loads over a small step, by the rule of the midpoint."""
    loads, work = before.problem.loads, 0.0
    points = [(before.problem.leader, None, loads.tip_force, loads.tip_moment)]
    points += [(load.tube, load.X, load.force, load.moment) for load in loads.point_forces]
    for tube, X, P, Q in points:
        (r0, R0), (r1, R1) = (material_pose(solution, tube, X) for solution in (before, after))
        turn = R1 @ R0.T
        axial = 0.5 * np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
        sine = np.linalg.norm(axial)
        w = axial * (np.arcsin(sine) / sine if sine > 0.0 else 1.0)
        work += float(np.dot(P, r1 - r0) + np.dot(Q, w))
    return work


def material_pose(solution: LoadedSolution, tube: int, X: float | None) -> tuple[np.ndarray, np.ndarray]:
    """Position and material frame of a tube at X, None its end."""
    problem = solution.problem
    s = (problem.robot.tubes[tube].length if X is None else X) - problem.D[tube]
    stretch = min(
        (stretch for stretch in solution.stretches if tube in stretch.piece.tubes),
        key=lambda stretch: abs(stretch.piece.end - s),
    )
    assert stretch.piece.end == pytest.approx(s, abs=1e-12)  # a load ends a piece
    y = stretch.end
    psi = y[stretch.piece.psi][list(stretch.piece.tubes).index(tube)]
    roll = np.array([[1, 0, 0], [0, np.cos(psi), -np.sin(psi)], [0, np.sin(psi), np.cos(psi)]])
    return y[PLACE], y[FRAME].reshape(3, 3) @ roll


@pytest.mark.parametrize("seed", range(6))
def test_the_work_balances_under_dead_moments(seed):
    """No potential, but along any way at constant loads dE - the loads' work = tau_alpha dalpha + tau_D dD."""
    robot, alpha, D, loads = scene(seed, moments=True)
    loads = Loads(loads.tip_force, loads.tip_moment, loads.point_forces)
    here, rng = solve(robot, alpha, D, loads), np.random.default_rng(seed)
    turn, slide = rng.normal(size=(2, robot.n_tubes))
    slide *= 0.1
    h = 1e-4
    before, after = (solve(robot, alpha + i * h * turn, D + i * h * slide, loads, here) for i in (-1, 1))
    spent = elastic_energy(after) - elastic_energy(before) - loads_work(before, after)
    supplied = here.torque @ turn + force(here) @ slide
    assert spent / (2.0 * h) == pytest.approx(supplied, abs=2e-9) and abs(supplied) > 1e-3


@pytest.mark.parametrize("seed", range(6))
def test_sums_and_axial_balance(seed):
    """sum tau_alpha = -m(0+).e_x; sum tau_D = n(0+).e_x + |k(0+)|^2 sum K / 2: towards the guide nothing is lost."""
    robot, alpha, D, loads = scene(seed, moments=True)
    solution = solve(robot, alpha, D, loads)
    piece = solution.problem.pieces[0]
    k_y, k_z, _, _ = piece.curvature(0.0, solution.stretches[0].begin[:, None])
    reaction = 0.5 * piece.bending.sum() * float(k_y[0] ** 2 + k_z[0] ** 2)
    assert solution.torque.sum() == pytest.approx(-solution.base_moment[0], abs=1e-12)
    assert force(solution).sum() == pytest.approx(solution.base_force[0] + reaction, abs=1e-9)
    assert np.ptp(force_interval(solution), axis=1) == pytest.approx(np.zeros(robot.n_tubes), abs=1e-12)


def test_one_sided_forces_are_limits(seed_robot):
    """A segment border on the orifice: towards -D and +D what it is 1 um away."""
    alpha, D, loads = np.array([0.0, 1.0]), np.array([0.0935, 0.1705]), Loads(tip_force=(0.2, -0.3, 0.4))
    here = solve(seed_robot, alpha, D, loads)
    interval = force_interval(here)
    for side, way in enumerate((-1.0, 1.0)):
        near = [force(solve(seed_robot, alpha, D + np.array([way * h, 0.0]), loads, here))[0] for h in (1e-6, 2e-6)]
        assert interval[0, side] == pytest.approx(2.0 * near[0] - near[1], abs=1e-6)
    assert interval[0, 1] - interval[0, 0] > 0.1 and np.ptp(interval[1]) < 1e-12
