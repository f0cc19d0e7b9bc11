"""Equilibria against reference values and against independent integration of the boundary-value model."""

from __future__ import annotations

import time

import numpy as np
import pytest
from conftest import ROOT
from dense_energies import energy_of_answer
from dense_energies import solved_for
from judges_of_shape import base_angles
from judges_of_shape import tip_position
from random_robots import random_D
from random_robots import random_robot

from ctr_pvs import CommandError
from ctr_pvs import EquilibriumSolver
from ctr_pvs import NoEquilibriumError
from ctr_pvs import Robot
from ctr_pvs import Segment
from ctr_pvs import Status
from ctr_pvs import Tube
from ctr_pvs import load_robot

SWEEPS = ("fig4_full", "fig4_partial")


@pytest.mark.parametrize("start", ["cold", "warm"])
@pytest.mark.parametrize("sweep", SWEEPS)
def test_the_seeds_sweeps(seed_robot, reference, sweep, start):
    """All 26 rows of Fig. 4: tip to 2e-8 m (the file's own digits: 1e-9), angles, and torque to 1e-6 relative."""
    solver = EquilibriumSolver(seed_robot, tolerance=1e-8)
    D = reference[sweep]["D"]
    for row in reference[sweep]["rows"]:
        answer = solver.solve([0.0, np.radians(row["alpha2_deg"])], D, start=start)
        assert answer.status is Status.OK, answer.message
        assert np.linalg.norm(answer.tip.position - row["tip_m"]) < 2e-8
        assert answer.torque[1] == pytest.approx(row["torque2_Nm"], rel=1e-6, abs=1e-12)
        places = np.array([0.0, seed_robot.tubes[0].length - D[0]])
        theta = np.degrees(np.diff(answer.twist(places), axis=1)[:, 0])
        assert theta == pytest.approx([row["theta2_orifice_deg"], row["theta2_outer_tip_deg"]], abs=1e-7)


def test_failures_have_no_shape_and_cost_no_history(seed_robot, reference):
    """An answer without an equilibrium refuses to show one, and the last good one stays the warm start."""
    D = reference["fig4_full"]["D"]
    solver = EquilibriumSolver(seed_robot, tolerance=1e-7)
    assert solver.solve([0.0, np.radians(270)], D).status is Status.OK
    lost = solver.solve([0.0, np.radians(90)], D, budget=1e-9)  # too far for one step
    assert lost.status is Status.TIMEOUT and not lost.success
    for output in ("tip", "torque", "force", "energy", "jacobian", "degrees_of_freedom"):
        with pytest.raises(NoEquilibriumError, match="timeout"):
            getattr(lost, output)
    assert np.isnan(lost.stability_margin)
    # 271 deg lies on this branch only by its history: a cold start from -89 deg would be elsewhere.
    again = solver.solve([0.0, np.radians(271)], D)
    assert again.status is Status.OK and again.stability_margin < 1.0


def test_fig2_lower_branch(reference):
    """Hard coupling, alpha_2 = 180 deg exactly: one of the two mirror branches, to 1e-6 deg and 1e-8 m."""
    robot = load_robot(ROOT / "config" / "renda2021_fig2.yaml")
    answer = EquilibriumSolver(robot, tolerance=1e-9).solve([0.0, np.pi], [0.0, 0.0])
    row = reference["fig2"]
    theta = np.degrees(np.diff(answer.twist(np.array([0.14])), axis=1)[0, 0])
    assert theta == pytest.approx(row["theta2_outer_tip_deg"], abs=1e-6)
    assert np.linalg.norm(answer.tip.position - row["tip_m"]) < 1e-8


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("tubes", [1, 2, 3, 4])
def test_random_robots_against_tip_integration(tubes, seed):
    """The tips' angles, integrated back to the bases, give the command; the torque there is tau_alpha; the tip
    agrees."""
    rng = np.random.default_rng([seed, tubes])
    robot = random_robot(rng, tubes)
    D, alpha = random_D(rng, robot), rng.uniform(-2.0, 2.0, tubes)
    answer = EquilibriumSolver(robot, tolerance=1e-8).solve(alpha, D)
    assert answer.status is Status.OK, answer.message
    ends = np.array([max(tube.length - base, 0.0) for tube, base in zip(robot.tubes, D, strict=True)])
    tip_angles = np.array([answer.twist(np.array([end]))[0, j] for j, end in enumerate(ends)])
    found, torque = base_angles(robot, D, tip_angles)
    assert found == pytest.approx(alpha, abs=2e-6)
    assert -torque == pytest.approx(answer.torque, rel=1e-6, abs=2e-7)
    orifice = answer.twist(np.zeros(1))[0]
    assert np.linalg.norm(answer.tip.position - tip_position(robot, D, orifice, torque)) < 3e-7
    assert answer.stability_margin > 0.0


def test_cold_equals_warm():
    """Where no fold lies between, a walk of many commands ends where a cold start does: 1e-8 rad and 1e-9 m."""
    rng = np.random.default_rng(5)
    for _ in range(6):
        robot = random_robot(rng, 3, strength=0.6)
        warm, cold = EquilibriumSolver(robot, tolerance=1e-8), EquilibriumSolver(robot, tolerance=1e-8)
        for _ in range(5):
            alpha, D = rng.uniform(-1.5, 1.5, 3), random_D(rng, robot)
            a, b = warm.solve(alpha, D), cold.solve(alpha, D, start="cold")
            assert a.success and b.success
            assert np.linalg.norm(a.tip.position - b.tip.position) < 1e-9
            s = np.linspace(0.0, a.shape.domain.length, 20)
            assert np.allclose(a.twist(s), b.twist(s), atol=1e-8, equal_nan=True)


