"""The installed package is whole: it solves from a folder that knows nothing of the checkout."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("setuptools")

ROOT = Path(__file__).resolve().parents[1]

SOLVE = """
import ctr_pvs
from ctr_pvs import EquilibriumSolver, load_robot
answer = EquilibriumSolver(load_robot(r"{robot}"), 1e-6).solve([0.0, 1.0], [0.0935, 0.2085])
assert answer.success, answer.message
print(ctr_pvs.__file__, len(answer.backbone(5)))
"""


def test_it_solves_from_where_it_is_installed(tmp_path):
    source, site = tmp_path / "source", tmp_path / "site"
    # From a copy: setuptools leaves a build folder where it works.
    shutil.copytree(ROOT, source, ignore=shutil.ignore_patterns(".*", "build", "install", "log", "__pycache__"))
    build = [sys.executable, "setup.py", "-q", "build", "--build-lib", site]
    subprocess.run(build, cwd=source, check=True, capture_output=True, timeout=120.0)
    script = SOLVE.format(robot=ROOT / "config" / "renda2021.yaml")
    environment = {"PYTHONPATH": str(site), "NUMBA_DISABLE_JIT": "1", "PATH": "/usr/bin:/bin"}
    run = subprocess.run(
        [sys.executable, "-c", script], cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=60.0
    )
    assert run.returncode == 0, run.stderr
    assert str(site) in run.stdout and run.stdout.strip().endswith("5")
