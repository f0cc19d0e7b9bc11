"""docs/insertion_forces.md, proved: dE/dD against eq. (41), against Newton's law, and round closed command loops."""

from __future__ import annotations

import numpy as np
import pytest
from random_robots import random_D
from random_robots import random_robot

from bench.common.places import DOCS
from bench.pvs import command_loops as loops
from bench.pvs import insertion_cases as cases
from bench.pvs import insertion_forces
from bench.pvs import smoothed_rod
from ctr_pvs import EquilibriumSolver
from ctr_pvs import Robot
from ctr_pvs import Segment
from ctr_pvs import Tube
from ctr_pvs.errors import FieldError

TABLE_2 = {case.name[0]: case for case in cases.table_2_cases()}
MOST_WORK = 1e-9  # J, of a closed loop


def wholly_curved_pair(rng):
    """Two tubes of one segment each, with constant or linear pre-curvature in any plane; base positions such that the
    outer tube ends inside the inner one."""
    tubes = []
    for index, length in enumerate((rng.uniform(0.1, 0.2), 0.5)):
        bending = rng.uniform(0.01, 0.05)
        curvature = [rng.uniform(4, 12) * np.exp(2j * np.pi * rng.random())]
        if rng.random() < 0.7:
            curvature.append(rng.uniform(-40, 40) + 1j * rng.uniform(-40, 40))
        tubes.append(Tube(f"t{index}", (Segment(length, bending, bending / rng.uniform(1.0, 1.5), tuple(curvature)),)))
    D1 = rng.uniform(0.1, 0.8) * tubes[0].length
    return Robot("pair", tuple(tubes)), np.array([D1, D1 + rng.uniform(0.0, 0.2)])


def check_identity(robot, alpha, D, fidelity):
    """dE/dD_2 = -(41) + K_2 [ |k(0+)|^2 + |kappa*_2(L_1)|^2 - |k(L_1-)|^2 ] / 2, and the sums of both models."""
    answer = EquilibriumSolver(robot, 1e-10, fidelity).solve(alpha, D)
    seeds = EquilibriumSolver(robot, 1e-10, fidelity, force_model="renda2021").solve(alpha, D)
    k_orifice, k_end = (answer.shape.curvature(0, np.array([x]))[0] for x in (0.0, 1.0))
    inner = robot.tubes[1].segments[0]
    own = inner.pre_curvature(robot.tubes[0].length - D[0] + D[1])
    missing = 0.5 * inner.bending_stiffness * (abs(k_orifice) ** 2 + abs(own) ** 2 - abs(k_end) ** 2)
    assert seeds.force[1] + missing == pytest.approx(answer.force[1], rel=1e-7)
    assert abs(seeds.force.sum()) < 1e-9  # eq. (43)
    stiffness = sum(tube.segments[0].bending_stiffness for tube in robot.tubes)
    assert answer.force.sum() == pytest.approx(0.5 * stiffness * abs(k_orifice) ** 2, rel=1e-9)


@pytest.mark.parametrize("seed", range(40))
def test_what_equation_41_leaves_out(seed):
    rng = np.random.default_rng([seed, 41])
    robot, D = wholly_curved_pair(rng)
    check_identity(robot, rng.uniform(-2.0, 2.0, 2), D, "torsion")


@pytest.mark.parametrize("row", TABLE_2)
def test_what_equation_41_leaves_out_of_untwisted_tubes(row):
    case = TABLE_2[row]
    check_identity(case.robot, case.alpha, case.D, "torsionless")


def test_case_b_of_table_2():
    """Sliding the inner tube alone changes nothing beyond the orifice: its force is that of straightening it."""
    case = TABLE_2["b"]
    K2 = case.robot.tubes[1].segments[0].bending_stiffness
    answer = case.solve()
    assert answer.force[1] == pytest.approx(0.5 * K2 * 30.0**2, rel=1e-12)
    assert answer.force[1] == pytest.approx(8.39635, abs=5e-6)
    seeds = EquilibriumSolver(case.robot, 1e-9, force_model="renda2021").solve(case.alpha, case.D)
    assert seeds.force[1] == pytest.approx(-3.652, abs=5e-4)
    moved = EquilibriumSolver(case.robot, 1e-9).solve(case.alpha, case.D + np.array([0.0, 0.04]))
    assert moved.energy - answer.energy == pytest.approx(0.04 * answer.force[1], rel=1e-12)
    beyond = answer.shape.materials.straightening_energy.sum() - answer.energy
    assert moved.shape.materials.straightening_energy.sum() - moved.energy == pytest.approx(beyond, rel=1e-12)


