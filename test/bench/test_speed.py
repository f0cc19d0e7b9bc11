"""The bench of speed against accuracy at tiny size: what it compares is the same problem, and its file says what it
should.

No time is asserted: machines differ.
"""

from __future__ import annotations

import csv

import numpy as np
import pytest
from run_scripts import run

from bench.common.scenes import scenes
from bench.speed import methods
from bench.speed import rows
from bench.speed.centreline import Centreline
from bench.speed.fixed_levels import Full
from bench.speed.seeds_way import AsPrinted
from ctr_pvs import EquilibriumSolver

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


@pytest.fixture(scope="module")
def courses() -> dict[str, rows.Course]:
    return {scene.name: rows.Course(scene) for scene in scenes(1, 2)}


def measured(course: rows.Course, family: str, setting: str, start: str) -> rows.Row:
    make = methods.METHODS[family][setting]
    return rows.measure(course, family, setting, make, start, budget=1e-3)


def test_the_converged_tips_are_those_of_the_boundary_value_model(courses):
    for course in courses.values():
        assert course.confirm() < rows.AGREEMENT


@pytest.mark.parametrize("start", ["warm", "cold"])
@pytest.mark.parametrize("setting", methods.METHODS["auto"])
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
    out = run("speed.speed_accuracy", "--quick", "--output", str(tmp_path))
    assert "converged tip" in out
    with (tmp_path / "speed_accuracy.csv").open() as stream:
        lines = list(csv.DictReader(stream))
    assert list(lines[0]) == COLUMNS
    settings = {(name, setting) for name, every in methods.METHODS.items() for setting in every}
    assert {row["method"] for row in lines} == set(methods.METHODS)
    assert {(row["method"], row["setting"]) for row in lines} <= settings
    assert {row["start"] for row in lines} == {"warm", "cold"} and len(lines) == 2 * (2 * len(methods.METHODS) - 1)
    for row in lines:
        assert int(row["elsewhere"]) <= int(row["answered"]) <= int(row["commands"])
        if int(row["answered"]) > int(row["elsewhere"]):
            ratio = float(row["time_us"]) / float(row["time_u"])
            assert ratio == pytest.approx(float(row["u_us"]), rel=0.5)


def test_the_chart_is_drawn(courses, tmp_path):
    pytest.importorskip("matplotlib")
    from bench.speed.chart import draw

    names = ("auto", "torsionless", "solve_bvp")
    drawn = [
        measured(course, name, next(iter(methods.METHODS[name])), start)
        for course in courses.values()
        for name in names
        for start in ("warm", "cold")
    ]
    draw(drawn, tmp_path / "speed")
    assert {path.name for path in tmp_path.iterdir()} == {"speed.png", "speed.svg"}
