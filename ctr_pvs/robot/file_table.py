"""One mapping of a robot file together with its place in it, so that whatever is wrong is said where it stands."""

from __future__ import annotations

from collections.abc import Iterable
from collections.abc import Iterator
from collections.abc import Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from ctr_pvs.errors import RobotError
from ctr_pvs.errors import RobotFileError
from ctr_pvs.robot.reading.hints import remedy
from ctr_pvs.robot.robot import number_in


@dataclass(frozen=True)
class Table:
    """A mapping, and where it was found.

    Args:
        file: path of the robot file.
        path: key path of the mapping; empty for the whole file.
        values: its content.
    """

    file: str
    path: str
    values: Mapping[Any, Any]

    def __contains__(self, key: str) -> bool:
        return key in self.values

    def at(self, key: object) -> str:
        """The key path of one of the table's keys."""
        return f"{self.path}.{key}" if self.path else str(key)

    def error(self, key: str, limit: str, remedy: str = "") -> RobotFileError:
        """The error that what stands under `key`, or is missing there, breaks the rule `limit`."""
        return RobotFileError(self.file, self.at(key), self.values.get(key), limit, remedy)

    def refuse_other_keys(self, known: Iterable[str], what: str = "key") -> None:
        """Raises for the first key that is not `known`, and says what to write in its place."""
        known = tuple(known)
        for key in self.values:
            if key not in known:
                rule = f"one of the {what}s {', '.join(known)}"
                raise RobotFileError(self.file, self.at(key), key, rule, remedy(str(key), known))

    def require(self, key: str, what: str, remedy: str = "add this key") -> Any:
        """What stands under `key`; raises when nothing does."""
        if self.values.get(key) is None:
            raise self.error(key, what, remedy)
        return self.values[key]

    def number(self, key: str, low: float, high: float, unit: str = "") -> float:
        """The number under `key`, in [low, high]."""
        return self._number(key, self.values.get(key), low, high, unit)

    def numbers(self, key: str, low: float, high: float, unit: str = "") -> list[float]:
        """The list of numbers under `key`, each in [low, high]; empty when there is no such key."""
        if key not in self:
            return []
        values = self.values[key]
        if not isinstance(values, list):
            example = f"write [{values}]" if isinstance(values, int | float) else ""
            raise self.error(key, "a list of numbers", example)
        return [self._number(f"{key}[{index}]", value, low, high, unit) for index, value in enumerate(values)]

    def table(self, key: str) -> Table:
        """The mapping under `key`; an empty one when there is no such key."""
        return self._table(key, self.values.get(key, {}))

    def tables(self, key: str, what: str) -> list[Table]:
        """The list of mappings under `key`, at least one."""
        values = self.require(key, f"a list of at least one {what}")
        if not isinstance(values, list) or not values:
            raise self.error(key, f"a list of at least one {what}")
        return [self._table(f"{key}[{index}]", value) for index, value in enumerate(values)]

    @contextmanager
    def blamed(self, keys: Mapping[str, str] | None = None) -> Iterator[None]:
        """Turns a RobotError raised inside into a RobotFileError at this table.

        Args:
            keys: the file's key for a constructor's field, where they are not the same.
        """
        try:
            yield
        except RobotError as error:
            field = (keys or {}).get(error.field, error.field)
            raise RobotFileError(self.file, self.at(field), error.value, error.limit, error.remedy) from None

    def _table(self, key: str, value: object) -> Table:
        if not isinstance(value, dict):
            raise RobotFileError(self.file, self.at(key), value, "a mapping (key: value)")
        return Table(self.file, self.at(key), value)

    def _number(self, key: str, value: object, low: float, high: float, unit: str) -> float:
        try:
            return number_in(key, value, low, high, unit)
        except RobotError as error:
            remedy = "write the number without quotes" if _is_number_in_quotes(value) else ""
            raise RobotFileError(self.file, self.at(key), value, error.limit, remedy) from None


def _is_number_in_quotes(value: object) -> bool:
    try:
        return isinstance(value, str) and float(value) is not None
    except ValueError:
        return False
