"""Sweeps: the answers of single solves, in order, bit for bit the same however they are cut."""

from __future__ import annotations

import itertools
import multiprocessing
import threading
from concurrent.futures import Executor
from concurrent.futures import Future
from concurrent.futures import ProcessPoolExecutor

import numpy as np
import pytest
from conftest import ROOT

from ctr_pvs import EquilibriumSolver
from ctr_pvs import Status
from ctr_pvs import load_robot
from ctr_pvs.errors import CommandError
from ctr_pvs.robot.loads import Loads
from ctr_pvs.tasks import sweep as module
from ctr_pvs.tasks.sweep import STATUSES
from ctr_pvs.tasks.sweep import Grid
from ctr_pvs.tasks.sweep import Layout
from ctr_pvs.tasks.sweep import Listed
from ctr_pvs.tasks.sweep import joined
from ctr_pvs.tasks.sweep import sweep

ANGLES = [np.array([0.0]), np.linspace(-1.0, 5.5, 5)]
BASES = [np.array([0.05, 0.0935]), np.array([0.08, 0.2085])]


def every(robot, commands, first=0, chunk=None):
    return joined(commands.layout, list(sweep(EquilibriumSolver(robot), commands, first, chunk)))


def test_a_grid_counts_through_every_combination_the_last_D_fastest(seed_robot):
    grid = Grid(seed_robot, ANGLES, BASES, (0.0, 0.1, 0.0))
    expected = [[*row, 0.0, 0.1, 0.0] for row in itertools.product(*ANGLES, *BASES)]
    assert len(grid) == len(expected) == 20
    assert grid.rows(0, 20).tolist() == expected
    assert grid.rows(7, 11).tolist() == expected[7:11]
    assert len(Grid(seed_robot, [np.zeros(1000)] * 2, [np.zeros(1000)] * 2)) == 10**12  # never made as a whole
    with pytest.raises(CommandError, match="at most 1e\\+12 combinations"):
        Grid(seed_robot, [np.zeros(1000)] * 2, [np.zeros(1000), np.zeros(1001)])
    with pytest.raises(CommandError, match="2 tubes"):
        Grid(seed_robot, ANGLES[:1], BASES)


def test_rows_are_the_answers_of_single_solves(seed_robot):
    """Among them rows that snap on the way, and rows whose inner base would be before the outer one."""
    rows = every(seed_robot, Grid(seed_robot, ANGLES, BASES))
    seen = set()
    for row, code in enumerate(rows.codes.tolist()):
        seen.add(STATUSES[code])
        if rows["D"][row, 1] < rows["D"][row, 0]:
            assert STATUSES[code] == "rejected"
            assert np.isnan(rows.numbers[row, rows.layout.commands.stop :]).all()
            continue
        answer = EquilibriumSolver(seed_robot).solve(rows["alpha"][row], rows["D"][row])
        assert STATUSES[code] == answer.status.value
        assert rows["tip_position"][row] == pytest.approx(answer.tip.position, abs=1e-10)
        assert rows["tip_orientation"][row] == pytest.approx(answer.tip.orientation, abs=1e-9)
        assert rows["torque"][row] == pytest.approx(answer.torque, abs=1e-10)
        assert rows["force"][row] == pytest.approx(answer.force, abs=1e-7)
        assert rows["stability_margin"][row, 0] == pytest.approx(answer.stability_margin, abs=1e-7)
    assert seen == {"ok", "snap", "rejected"}
    assert rows.success.tolist() == [STATUSES[code] in ("ok", "snap") for code in rows.codes]


@pytest.mark.parametrize("force", [None, (0.0, 0.2, -0.1)])
def test_the_same_bits_however_cut(force):
    robot = load_robot(ROOT / "config" / "three_tubes.yaml")
    axes = [np.array([0.0, 1.0]), np.array([0.5, 2.0]), np.array([-1.0, 3.0])]
    depths = [np.array([0.06]), np.array([0.14]), np.array([0.2, 0.24])]
    grid = Grid(robot, axes, depths, force)
    whole = every(robot, grid, chunk=16)
    for first, chunk in ((0, 1), (0, 5), (0, None), (7, 3), (15, 9)):
        part = every(robot, grid, first, chunk)
        assert part.numbers.tobytes() == whole.numbers[first:].tobytes()
        assert part.codes.tolist() == whole.codes[first:].tolist()


