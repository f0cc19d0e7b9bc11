"""The prepared models: the same energy, a certificate that holds, degrees that depend on the command alone."""

from __future__ import annotations

import copy

import numpy as np
import pytest
from random_robots import random_D
from random_robots import random_robot

from ctr_pvs import EquilibriumSolver
from ctr_pvs import Robot
from ctr_pvs import Segment
from ctr_pvs import Status
from ctr_pvs import Tube
from ctr_pvs.backbone import poses
from ctr_pvs.energy import TorsionEnergy
from ctr_pvs.fidelity import first_degrees
from ctr_pvs.materials import Materials
from ctr_pvs.pair_form import LARGEST_TABLE
from ctr_pvs.pair_form import PackedForm
from ctr_pvs.sections import piecewise_domain
from ctr_pvs.serving import ServingModel
from ctr_pvs.serving import raised
from ctr_pvs.stability import stability_margin
from ctr_pvs.swing import tip_weights

PARTIAL = np.array([0.0935, 0.1705])


def prepared(robot, D, tolerance=1e-7):
    materials = Materials(robot, piecewise_domain(robot, np.asarray(D, dtype=float)))
    degrees = first_degrees(materials, tolerance)
    return ServingModel(TorsionEnergy(materials, raised(degrees)), degrees)


def scenes(count, tubes=(2, 3, 4), strength=2.0):
    for seed in range(count):
        rng = np.random.default_rng([seed, 77])
        robot = random_robot(rng, tubes[seed % len(tubes)], strength)
        model = prepared(robot, random_D(rng, robot))
        if model.n:
            yield rng, model


def test_the_packed_form_is_the_energy():
    """Gradient and Hessian of the pair form are those of the energy, in the order of the model."""
    for rng, model in scenes(12):
        q = 0.3 * rng.standard_normal(model.finer) * model.energy.constant() ** 0.5
        q[model.order[model.n :]] = 0.0
        alpha = rng.uniform(-3, 3, model.tubes)
        gradient, hessian = model.energy.derivatives(q, alpha)
        sines = np.sin(model.waves.dot(model.start(q, alpha)))
        out = model.check_form.terms(sines)
        size = model.check_form.size
        assert out[size:] + q[model.order] == pytest.approx(gradient[model.order], rel=1e-11, abs=1e-13)
        unpacked = model.check_form.unpacked(sines)
        assert np.tril(unpacked) == pytest.approx(
            np.tril(hessian[np.ix_(model.order, model.order)]), rel=1e-11, abs=1e-13
        )


def test_table_and_product_agree(monkeypatch):
    """The two ways to evaluate the form, for small and large robots, give the same numbers."""
    compared = 0
    for _, model in scenes(8):
        sines = np.sin(np.linspace(0.0, 9.0, 2 * model.rows + 2))
        for tangents in (True, False):
            by_table = PackedForm(model.pairs, model.n, tangents)
            monkeypatch.setattr("ctr_pvs.pair_form.LARGEST_TABLE", 0)
            by_product = PackedForm(model.pairs, model.n, tangents)
            monkeypatch.setattr("ctr_pvs.pair_form.LARGEST_TABLE", LARGEST_TABLE)
            if by_table._table is None:
                continue
            sines[-2] = 1.0
            assert by_product.terms(sines) == pytest.approx(by_table.terms(sines), rel=1e-11, abs=1e-13)
            compared += 1
    assert compared >= 8


def test_the_tangent_is_the_rate_of_the_equilibrium(seed_robot):
    solver = EquilibriumSolver(seed_robot, tolerance=1e-8)
    alpha, step = np.array([0.2, 1.7]), np.array([0.0, 1e-5])
    served = solver.solve(alpha, PARTIAL).source.served
    ahead, behind = (solver.solve(alpha + sign * step, PARTIAL).source.served for sign in (1.0, -1.0))
    rate = (ahead.q - behind.q)[served.model.order[: served.model.n]] / (2.0 * step[1])
    assert -served.answers[1] == pytest.approx(rate, rel=1e-5, abs=1e-9)


