"""The bench of cost growth at tiny size, and its fits."""

from __future__ import annotations

import csv

import pytest
from run_scripts import run

from bench.common.nested_robots import nested
from bench.common.nested_robots import segmented
from bench.common.nested_robots import turned
from bench.growth import points as growth
from ctr_pvs import EquilibriumSolver


def test_fits_of_cost_growth():
    points = [growth.Point("solve", "tubes", n, 0, 0.0, 5.0 * n**1.5) for n in (2, 3, 5, 8)]
    assert growth.power(points) == pytest.approx(1.5)
    points = [growth.Point("solve", "segments a tube", n, 0, 0.0, 7.0 + 2.0 * n) for n in (1, 2, 4, 8)]
    assert growth.line(points) == pytest.approx((7.0, 2.0, 1.0))


def test_cost_growth_writes_its_file(tmp_path):
    run("growth.cost_growth", "--quick", "--output", str(tmp_path))
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


def test_the_exponent_is_fitted_from_four_tubes_on():
    points = [growth.Point("solve", "tubes", n, 0, 0.0, float(n)) for n in (2, 3, 4, 8, 20)]
    assert [point.number for point in growth.fitted(points)] == [4, 8, 20]
    assert growth.fitted(points[:2]) == points[:2]
    assert "tubes^1.00 from 4 on" in growth.fits_table(points)


def test_the_chart_is_drawn(tmp_path):
    pytest.importorskip("matplotlib")
    from bench.growth.chart import draw

    points = [*growth.tubes((2, 3), 4), *growth.segments((1, 2), 4), *growth.poses((2, 9), 4)]
    draw([*points, *growth.batches((1, 2))], tmp_path / "growth")
    assert {path.name for path in tmp_path.iterdir()} == {"growth.png", "growth.svg"}
