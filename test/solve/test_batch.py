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
from ctr_pvs.answer.engine import Engine
from ctr_pvs.answer.engine import Workspace
from ctr_pvs.errors import FieldError
from ctr_pvs.kernel.arrays import STATE
from ctr_pvs.kernel.walk.step import MORE
from ctr_pvs.kernel.walk.step import OK
from ctr_pvs.solve import batch as batches
from ctr_pvs.solve.batch import Batch

PARTIAL = np.array([0.0935, 0.1705])


def solved(robot: Robot, alpha, D, tolerance: float = 1e-6, level: str = "auto", **options) -> Batch:
    return EquilibriumSolver(robot, tolerance, level).solve_batch(alpha, D, **options)


def assert_equal_to_single(robot: Robot, batch: Batch, rows, tolerance: float = 1e-6, level: str = "auto") -> None:
    """Status, level, tip, torque, estimate and margin of single cold solves with a fresh solver."""
    for row in rows:
        solver = EquilibriumSolver(robot, tolerance, level)
        answer = solver.solve(batch.alpha[row], batch.D[row], start="cold")
        assert batch.status[row] is answer.status
        assert batch.message(row) == answer.message
        assert batch.fidelity[row] == answer.fidelity
        if np.isnan(answer.residual):
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


def cold_rows(engine: Engine, alpha: np.ndarray, D: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The states that the kernel finds for many commands, without their unknowns, and what it says
    of each."""
    out, codes = np.zeros((len(alpha), STATE + 3 * alpha.shape[1])), np.full(len(alpha), -1)
    engine.cold_rows(alpha, D, True, out, codes)
    return out, codes


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
        codes = cold_rows(Engine(robot, 1e-6), alpha, D)[1]
        alone += int(np.count_nonzero((codes != OK) & (codes != MORE)))
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
def test_neither_portions_nor_threads_nor_order_matter(seed_robot, same, monkeypatch):
    rng = np.random.default_rng(84)
    alpha = np.column_stack([rng.uniform(-1.0, 1.0, 300), rng.uniform(-3.0, 3.0, 300)])
    D = np.tile(PARTIAL, (300, 1))
    if not same:
        D += rng.uniform(-5e-3, 0.0, D.shape)
    whole = solved(seed_robot, alpha, D)
    assert whole.success.all()
    for block, portion, threads in ((300, 7, 4), (64, 64, 1), (37, 300, 3), (1, 1, 2)):
        monkeypatch.setattr(batches, "BLOCK", block)
        monkeypatch.setattr(batches, "PORTION", portion)
        monkeypatch.setattr("os.cpu_count", lambda threads=threads: threads)
        some = slice(0, 300 if block > 1 else 20)
        parts = solved(seed_robot, alpha[some], D[some])
        assert np.array_equal(parts.tip_position, whole.tip_position[some])
        assert np.array_equal(parts.torque, whole.torque[some])
    monkeypatch.undo()
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


@pytest.mark.parametrize("loaded", [False, True], ids=["unloaded", "loaded"])
@pytest.mark.parametrize("tubes", [1, 2, 3])
def test_margins_and_forces_noted_on_the_way_are_those_of_single_answers(tubes, loaded):
    """Bit by bit, rows that snap and rows that the robot cannot take among them."""
    rng = np.random.default_rng([tubes, loaded, 88])
    robot = random_robot(rng, tubes, strength=2.0)
    alpha, D = many_rows(rng, robot, 6 if loaded else 20, 4.0)
    D[1] = -1.0
    force = rng.uniform(-0.1, 0.1, (len(D), 3)) if loaded else None
    noted, asked = (solved(robot, alpha, D, tip_force=force, complete=complete) for complete in (True, False))
    assert noted.stability_margin.tobytes() == asked.stability_margin.tobytes()
    assert noted.force.tobytes() == asked.force.tobytes()
    assert np.isnan(noted.force[1]).all() and np.isfinite(noted.force).all(axis=1).sum() > len(D) // 2
    row = int(np.flatnonzero(noted.success)[-1])
    assert noted.force[row].tobytes() == noted[row].force.tobytes()


def test_forces_noted_on_the_way_are_of_the_force_model(seed_robot):
    solver, D = EquilibriumSolver(seed_robot, 1e-6, force_model="renda2021"), [0.15, 0.25]
    batch = solver.solve_batch([[0.0, 1.2]], [D], complete=True)
    assert batch.force[0].tobytes() == solver.solve([0.0, 1.2], D, "cold").force.tobytes()
    assert np.abs(batch.force[0] - solved(seed_robot, [[0.0, 1.2]], [D]).force[0]).max() > 1e-3


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


def test_progress_is_told(seed_robot, monkeypatch):
    told = []
    monkeypatch.setattr(batches, "BLOCK", 4)
    alpha = np.column_stack([np.zeros(10), np.linspace(0.1, 1.0, 10)])
    solved(seed_robot, alpha, np.tile(PARTIAL, (10, 1)), progress=lambda *now: told.append(now))
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
def test_rows_of_the_kernel_are_its_single_answers(seed, tubes):
    """Bit by bit, and a workspace that is too small for some of the rows leaves nothing out."""
    rng = np.random.default_rng([seed, tubes, 87])
    robot = random_robot(rng, tubes)
    alpha, D = many_rows(rng, robot, 12, 2.0)
    engine = Engine(robot, 1e-6)
    small = Workspace(tubes, int(engine.segments.sum()) + 1)
    small.capacity[1:] = 1
    small._allocate()
    engine._local.workspace = small
    numbers, codes = cold_rows(engine, alpha, D)
    assert np.isin(codes, range(5)).all()
    for row, code in enumerate(codes.tolist()):
        again, state = Engine(robot, 1e-6).cold_start(alpha[row], D[row], True)
        assert again == code
        if code == OK:
            assert np.array_equal(state[: numbers.shape[1]], numbers[row])
