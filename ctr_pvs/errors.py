"""What a caller did wrong, said so that it can be put right.

Every message is one line and holds the same three parts: which field, what was expected of it, and what came. A
caller that wants to react rather than to show the line finds the parts as attributes.
"""

from __future__ import annotations

import reprlib

_brief = reprlib.Repr()
_brief.maxstring = _brief.maxlong = _brief.maxother = 80


def shown(value: object) -> str:
    """`value` as one short line, whatever it is: files may hold pages of text, and YAML aliases endless nests."""
    return " ".join(_brief.repr(value).split())


class FieldError(ValueError):
    """A value that breaks a rule.

    Attributes:
        field: name of the value, as the caller wrote it (`length`, `D[1]`).
        value: what came.
        limit: the rule, phrased to follow "expected".
        remedy: what to do about it; may be empty.
    """

    def __init__(self, field: str, value: object, limit: str, remedy: str = "") -> None:
        self.field = field
        self.value = value
        self.limit = limit
        self.remedy = remedy
        super().__init__(field, value, limit, remedy)  # as the constructor takes them, so that pickling works

    def __str__(self) -> str:
        return _sentence(self.field, self.limit, shown(self.value), self.remedy)


def check_choice(field: str, value: str, choices: tuple[str, ...]) -> None:
    """Raises ``FieldError`` for a ``value`` that is none of ``choices``."""
    if value not in choices:
        raise FieldError(field, value, f"one of {', '.join(choices)}")


class TableError(FieldError):
    """A table of measurements that cannot be read. `field` is the file, or the column and row in it."""


class RobotError(FieldError):
    """A robot, tube or segment that cannot exist, from its constructor. `field` is the constructor's argument."""


class CommandError(FieldError):
    """A command (alpha, D) that the robot cannot take. `field` is `alpha`, `D`, or one entry such as `D[1]`."""


class LoadError(FieldError):
    """An external load that cannot act on the robot. `field` is an argument of `Loads` or `PointForce`, or one entry
    such as `point_forces[1].X`."""


class RobotFileError(ValueError):
    """A robot file that cannot be read or breaks a rule.

    Attributes:
        file: path of the file.
        field: key path inside it, such as `tubes[1].segments[0].length`; empty when the file as a whole is at fault.
        value: what stands there; None where nothing does.
        limit: the rule, phrased to follow "expected".
        remedy: what to do about it; may be empty.
    """

    def __init__(self, file: str, field: str, value: object, limit: str, remedy: str = "") -> None:
        self.file = file
        self.field = field
        self.value = value
        self.limit = limit
        self.remedy = remedy
        super().__init__(file, field, value, limit, remedy)

    def __str__(self) -> str:
        came = "nothing" if self.value is None else shown(self.value)
        place = f"{self.file}: {self.field}" if self.field else self.file
        return _sentence(place, self.limit, came, self.remedy)


def _sentence(place: str, limit: str, came: str, remedy: str) -> str:
    line = f"{place}: expected {limit}, got {came}"
    return " ".join((f"{line}; {remedy}" if remedy else line).splitlines())


class RobotWarning(UserWarning):
    """A robot that can be, with a number that looks as if it were in another unit. One line."""
