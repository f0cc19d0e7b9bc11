"""Batches of commands against single cold solves, row by row."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest
from conftest import ROOT
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
from ctr_pvs.batch import Batch
from ctr_pvs.batch import BatchSolver
from ctr_pvs.batch_backbone import _nodes_needed
from ctr_pvs.batch_layout import Geometry
from ctr_pvs.batch_layout import Layout
from ctr_pvs.batch_layout import topology_keys
from ctr_pvs.batch_tables import Tables
from ctr_pvs.batch_values import Values
from ctr_pvs.collocation import nodes_needed
from ctr_pvs.errors import FieldError
from ctr_pvs.serve import Rungs

PARTIAL = np.array([0.0935, 0.1705])


def solved(robot: Robot, alpha, D, tolerance: float = 1e-6, level: str = "auto", **options) -> Batch:
    return BatchSolver(EquilibriumSolver(robot, tolerance, level), level).solve(alpha, D, **options)


def assert_equal_to_single(robot: Robot, batch: Batch, rows, tolerance: float = 1e-6, level: str = "auto") -> None:
    """Status, level, tip, torque, estimate and margin of single cold solves with a fresh solver."""
    for row in rows:
        solver = EquilibriumSolver(robot, tolerance, level)
        answer = solver.solve(batch.alpha[row], batch.D[row], start="cold")
        assert batch.status[row] is answer.status
        assert batch.message(row) == answer.message
        assert batch.fidelity[row] == answer.fidelity
        if answer.solution is None:
            assert np.isnan(batch.tip_position[row]).all()
            continue
        assert batch.tip_position[row] == pytest.approx(answer.tip.position, abs=1e-10)
        assert batch.tip_orientation[row] == pytest.approx(answer.tip.orientation, abs=1e-9)
        assert batch.torque[row] == pytest.approx(answer.torque, abs=1e-10)
        assert batch.degrees_of_freedom[row] == answer.degrees_of_freedom
        loose = 1e-2 if answer.fidelity == "torsionless" else 1e-5
        assert batch.error_estimate[row] == pytest.approx(answer.error_estimate, rel=loose)
        assert batch.stability_margin[row] == pytest.approx(answer.stability_margin, abs=1e-7)
        assert batch.residual[row] < 1e-9 or batch.fidelity[row] == "torsionless"


def test_the_method_of_the_solver(seed_robot):
    """Leaves the warm start alone, and keeps its tables."""
    solver = EquilibriumSolver(seed_robot, tolerance=1e-6)
    solver.solve([0.0, 0.4], PARTIAL)
    alpha = np.column_stack([np.zeros(6), np.linspace(0.1, 3.0, 6)])
    for _ in range(2):
        batch = solver.solve_batch(alpha, np.tile(PARTIAL, (6, 1)))
        assert_equal_to_single(seed_robot, batch, range(6))
    assert solver.solve([0.0, 0.41], PARTIAL).iterations <= 3
    with pytest.raises(FieldError, match="start"):
        solver.solve_batch(alpha, np.tile(PARTIAL, (6, 1)), start="warm")


def many_rows(rng: np.random.Generator, robot: Robot, count: int, spread: float) -> tuple[np.ndarray, np.ndarray]:
    """Half of the rows at one D, the others near it or anywhere."""
    base = random_D(rng, robot)
    reach = np.minimum.accumulate([tube.length for tube in robot.tubes][::-1])[::-1]
    D = np.tile(base, (count, 1))
    for row in range(count // 2, count):
        moved = random_D(rng, robot) if row % 3 == 0 else base + rng.uniform(-3e-3, 3e-3, robot.n_tubes)
        D[row] = np.maximum.accumulate(np.clip(moved, 0.0, reach))
    return rng.uniform(-spread, spread, (count, robot.n_tubes)), D


@pytest.mark.parametrize("tubes", [1, 2, 3])
@pytest.mark.parametrize("seed", range(4))
def test_random_robots(tubes, seed):
    rng = np.random.default_rng([seed, tubes, 81])
    robot = random_robot(rng, tubes)
    alpha, D = many_rows(rng, robot, 16, 2.0)
    tolerance = (1e-4, 1e-5, 1e-6, 1e-8)[seed]
    batch = solved(robot, alpha, D, tolerance)
    assert_equal_to_single(robot, batch, range(len(batch)), tolerance)


def test_most_rows_are_solved_together():
    """Otherwise the rest would test the solver of single commands only."""
    rng = np.random.default_rng(82)
    alone = 0
    for tubes in (2, 3):
        robot = random_robot(rng, tubes, strength=0.7)
        alpha, D = many_rows(rng, robot, 40, 2.0)
        alone += int(np.count_nonzero(solved(robot, alpha, D)._part < 0))
    assert alone <= 8


@pytest.mark.parametrize("D", [[0.0935, 0.2085], [0.0935, 0.1705], [0.05, 0.19]])
@pytest.mark.parametrize("count", [31, 400])
def test_the_seed_robot_through_its_snaps(seed_robot, D, count):
    """Turned by up to 300 deg: rows that snap on the way say so, with the answers of single solves."""
    degrees = np.linspace(-300.0, 300.0, 31)
    alpha = np.column_stack([np.zeros(31), np.radians(degrees)])
    every = np.concatenate([alpha, np.column_stack([np.zeros(count), np.linspace(-3.0, 3.0, count)])])
    batch = solved(seed_robot, every, np.tile(D, (len(every), 1)), 1e-5)
    assert_equal_to_single(seed_robot, batch, range(31), 1e-5)
    assert_equal_to_single(seed_robot, batch, range(31, len(every), 41), 1e-5)
    if D[1] == 0.2085:
        assert np.count_nonzero(batch.status == Status.SNAP) >= 2


def test_right_up_to_a_fold(seed_robot):
    """Rows within 1e-3 rad of the snap, on both sides of it."""
    D = np.array([0.0935, 0.2085])
    solver = EquilibriumSolver(seed_robot, 1e-6)
    solver.solve([0.0, 4.0], D)
    fold = 4.0 + solver.distance_to_snap()[1, 1]
    angles = np.concatenate([np.linspace(-4.0, 4.0, 200), fold + np.array([-1e-2, -1e-3, -1e-5, 1e-5, 1e-3])])
    batch = solved(seed_robot, np.column_stack([0 * angles, angles]), np.tile(D, (len(angles), 1)))
    assert [status is Status.SNAP for status in batch.status[-5:]] == [False, False, False, True, True]
    assert_equal_to_single(seed_robot, batch, [198, 200, 201, 203, 204])


@pytest.mark.parametrize("level", ["torsion", "torsionless"])
def test_levels(seed_robot, level):
    alpha = np.column_stack([np.zeros(9), np.linspace(-2.0, 2.0, 9)])
    batch = solved(seed_robot, alpha, np.tile(PARTIAL, (9, 1)), level=level)
    assert_equal_to_single(seed_robot, batch, range(9), level=level)


def test_three_tubes_of_a_file():
    robot = load_robot(ROOT / "config" / "three_tubes.yaml")
    rng = np.random.default_rng(83)
    alpha = rng.uniform(-2.5, 2.5, (12, 3))
    D = np.tile([0.06, 0.14, 0.24], (12, 1))
    assert_equal_to_single(robot, solved(robot, alpha, D), range(12))


def test_bad_rows_are_told_and_the_others_solved(seed_robot):
    D = np.tile(PARTIAL, (7, 1))
    alpha = np.zeros((7, 2))
    alpha[:, 1] = 0.5
    alpha[1, 0], alpha[2, 1] = np.nan, 2e6
    D[3] = [0.2, 0.1]
    D[4, 1] = np.inf
    D[5, 0] = -1e-13  # a rounding error, which a single solve puts right as well
    batch = solved(seed_robot, alpha, D)
    assert batch.rejected.tolist() == [False, True, True, True, True, False, False]
    assert batch.success.tolist() == [True, False, False, False, False, True, True]
    assert "alpha[0]" in batch.message(1) and "finite" in batch.message(1)
    assert "D[0]" in batch.message(3) or "D[1]" in batch.message(3)
    assert np.isnan(batch.tip_position[1:5]).all() and np.isnan(batch.stability_margin[1:5]).all()
    assert np.array_equal(batch.tip_position[0], batch.tip_position[6])
    assert batch.D[5, 0] == 0.0
    assert_equal_to_single(seed_robot, batch, [0, 5, 6])
    with pytest.raises(NoEquilibriumError, match="alpha"):
        _ = batch[1].tip


@pytest.mark.parametrize(
    ("alpha", "D"),
    [
        (np.zeros((3, 2)), np.zeros((2, 2))),
        (np.zeros((3, 3)), np.zeros((3, 3))),
        (np.zeros(2), np.zeros(2)),
        ([[0.0, 1.0], [0.0]], np.zeros((2, 2))),
        (np.array([["a", "b"]]), np.zeros((1, 2))),
    ],
)
def test_wrong_tables_are_refused(seed_robot, alpha, D):
    with pytest.raises(CommandError):
        solved(seed_robot, alpha, D)


def test_no_rows_and_one_row(seed_robot):
    none = solved(seed_robot, np.zeros((0, 2)), np.zeros((0, 2)))
    assert len(none) == 0 and none.tip_position.shape == (0, 3) and none.stability_margin.shape == (0,)
    assert len(solved(seed_robot, [], [])) == 0
    one = solved(seed_robot, [[0.0, 1.2]], [PARTIAL])
    assert_equal_to_single(seed_robot, one, [0])
    with pytest.raises(IndexError):
        one[1]


@pytest.mark.parametrize("same", [True, False])
def test_neither_chunks_nor_order_matter(seed_robot, same):
    rng = np.random.default_rng(84)
    alpha = np.column_stack([rng.uniform(-1.0, 1.0, 300), rng.uniform(-3.0, 3.0, 300)])
    D = np.tile(PARTIAL, (300, 1))
    if not same:
        D += rng.uniform(-5e-3, 0.0, D.shape)
    whole = solved(seed_robot, alpha, D)
    assert whole.success.all()
    for block, chunk in ((300, 7), (64, 64), (37, 300), (1, 1)):
        some = slice(0, 300 if block > 1 else 20)
        parts = solved(seed_robot, alpha[some], D[some], block=block, chunk=chunk)
        assert parts.tip_position == pytest.approx(whole.tip_position[some], abs=1e-12)
        assert parts.torque == pytest.approx(whole.torque[some], abs=1e-12)
    shuffled = rng.permutation(300)
    again = solved(seed_robot, alpha[shuffled], D[shuffled])
    assert again.tip_position == pytest.approx(whole.tip_position[shuffled], abs=1e-12)
    assert again.tip_orientation == pytest.approx(whole.tip_orientation[shuffled], abs=1e-11)


def test_turning_all_tubes_and_whole_turns(seed_robot):
    """A common rotation, also by thousands of turns, turns the shape and loses no more than its own rounding."""
    alpha = np.column_stack([np.zeros(200), np.linspace(-3.0, 3.0, 200)])
    D = np.tile(PARTIAL, (200, 1))
    still = solved(seed_robot, alpha, D)
    turned = solved(seed_robot, alpha + 5000.0 * np.pi, D)
    assert turned.success.all()
    assert turned.tip_position == pytest.approx(still.tip_position, abs=1e-11)


def test_a_row_has_every_output(seed_robot):
    alpha = np.column_stack([np.full(5, 0.3), np.linspace(0.2, 5.6, 5)])
    D = np.tile([0.0935, 0.2085], (5, 1))
    batch = solved(seed_robot, alpha, D)
    for row in (0, 2, 4, -1):
        answer = batch[row]
        single = EquilibriumSolver(seed_robot, 1e-6).solve(alpha[row], D[row], start="cold")
        assert answer.status is single.status and answer.message == single.message
        assert answer.tip.position == pytest.approx(batch.tip_position[row], abs=1e-12)
        assert answer.torque == pytest.approx(batch.torque[row], abs=1e-11)
        assert answer.force == pytest.approx(single.force, abs=1e-8)
        assert answer.energy == pytest.approx(single.energy, abs=1e-12)
        assert answer.backbone(20).position == pytest.approx(single.backbone(20).position, abs=1e-10)
        assert answer.stability_margin == pytest.approx(batch.stability_margin[row], abs=1e-8)
        assert answer.error_estimate == pytest.approx(batch.error_estimate[row], rel=1e-5)
        assert len(answer.snaps) == len(single.snaps)


def test_tubes_that_do_not_couple():
    """All inside, one tube out, straight tubes: closed forms."""
    curved, straight = Segment(0.1, 0.05, 0.04, (10.0,)), Segment(0.1, 0.05, 0.04)
    pair = Robot("pair", (Tube("a", (curved,)), Tube("b", (curved,))))
    D = np.array([[0.1, 0.1], [0.1, 0.1], [0.02, 0.1], [0.1, 0.1]])
    batch = solved(pair, np.array([[0.0, 1.0], [0.5, 2.0], [0.3, 0.0], [1e5, 0.0]]), D)
    assert_equal_to_single(pair, batch, range(4))
    rods = Robot("rods", (Tube("a", (straight,)), Tube("b", (straight, straight))))
    batch = solved(rods, np.zeros((3, 2)), np.array([[0.0, 0.0], [0.05, 0.06], [0.02, 0.1]]))
    assert_equal_to_single(rods, batch, range(3))


def test_bases_on_the_orifice():
    """Tubes without a guided part, whose lead has no compliance."""
    rng = np.random.default_rng(85)
    for tubes in (2, 3):
        segments = [Segment(0.1 + 0.02 * j, 0.05 / (j + 1), 0.04 / (j + 1), (6.0 + 2.0 * j,)) for j in range(tubes)]
        robot = Robot("bare", tuple(Tube(f"t{j}", (segment,)) for j, segment in enumerate(segments)))
        alpha, D = rng.uniform(-1.0, 1.0, (6, tubes)), np.zeros((6, tubes))
        D[1:, -1], D[3:, 1] = 0.01, 0.01
        assert_equal_to_single(robot, solved(robot, alpha, D), range(6))


def test_progress_is_told(seed_robot):
    told = []
    alpha = np.column_stack([np.zeros(10), np.linspace(0.1, 1.0, 10)])
    solved(seed_robot, alpha, np.tile(PARTIAL, (10, 1)), progress=lambda *now: told.append(now), block=4)
    assert told == [(4, 10), (8, 10), (10, 10)]


def test_memory_is_bounded(seed_robot):
    """Beyond what the answers hold, twice the rows take no more."""

    def peak(count: int) -> float:
        alpha = np.column_stack([np.zeros(count), np.random.default_rng(86).uniform(-3.4, 3.4, count)])
        D = np.tile(PARTIAL, (count, 1))
        tracemalloc.start()
        batch = solved(seed_robot, alpha, D, 1e-5)
        now, most = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        assert batch.success.all()
        assert now < 400 * count + 5e6
        return most - now

    assert peak(20_000) < 60e6
    assert peak(60_000) < 60e6


@pytest.mark.parametrize("tubes", [1, 2, 3, 4])
@pytest.mark.parametrize("seed", range(6))
def test_tables_are_those_of_single_commands(seed, tubes):
    """At several D of one layout: sections, degrees, pairs, weights and slack, all told by arrays over D."""
    rng = np.random.default_rng([seed, tubes, 87])
    robot = random_robot(rng, tubes)
    base = random_D(rng, robot)
    reach = np.minimum.accumulate([tube.length for tube in robot.tubes][::-1])[::-1]
    D = [np.maximum.accumulate(np.clip(base + rng.uniform(-1e-3, 1e-3, tubes), 0.0, reach)) for _ in range(6)]
    keys = topology_keys(robot, np.array([base, *D]).T)
    D = np.array([base, *(one for one, key in zip(D, keys[1:], strict=True) if key == keys[0])]).T
    layout, tolerance = Layout(robot, D[:, 0]), 1e-5
    geometry = Geometry(layout, D)
    rungs = [Rungs(robot, one.copy(), tolerance) for one in D.T]
    degrees = geometry.first_degrees(tolerance)
    panels = np.array([np.broadcast_to(geometry.panels(m), D.shape[1]) for m in layout.coupled]).reshape(-1, D.shape[1])
    values = Values(Tables(layout, tuple(degrees[:, 0].tolist())), geometry, tolerance)
    tables = values.tables
    for k, rung in enumerate(rungs):
        assert rung.materials.domain.topology == layout.materials.domain.topology
        assert geometry.boundaries[:, k] == pytest.approx(rung.materials.domain.boundaries, abs=1e-14)
        assert tuple(degrees[:, k].tolist()) == rung.first
        if np.any(degrees[:, k] != degrees[:, 0]) or np.any(panels[:, k] != panels[:, 0]):
            continue
        model, here = rung[0], values.take(np.array([k]))
        assert here.slack == pytest.approx(rung.slack)
        assert here.twist_norm == pytest.approx(model.twist_norm)
        assert here.amplitude[:, 0] == pytest.approx(model.pairs.amplitude, rel=1e-9)
        assert np.exp(1j * here.phase[:, 0]) == pytest.approx(np.exp(1j * model.pairs.phase), abs=1e-9)
        assert here.tip_shares()[:, 0] == pytest.approx(model.tip_shares)
        told = {(i, j): strength * np.exp(1j * phase) for i, j, strength, phase in model._first_twist}
        assert {(i, j): strength[0] for i, j, strength in here.first_twist()} == pytest.approx(told, abs=1e-12)
        least = here.least_first_twist()
        assert least is None or abs(least[2][0]) <= abs(here.first_twist()[0][2][0]) * (1.0 + 1e-9)
        q = rng.normal(size=model.finer)
        u = unknowns(tables, here, model, q)
        assert np.sum(u * here.stiff(u)) == pytest.approx(q @ q)
        assert tables.difference @ u[:, 0] == pytest.approx(model.pairs.map @ q, abs=1e-9)
        assert here.tip_motion(u)[0] == pytest.approx(np.abs(model.weights @ q).sum())


def unknowns(tables: Tables, values: Values, model, q: np.ndarray) -> np.ndarray:
    """The u (finer, 1) of a batch for the q (finer,) of a single command's model, in its order."""
    u = np.zeros((model.finer, 1))
    if model.finer:
        spread = np.zeros(model.finer)
        spread[model.order] = q
        turn = values.lead[:, 0] * model.energy.space.field(spread).guide
        u[: tables.lead, 0] = turn[tables.leading[1:]] - turn[tables.leading[0]] if tables.lead else 0.0
        u[tables.lead :, 0] = q[tables.lead :] * np.sqrt(values.geometry.lengths[tables.section[tables.lead :], 0])
    return u


def test_gauss_points_are_those_of_single_commands():
    rng = np.random.default_rng(88)
    cases = 10.0 ** rng.uniform([-3, -1, -1, -1, -9], [0, 2, 3, 2, -3], (200, 5))
    cases[::3, 3] = 0.0
    together = _nodes_needed(*cases.T)
    assert together.T.tolist() == [list(nodes_needed(*case)) for case in cases.tolist()]
