"""The benches of serving at tiny size: no time is asserted, only what the tables hold."""

from __future__ import annotations

import numpy as np
import pytest

from bench.common.places import SPEED
from bench.common.samples import Samples
from bench.common.scenes import scenes
from bench.common.strokes import ASKED
from bench.common.strokes import serve
from bench.common.strokes import strokes
from bench.serving import comparisons
from bench.serving import hard_cases
from bench.serving import many
from bench.serving import steps
from bench.speed.rows import Course
from ctr_pvs import EquilibriumSolver

#: What the scripts write of docs/speed_accuracy.md.
TABLES = (
    "machine",
    "warm steps",
    "sliding steps",
    "tolerance",
    "three tubes",
    "batch",
    "workspace",
    "many segments",
    "strong coupling",
    "equal error",
    "seed's way",
    "growth",
    "profile",
    "effectivity",
)


def test_the_document_has_a_place_for_every_table():
    text = SPEED.read_text(encoding="utf-8")
    for name in TABLES:
        assert f"<!-- {name} -->\n" in text and f"<!-- end {name} -->" in text


def test_strokes_go_back_and_forth_in_small_steps_below_the_fold():
    for stroke in strokes():
        angles = np.degrees([alpha[-1] for alpha in stroke.steps(4100)])
        assert np.abs(np.diff(angles)) == pytest.approx(0.1)
        assert angles.min() >= stroke.low - 1e-9 and angles.max() <= stroke.high + 1e-9
        solver = EquilibriumSolver(stroke.robot)
        ends = [*stroke.approach(), stroke.direction * np.radians(stroke.high)]
        answers = [solver.solve(alpha, stroke.D) for alpha in ends]
        assert all(answer.status.value == "ok" for answer in answers)


def test_tables_of_steps():
    stroke = strokes()[0]
    told = steps.steps_table([stroke], 3)
    assert told.count("\n") == 2 + len(ASKED) and "interpreted" in told
    assert steps.sliding_table([stroke], 2).count("\n") == 1 + len(ASKED)
    assert "two nested tubes" in steps.tubes_table(3)


def test_a_looser_tolerance_takes_fewer_unknowns():
    rows = steps.tolerance_table([strokes()[0]], 2).splitlines()[2:]
    unknowns = [int(row.split()[-3]) for row in rows]
    assert len(rows) == len(steps.TOLERANCES) and unknowns == sorted(unknowns) and unknowns[0] < unknowns[-1]


def test_tables_of_comparisons():
    course = Course(scenes(1, 2)[1])
    assert f"| {course.scene.name} | " in comparisons.seeds_table([course])
    row = comparisons.at_equal_error(course, "auto")
    assert row is not None and row.error_largest_m <= comparisons.ERROR
    assert "samples of solve and tip pose" in comparisons.profile_table(strokes()[0], 2)


def test_tables_of_batches():
    assert many.batch_table(3).count("\n") == 3
    told = many.workspace_table(3).splitlines()
    assert sum(int(row.split("|")[2]) for row in told[2:]) == 3


def test_workspace_commands_are_such_that_the_robot_takes_them():
    robot = many.nested(3)[0]
    for alpha, D in zip(*many.workspace(robot, 200), strict=True):
        robot.check_command(alpha, D)


def test_table_of_many_segments():
    assert "u a segment" in hard_cases.segments_table((2,), 1, 2)


@pytest.mark.soak
def test_a_strong_pair_snaps_once():
    """A cold start through a fold: interpreted it takes half a minute."""
    assert "| 1 | 1 |" in hard_cases.strong_table(5.0)


def test_samples_find_the_package_at_work():
    stroke, samples = strokes()[0], Samples()
    samples.run(lambda: serve(stroke, ASKED["solve alone"][0], 2000))
    assert samples.total == sum(samples.own.values()) > 0
    assert all("." in name for name in samples.own)
