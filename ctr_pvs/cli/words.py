"""What command lines share: numbers among their words, and words that cannot be meant told of in one line."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable
from collections.abc import Sequence
from typing import NoReturn


class UsageError(ValueError):
    """Arguments that cannot be meant. The message is one line."""


class Parser(argparse.ArgumentParser):
    """Says what is wrong in one line, without the usage before it."""

    def error(self, message: str) -> NoReturn:
        raise UsageError(f"{message} (see {self.prog} --help)")


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


def shielded(words: Sequence[str]) -> list[str]:
    """The words with negative numbers made safe from argparse, which takes -1e-3 and -inf for options.

    A leading space is enough: it is no part of an option's name, and `float` ignores it. `--alpha=-1 0` is cut in two
    first, because argparse would give `--alpha=...` that one value only.
    """
    safe: list[str] = []
    for word in words:
        option, equals, value = word.partition("=")
        if option.startswith("--") and equals and _is_numbers(value):
            safe += [option, f" {value}"]
        else:
            safe.append(f" {word}" if word.startswith("-") and _is_numbers(word) else word)
    return safe


def _is_numbers(text: str) -> bool:
    """Whether it is a number, or several with colons between them, as ranges have."""
    return all(map(is_number, text.split(":")))
