"""The speed benches at tiny size: what they compare is the same problem, and their files say what they should.

No time is asserted: machines differ.
"""

from __future__ import annotations

import csv
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "bench"))

import cost_growth  # noqa: E402
import serving_cost  # noqa: E402
import speed_accuracy  # noqa: E402
import speed_methods  # noqa: E402
from centreline import Centreline  # noqa: E402
from clock import Stopwatch  # noqa: E402
from clock import repeated  # noqa: E402
from clock import unit  # noqa: E402
from fixed_levels import Full  # noqa: E402
from nested_robots import nested  # noqa: E402
from nested_robots import segmented  # noqa: E402
from nested_robots import turned  # noqa: E402
from samples import Samples  # noqa: E402
from seeds_way import AsPrinted  # noqa: E402
from served import ASKED  # noqa: E402
from served import serve  # noqa: E402
from served import strokes  # noqa: E402
from speed_scenes import scenes  # noqa: E402

from ctr_pvs import EquilibriumSolver  # noqa: E402

COLUMNS = [
    "scene",
    "method",
    "setting",
    "start",
    "unknowns",
    "commands",
    "answered",
    "elsewhere",
    "time_us",
    "time_u",
    "error_median_m",
    "error_largest_m",
    "u_us",
]


def run(script: str, *arguments: str, **environment: str) -> str:
    path = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH")]))
    command = [sys.executable, str(ROOT / "bench" / script), *arguments]
    variables = {**os.environ, "PYTHONPATH": path, **environment}
    done = subprocess.run(command, env=variables, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def courses() -> dict[str, speed_accuracy.Course]:
    return {scene.name: speed_accuracy.Course(scene) for scene in scenes(1, 2)}


def measured(course: speed_accuracy.Course, family: str, setting: str, start: str) -> speed_accuracy.Row:
    make = speed_methods.METHODS[family][setting]
    return speed_accuracy.measure(course, family, setting, make, start, budget=1e-3)


def test_the_converged_tips_are_those_of_the_boundary_value_model(courses):
    for course in courses.values():
        assert course.confirm() < speed_accuracy.AGREEMENT


@pytest.mark.parametrize("start", ["warm", "cold"])
@pytest.mark.parametrize("setting", speed_methods.METHODS["auto"])
def test_auto_keeps_its_tolerance(courses, setting, start):
    for course in courses.values():
        row = measured(course, "auto", setting, start)
        assert row.right == row.answered == row.commands > 1
        assert row.error_largest_m <= float(setting)


@pytest.mark.parametrize(
    ("family", "setting", "largest"),
    [("torsion", "6", 1e-9), ("full", "3", 1e-6), ("solve_bvp", "1e-06", 1e-6), ("shooting", "1e-08", 1e-8)],
)
def test_every_family_reaches_the_same_tips(courses, family, setting, largest):
    for name in ("Fig. 4, partial overlap", "three tubes"):
        row = measured(courses[name], family, setting, "warm")
        assert row.right == row.commands and row.error_largest_m < largest


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_the_seeds_way_is_our_full_level_in_its_own_basis(degree):
    """Monomials, differences and hybr on one side, Legendre and Newton on the other: the same strains, the same tip."""
    for scene in (scenes(1, 2)[0], scenes(1, 2)[3]):
        seed, full = AsPrinted(scene.robot, scene.D, degree), Full(scene.robot, scene.D, degree)
        full.cold(np.zeros(len(scene.D)))
        for degrees in range(0, 61, 10):
            tips = [level.warm(scene.alpha(degrees)) for level in (seed, full)]
        assert np.linalg.norm(tips[0] - tips[1]) < 1e-9


def test_the_seeds_equations_as_printed_give_the_tabulated_tip():
    scene = scenes(1, 2)[1]
    seed = AsPrinted(scene.robot, scene.D)
    for degrees in range(0, 31, 10):
        seed.warm(scene.alpha(degrees))
    alpha = scene.alpha(31.0)
    printed = seed.printed(alpha)
    assert np.linalg.norm(printed - seed.warm(alpha)) < 1e-10


def test_the_centreline_of_the_bench_is_the_packages():
    for scene in scenes(1, 2):
        answer = EquilibriumSolver(scene.robot, 1e-9).solve(scene.alpha(40.0), scene.D)
        line = Centreline(scene.robot, scene.D)
        assert np.linalg.norm(line.tip(answer.shape.angles_at(line.s)) - answer.tip.position) < 1e-9


def test_speed_accuracy_writes_its_file(tmp_path):
    """All families on one scene, each with two settings but the one that has a single setting."""
    out = run("speed_accuracy.py", "--quick", "--output", str(tmp_path))
    assert "converged tip" in out
    with (tmp_path / "speed_accuracy.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert list(rows[0]) == COLUMNS
    settings = {(name, setting) for name, every in speed_methods.METHODS.items() for setting in every}
    assert {row["method"] for row in rows} == set(speed_methods.METHODS)
    assert {(row["method"], row["setting"]) for row in rows} <= settings
    assert {row["start"] for row in rows} == {"warm", "cold"} and len(rows) == 2 * (2 * len(speed_methods.METHODS) - 1)
    for row in rows:
        assert int(row["elsewhere"]) <= int(row["answered"]) <= int(row["commands"])
        if int(row["answered"]) > int(row["elsewhere"]):
            ratio = float(row["time_us"]) / float(row["time_u"])
            assert ratio == pytest.approx(float(row["u_us"]), rel=0.5)


def test_the_charts_are_drawn(courses, tmp_path):
    pytest.importorskip("matplotlib")
    from growth_chart import draw as draw_growth
    from speed_chart import draw

    names = ("auto", "torsionless", "solve_bvp")
    rows = [
        measured(course, name, next(iter(speed_methods.METHODS[name])), start)
        for course in courses.values()
        for name in names
        for start in ("warm", "cold")
    ]
    draw(rows, tmp_path / "speed")
    points = [*cost_growth.tubes((2, 3), 4), *cost_growth.segments((1, 2), 4), *cost_growth.poses((2, 9), 4)]
    draw_growth(points, tmp_path / "growth")
    assert {path.name for path in tmp_path.iterdir()} == {"speed.png", "speed.svg", "growth.png", "growth.svg"}


def test_fits_of_cost_growth():
    points = [cost_growth.Point("solve", "tubes", n, 0, 0.0, 5.0 * n**1.5) for n in (2, 3, 5, 8)]
    assert cost_growth.power(points) == pytest.approx(1.5)
    points = [cost_growth.Point("solve", "segments a tube", n, 0, 0.0, 7.0 + 2.0 * n) for n in (1, 2, 4, 8)]
    assert cost_growth.line(points) == pytest.approx((7.0, 2.0, 1.0))


def test_cost_growth_writes_its_file(tmp_path):
    run("cost_growth.py", "--quick", "--output", str(tmp_path))
    with (tmp_path / "cost_growth.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert list(rows[0]) == ["what", "grows", "number", "unknowns", "time_us", "time_u"]
    assert {row["grows"] for row in rows} >= {"tubes", "segments a tube", "poses"}
    assert all(float(row["time_u"]) > 0.0 for row in rows)


def test_the_families_have_the_sections_they_promise():
    for n in (2, 5):
        robot, D = nested(n)
        answer = EquilibriumSolver(robot).solve(0.5 * turned(n), D)
        assert answer.success and answer.shape.domain.n_sections == 2 * n - 1
    for k in (1, 4):
        robot, D = segmented(k)
        assert [len(tube.segments) for tube in robot.tubes] == [k + 1, k + 1]
        assert EquilibriumSolver(robot).solve([0.0, 0.5], D).success


def test_strokes_go_back_and_forth_in_small_steps_below_the_fold():
    for stroke in strokes():
        angles = np.degrees([alpha[-1] for alpha in stroke.steps(4100)])
        assert np.abs(np.diff(angles)) == pytest.approx(0.1)
        assert angles.min() >= stroke.low - 1e-9 and angles.max() <= stroke.high + 1e-9
        solver = EquilibriumSolver(stroke.robot)
        ends = [*stroke.approach(), stroke.direction * np.radians(stroke.high)]
        answers = [solver.solve(alpha, stroke.D) for alpha in ends]
        assert all(answer.status.value == "ok" for answer in answers)


def test_tables_of_serving_cost(courses):
    (stroke, *_), course = strokes(), courses["Fig. 4, partial overlap"]
    for ask, _ in ASKED.values():
        assert serve(stroke, ask, 4).units > 0.0
    assert serving_cost.steps_table([stroke], 3).count("\n") == 1 + len(ASKED)
    assert "two nested tubes" in serving_cost.tubes_table(3)
    assert "| Fig. 4, partial overlap | " in serving_cost.seeds_table([course])
    assert serving_cost.batch_table(3)
    row = serving_cost.at_equal_error(course, "auto")
    assert row is not None and row.error_largest_m <= serving_cost.ERROR
    markers = serving_cost.DOCUMENT.read_text()
    for name in ("machine", "warm steps", "three tubes", "batch", "equal error", "seed's way", "profile", "compiled"):
        assert f"<!-- {name} -->\n" in markers and f"<!-- end {name} -->" in markers


def test_samples_find_the_package_at_work():
    stroke, samples = strokes()[0], Samples()
    samples.run(lambda: serve(stroke, ASKED["solve alone"][0], 30))
    assert samples.total == sum(samples.own.values()) > 0
    assert all("." in name for name in samples.own)


def test_the_clock():
    u = unit()
    assert 1e-8 < u < 1e-3
    timing = repeated(lambda: sum(range(1000)), 5)
    assert timing.microseconds == pytest.approx(1e6 * timing.seconds)
    watch = Stopwatch()
    assert watch.time(lambda: 7) == 7 and watch.spent == watch.seconds[0] > 0.0


def test_the_compiled_kernel_agrees_or_is_left_out():
    """Where Numba is missing one line says so; where it is there, the script compares poses itself."""
    try:
        import numba  # noqa: F401
    except ImportError:
        out = run("numba_kernel.py", "--quick")
        assert len(out.splitlines()) == 1 and "pip install numba" in out
        return
    import numba_kernel

    apart, turned_by = numba_kernel.differences(strokes()[0])
    assert apart < numba_kernel.AGREEMENT and turned_by < 1e-7
