"""examples/simulated_pipeline.py: on simulated time, in lock step, and the same file whenever it runs."""

import csv
import importlib.util
import math
import subprocess
import sys
from pathlib import Path

import pytest

from ctr_pvs import EquilibriumSolver
from ctr_pvs_interfaces.msg import EquilibriumStatus
from ctr_pvs_ros.client.status_client import Told

EXAMPLE = Path(__file__).parents[2] / "examples" / "simulated_pipeline.py"
STEPS = 12
TIMEOUT = 100.0  # s


def run(output, *words):
    """The example in a graph of its own."""
    command = [sys.executable, EXAMPLE, "--output", output, "--steps", str(STEPS), *words]
    return subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT)


@pytest.fixture(scope="module")
def first(graph, tmp_path_factory):
    output = tmp_path_factory.mktemp("pipeline") / "first.csv"
    return run(output), output


@pytest.fixture(scope="module")
def rows(first):
    with first[1].open(encoding="utf-8") as file:
        return [{name: float(value) for name, value in row.items()} for row in csv.DictReader(file)]


def test_every_command_has_its_answer_and_the_stamp_is_simulated(first, rows):
    outcome, output = first
    assert outcome.returncode == 0, outcome.stderr
    assert [row["time_s"] for row in rows] == pytest.approx([100.0 + 0.1 * step for step in range(STEPS + 1)], abs=1e-9)
    assert f"{STEPS + 1} commands, {STEPS + 1} answers; 1.20 s of simulated time in " in outcome.stdout
    assert f"smallest snap reserve {min(row['snap_reserve'] for row in rows):.4f}" in outcome.stdout
    assert outcome.stdout.endswith(f"written to {output}\n")


def test_it_inserts_and_turns(rows):
    first, last = rows[0], rows[-1]
    assert (first["outer_translation"], last["outer_translation"]) == (0.14, 0.0935)
    assert (first["inner_translation"], last["inner_translation"]) == (0.24, 0.2085)
    assert (first["inner_rotation"], last["inner_rotation"]) == (0.0, math.radians(100.0))


def test_tips_and_reserves_are_the_solvers(rows, seed_robot):
    solver = EquilibriumSolver(seed_robot, tolerance=1e-7)
    for row in rows[:: STEPS // 3]:
        alpha, D = ([row[f"{tube}_{kind}"] for tube in ("outer", "inner")] for kind in ("rotation", "translation"))
        expected = solver.solve(alpha, D)
        assert [row[f"tip_{axis}_m"] for axis in "xyz"] == pytest.approx(expected.tip.position, abs=1e-5)
        assert row["stability_margin"] == pytest.approx(expected.stability_margin, abs=1e-3)
        assert row["snap_reserve"] == pytest.approx(expected.snap_reserve, abs=1e-3)


def test_a_second_run_writes_the_same_file(first, tmp_path):
    assert run(tmp_path / "again.csv").returncode == 0
    assert (tmp_path / "again.csv").read_bytes() == first[1].read_bytes()


def test_what_is_refused_is_no_row():
    spec = importlib.util.spec_from_file_location("simulated_pipeline", EXAMPLE)
    example = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(example)
    status = EquilibriumStatus(outcome=EquilibriumStatus.REFUSED, reason="out_of_limits", message="too far")
    with pytest.raises(example.Refused, match="out_of_limits: too far"):
        example.row(Told(status, None, None))
