"""The benches of stability at tiny size."""

from __future__ import annotations

from bench.stability import stability_cost
from bench.stability import stability_numbers


def test_parts_of_an_answer_can_be_timed():
    rows = stability_cost.tasks(stability_cost.FAR)
    assert all(task() is not None for task in rows.values())


def test_low_degrees_see_the_critical_coupling_too_high(monkeypatch):
    told = {}
    monkeypatch.setattr(stability_numbers, "publish", lambda name, text, _: told.update({name: text}))
    stability_numbers.ritz()
    seen = [float(row.split("|")[2]) for row in told["ritz"].splitlines()[2:]]
    assert seen == sorted(seen, reverse=True) and abs(seen[-1] - 2.4674) < 1e-4
