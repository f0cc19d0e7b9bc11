"""Links on the site where pages and docstrings name a page as a reader of the repository finds it: docs/loads.md."""

from __future__ import annotations

import re
from typing import Any

from docutils import nodes
from sphinx import addnodes
from sphinx.application import Sphinx
from sphinx.transforms import SphinxTransform

MENTION = re.compile(r"\bdocs/([\w/]+)\.md\b")
#: Text in there is no mention, or is a link already.
LEFT_ALONE = (nodes.FixedTextElement, nodes.literal, nodes.reference, nodes.title, addnodes.pending_xref)


class Mentions(SphinxTransform):
    """A mention becomes a link with the title of the page; one of a page that is not there is a broken link."""

    default_priority = 400

    def apply(self, **_: Any) -> None:
        for text in list(self.document.findall(nodes.Text)):
            if MENTION.search(text) and not any(isinstance(node, LEFT_ALONE) for node in _above(text)):
                text.parent.replace(text, self._with_links(text))

    def _with_links(self, text: nodes.Text) -> list[nodes.Node]:
        parts: list[nodes.Node] = []
        end = 0
        for mention in MENTION.finditer(text):
            parts += [nodes.Text(text[end : mention.start()]), self._link(mention[1])]
            end = mention.end()
        return [*parts, nodes.Text(text[end:])]

    def _link(self, page: str) -> nodes.Node:
        link = addnodes.pending_xref(
            "", nodes.inline(), refdomain="std", reftype="doc", reftarget=f"/{page}", refexplicit=False, refwarn=True,
            refdoc=self.env.docname,
        )  # fmt: skip
        return nodes.emphasis("", "", link)


def _above(node: nodes.Node) -> list[nodes.Node]:
    parents = []
    while node.parent is not None:
        node = node.parent
        parents.append(node)
    return parents


def setup(app: Sphinx) -> dict[str, Any]:
    app.add_transform(Mentions)
    return {"parallel_read_safe": True}