def smoothed(case, width):
    tip_angle = np.diff(case.solve().twist(np.array([case.tip]))[0])[0]
    return smoothed_rod.smoothed_forces(case.robot, case.alpha, case.D, width, float(tip_angle)).force


@pytest.mark.parametrize("row", ["b", "c", "e", "f", "amid"])
def test_newtons_law_without_jumps_tends_to_virtual_work(row):
    """Axial forces integrated along tubes whose jumps are ramps: first order in the ramps' width, to dE/dD."""
    case = cases.jump_case() if row == "amid" else TABLE_2[row]
    force = case.solve().force
    wide, narrow = (smoothed(case, width) for width in (1e-3, 1e-4))
    assert np.all(np.abs(narrow - force) < 0.11 * np.abs(wide - force) + 1e-8)
    assert (10.0 * narrow - wide) / 9.0 == pytest.approx(force, rel=1e-4, abs=1e-4)


def test_a_kink_is_a_jump_smoothed_over_nothing(seed_robot):
    """Across a ramp on the orifice the force runs through the interval, from one end to the other."""
    width = 1e-5
    alpha, D = np.radians([0.0, 100.0]), np.array([0.0935, 0.2085])
    interval = EquilibriumSolver(seed_robot, 1e-9).solve(alpha, D).force_interval[0]
    for shift, expected in ((-2 * width, interval[0]), (2 * width, interval[1])):
        case = cases.Case("kink", seed_robot, alpha, D + np.array([shift, 0.0]))
        assert smoothed(case, width)[0] == pytest.approx(expected, abs=5e-4)
    assert interval[0] < smoothed(cases.Case("kink", seed_robot, alpha, D), width)[0] < interval[1]


def test_valleys_hold_and_ridges_do_not(seed_robot):
    """Where the inner tube's curve meets the outer tip the energy has a valley, where tips are level a ridge."""
    solver = EquilibriumSolver(seed_robot, 1e-9)
    alpha = np.radians([0.0, 100.0])
    valley = solver.solve(alpha, [0.15, 0.1827])
    ridge = solver.solve(alpha, [0.15, 0.2677])
    assert valley.loads.kink.all() and ridge.loads.kink.all()
    assert np.all(valley.force_interval[:, 1] > valley.force_interval[:, 0] + 1.0)
    assert np.all(ridge.force_interval[:, 1] < ridge.force_interval[:, 0] - 0.1)


def random_loop(rng, robot):
    """Four commands and back to the first, some of them across kinks, all in order and within the tubes."""
    n, lengths = robot.n_tubes, np.array([tube.length for tube in robot.tubes])
    alpha, D = rng.uniform(-1.2, 1.2, n), random_D(rng, robot)
    corners = [np.concatenate([alpha, D])]
    while len(corners) < 4:
        D_next = D + rng.uniform(-0.012, 0.012, n)
        if np.all(np.diff(D_next) > 0.0) and np.all(D_next < lengths) and D_next[0] > 0.0:
            corners.append(np.concatenate([alpha + rng.uniform(-0.7, 0.7, n), D_next]))
    return [*corners, corners[0]]


def check_random_loops(tubes, seeds):
    """At one level: where ``auto`` leaves twist out and takes it in again, the energy changes by what twist holds."""
    closed = 0
    for seed in seeds:
        rng = np.random.default_rng([seed, tubes, 3])
        robot = random_robot(rng, tubes)
        try:
            trip = loops.travel(EquilibriumSolver(robot, 1e-8, fidelity="torsion"), random_loop(rng, robot))
        except loops.PathLost:
            continue  # it snapped: no loop through equilibria
        if trip.same_equilibrium():
            closed += 1
            assert abs(trip.work[-1]) < MOST_WORK, seed
        assert trip.work[-1] == pytest.approx(trip.energy_change, abs=MOST_WORK)
    return closed


