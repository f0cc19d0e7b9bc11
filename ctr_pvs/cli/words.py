"""What the subcommands of the command line share: numbers among its words, and the error for words that cannot be
meant."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable


class UsageError(ValueError):
    """Arguments that cannot be meant. The message is one line."""


def is_number(text: str) -> bool:
    """Whether `float` reads it; NaN and infinities count."""
    try:
        float(text)
    except ValueError:
        return False
    return True


def number(text: str) -> float:
    """A finite number, for argparse."""
    if not is_number(text) or not math.isfinite(float(text)):
        raise argparse.ArgumentTypeError(f"expected a finite number, got {text.strip()!r}")
    return float(text)


def whole_number(low: int, high: int) -> Callable[[str], int]:
    """The type, for argparse, of a whole number from `low` to `high`."""

    def parse(text: str) -> int:
        value = number(text)
        if value != int(value) or not low <= value <= high:
            raise argparse.ArgumentTypeError(f"expected a whole number from {low} to {high}, got {text.strip()!r}")
        return int(value)

    return parse
