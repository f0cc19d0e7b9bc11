"""The checkout as somebody else has it: what it installs, a copy of it, an environment that does not know this one."""

from __future__ import annotations

import configparser
import os
import shutil
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
MADE_HERE = (".*", "build", "install", "log", "dist", "demo", "reproduce", "*.egg-info", "__pycache__")
PATHS = ("PATH", "PYTHONPATH", "LD_LIBRARY_PATH", "AMENT_PREFIX_PATH", "CMAKE_PREFIX_PATH", "COLCON_PREFIX_PATH")


def entry_points() -> dict[str, str]:
    """Executable name -> module:function."""
    settings = configparser.ConfigParser()
    settings.read(ROOT / "setup.cfg", encoding="utf-8")
    scripts = settings["options.entry_points"]["console_scripts"].split("\n")
    return dict(script.split(" = ") for script in scripts if script)


def copy_checkout(to: Path) -> Path:
    """A copy without anything that was made in the checkout; setuptools and colcon leave folders where they work."""
    return shutil.copytree(ROOT, to, ignore=shutil.ignore_patterns(*MADE_HERE))


def environment_without(*folders: Path) -> dict[str, str]:
    """This process's environment less every search path that leads to the checkout's code or into a folder."""
    environment = dict(os.environ)
    for name in PATHS:
        entries = [Path(entry) for entry in environment.pop(name, "").split(os.pathsep) if entry]
        kept = [entry for entry in entries if entry != ROOT and not any(map(entry.is_relative_to, folders))]
        if kept:
            environment[name] = os.pathsep.join(map(str, kept))
    return environment
