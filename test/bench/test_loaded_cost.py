"""The benches of loads at tiny size: no time is asserted, only what they judge and what their tables hold."""

from __future__ import annotations

import numpy as np
import pytest

from bench.accuracy import loaded_effectivity
from bench.common.places import LOADS
from bench.common.scenes import PARTIAL_OVERLAP
from bench.common.scenes import SEED
from bench.loaded.fold_methods import FoldJudge
from bench.loaded.fold_methods import Found
from bench.loaded.fold_methods import Newton
from bench.loaded.where_methods_fail import FOLD
from bench.loaded.where_methods_fail import FORCE
from bench.loads import loaded_cost
from bench.loads.rivals import RIVALS
from bench.loads.snap_map import KNOWN
from bench.loads.snap_map import load_fold
from bench.loads.strokes import Served
from bench.loads.strokes import serve_in_turn
from bench.loads.strokes import strokes
from bench.stability.judges import Kind
from bench.stability.judges import Outcome
from bench.stability.judges import Tracker

#: What the scripts write of docs/loads.md.
TABLES = (
    "loaded folds",
    "loaded sensing",
    "loaded machine",
    "loaded tolerance",
    "loaded steps",
    "loaded parts",
    "loaded tubes",
    "loaded batch",
    "loaded rivals",
    "loaded effectivity",
    "loaded failures",
)


@pytest.fixture(scope="module")
def judge() -> FoldJudge:
    """Of commands around the fold, and one far before it."""
    angles = np.radians([0.0, 20.0, FOLD - 1.0, FOLD + 1.0])
    return FoldJudge(SEED, PARTIAL_OVERLAP, FORCE, np.column_stack([np.zeros(4), angles]))


def test_the_document_has_a_place_for_every_table():
    text = LOADS.read_text(encoding="utf-8")
    for name in TABLES:
        assert f"<!-- {name} -->\n" in text and f"<!-- end {name} -->" in text


def test_a_scene_is_judged_right_by_two_models_that_agree():
    verdict = loaded_effectivity.judge(0)
    assert verdict.answered and verdict.within and verdict.told
    assert verdict.apart <= loaded_effectivity.AGREEMENT
    assert loaded_effectivity.exceptions([verdict]) == "No exception."


def test_exceptions_are_listed_with_their_cause():
    def verdict(seed: int, error: float, estimate: float, apart: float) -> loaded_effectivity.Verdict:
        return loaded_effectivity.Verdict(seed, 2, "ok", 0, 1e-6, 9, error, estimate, apart, 1.0)

    listed = loaded_effectivity.exceptions(
        [
            verdict(1, 1e-8, 1e-7, 1e-15),
            verdict(2, 2e-6, 3e-6, 1e-15),
            verdict(3, 1e-7, 1e-8, 1e-15),
            verdict(4, 1e-7, 1e-8, 1e-7),
            loaded_effectivity.Verdict(5, 3, "no_stable_equilibrium", 0, 1e-6),
        ]
    )
    rows = {line.split(" | ")[0].strip("| "): line for line in listed.splitlines()[2:5]}
    assert sorted(rows) == ["2", "3", "4"]
    assert "degrees chosen too low" in rows["2"] and "estimate is too small" in rows["3"] and "judges" in rows["4"]
    assert "`no_stable_equilibrium` 1" in listed


def test_strokes_go_back_and_forth_and_slide():
    every = strokes()
    for stroke in every.values():
        angles = [np.degrees(alpha[-1]) for alpha, _ in stroke.commands(500)]
        assert np.abs(np.diff(angles)) == pytest.approx(1.0)
        assert min(angles) >= stroke.low - 1e-9 and max(angles) <= stroke.high + 1e-9
    still = loaded_cost.replace(every["Fig. 4, partial overlap"], sliding=True)
    depths = np.array([D for _, D in still.commands(5)])
    assert np.diff(depths[:, 1]) == pytest.approx(-1e-5) and np.ptp(depths[:, 0]) == 0.0


def test_served_steps_are_judged():
    served = Served(strokes()["Fig. 4, partial overlap"], 1e-5)
    serve_in_turn([served], 2, judged=True)
    assert len(served.errors) == 3 and len(served.watch.seconds) == 2
    assert 0.0 < max(served.errors) <= max(served.estimates) <= 1e-5


def test_the_rivals_table_says_what_was_measured_elsewhere():
    told = loaded_cost.rivals_table(loaded_cost.rival_rows(), {})
    assert told.count("another machine") == len(RIVALS) and loaded_cost.HERE not in told


@pytest.mark.soak  # interpreted, a minute
def test_a_fold_by_load_is_the_known_one():
    known = next(fold for fold in KNOWN if not fold.turned)
    assert load_fold(np.radians(known.alpha), known.D, known.force) == pytest.approx(known.value, abs=1e-6)


def test_the_judges_branch_ends_at_the_known_fold(judge):
    assert judge.alive(0, 2) and not judge.alive(0, 3)


def test_a_method_is_judged_by_the_state_next_to_its_answer(judge):
    method, tracker = Newton(judge, True), Tracker(judge)
    method.last = np.array(judge.state(0, 0).x)
    answer = method.solve(judge.commands[1])
    assert tracker.outcome(answer, 1) is Outcome.RIGHT
    assert judge.locate(Found(None), 1) is Kind.NOTHING
