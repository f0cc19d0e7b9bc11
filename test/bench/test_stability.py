"""The failure chart, on a few robots: this solver is never silently wrong, and the judge does catch others."""

from __future__ import annotations

import csv
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from run_scripts import run

from bench.stability import rows
from bench.stability.judges import FineJudge
from bench.stability.judges import Outcome
from bench.stability.judges import Tracker
from bench.stability.methods import METHODS
from bench.stability.methods import THIS_SOLVER
from bench.stability.robots_that_snap import three_tubes

SILENT = ("silent wrong branch", "silent unstable", "not an equilibrium")


@pytest.fixture(scope="module")
def chart(tmp_path_factory) -> list[dict[str, str]]:
    folder = tmp_path_factory.mktemp("chart")
    run("stability.where_methods_fail", "--quick", "--output", str(folder))
    with (folder / "where_methods_fail.csv").open() as stream:
        return list(csv.DictReader(stream))


def count(rows: list[dict[str, str]], *outcomes: str) -> int:
    return sum(int(row[outcome]) for row in rows for outcome in outcomes)


@pytest.mark.soak
def test_this_solver_is_never_silently_wrong(chart):
    own = [row for row in chart if row["method"] == "this solver"]
    assert {row["start"] for row in own} == {"warm", "cold before the fold", "cold past the fold"}
    assert count(own, *SILENT, "flagged snap, no fold", "reported failure") == 0
    assert count(own, "right branch") > 60 and count(own, "flagged snap") > 2


@pytest.mark.soak
def test_the_judge_catches_general_methods(chart):
    """lambda = 5, b = 0, the easiest pair to fail at: each kind of silent failure is seen, and no warm method passes
    the fold without at least a reported failure."""
    others = [row for row in chart if row["method"] != "this solver" and row["lambda"] == "5.0" and row["b"] == "0.0"]
    assert all(count(others, outcome) > 0 for outcome in SILENT)
    assert all(row["worst"] not in ("right branch", "flagged snap") for row in others)


@pytest.mark.soak
def test_without_a_fold_every_warm_sweep_is_right(chart):
    """lambda = 2, b = 0 cannot snap: here even the judge has nothing to say against the others."""
    free = [row for row in chart if row["start"] == "warm" and row["lambda"] == "2.0"]
    assert len(free) == 7 and all(row["worst"] == "right branch" for row in free)


def test_a_short_sweep_of_a_pair_that_cannot_snap():
    found = list(rows.two_tube_rows([(2.0, 0.0)], 4))
    assert all(row.worst is Outcome.RIGHT for row in found)
    assert {row.method for row in found} == set(METHODS)
    assert rows.summary(found).count("\n") == 1 + len(METHODS)


def test_the_finer_judge_follows_three_tubes_and_knows_their_states():
    robot, D, direction = three_tubes(np.random.default_rng([0, 3]))
    judge = FineJudge(robot, D, np.linspace(0.0, 0.4, 3)[:, None] * direction)
    tracker = Tracker(judge)
    for make in (METHODS["Newton"], METHODS[THIS_SOLVER]):
        method = make(robot, D, True)
        assert all(tracker.outcome(method.solve(judge.commands[k]), k) is Outcome.RIGHT for k in range(3))
    assert judge.alive(0, 2)


def test_the_chart_is_drawn(tmp_path):
    pytest.importorskip("matplotlib")
    from bench.stability.chart import draw_pairs
    from bench.stability.chart import draw_robots

    pairs = [rows.Row("pair", 2.0, 0.5, "warm", name, Counter({Outcome.RIGHT: 3})) for name in METHODS]
    draw_pairs(pairs, tmp_path / "pairs.png")
    draw_robots([replace(row, robot="three 0") for row in pairs], tmp_path / "three.png")
    rows.save(pairs, tmp_path / "rows.csv")
    assert rows.load(tmp_path / "rows.csv") == pairs
    assert len(list(tmp_path.iterdir())) == 3
