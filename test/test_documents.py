"""README and docs: what they name is there; the reference has every public name. `make site` checks the rest."""

from __future__ import annotations

import importlib
import re

import pytest
from checkout import ROOT

import ctr_pvs

DOCS = ROOT / "docs"
PAGES = [ROOT / "README.md", *sorted(DOCS.rglob("*.md"))]
#: A path of the repository, as text or in a link; `*` and `{}` stand for more than one.
FOLDERS = "bench|config|ctr_pvs|ctr_pvs_interfaces|ctr_pvs_ros|docs|examples|launch|scripts|test"
PATH = re.compile(rf"(?<![\w/.$)-])(?:{FOLDERS})/(?:[\w./-]*[\w/])?")
LINK = re.compile(r"\]\(([^)#:\s]+)(?:#[^)]*)?\)")
PUBLIC = re.compile(r"^\.\. auto(?:class|function|exception):: (ctr_pvs[\w.]*)", re.MULTILINE)


def exists(path: str) -> bool:
    """A file or folder, or a message or module, whose ending may be left out."""
    place = ROOT / path
    return place.exists() or any(place.parent.glob(f"{place.name}.*"))


@pytest.mark.parametrize("page", PAGES, ids=lambda path: str(path.relative_to(ROOT)))
def test_what_a_page_names_is_there(page):
    text = page.read_text(encoding="utf-8")
    assert [path for path in PATH.findall(text) if not exists(path)] == []
    assert [link for link in LINK.findall(text) if not (page.parent / link).exists()] == []


def test_a_missing_file_is_seen():
    assert PATH.findall("see docs/loads.md, (test/solve/test_snap.py) and `examples/`.") == [
        "docs/loads.md",
        "test/solve/test_snap.py",
        "examples/",
    ]
    assert exists("docs/loads.md") and exists("ctr_pvs_interfaces/srv/SolveEquilibrium") and not exists("docs/load.md")


def test_the_reference_has_every_public_name_and_no_other():
    told = [name for page in sorted((DOCS / "api").glob("*.rst")) for name in PUBLIC.findall(page.read_text("utf-8"))]
    assert len(told) == len(set(told))
    own = {name.removeprefix("ctr_pvs.") for name in told if name.count(".") == 1}
    errors = {name for name in ctr_pvs.__all__ if getattr(ctr_pvs, name).__module__ == "ctr_pvs.errors"}
    assert own | errors == set(ctr_pvs.__all__)  # those of ctr_pvs.errors are told as a module
    for name in told:
        module, _, last = name.rpartition(".")
        assert hasattr(importlib.import_module(module), last), name
