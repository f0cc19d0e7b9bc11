"""What a command line says beside its answer, on standard error: warnings of the robot, and hints."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TextIO

from ctr_pvs.errors import RobotWarning


@contextmanager
def robot_warnings_told() -> Iterator[None]:
    """Warnings of robots are one line each on standard error, whatever filters there are; others go their own way."""
    with warnings.catch_warnings():
        warnings.simplefilter("always", RobotWarning)
        before = warnings.showwarning

        def show(
            message: Warning | str,
            category: type[Warning],
            filename: str,
            lineno: int,
            file: TextIO | None = None,
            line: str | None = None,
        ) -> None:
            if issubclass(category, RobotWarning):
                tell("warning", str(message))
            else:
                before(message, category, filename, lineno, file, line)

        warnings.showwarning = show
        yield


def tell(kind: str, text: str) -> None:
    """One line."""
    print(f"ctr-pvs: {kind}: {' '.join(text.splitlines())}", file=sys.stderr)
