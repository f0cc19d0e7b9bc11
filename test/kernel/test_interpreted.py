"""Interpreted and compiled kernels give the same numbers; and what has no compiler is still an answer."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from random_robots import random_D
from random_robots import random_robot

from ctr_pvs import EquilibriumSolver
from ctr_pvs.kernel import compiler

HERE = Path(__file__).resolve()
ROOT = HERE.parents[2]
SCENES = 12


def told() -> list[dict[str, object]]:
    """What a dozen scenes give, one after the other, warm and cold: of all levels, with slides and snaps."""
    rows = []
    for seed in range(SCENES):
        rng = np.random.default_rng([seed, 53])
        robot = random_robot(rng, 1 + seed % 4, strength=2.0 if seed % 3 else 0.5)
        solver = EquilibriumSolver(robot, (1e-3, 1e-5, 1e-8)[seed % 3])
        D = random_D(rng, robot)
        for shift in (0.0, 1e-3):
            answer = solver.solve(rng.uniform(-2.0, 2.0, robot.n_tubes), np.maximum(D - shift, 0.0))
            row: dict[str, object] = {"status": answer.status.value, "fidelity": answer.fidelity}
            if answer.success:
                row |= {
                    "position": answer.tip.position.tolist(),
                    "backbone": answer.backbone(9).position.tolist(),
                    "orientation": answer.tip.orientation.tolist(),
                    "torque": answer.torque.tolist(),
                    "force": answer.force_interval.tolist(),
                    "jacobian": answer.jacobian.tolist(),
                    "margin": answer.stability_margin,
                    "degrees": answer.degrees_of_freedom,
                }
            rows.append(row)
    return rows


def interpreted(code: str) -> str:
    environment = os.environ | {"NUMBA_DISABLE_JIT": "1", "PYTHONPATH": f"{ROOT}:{ROOT / 'test'}:{HERE.parent}"}
    run = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, timeout=300.0, check=False
    )
    assert run.returncode == 0, run.stderr
    return run.stdout


@pytest.mark.skipif(compiler.mode() != "compiled", reason="the kernels are not compiled: python -m ctr_pvs.kernel")
def test_interpreted_and_compiled_kernels_give_the_same_numbers():
    code = "import json, test_interpreted as t; print(json.dumps([t.compiler.mode(), t.told()]))"
    mode, rows = json.loads(interpreted(code))
    assert mode == "interpreted"
    for slow, fast in zip(rows, told(), strict=True):
        assert slow.keys() == fast.keys()
        for name in ("status", "fidelity", "degrees"):
            assert slow.get(name) == fast.get(name)
        if slow["status"] not in ("ok", "snap"):
            continue
        for name in ("position", "backbone"):  # m
            assert np.array(slow[name]) == pytest.approx(np.array(fast[name]), abs=1e-12)
        for name in ("orientation", "torque", "force", "jacobian", "margin"):
            value = np.array(fast[name])
            assert np.array(slow[name]) == pytest.approx(value, abs=1e-10 * max(1.0, float(np.abs(value).max())))
