"""Runs the scripts of ``bench`` as they are documented."""

from __future__ import annotations

import subprocess
import sys

from bench.common.places import ROOT


def run(module: str, *arguments: str) -> str:
    """What a script of ``bench`` prints, run as documented."""
    command = [sys.executable, "-m", f"bench.{module}", *arguments]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stderr
    return done.stdout
