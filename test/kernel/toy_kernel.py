"""A toy: the machinery under test around two small kernels, as a package of the same name in a folder of its own.

What runs it is always another process: in this one the package is the real one.
"""

from __future__ import annotations

import importlib.util
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

KERNEL = Path(__file__).resolve().parents[2] / "ctr_pvs" / "kernel"

INNER = """
from ctr_pvs.kernel.compiler import compiled

@compiled
def term(x):
    return 2.0 * x

@compiled
def total(x):
    sum = 0.0
    for i in range(x.shape[0]):
        sum += term(x[i])
    return sum
"""

ENTRIES = """
import math
from ctr_pvs.kernel.compiler import entry_point
from ctr_pvs.kernel.inner import total as added

@entry_point("float64(float64[::1])")
def add(x):
    return added(x)

@entry_point("int64(float64[::1], float64[::1], int64)")
def wander(x, out, steps):
    for i in range(x.shape[0]):
        out[i] = x[i]
        for k in range(steps):
            out[i] = math.sin(out[i] + 0.1 * k) / (1.0 + out[i] * out[i]) + 0.5 * x[i]
    return steps
"""

#: So many branches that compiling takes long enough to be interrupted.
SLOW = "".join(
    f"""
@entry_point("float64(float64[::1])")
def slow{n}(x):
    s = {n}.0
"""
    + "".join(
        f"    if x[{k}] > s:\n        for i in range(x.shape[0]):\n            s += math.sin(x[i] * {k}.0) * x[{k}]\n"
        for k in range(150)
    )
    + "    return s\n"
    for n in (1, 2)
)

needs_numba = pytest.mark.skipif(importlib.util.find_spec("numba") is None, reason="Numba is not installed")

#: One line: what runs, and the sum of 0, 1, 2 doubled.
ADD = "print(compiler.mode(), entries.add(np.arange(3.0)))\n"
INTERPRETED, COMPILED = ["interpreted 6.0"], ["compiled 6.0"]
WHY = "print(compiler.why())\n"
SLOWER = "kernels run interpreted, slower, with the same numbers"
AT_ONCE = 2.0  # s, for what ends when it is told to


class Toy:
    """The package in ``folder``/code and the environment of its processes, with a cache folder of their own."""

    def __init__(self, folder: Path, entries: str = ENTRIES) -> None:
        self.folder, self.code, self.cache = folder, folder / "code", folder / "cache"
        kernel = self.code / "ctr_pvs" / "kernel"
        ignored = shutil.ignore_patterns("__pycache__")
        kernel.mkdir(parents=True)
        (self.code / "ctr_pvs" / "__init__.py").touch()
        # Numba looks for linear algebra in scipy; without it every process of these tests is a third quicker.
        (self.code / "scipy.py").write_text("raise ImportError")
        shutil.copytree(KERNEL / "compiler", kernel / "compiler", ignore=ignored)
        for name in ("__init__.py", "__main__.py"):
            shutil.copy(KERNEL / name, kernel / name)
        (kernel / "inner.py").write_text(INNER)
        (kernel / "entries.py").write_text(entries)
        (kernel / "outputs.py").touch()  # the toy has all it has in one file
        self.kernel = kernel
        kept = {name: value for name, value in os.environ.items() if not name.startswith(("NUMBA_", "PYTHON"))}
        self.environment = {
            **kept,
            "PYTHONPATH": str(self.code),
            "PYTHONDONTWRITEBYTECODE": "1",  # edits within a second must be seen
            "OPENBLAS_NUM_THREADS": "1",
            "XDG_CACHE_HOME": str(self.cache),
        }

    def start(self, *words: str, **environment: str | None) -> subprocess.Popen[str]:
        """Start Python with ``words``; a variable given as None is not set."""
        varied = {**self.environment, **environment}
        given = {name: value for name, value in varied.items() if value is not None}
        pipe = subprocess.PIPE
        return subprocess.Popen(
            [sys.executable, *words], env=given, cwd=self.folder, stdout=pipe, stderr=pipe, stdin=pipe, text=True
        )

    def run(self, *words: str, code: int = 0, **environment: str | None) -> str:
        """Standard output of Python with ``words``, which ends with ``code``."""
        process = self.start(*words, **environment)
        out, err = process.communicate(timeout=60)
        assert process.returncode == code, out + err
        return out

    def compile(self, *words: str, code: int = 0, **environment: str | None) -> str:
        """What ``python -m ctr_pvs.kernel`` says at the end."""
        return self.run("-m", "ctr_pvs.kernel", *words, code=code, **environment)

    def say(self, program: str, **environment: str | None) -> list[str]:
        """Lines that ``program`` prints, warnings being errors; the names below are imported for it."""
        imports = "import numpy as np\nfrom ctr_pvs.kernel import compiler, entries\n"
        return self.run("-W", "error", "-c", imports + program, **environment).splitlines()


def folders(toy: Toy) -> list[Path]:
    """What lies in the cache, the lock left out."""
    return [path for path in (toy.cache / "ctr_pvs").glob("*") if path.is_dir()]


def processes(toy: Toy) -> list[int]:
    """Processes that run code of ``toy``, by the path they look for modules on."""
    found = []
    for process in Path("/proc").glob("[0-9]*"):
        try:
            if str(toy.code).encode() in (process / "environ").read_bytes():
                found.append(int(process.name))
        except OSError:
            continue  # ended meanwhile
    return found


def wait_for(condition: Callable[[], bool], seconds: float, what: str) -> None:
    """Fails with ``what`` where the condition is not met in time."""
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, what
        time.sleep(0.02)
