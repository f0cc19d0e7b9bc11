"""Commands for renda2021.yaml as no sane client sends them, each with the reasons for which it may be refused."""

from __future__ import annotations

import math
import random
from collections.abc import Iterator
from dataclasses import dataclass
from dataclasses import field
from dataclasses import replace

NAMES = ("outer_rotation", "outer_translation", "inner_rotation", "inner_translation")
LENGTHS = {"outer_translation": 0.1858, "inner_translation": 0.3035}  # m
NOT_NUMBERS = (math.nan, math.inf, -math.inf)
HUGE = (1e308, -1e308, 1.7e308, 1e7, -1e300)
NOT_JOINTS = ("", " ", "outer_rotation ", "OUTER_ROTATION", "x" * 5000, "\n\r\t", "größe", "%s%n{}", "inner", "机器人")
BREAKABLE = 0.9  # share of messages that are broken


@dataclass(frozen=True)
class Fuzzed:
    """One JointState.

    Attributes:
        reasons: for which it may be refused; none: it must be answered.
        words: what the refusal must name.
    """

    names: list[str]
    positions: list[float]
    velocities: list[float] = field(default_factory=list)
    efforts: list[float] = field(default_factory=list)
    reasons: frozenset[str] = frozenset()
    words: tuple[str, ...] = ()


def fuzz(seed: int, count: int) -> Iterator[Fuzzed]:
    """`count` commands, the same for the same seed."""
    rng = random.Random(seed)
    for _ in range(count):
        good = good_command(rng)
        yield rng.choice(BREAKERS)(rng, good) if rng.random() < BREAKABLE else _unusual(rng, good)


def good_command(rng: random.Random) -> Fuzzed:
    """A complete command within limits, far from every fold."""
    outer, inner = rng.uniform(0.05, 0.15), rng.uniform(0.16, 0.29)
    return Fuzzed(list(NAMES), [rng.uniform(-0.8, 0.8), outer, rng.uniform(-0.8, 0.8), inner])


def _unusual(rng: random.Random, good: Fuzzed) -> Fuzzed:
    """Still good: joints in any order, and fields full of rubbish that are not read."""
    order = rng.sample(range(len(NAMES)), len(NAMES))
    rubbish = [rng.choice((*NOT_NUMBERS, *HUGE, 0.0)) for _ in range(rng.randrange(6))]
    names, positions = [good.names[i] for i in order], [good.positions[i] for i in order]
    return replace(good, names=names, positions=positions, velocities=rubbish, efforts=rubbish[::-1])


def _with(good: Fuzzed, index: int, value: float) -> list[float]:
    return [*good.positions[:index], value, *good.positions[index + 1 :]]


def _broken(good: Fuzzed, reason: str, names: list[str], positions: list[float], *words: str) -> Fuzzed:
    return replace(good, names=names, positions=positions, reasons=frozenset({reason}), words=words)


def _not_finite(rng: random.Random, good: Fuzzed) -> Fuzzed:
    index, value = rng.randrange(len(NAMES)), rng.choice(NOT_NUMBERS)
    return _broken(good, "non_finite", good.names, _with(good, index, value), NAMES[index], str(value))


def _huge(rng: random.Random, good: Fuzzed) -> Fuzzed:
    index, value = rng.randrange(len(NAMES)), rng.choice(HUGE)
    return _broken(good, "out_of_limits", good.names, _with(good, index, value), NAMES[index].partition("_")[0])


def _past_an_end(rng: random.Random, good: Fuzzed) -> Fuzzed:
    index = rng.choice((1, 3))
    beyond = LENGTHS[NAMES[index]] + 10 ** rng.uniform(-9, 0)
    value = rng.choice((-(10 ** rng.uniform(-9, 0)), beyond))
    return _broken(good, "out_of_limits", good.names, _with(good, index, value), NAMES[index].partition("_")[0])


def _crossed_bases(rng: random.Random, good: Fuzzed) -> Fuzzed:
    value = good.positions[1] - 10 ** rng.uniform(-9, -2)
    return _broken(good, "out_of_limits", good.names, _with(good, 3, value), "inner", "outer")


def _empty(_: random.Random, good: Fuzzed) -> Fuzzed:
    return _broken(good, "missing_joint", [], [])


def _nameless(rng: random.Random, good: Fuzzed) -> Fuzzed:
    return _broken(good, "nameless", [], good.positions[: rng.randint(1, 4)])


def _ragged(rng: random.Random, good: Fuzzed) -> Fuzzed:
    length = rng.choice((0, 1, 3, 5, 50))
    return _broken(good, "ragged", good.names, (good.positions * 13)[:length], str(length))


def _twice(rng: random.Random, good: Fuzzed) -> Fuzzed:
    name = rng.choice(NAMES)
    return _broken(good, "duplicate_joint", [*good.names, name], [*good.positions, rng.uniform(-1, 1)], name)


def _some_missing(rng: random.Random, good: Fuzzed) -> Fuzzed:
    kept = sorted(rng.sample(range(len(NAMES)), rng.randrange(1, len(NAMES))))
    missing = next(name for i, name in enumerate(NAMES) if i not in kept)
    return _broken(good, "missing_joint", [NAMES[i] for i in kept], [good.positions[i] for i in kept], missing)


def _unknown(rng: random.Random, good: Fuzzed) -> Fuzzed:
    index, name = rng.randrange(len(NAMES)), rng.choice(NOT_JOINTS)
    return _broken(good, "unknown_joint", [*good.names[:index], name, *good.names[index + 1 :]], good.positions)


def _everything_at_once(rng: random.Random, good: Fuzzed) -> Fuzzed:
    """Which reason comes first is not promised, only that there is one."""
    names = [rng.choice((*NAMES, *NOT_JOINTS)) for _ in range(rng.randrange(1, 30))]
    positions = [rng.choice((*NOT_NUMBERS, *HUGE)) for _ in range(rng.randrange(1, 30))]
    reasons = frozenset({"ragged", "duplicate_joint", "unknown_joint", "non_finite", "missing_joint", "out_of_limits"})
    return replace(good, names=names, positions=positions, reasons=reasons)


BREAKERS = (
    _not_finite,
    _huge,
    _past_an_end,
    _crossed_bases,
    _empty,
    _nameless,
    _ragged,
    _twice,
    _some_missing,
    _unknown,
    _everything_at_once,
)
