"""How `make site` has Sphinx make the site from this folder and the docstrings. The pages can be read without."""

from __future__ import annotations

import sys
import xml.etree.ElementTree as ET
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "docs" / "_extensions")]

project = "ctr_pvs"
author = "ctr_pvs maintainers"
version = release = ET.parse(ROOT / "package.xml").findtext("version", "")

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "mentions", "plain_docstrings"]
exclude_patterns = ["_extensions"]
highlight_language = "none"  # blocks that name no language are what programs print, or formulas

# Links to headings are checked as those to pages are.
myst_heading_anchors = 4

# Docstrings: names in single backquotes are code, as in the sources; members in the order of the sources.
default_role = "code"
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_typehints_format = "short"
autodoc_preserve_defaults = True
# Told by the names that the sources use, not by what these stand for.
ALIASES = ("Array", "ArrayLike", "Codes", "Guess", "Ints", "Mask", "Progress", "Range", "Start", "Vector")
autodoc_type_aliases = {name: name for name in ALIASES}
napoleon_numpy_docstring = False
add_module_names = False
python_use_unqualified_type_names = True
python_maximum_signature_line_length = 100
# Types of others, which no page here describes, and our own that only fill signatures.
nitpick_ignore_regex = [
    ("py:.*", r"(numpy|collections\.abc|concurrent\.futures|os)\..*"),
    ("py:class", "|".join(ALIASES)),
    ("py:class", r"ctr_pvs\.solve\.solver\.EquilibriumSolver"),  # what the solver of the page on it is derived from
]

html_theme = "furo"
html_title = f"ctr_pvs {release}"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_show_sourcelink = False
html_copy_source = False
html_show_copyright = False
