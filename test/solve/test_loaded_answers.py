"""Equilibria under external loads: converged cases of two other methods, closed forms, what every answer must keep."""

from __future__ import annotations

import numpy as np
import pytest
from elastica import side_force_elastica
from loaded_cases import CASES
from loaded_cases import Case
from random_loads import random_loads
from random_robots import random_D
from random_robots import random_robot

from ctr_pvs import EquilibriumSolver
from ctr_pvs import Robot
from ctr_pvs import Segment
from ctr_pvs import Status
from ctr_pvs import Tube
from ctr_pvs.errors import FieldError
from ctr_pvs.errors import LoadError
from ctr_pvs.robot.loads import Loads
from ctr_pvs.robot.loads import PointForce

FULL, PARTIAL = np.array([0.0935, 0.2085]), np.array([0.0935, 0.1705])
K, GJ, LENGTH, GUIDE = 0.02, 0.015, 0.2, 0.05
ROD = Robot("rod", (Tube("rod", (Segment(LENGTH + GUIDE, K, GJ),)),))


def close(value, reference, share: float) -> bool:
    """Within ``share`` of the largest number."""
    value, reference = np.asarray(value, dtype=float), np.asarray(reference, dtype=float)
    return bool(np.abs(value - reference).max() <= share * max(np.abs(reference).max(), 1e-9))


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_converged_cases(case: Case):
    """At 1e-9 m, as far as digits go; Jacobian, compliance and forces hold towards +D."""
    answer = EquilibriumSolver(case.robot, 1e-9).solve(case.alpha, case.D, loads=case.loads)
    assert answer.success and not answer.snaps, answer.message
    values = case.values
    tip = np.array(values["tip"]["position"])
    assert np.linalg.norm(answer.tip.position - tip) < 1e-10
    assert abs(np.dot(answer.tip.orientation, values["tip"]["orientation"])) == pytest.approx(1.0, abs=1e-12)
    assert close(answer.torque, values["torque"], 1e-9) and close(answer.loads.torque, values["torque"], 1e-9)
    assert close(answer.force_interval, values["force_interval"], 1e-9)
    assert close(answer.force, values["force"], 1e-9)
    assert close(answer.base_wrench.force, values["internal_force"], 1e-12)
    assert close(answer.base_wrench.moment, values["internal_moment"], 1e-9)
    rates = np.vstack([values["jacobian_position"], values["jacobian_rotation"]])
    assert close(answer.jacobian, rates, 1e-7) and close(answer.compliance, values["compliance"], 1e-7)
    ends = [tube.length - base for tube, base in zip(case.robot.tubes, case.D, strict=True)]
    psi = [answer.twist(np.array([end]))[0, j] for j, end in enumerate(ends)]
    assert psi == pytest.approx(values["psi_tip"], abs=1e-8)
    assert answer.energy == pytest.approx(values["elastic_energy"], rel=1e-9)
    if case.loads.has_moments:
        assert np.isnan(answer.potential)
    else:
        assert answer.potential == pytest.approx(values["potential"], rel=1e-9)
    assert 0.0 < answer.stability_margin <= 1.0 and values["margin"] > 0.0
    assert answer.applied_loads == case.loads and answer.fidelity == "full" and answer.residual < 1e-10
    assert answer.kink == bool(values["border_tubes"])


@pytest.mark.parametrize("tolerance", [1e-3, 1e-4, 1e-5, 1e-6, 1e-7])
@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_the_error_is_within_tolerance_and_below_its_estimate(case: Case, tolerance: float):
    answer = EquilibriumSolver(case.robot, tolerance).solve(case.alpha, case.D, loads=case.loads)
    assert answer.success, answer.message
    error = np.linalg.norm(answer.tip.position - values_tip(case))
    assert error <= answer.error_estimate <= tolerance
    assert answer.reason.startswith("full") and "\n" not in answer.reason


def values_tip(case: Case) -> np.ndarray:
    return np.array(case.values["tip"]["position"])


