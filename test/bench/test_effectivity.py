"""fidelity="auto" keeps its tolerance, and its error estimate is one, on random scenes (all 2,000 of them: bench/)."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "bench"))

import effectivity


@pytest.mark.parametrize("first", [0, 50])
def test_errors_stay_below_estimate_and_tolerance(first):
    verdicts = [effectivity.judge(seed) for seed in range(first, first + 50)]
    assert all(verdict is not None for verdict in verdicts)
    assert all(verdict.error <= min(verdict.tolerance, verdict.estimate) for verdict in verdicts)
    levels = {verdict.fidelity for verdict in verdicts}
    unknowns = [verdict.unknowns for verdict in verdicts]
    assert "torsion" in levels and len(set(unknowns)) > 5  # not one model for all


def test_a_tighter_tolerance_brings_more_unknowns_and_less_error():
    robot, alpha, D, _ = effectivity.random_scene(7)
    unknowns, errors = [], []
    for tolerance in (1e-3, 1e-5, 1e-7, 1e-9):
        answer = effectivity.EquilibriumSolver(robot, tolerance).solve(alpha, D)
        unknowns.append(answer.degrees_of_freedom)
        errors.append(np.linalg.norm(answer.tip.position - effectivity.true_tip(answer)))
    assert unknowns == sorted(unknowns) and unknowns[0] < unknowns[-1]
    assert errors[0] > errors[-1] and errors[-1] < 1e-9
