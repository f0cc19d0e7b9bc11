"""Tutorials, followed to the letter: every block runs, and prints what the page says."""

from __future__ import annotations

import shutil

import pytest
import tutorial

ALL = {str(path.relative_to(tutorial.PAGES)) for path in (tutorial.PAGES / "tutorials").glob("*.md")}
WITH_ROS = "tutorials/ros.md"  # followed in test/ros, by a node and its clients


@pytest.mark.parametrize("page", ["getting_started.md", *sorted(ALL - {WITH_ROS})])
def test_a_tutorial_does_and_prints_what_it_says(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    if any(block.language == "bash" for block in tutorial.blocks(page)) and shutil.which("ctr-pvs") is None:
        pytest.skip("the executables are not on the path here")
    tutorial.follow(page, tmp_path)


def test_what_a_page_says_wrongly_is_seen(tmp_path, monkeypatch):
    monkeypatch.setattr(tutorial, "PAGES", tmp_path)
    page = tmp_path / "page.md"
    page.write_text("```python\nprint(1)\n```\n\nprints\n\n```\n1\n```\n\n```bash\necho 2\n```\n```\n3\n```\n")
    with pytest.raises(AssertionError, match=r"page\.md:11 prints\n2\nand not\n3"):
        tutorial.follow("page.md", tmp_path)
    page.write_text("```bash\nfalse\ntrue\n```\n")
    with pytest.raises(AssertionError, match=r"page\.md:1: "):
        tutorial.follow("page.md", tmp_path)


@pytest.mark.parametrize(
    ("told", "printed", "good"),
    [
        ("x 1.25 mm", "x  1.27 mm\n", True),
        ("x 1.25 mm", "x 1.28 mm", False),
        ("x 1.25 mm", "y 1.25 mm", False),
        ("1.0e-08", "1.2e-08", True),
        ("1.0e-08", "1.0e-07", False),
        ("[ 0. -0.5]", "[-0. -0.5]", True),
        ("3 of 4", "3 of 5", False),
        ("3 of 4 in ... s", "3 of 4 in 0.2 s", True),
        ("1.0", "1.0 2.0", False),
    ],
)
def test_numbers_are_told_to_their_last_places(told, printed, good):
    assert tutorial.same(told, printed) is good