@pytest.mark.parametrize("angle", [0.2, 0.8, 1.3])
def test_elastica_under_a_side_force(angle: float):
    P, along, away = side_force_elastica(angle, LENGTH, K)
    solver = EquilibriumSolver(ROD, 1e-9)
    for y, z in ((0.0, 1.0), (0.6, -0.8)):
        answer = solver.solve([0.0], [GUIDE], "cold", loads=Loads(tip_force=(0.0, y * P, z * P)))
        assert answer.tip.position == pytest.approx([along, y * away, z * away], abs=1e-9)
        assert answer.base_wrench.moment == pytest.approx([0.0, -z * P * along, y * P * along], abs=1e-9)
        k = P * along / K  # at the orifice
        assert answer.force == pytest.approx([0.5 * K * k**2], rel=1e-8)


def test_euler_load():
    """A straight rod buckles at pi^2 K / (4 L^2); the margin falls there from 1 in proportion."""
    euler = np.pi**2 * K / (4.0 * LENGTH**2)
    solver = EquilibriumSolver(ROD, 1e-9)
    solver.solve([0.0], [GUIDE], loads=Loads(tip_force=(-0.01, 0.0, 0.0)))
    margins = []
    for share in (0.25, 0.5, 0.9):
        answer = solver.solve([0.0], [GUIDE], loads=Loads(tip_force=(-share * euler, 0.0, 0.0)))
        assert answer.success and answer.tip.position == pytest.approx([LENGTH, 0.0, 0.0], abs=1e-12)
        margins.append(answer.stability_margin)
    assert margins == pytest.approx([0.75, 0.5, 0.1], abs=1e-8)
    factor = solver.load_to_snap(Loads(tip_force=(-euler, 0.0, 0.0)))
    assert 0.9 + factor == pytest.approx(1.0, rel=1e-5)  # at a bifurcation the margin falls in proportion
    beyond = solver.solve([0.0], [GUIDE], loads=Loads(tip_force=(-1.2 * euler, 0.0, 1e-2)))
    assert beyond.success and beyond.stability_margin > 0.0 and beyond.tip.position[2] > 0.02


def test_pulling_moments_and_weight():
    """A moment bends a rod to a circle, twists it with the guide; a weight bends as a linear beam does."""
    solver = EquilibriumSolver(ROD, 1e-9)
    bent = solver.solve([0.0], [GUIDE], loads=Loads(tip_moment=(0.0, 0.1, 0.0)))
    k = 0.1 / K
    assert bent.tip.position == pytest.approx([np.sin(k * LENGTH) / k, 0.0, (np.cos(k * LENGTH) - 1.0) / k], abs=1e-9)
    twisted = solver.solve([0.3], [GUIDE], loads=Loads(tip_moment=(0.01, 0.0, 0.0)))
    assert twisted.torque == pytest.approx([-0.01], rel=1e-9)
    assert twisted.twist(np.array([LENGTH]))[0] == pytest.approx([0.3 + 0.01 * (LENGTH + GUIDE) / GJ], rel=1e-9)
    density, area = 8000.0, np.pi / 4.0 * 0.002**2
    heavy = Robot("heavy", (Tube("rod", ROD.tubes[0].segments, 0.0, 0.002, density=density),))
    g = 1e-3
    small = EquilibriumSolver(heavy, 1e-10).solve([0.0], [GUIDE], loads=Loads(gravity=(0.0, 0.0, -g)))
    assert small.tip.position[2] == pytest.approx(-density * area * g * LENGTH**4 / (8.0 * K), rel=1e-5)


def scene(seed: int, moments: bool = False, size: float = 0.5):
    rng = np.random.default_rng([seed, 177])
    robot = random_robot(rng, 2 + seed % 2)
    D, alpha = random_D(rng, robot), rng.uniform(-1.0, 1.0, robot.n_tubes)
    return robot, alpha, D, random_loads(rng, robot, D, moments, size)


