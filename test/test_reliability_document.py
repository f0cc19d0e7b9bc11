"""docs/reliability.md names tests that exist, and says rightly which of them are long."""

from __future__ import annotations

import ast
import re
from pathlib import Path

ROOT = Path(__file__).parents[1]
PROMISES = 20


def all_tests() -> dict[str, bool]:
    """The names of all tests -> whether they are marked soak as a whole."""
    found = {}
    for path in (ROOT / "test").rglob("test_*.py"):
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.FunctionDef) and node.name.startswith("test_"):
                found[node.name] = any(ast.unparse(mark) == "pytest.mark.soak" for mark in node.decorator_list)
    return found


def test_every_promise_has_its_row_and_every_test_that_is_named_is_there():
    text = (ROOT / "docs" / "reliability.md").read_text(encoding="utf-8")
    rows = [line for line in text.splitlines() if re.match(r"\| \d+ \|", line)]
    assert [int(row.split("|")[1]) for row in rows] == list(range(1, PROMISES + 1))
    there = all_tests()
    for name, soak in re.findall(r"`(test_\w+)`( \(soak\))?", text):
        assert name in there, name
        assert there[name] == bool(soak), name
