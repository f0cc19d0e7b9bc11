"""Limits in wall-clock time, on machines that may have other things to do."""

from __future__ import annotations

import os

import pytest

#: Processes that want to run, per processor, averaged over a minute [no unit]; above it the machine is busy.
BUSY = 1.25


def check_in_time(took: float, limit: float) -> None:
    """Fails where something took ``limit`` [s] of wall-clock time or more.

    Where the machine was busy meanwhile, that says nothing of what was timed: the test is then skipped, and says so.
    """
    if took < limit:
        return
    load = os.getloadavg()[0] / (os.cpu_count() or 1)
    if load > BUSY:
        pytest.skip(f"{took:.1f} s in place of {limit:g} s, on a busy machine: {load:.1f} processes per processor")
    raise AssertionError(f"took {took:.1f} s, allowed are {limit:g} s")