@pytest.mark.parametrize("moments", [False, True])
@pytest.mark.parametrize("seed", range(4))
def test_sum_rules(seed: int, moments: bool):
    """sum tau_alpha = -m(0+).e_x, and sum tau_D = n(0+).e_x + |k(0+)|^2 sum K / 2."""
    robot, alpha, D, loads = scene(seed, moments)
    answer = EquilibriumSolver(robot, 1e-8).solve(alpha, D, loads=loads)
    assert answer.success, answer.message
    wrench, psi = answer.base_wrench, answer.twist(np.array([0.0]))[0]
    assert answer.torque.sum() == pytest.approx(-wrench.moment[0], abs=1e-10)
    total, stiffness = complex(wrench.moment[1], wrench.moment[2]), 0.0
    for tube, base, angle in zip(robot.tubes, D, psi, strict=True):
        index = int(np.searchsorted(tube.breaks[1:-1], base, side="right"))
        segment = tube.segments[index]
        curvature = segment.pre_curvature(base - tube.breaks[index]) if segment.curvature else 0.0
        total += segment.bending_stiffness * complex(curvature) * np.exp(1j * angle)
        stiffness += segment.bending_stiffness
    assert answer.force.sum() == pytest.approx(wrench.force[0] + 0.5 * abs(total) ** 2 / stiffness, rel=1e-7)


@pytest.mark.parametrize("moments", [False, True])
@pytest.mark.parametrize("seed", range(4))
def test_warm_equals_cold_and_without_loads_is_as_before(seed: int, moments: bool):
    robot, alpha, D, loads = scene(seed, moments)
    solver = EquilibriumSolver(robot, 1e-8)
    free = solver.solve(alpha, D)
    cold = solver.solve(alpha, D, "cold", loads=loads)
    assert free.success and cold.success and np.linalg.norm(cold.tip.position - free.tip.position) > 0.02 * free.length
    again = solver.solve(alpha, D)
    assert again.applied_loads is None and again.fidelity == free.fidelity
    assert again.tip.position == pytest.approx(free.tip.position, abs=1e-10)
    assert again.torque == pytest.approx(free.torque, abs=1e-9) and again.force == pytest.approx(free.force, abs=1e-8)
    solver.solve(alpha + 0.1 * np.arange(robot.n_tubes), D, loads=loads.scaled(0.5))
    warm = solver.solve(alpha, D, loads=loads)
    assert warm.success and not warm.snaps
    assert warm.tip.position == pytest.approx(cold.tip.position, abs=2e-8)
    assert warm.torque == pytest.approx(cold.torque, abs=1e-7)
    assert warm.degrees_of_freedom == cold.degrees_of_freedom


def test_no_load_is_none(seed_robot):
    """Loads of zeros, and None, are the unloaded answer."""
    solver = EquilibriumSolver(seed_robot, 1e-6)
    free = solver.solve([0.0, 1.0], PARTIAL)
    for none in (Loads(), Loads(point_forces=(PointForce(1, 0.2),)), None):
        answer = solver.solve([0.0, 1.0], PARTIAL, loads=none)
        assert answer.applied_loads is None and answer.fidelity == free.fidelity
        assert answer.tip.position == pytest.approx(free.tip.position, abs=1e-11)


def test_reversed_intervals(seed_robot):
    """A concave kink: pulled up at alpha 0, full overlap, no constant force holds tube 1; unloaded it is convex."""
    solver = EquilibriumSolver(seed_robot, 1e-7)
    free = solver.solve([0.0, 0.0], FULL)
    assert free.kink and not free.force_interval_reversed.any()
    pulled = solver.solve([0.0, 0.0], FULL, loads=Loads(tip_force=(0.0, 0.0, 5.0)))
    assert pulled.success and pulled.force_interval_reversed.tolist() == [True, False]
    assert pulled.force_interval[0, 0] > pulled.force_interval[0, 1]


