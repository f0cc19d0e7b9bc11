"""The files that come with the code: robots that go by name, and package.xml.

In a checkout they lie at its root. Installed, by pip or colcon, they lie in share/ctr_pvs of one of the folders above
the code: a venv, the user's folder, a prefix of ROS.
"""

from __future__ import annotations

import os
from pathlib import Path

_PACKAGE = "ctr_pvs"
_ROBOT_HAS = "tubes:"  # at the start of a line; the node's parameter file lies in the same folder
_SUFFIX = ".yaml"


def shipped_folder(code: Path = Path(__file__)) -> Path | None:
    """Where package.xml and config/ are, as seen from a module of the package; None if the code was copied alone."""
    root = code.resolve().parents[2]
    shares = (parent / "share" / _PACKAGE for parent in (*code.absolute().parents, *code.resolve().parents))
    return next((folder for folder in (root, *shares) if (folder / "package.xml").is_file()), None)


def shipped_robots() -> dict[str, Path]:
    """The robot files that come with the code, by name."""
    folder = shipped_folder()
    if folder is None:
        return {}
    files = sorted((folder / "config").glob(f"*{_SUFFIX}"))
    return {file.stem: file for file in files if f"\n{_ROBOT_HAS}" in f"\n{file.read_text(encoding='utf-8')}"}


def is_a_name(path: str) -> bool:
    """Whether it may be the name of a shipped robot: neither folder nor suffix, and no file that is there."""
    separators = (os.sep, os.altsep or os.sep)
    return bool(path) and not any(mark in path for mark in (*separators, ".", "\0")) and not os.path.exists(path)
