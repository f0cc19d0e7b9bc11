"""Kernels compiled with every index checked: none reads or writes beside its arrays."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from toy_kernel import Toy
from toy_kernel import needs_numba

ROOT = Path(__file__).resolve().parents[2]
#: Tests that go through every kernel: all kinds of elements, paths, snaps, loads, outputs, batches.
FOLDERS = ("test/solve", "test/answer", "test/tasks", "test/oracles")
CHECKED = {"NUMBA_BOUNDSCHECK": "1"}
LIMIT = 3600.0  # s


@needs_numba
def test_an_index_beside_its_array_is_an_error_where_bounds_are_checked(tmp_path):
    """What the long test below relies on."""
    toy = Toy(tmp_path)
    toy.compile(**CHECKED)
    program = """
assert compiler.mode() == "compiled"
try:
    entries.wander(np.ones(3), np.empty(2), 1)
except IndexError as error:
    print(error)
"""
    assert toy.say(program, **CHECKED) == ["index is out of bounds"]


@needs_numba
@pytest.mark.soak
def test_no_kernel_looks_beside_its_arrays(tmp_path):
    kept = {name: value for name, value in os.environ.items() if not name.startswith("NUMBA_")}
    environment = {**kept, **CHECKED, "XDG_CACHE_HOME": str(tmp_path)}

    def run(*words: str) -> str:
        done = subprocess.run(
            [sys.executable, *words], cwd=ROOT, env=environment, capture_output=True, text=True, timeout=LIMIT
        )
        assert done.returncode == 0, done.stdout[-4000:] + done.stderr
        return done.stdout

    run("-m", "ctr_pvs.kernel")
    program = "from ctr_pvs.kernel import compiler; from ctr_pvs.kernel import entries; print(compiler.mode())"
    assert run("-c", program) == "compiled\n"
    told = run("-m", "pytest", "-q", "-m", "not soak and not alone", *FOLDERS)
    assert " passed" in told.splitlines()[-1]
