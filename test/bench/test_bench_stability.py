"""The failure chart, on a few robots: this solver is never silently wrong, and the judge does catch others."""

from __future__ import annotations

import csv
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SILENT = ("silent wrong branch", "silent unstable", "not an equilibrium")


@pytest.fixture(scope="module")
def rows(tmp_path_factory) -> list[dict[str, str]]:
    folder = tmp_path_factory.mktemp("chart")
    path = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH")]))
    command = [sys.executable, str(ROOT / "bench" / "where_methods_fail.py"), "--quick", "--output", str(folder)]
    done = subprocess.run(command, env={**os.environ, "PYTHONPATH": path}, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    with (folder / "where_methods_fail.csv").open() as stream:
        return list(csv.DictReader(stream))


def count(rows: list[dict[str, str]], *outcomes: str) -> int:
    return sum(int(row[outcome]) for row in rows for outcome in outcomes)


def test_this_solver_is_never_silently_wrong(rows):
    own = [row for row in rows if row["method"] == "this solver"]
    assert {row["start"] for row in own} == {"warm", "cold before the fold", "cold past the fold"}
    assert count(own, *SILENT, "flagged snap, no fold", "reported failure") == 0
    assert count(own, "right branch") > 60 and count(own, "flagged snap") > 2


def test_the_judge_catches_general_methods(rows):
    """lambda = 5, b = 0, the easiest pair to fail at: each kind of silent failure is seen, and no warm method passes
    the fold without at least a reported failure."""
    others = [row for row in rows if row["method"] != "this solver" and row["lambda"] == "5.0" and row["b"] == "0.0"]
    assert all(count(others, outcome) > 0 for outcome in SILENT)
    assert all(row["worst"] not in ("right branch", "flagged snap") for row in others)


def test_without_a_fold_every_warm_sweep_is_right(rows):
    """lambda = 2, b = 0 cannot snap: here even the judge has nothing to say against the others."""
    free = [row for row in rows if row["start"] == "warm" and row["lambda"] == "2.0"]
    assert len(free) == 7 and all(row["worst"] == "right branch" for row in free)
