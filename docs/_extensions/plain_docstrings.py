"""Lists of arguments as the docstrings write them, "start : where to set out from", become lists on the site.

An item begins where a line, or a sentence in it, does; it goes on to the next item or to the end of the paragraph.
"""

from __future__ import annotations

import re
from typing import Any

from sphinx.application import Sphinx

NAME = r"[A-Za-z_]\w*(?: \([^()]*\))?(?: \[[^\[\]]*\])?"
ITEM = re.compile(rf"(?:^\s*|(?<=[.;])\s+)({NAME}(?:, {NAME})*) : ")

ALIAS = re.compile(r"[~\w.]*TypeAliasForwardRef\('(\w+)'\)")


def listed(paragraph: list[str]) -> list[str]:
    """The lines of a paragraph that begins with an item, as a list; others as they are."""
    if not paragraph or not ITEM.match(paragraph[0].lstrip()):
        return paragraph
    text = " ".join(line.strip() for line in paragraph)
    _, *parts = ITEM.split(text)
    return [f"* **{names}**: {rest.strip()}" for names, rest in zip(parts[::2], parts[1::2], strict=True)]


def rewrite(app: Sphinx, what: str, name: str, thing: object, options: object, lines: list[str]) -> None:
    """For every docstring that a page shows."""
    told: list[str] = []
    paragraph: list[str] = []
    for line in [*lines, ""]:
        if line.strip():
            paragraph.append(line)
            continue
        told += [*listed(paragraph), ""]
        paragraph = []
    # Of a property, Napoleon takes what stands before a colon in the first line for the type: let that be empty.
    lines[:] = ["..", "", *told] if what in ("property", "attribute") else told


def sign(
    app: Sphinx, what: str, name: str, thing: object, options: object, signature: str | None, returned: str | None
) -> tuple[str | None, str | None]:
    """Without what is no Python: defaults that are made anew each time, and aliases of types within unions."""
    plain = [text and ALIAS.sub(r"\1", text.replace("<factory>", "...")) for text in (signature, returned)]
    return plain[0], plain[1]


def setup(app: Sphinx) -> dict[str, Any]:
    app.connect("autodoc-process-docstring", rewrite, priority=400)  # before napoleon reads its sections
    app.connect("autodoc-process-signature", sign)
    return {"parallel_read_safe": True}
