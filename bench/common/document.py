"""Tables in Markdown, printed and written into a document between their markers."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path


def table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """A Markdown table; all columns but the first are aligned to the right."""
    titles = list(head)
    lines = [titles, ["---", *["---:"] * (len(titles) - 1)], *(list(row) for row in rows)]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def publish(name: str, text: str, document: Path | None) -> None:
    """Print ``text``, and put it between ``<!-- name -->`` and ``<!-- end name -->`` of ``document``."""
    print(f"\n{name}\n{text}", flush=True)
    if document is None:
        return
    markers = re.compile(rf"(<!-- {name} -->\n).*?(<!-- end {name} -->)", re.DOTALL)
    content = document.read_text()
    if not markers.search(content):
        raise ValueError(f"{document.name} has no place for '{name}'")
    document.write_text(markers.sub(lambda found: f"{found[1]}{text}\n{found[2]}", content))
