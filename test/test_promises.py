"""Promises of the package as a whole that no single module keeps; docs/reliability.md lists the tests of the others."""

import ast
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from random_robots import random_D
from random_robots import random_robot

from ctr_pvs import EquilibriumSolver
from ctr_pvs import Status

ROOT = Path(__file__).parents[1]
TOLERANCE = 1e-6  # m
LARGEST_RESIDUAL = 1e-9  # N m
MEMORY_GROWTH = 5.0  # MB
WITHOUT_ROS = "import sys; sys.modules['rclpy'] = None; import pytest; sys.exit(pytest.main(sys.argv[1:]))"


def walk(seed, commands=6):
    """The answers to random commands of one random robot, one after the other."""
    rng = np.random.default_rng([seed, 71])
    robot = random_robot(rng, 2 + seed % 2, strength=4.0)
    solver = EquilibriumSolver(robot, TOLERANCE)
    for _ in range(commands):
        yield solver.solve(rng.uniform(-4.0, 4.0, robot.n_tubes), random_D(rng, robot))


def test_no_answer_is_unstable_out_of_balance_or_silently_on_another_branch():
    """Random walks with strong coupling, through folds: what is called good is good, and a snap is told in full."""
    snaps = 0
    for answer in (answer for seed in range(6) for answer in walk(seed)):
        assert answer.success == (answer.status in (Status.OK, Status.SNAP))
        assert (answer.status is Status.SNAP) <= bool(answer.snaps)
        if answer.success:
            assert answer.stability_margin > 0.0
            assert answer.residual < LARGEST_RESIDUAL
            assert answer.error_estimate <= TOLERANCE
        snaps += len(answer.snaps)
        for snap in answer.snaps:
            assert 0.0 <= snap.t <= 1.0 and snap.energy_released > 0.0
            assert snap.before is not None and snap.after is not None
    assert snaps > 3


def imported_by(path):
    """The top packages that a module imports anywhere in it."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name.partition(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            yield node.module.partition(".")[0]


def test_the_solver_and_its_tests_import_nothing_of_ros():
    allowed = {
        *sys.stdlib_module_names,
        "numpy",
        "scipy",
        "yaml",
        "matplotlib",
        "pytest",
        "numba",
        "llvmlite",
        "pyarrow",  # where it is there: Parquet
        "viser",  # the live page
        "distributed",  # clusters
        "ctr_pvs",
    }
    for path in (ROOT / "ctr_pvs").rglob("*.py"):
        assert set(imported_by(path)) <= allowed, path.name
    of_the_node = {ROOT / "test" / "node", ROOT / "test" / "ros"}
    for path in (ROOT / "test").rglob("*.py"):
        if path.parent in of_the_node:
            continue
        assert not {"rclpy", "ctr_pvs_ros", "ctr_pvs_interfaces"} & set(imported_by(path)), path.name


def test_without_ros_the_node_tests_are_skipped_and_say_so():
    command = [sys.executable, "-c", WITHOUT_ROS, "-rs", "-p", "no:cacheprovider", ROOT / "test" / "ros"]
    run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=60.0)
    assert "ROS 2 with ctr_pvs_interfaces is not sourced: no node tests" in run.stdout, run.stdout + run.stderr
    assert "failed" not in run.stdout and "error" not in run.stdout
    assert " passed" not in run.stdout


def test_the_readme_says_what_the_package_is_not():
    text = " ".join((ROOT / "README.md").read_text(encoding="utf-8").split())
    for words in ("Deadlines are soft", "not a medical device", "not a safety function", "no friction"):
        assert words in text


def resident_memory():
    """RSS of this process [MB]."""
    lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmRSS:")) / 1024.0


@pytest.mark.soak
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="memory is read from /proc")
def test_a_hundred_thousand_solves_take_no_memory(seed_robot):
    """Rotation and sliding together, with all outputs; after the tables that stay are filled."""
    solver = EquilibriumSolver(seed_robot)
    warm = 0.0
    for count in range(110_000):
        t = 0.005 * count
        alpha = [0.5 * np.sin(0.7 * t), 1.5 * np.sin(1.4 * t)]
        D = [0.09 + 0.02 * np.sin(0.3 * t), 0.21 + 0.03 * np.sin(0.45 * t)]
        answer = solver.solve(alpha, D)
        assert answer.success and len(answer.backbone(20)) == 20 and answer.force.shape == (2,)
        if count == 10_000:
            warm = resident_memory()
    growth = resident_memory() - warm
    print(f"memory grew by {growth:+.2f} MB from {warm:.1f} MB over 100000 solves")
    assert growth < MEMORY_GROWTH