def test_turning_all_tubes_turns_the_shape():
    """Objectivity: loads, energy and margin stay to 1e-12, also for whole turns; the shape turns with the tubes."""
    rng = np.random.default_rng(8)
    robot = random_robot(rng, 3)
    D, alpha = random_D(rng, robot), rng.uniform(-1.0, 1.0, 3)
    still = EquilibriumSolver(robot, tolerance=1e-9).solve(alpha, D)
    for turn in (0.7, 2.0 * np.pi, -2.0 * np.pi):
        turned = EquilibriumSolver(robot, tolerance=1e-9).solve(alpha + turn, D)
        c, s = np.cos(turn), np.sin(turn)
        rotation = np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
        assert turned.tip.position == pytest.approx(rotation @ still.tip.position, abs=1e-12)
        assert turned.torque == pytest.approx(still.torque, abs=1e-12)
        assert turned.force == pytest.approx(still.force, abs=1e-11)
        assert turned.energy == pytest.approx(still.energy, abs=1e-13)
        assert turned.stability_margin == pytest.approx(still.stability_margin, abs=1e-11)


def test_same_history_gives_the_same_bits(seed_robot):
    commands = [([0.0, 0.3], [0.09, 0.2]), ([0.1, 1.3], [0.08, 0.21]), ([0.2, 2.9], [0.0935, 0.1705])]
    runs = []
    for _ in range(2):
        solver = EquilibriumSolver(seed_robot, tolerance=1e-7)
        runs.append([solver.solve(*command) for command in commands])
    for a, b in zip(*runs, strict=True):
        assert np.array_equal(a.tip.position, b.tip.position)
        assert np.array_equal(a.torque, b.torque) and np.array_equal(a.force_interval, b.force_interval)


def test_the_residual_is_that_of_the_answer(seed_robot):
    answer = EquilibriumSolver(seed_robot).solve([0.0, 2.0], [0.0935, 0.2085])
    energy, y = energy_of_answer(answer), answer.state.unknowns
    # The unknowns solved for; the others only check.
    unbalanced = energy.gradient(y, answer.alpha) * solved_for(answer._engine, answer.state)
    again = energy.twist_size(unbalanced)
    assert again <= answer.residual + 1e-15 and answer.residual < 1e-11


def test_out_of_time_is_said(seed_robot):
    solver = EquilibriumSolver(seed_robot)
    solver.solve([0.0, 0.1], [0.0935, 0.2085])
    answer = solver.solve([0.0, 4.8], [0.0935, 0.2085], budget=1e-9)
    assert answer.status is Status.TIMEOUT and not answer.success
    start = time.monotonic()
    assert solver.solve([0.0, 4.8], [0.0935, 0.2085], budget=10.0).success
    assert time.monotonic() - start < 10.0


@pytest.mark.parametrize(
    ("options", "word"),
    [
        ({"fidelity": "magic"}, "fidelity"),
        ({"force_model": "guess"}, "force_model"),
        ({"tolerance": -1.0}, "tolerance"),
        ({"tolerance": float("nan")}, "tolerance"),
    ],
)
def test_wrong_options_are_named(seed_robot, options, word):
    with pytest.raises(ValueError, match=word):
        EquilibriumSolver(seed_robot, **options)


def test_a_bad_command_changes_nothing(seed_robot):
    solver = EquilibriumSolver(seed_robot, tolerance=1e-8)
    D = [0.0935, 0.2085]
    for angle in np.radians([60, 120, 180, 240]):
        solver.solve([0.0, angle], D)
    for alpha, bad in [([0.0, np.nan], D), ([0.0], D), ([0.0, 1.0], [0.2, 0.1]), ([0.0, 1.0], [-0.1, 0.1])]:
        with pytest.raises(CommandError):
            solver.solve(alpha, bad)
    # 240 deg lies on this branch only if the history is still there: a cold start from elsewhere is not needed.
    assert solver.solve([0.0, np.radians(241)], D).iterations <= 8


def test_uncoupled_tubes_forget():
    """With a tube inside there is no history: a huge angle commanded there does not stay in the way afterwards."""
    segment = Segment(0.1, 0.05, 0.04, (10.0,))
    solver = EquilibriumSolver(Robot("pair", (Tube("a", (segment,)), Tube("b", (segment,)))), tolerance=1e-8)
    assert solver.solve([0.0, 1e5], [0.1, 0.1]).success
    again = solver.solve([0.0, 1.0], [0.02, 0.03])
    assert again.success and again.iterations < 40


def test_everything_retracted_and_single_tubes():
    """Nothing out: the tip is the orifice.  One tube: no unknowns, exactly its own shape."""
    segment = Segment(0.1, 0.05, 0.04, (10.0,))
    robot = Robot("pair", (Tube("a", (segment,)), Tube("b", (segment,))))
    inside = EquilibriumSolver(robot).solve([0.0, 1.0], [0.1, 0.1])
    assert inside.success and inside.degrees_of_freedom == 0
    assert np.array_equal(inside.tip.position, np.zeros(3))
    assert inside.torque == pytest.approx([0.0, 0.0])
    single = EquilibriumSolver(Robot("single", (Tube("a", (segment,)),))).solve([0.0], [0.04])
    angle = 10.0 * 0.06
    assert single.tip.position == pytest.approx([np.sin(angle) / 10, 0.0, -(1 - np.cos(angle)) / 10], abs=1e-14)