def test_lowered_cosines_bound_the_hessian():
    """Within ``reach`` of a state no Hessian is below the one that the check factorises."""
    for rng, model in scenes(10):
        z = model.start(np.zeros(model.finer), rng.uniform(-3, 3, model.tubes))
        sines = np.sin(model.waves.dot(z))
        reach = 0.2
        sines[-1] = reach
        bound = model.check_form.unpacked(sines)
        bound += np.tril(bound, -1).T
        angles = model.waves.dot(z)[model.rows : 2 * model.rows]
        for _ in range(5):
            near = angles + rng.uniform(-reach, reach, model.rows)
            hessian = (
                np.eye(model.finer) + (model.pairs.map.T * (model.pairs.amplitude * np.cos(near))) @ model.pairs.map
            )
            assert np.linalg.eigvalsh(hessian - bound)[0] > -1e-9 * np.abs(hessian).max()


def test_the_margin_is_that_of_the_finer_energy(seed_robot):
    solver = EquilibriumSolver(seed_robot, tolerance=1e-6)
    for degrees in (30, 150, 200, 205.5):
        answer = solver.solve([0.0, np.radians(degrees)], PARTIAL)
        expected = stability_margin(answer.solution.energy, answer.solution.q, answer.alpha)
        assert answer.stability_margin == pytest.approx(expected, abs=1e-12)


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


def test_degree_changes_do_not_make_the_stream_jump(seed_robot):
    """Along a path on which level and degrees change, the answer stays within the tolerance of the exact one."""
    tolerance = 1e-4
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
    assert len(seen) >= 3 and {"torsionless", "torsion"} == {level for level, _ in seen}


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


@pytest.mark.parametrize("seed", range(8))
def test_loads_and_shape_of_a_served_answer_agree_with_the_general_ones(seed):
    """Tip and poses from prepared tables and from the fields along the rod."""
    rng = np.random.default_rng([seed, 31])
    robot = random_robot(rng, 2 + seed % 3, 2.0)
    answer = EquilibriumSolver(robot, 1e-7).solve(rng.uniform(-2, 2, robot.n_tubes), random_D(rng, robot))
    backbone = answer.backbone(41)
    general = poses(answer.shape.pieces(1e-11), backbone.s)
    assert np.abs(backbone.position - general.position).max() < 1e-7
    assert np.abs(backbone.orientation - general.orientation).max() < 1e-5
    assert np.linalg.norm(backbone.orientation, axis=1) == pytest.approx(np.ones(41), abs=1e-12)
    assert backbone.position[-1] == pytest.approx(answer.tip.position, abs=1e-8)


def test_the_bound_adds_up_what_every_place_swings():
    """``tip_weights`` sum to what a walk over the Gauss points of all sections finds, tube by tube."""
    for rng, model in scenes(12):
        energy, change = model.energy, rng.standard_normal(model.finer)
        total, length = 0.0, energy.materials.domain.length
        for node in energy.all_nodes:
            swing = (node.weight * (length - node.s))[:, None] * node.bending * np.abs(node.kappa) / node.bending.sum()
            total += (swing * np.abs(energy.space.angle_map(node.section, node.rule.x) @ change)).sum()
        assert np.abs(tip_weights(energy) @ change).sum() == pytest.approx(total, rel=1e-10)


def test_what_a_topology_shares_carries_the_torques_to_another_D():
    """Neighbouring base positions share their unknowns; q is then carried over as the torque field would be."""
    for seed in range(8):
        rng = np.random.default_rng([seed, 77])
        robot = random_robot(rng, 2 + seed % 3, 1.0)
        D = random_D(rng, robot)
        before, after = (prepared(robot, D + step).energy.space for step in (0.0, 1e-9))
        assert before.unknowns is after.unknowns
        q = rng.standard_normal(before.n)
        assert after.carried(q, before) == pytest.approx(after.coordinates(before.field(q)), abs=1e-12)