def test_other_processes_give_the_same_bits(seed_robot):
    """Any executor will do: here one whose processes know nothing but what is sent to them."""
    grid = Grid(seed_robot, ANGLES, BASES)
    with ProcessPoolExecutor(2, multiprocessing.get_context("spawn")) as pool:
        rows = joined(grid.layout, list(sweep(EquilibriumSolver(seed_robot), grid, chunk=3, workers=pool)))
    here = every(seed_robot, grid)
    assert rows.numbers.tobytes() == here.numbers.tobytes() and rows.codes.tolist() == here.codes.tolist()


class LateFirst(Executor):
    """Answers what was handed in last before the rest; notes how much was under way."""

    def __init__(self):
        self.waiting, self.most, self.cancelled = [], 0, 0

    def submit(self, fn, /, *args, **kwargs):
        future = Future()
        future.add_done_callback(lambda done: setattr(self, "cancelled", self.cancelled + done.cancelled()))
        self.waiting.append((future, lambda: fn(*args, **kwargs)))
        self.most = max(self.most, len(self.waiting))
        if len(self.waiting) == 1:
            threading.Timer(0.05, self.answer).start()
        return future

    def answer(self):
        while self.waiting:
            future, work = self.waiting.pop()
            if future.set_running_or_notify_cancel():
                future.set_result(work())


def test_rows_keep_their_order_whoever_is_first_and_few_are_under_way(seed_robot, monkeypatch):
    monkeypatch.setattr(module, "AHEAD", 4)
    monkeypatch.setattr(module, "LOOK", 0.01)
    pool, grid = LateFirst(), Grid(seed_robot, ANGLES, BASES)
    parts = list(sweep(EquilibriumSolver(seed_robot), grid, chunk=2, workers=pool))
    assert joined(grid.layout, parts).numbers.tobytes() == every(seed_robot, grid).numbers.tobytes()
    assert 1 < pool.most <= 4
    assert min(map(len, parts)) == 0  # nothing came for a while, and whoever waits was told


def test_what_nobody_waits_for_any_more_is_given_up(seed_robot, monkeypatch):
    monkeypatch.setattr(module, "LOOK", 0.01)
    pool, grid = LateFirst(), Grid(seed_robot, ANGLES, BASES)
    rows = sweep(EquilibriumSolver(seed_robot), grid, chunk=1, workers=pool)
    assert sum(len(part) for part in itertools.islice((part for part in rows if len(part)), 3)) == 3
    rows.close()
    assert all(future.cancelled() or future.done() for future, _ in pool.waiting)


def test_each_row_has_its_own_force(seed_robot):
    table = np.array([[0.0, 1.0, 0.0935, 0.1705, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0935, 0.1705, 0.0, 0.4, -0.2]])
    rows = every(seed_robot, Listed(seed_robot, table, True))
    solver = EquilibriumSolver(seed_robot)
    for row, force in enumerate(((0.0, 0.0, 0.0), (0.0, 0.4, -0.2))):
        answer = solver.solve([0.0, 1.0], [0.0935, 0.1705], "cold", loads=Loads(tip_force=force))
        assert rows["tip_force"][row].tolist() == list(force)
        assert rows["tip_position"][row] == pytest.approx(answer.tip.position, abs=1e-9)
        assert rows["force"][row] == pytest.approx(answer.force, abs=1e-6)
    assert np.linalg.norm(np.diff(rows["tip_position"], axis=0)) > 1e-3


def test_names_and_groups_of_columns():
    plain, loaded = (Layout(["outer", "inner"], with_force) for with_force in (False, True))
    assert plain.names[:4] == loaded.names[:4] == ("alpha_outer", "alpha_inner", "D_outer", "D_inner")
    assert loaded.names[4:7] == ("tip_force_x", "tip_force_y", "tip_force_z") and "tip_force" not in plain.groups
    assert len(plain.names) + 3 == len(loaded.names) == 19
    for layout in (plain, loaded):
        columns = [column for part in layout.groups.values() for column in range(part.start, part.stop)]
        assert columns == list(range(len(layout.names)))
    assert STATUSES[:-1] == tuple(status.value for status in Status)
