"""fidelity="auto" keeps its tolerance, and its error estimate is one, on random scenes (all 2,000 of them: bench/)."""

from __future__ import annotations

import numpy as np
import pytest

from bench.accuracy import effectivity

#: Scenes whose cold starts meet no fold.
QUICK = (0, 2, 3, 4)


def check(seeds) -> list[effectivity.Verdict]:
    verdicts = [effectivity.judge(seed) for seed in seeds]
    assert all(verdict is not None for verdict in verdicts)
    assert all(verdict.error <= min(verdict.tolerance, verdict.estimate) for verdict in verdicts)
    assert all(verdict.apart <= effectivity.AGREEMENT for verdict in verdicts)
    return verdicts


def test_errors_stay_below_estimate_and_tolerance():
    verdicts = check(QUICK)
    assert "100.00 %" in effectivity.summary(verdicts)


@pytest.mark.soak
@pytest.mark.parametrize("first", [0, 50])
def test_errors_stay_below_estimate_and_tolerance_in_a_hundred_scenes(first):
    verdicts = check(range(first, first + 50))
    levels = {verdict.fidelity for verdict in verdicts}
    unknowns = [verdict.unknowns for verdict in verdicts]
    assert "torsion" in levels and len(set(unknowns)) > 5  # not one model for all


def test_a_tighter_tolerance_brings_more_unknowns_and_less_error():
    robot, alpha, D, _ = effectivity.random_scene(7)
    unknowns, errors = [], []
    for tolerance in (1e-3, 1e-5, 1e-7, 1e-9):
        answer = effectivity.EquilibriumSolver(robot, tolerance).solve(alpha, D)
        unknowns.append(answer.degrees_of_freedom)
        errors.append(np.linalg.norm(answer.tip.position - effectivity.true_tips(robot, answer)[0]))
    assert unknowns == sorted(unknowns) and unknowns[0] < unknowns[-1]
    assert errors[0] > errors[-1] and errors[-1] < 1e-9