@pytest.mark.parametrize("level", ["torsion", "torsionless"])
def test_levels_that_know_no_loads_are_refused(seed_robot, level: str):
    solver = EquilibriumSolver(seed_robot, 1e-5, fidelity=level)
    with pytest.raises(FieldError, match="fidelity"):
        solver.solve([0.0, 0.3], PARTIAL, loads=Loads(tip_force=(0.0, 0.1, 0.0)))
    assert solver.solve([0.0, 0.0], FULL, loads=Loads()).success


def test_other_refusals(seed_robot):
    pull = Loads(tip_force=(0.0, 0.1, 0.0))
    with pytest.raises(FieldError, match="force_model"):
        EquilibriumSolver(seed_robot, force_model="renda2021").solve([0.0, 0.3], PARTIAL, loads=pull)
    with pytest.raises(FieldError, match="lowest-energy"):
        EquilibriumSolver(seed_robot).solve([0.0, 0.3], PARTIAL, "lowest-energy", loads=pull)
    solver = EquilibriumSolver(seed_robot)
    good = solver.solve([0.0, 0.3], PARTIAL)
    for wrong, what in (
        (Loads(point_forces=(PointForce(1, 0.1, (0.0, 0.1, 0.0)),)), "X"),
        (Loads(point_forces=(PointForce(7, 0.1, (0.0, 0.1, 0.0)),)), "tube"),
        (Loads(gravity=(0.0, 0.0, -9.81)), "density"),
    ):
        with pytest.raises(LoadError, match=what):
            solver.solve([0.0, 0.3], PARTIAL, loads=wrong)
    assert solver.solve([0.0, 0.3], PARTIAL).tip.position == pytest.approx(good.tip.position, abs=1e-12)


def test_full_level_takes_loads(seed_robot):
    pull = Loads(tip_force=(0.0, 0.1, 0.0))
    auto = EquilibriumSolver(seed_robot, 1e-7).solve([0.0, 0.3], PARTIAL, loads=pull)
    full = EquilibriumSolver(seed_robot, 1e-7, fidelity="full").solve([0.0, 0.3], PARTIAL, loads=pull)
    assert full.fidelity == auto.fidelity == "full" and np.array_equal(full.tip.position, auto.tip.position)


def test_rows_of_a_batch_are_single_answers(seed_robot):
    rng = np.random.default_rng(8)
    alpha, D = np.column_stack([np.zeros(6), rng.uniform(-1.0, 1.0, 6)]), np.tile(PARTIAL, (6, 1))
    force, moment = rng.uniform(-0.5, 0.5, (6, 3)), rng.uniform(-5e-3, 5e-3, (6, 3))
    force[1], moment[1], moment[2] = 0.0, 0.0, 0.0
    solver = EquilibriumSolver(seed_robot, 1e-6)
    both = solver.solve_batch(alpha, D, tip_force=force, tip_moment=moment)
    assert both.success.all() and both.fidelity[1] == "torsion" and both.fidelity[0] == "full"
    for row in range(6):
        loads = Loads(tuple(force[row]), tuple(moment[row]))
        single = EquilibriumSolver(seed_robot, 1e-6).solve(alpha[row], D[row], loads=loads)
        assert both.status[row] is single.status is Status.OK
        assert np.array_equal(both.tip_position[row], single.tip.position)
        assert np.array_equal(both.torque[row], single.torque)
        assert both.error_estimate[row] == single.error_estimate
        assert both.degrees_of_freedom[row] == single.degrees_of_freedom
        assert both.stability_margin[row] == single.stability_margin
    answer = both[3]
    assert answer.applied_loads == Loads(tuple(force[3]), tuple(moment[3]))
    assert np.array_equal(answer.tip.position, both.tip_position[3])
    free = solver.solve_batch(alpha, D, tip_force=np.zeros((6, 3)))
    assert np.array_equal(free.tip_position, solver.solve_batch(alpha, D).tip_position)
    for wrong in (np.zeros((5, 3)), np.zeros((6, 2)), np.full((6, 3), np.nan)):
        with pytest.raises(LoadError, match="tip_force"):
            solver.solve_batch(alpha, D, tip_force=wrong)