@pytest.mark.parametrize("tubes", [2, 3])
def test_closed_loops_cost_no_work(tubes):
    assert check_random_loops(tubes, range(6)) >= 5


@pytest.mark.soak
@pytest.mark.parametrize("tubes", [2, 3])
def test_a_hundred_closed_loops_cost_no_work(tubes):
    assert check_random_loops(tubes, range(100, 160)) >= 50


def test_equation_41_makes_work_round_a_closed_loop():
    """Row b), untwisted: (41) depends on D_1 alone, so that sliding both tubes round a rectangle yields work."""
    case = TABLE_2["b"]
    D_1, D_2 = case.D
    corners = [(D_1, D_2), (D_1 + 0.04, D_2), (D_1 + 0.04, D_2 + 0.04), (D_1, D_2 + 0.04), (D_1, D_2)]
    path = [np.concatenate([case.alpha, D]) for D in corners]
    solver = EquilibriumSolver(case.robot, 1e-9)
    assert abs(loops.travel(solver, path).work[-1]) < MOST_WORK
    K1, K2 = (tube.segments[0].bending_stiffness for tube in case.robot.tubes)

    def along(D1):
        k_orifice, k_end = ((K1 * (30.0 - 80.0 * X) + K2 * 30.0) / (K1 + K2) for X in (D1, 0.2))
        return 0.5 * K2 * (k_end**2 - k_orifice**2)

    expected = 0.04 * (along(0.09) - along(0.05))
    assert expected > 0.04
    assert loops.travel(solver, path, loops.by_equation_41).work[-1] == pytest.approx(expected, rel=1e-9)


def test_a_loop_round_the_cusp_comes_back_elsewhere():
    """No fold is met, yet the robot comes back to another equilibrium, and the actuators paid the difference."""
    trip = loops.travel(EquilibriumSolver(cases.SEED, 1e-9), cases.CUSP_LOOP)
    assert all(corner.stability_margin > 0.9 for corner in trip.corners)
    tip = np.array([cases.SEED.tubes[0].length - 0.09])
    angles = [np.degrees(np.diff(corner.twist(tip)[0])[0]) for corner in (trip.corners[0], trip.corners[-1])]
    assert angles == pytest.approx([80.14, 293.71], abs=0.01)
    assert not trip.same_equilibrium()
    assert trip.energy_change == pytest.approx(-0.02940, abs=1e-5)
    assert trip.work[-1] == pytest.approx(trip.energy_change, rel=1e-6)


def test_equation_41_refuses_what_it_was_not_derived_for(seed_robot):
    rng = np.random.default_rng(3)
    with pytest.raises(FieldError, match=r"force_model: expected virtual_work .* two tubes.*it has 3"):
        EquilibriumSolver(random_robot(rng, 3), force_model="renda2021")
    solver = EquilibriumSolver(seed_robot, force_model="renda2021")
    amid = [0.1, 0.1705]  # the inner tube starts to curve inside the overlap
    outer_amid = [0.08, 0.2185]  # so does the outer one
    shorter = [0.15, 0.28]  # the inner tube ends inside the outer one
    for D in (amid, outer_amid, shorter):
        answer = solver.solve([0.0, 1.0], D)
        assert answer.success, answer.message
        with pytest.raises(FieldError, match="force_model: expected virtual_work for this command"):
            _ = answer.force
    assert np.all(np.isfinite(solver.solve([0.0, 1.0], [0.15, 0.25]).force))


@pytest.mark.parametrize("name", ["identity", "kinks", "loops", "cusp", "folds"])
def test_the_documents_tables_are_what_the_script_makes(name):
    """Smoothing, the slow table, is proved above."""
    text = (DOCS / "insertion_forces.md").read_text(encoding="utf-8")
    assert f"<!-- {name} -->\n{insertion_forces.TABLES[name]()}\n<!-- end {name} -->" in text
