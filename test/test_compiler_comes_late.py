"""Who asks for help, or names a wrong robot file, does not wait for the compiler to be imported."""

import subprocess
import sys
from pathlib import Path

import pytest

import ctr_pvs

ROOT = Path(__file__).parents[1]
PROGRAM = """
import sys
{what}
print(sorted(name for name in sys.modules if name in ("numba", "llvmlite", "ctr_pvs.kernel")))
"""
COMMAND = """
from ctr_pvs.cli.main import main
try:
    code = main({words!r})
except SystemExit as end:
    code = end.code
assert code == {code}, code
"""


def imported_by(what):
    """What of the compiler a fresh interpreter has imported after these lines; the last line of its output."""
    process = subprocess.run(
        [sys.executable, "-c", PROGRAM.format(what=what)], capture_output=True, text=True, cwd=ROOT, check=False
    )
    assert process.returncode == 0, process.stderr
    return process.stdout.splitlines()[-1]


@pytest.mark.parametrize(
    ("words", "code"),
    [
        (["--help"], 0),
        (["solve", "--help"], 0),
        (["stability", "--help"], 0),
        (["reproduce", "--help"], 0),
        (["reach", "--help"], 0),
        (["follow", "--help"], 0),
        (["solve"], 2),
        (["nothing"], 2),
        (["solve", "/nowhere/robot.yaml", "--alpha", "0", "--D", "0"], 2),
        (["stability", "/nowhere/robot.yaml", "--D", "0"], 2),
        (["reach", "/nowhere/robot.yaml", "--position", "0.1", "0", "0"], 2),
        (["follow", "renda2021", "--points", "/nowhere/points.csv"], 2),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else None,
)
def test_words_that_need_no_solver_do_without(words, code):
    assert imported_by(COMMAND.format(words=words, code=code)) == "[]"


def test_reading_a_robot_file_does_without():
    assert imported_by("import ctr_pvs\nctr_pvs.load_robot('config/renda2021.yaml')") == "[]"


def test_asking_for_the_solver_brings_it():
    assert "ctr_pvs.kernel" in imported_by("from ctr_pvs import EquilibriumSolver")


def test_all_public_names_are_there():
    for name in ctr_pvs.__all__:
        assert getattr(ctr_pvs, name).__name__ == name
        assert name in dir(ctr_pvs)
    with pytest.raises(AttributeError, match="no attribute 'Solver'"):
        _ = ctr_pvs.Solver
