"""The bench of the live page, at tiny size: no time is asserted, only that a real browser shows what sliders do."""

from __future__ import annotations

import shutil

import pytest

pytest.importorskip("viser", reason="viser is not installed: no live page")

from bench.view import slider_latency

pytestmark = [
    pytest.mark.soak,
    pytest.mark.skipif(shutil.which("chromium") is None, reason="chromium is not installed"),
    pytest.mark.filterwarnings("default"),  # viser's
]


def test_every_press_is_followed_by_a_shape_and_the_browser_does_not_complain():
    run = slider_latency.measure("three_tubes", 15)
    assert run.complaints == []
    assert len(run.seen) == 15 and len(run.served) >= 15 and len(run.frames) > 15
    assert run.seen.min() > run.served.min() > 0.0


def test_the_document_has_a_place_for_the_tables():
    text = slider_latency.DOCUMENT.read_text(encoding="utf-8")
    assert all(
        f"<!-- {name} -->" in text and f"<!-- end {name} -->" in text for name in ("page machine", "page latency")
    )
