"""Rows of answers as files: CSV, which grows line by line, and NPZ or Parquet, which are written whole, in place of
what was there before, now and then and at the end.  What is on the disk is a valid file at any time."""

from __future__ import annotations

import os
import time
from abc import ABC
from abc import abstractmethod
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.cli.words import UsageError
from ctr_pvs.tasks.sweep import STATUSES
from ctr_pvs.tasks.sweep import Layout
from ctr_pvs.tasks.sweep import Rows
from ctr_pvs.tasks.sweep import joined

Array = NDArray[np.float64]

#: Seconds between two writes of a file that is written whole, and rows that are read at once.
EVERY, BLOCK = 60.0, 4096


class Table(ABC):
    """Rows on their way to a file; ``count`` of them are there."""

    def __init__(self, path: Path, layout: Layout) -> None:
        self.path, self.layout, self.count = path, layout, 0

    @abstractmethod
    def kept(self) -> Iterator[Rows]:
        """The rows that the file holds from an earlier run, block by block; counts them.  Call once, before ``append``.

        Raises ``UsageError`` for a file that is not one of these rows.
        """

    @abstractmethod
    def append(self, rows: Rows) -> None: ...

    @abstractmethod
    def close(self) -> None: ...

    @abstractmethod
    def rows(self) -> Rows:
        """All of them; call it last."""

    def _foreign(self) -> UsageError:
        return UsageError(f"--resume: {self.path} holds no rows of this robot and these options")


def table_for(path: Path | None, layout: Layout) -> Table:
    """By the file's ending; in memory without a file.  Raises ``UsageError`` for Parquet without pyarrow."""
    if path is None:
        return MemoryTable(Path(os.devnull), layout)
    ending = path.suffix.lower()
    if ending == ".csv":
        return CsvTable(path, layout)
    if ending == ".npz":
        return NpzTable(path, layout)
    return ParquetTable(path, layout)


class CsvTable(Table):
    """A header and a line per row; numbers with all their digits."""

    def __init__(self, path: Path, layout: Layout) -> None:
        super().__init__(path, layout)
        self._header = ",".join((*layout.names, "status"))
        self._file: Any = None

    def kept(self) -> Iterator[Rows]:
        good = 0  # bytes of whole lines
        with self.path.open("rb") as file:
            header = file.readline()
            if not header.endswith(b"\n") or header.decode("utf-8", "replace").rstrip("\r\n") != self._header:
                raise self._foreign()
            good = file.tell()
            lines: list[str] = []
            for line in file:
                if not line.endswith(b"\n"):
                    break  # written in part
                lines.append(line.decode("utf-8", "replace").rstrip("\r\n"))
                good += len(line)
                if len(lines) == BLOCK:
                    yield self._read(lines)
                    lines = []
            if lines:
                yield self._read(lines)
        os.truncate(self.path, good)

    def _read(self, lines: list[str]) -> Rows:
        words = [line.split(",") for line in lines]
        try:
            numbers = np.array([row[:-1] for row in words], dtype=np.float64)
            codes = np.array([STATUSES.index(row[-1]) for row in words], dtype=np.int8)
        except ValueError:
            raise self._foreign() from None
        if numbers.shape[1] != len(self.layout.names):
            raise self._foreign()
        self.count += len(lines)
        return Rows(self.layout, numbers, codes)

    def append(self, rows: Rows) -> None:
        if self._file is None:
            self._file = self.path.open("a", encoding="utf-8", newline="")
            if self._file.tell() == 0:
                self._file.write(self._header + "\n")
        for numbers, code in zip(rows.numbers.tolist(), rows.codes.tolist(), strict=True):
            self._file.write(",".join(map(repr, numbers)) + f",{STATUSES[code]}\n")
        self._file.flush()
        self.count += len(rows)

    def close(self) -> None:
        if self._file is not None:
            self._file.close()

    def rows(self) -> Rows:
        return joined(self.layout, list(CsvTable(self.path, self.layout).kept()))


class MemoryTable(Table):
    """Rows in memory only."""

    def __init__(self, path: Path, layout: Layout) -> None:
        super().__init__(path, layout)
        self._parts: list[Rows] = []

    def kept(self) -> Iterator[Rows]:
        yield from ()

    def append(self, rows: Rows) -> None:
        self._parts.append(rows)
        self.count += len(rows)

    def close(self) -> None:
        pass

    def rows(self) -> Rows:
        return joined(self.layout, self._parts)


class WholeTable(MemoryTable):
    """Rows in memory, written together."""

    def __init__(self, path: Path, layout: Layout) -> None:
        super().__init__(path, layout)
        self._written = time.monotonic()

    def kept(self) -> Iterator[Rows]:
        rows = self._read()
        self._parts, self.count = [rows], len(rows)
        yield rows

    def append(self, rows: Rows) -> None:
        super().append(rows)
        if time.monotonic() > self._written + EVERY:
            self.close()
            self._written = time.monotonic()

    def close(self) -> None:
        self._parts = [joined(self.layout, self._parts)]
        beside = self.path.with_name(f".{self.path.name}.part")
        self._write(self._parts[0], beside)
        os.replace(beside, self.path)

    @abstractmethod
    def _read(self) -> Rows: ...

    @abstractmethod
    def _write(self, rows: Rows, path: Path) -> None: ...


class NpzTable(WholeTable):
    """An array per group, ``status`` (M,) and what its codes mean, ``status_names``; ``columns``: names of all."""

    def _read(self) -> Rows:
        try:
            with np.load(self.path, allow_pickle=False) as file:
                if tuple(file["columns"].tolist()) != self.layout.names:
                    raise self._foreign()
                groups = [file[key].reshape(len(file["status"]), -1) for key in self.layout.groups]
                return Rows(self.layout, np.hstack(groups), file["status"].astype(np.int8))
        except (ValueError, KeyError, OSError, EOFError) as error:
            if isinstance(error, UsageError):
                raise
            raise self._foreign() from None

    def _write(self, rows: Rows, path: Path) -> None:
        groups: dict[str, Any] = {key: rows[key] for key in self.layout.groups}
        groups["stability_margin"] = groups["stability_margin"][:, 0]
        groups.update(status=rows.codes, status_names=np.array(STATUSES), columns=np.array(self.layout.names))
        with path.open("wb") as file:
            np.savez(file, **groups)


class ParquetTable(WholeTable):
    """A column per name, and ``status`` as text."""

    def __init__(self, path: Path, layout: Layout) -> None:
        super().__init__(path, layout)
        try:
            import pyarrow
            from pyarrow import parquet
        except ImportError:
            raise UsageError("Parquet needs pyarrow (pip install pyarrow); .csv and .npz need nothing") from None
        self._arrow, self._parquet = pyarrow, parquet

    def _read(self) -> Rows:
        try:
            table = self._parquet.read_table(self.path)
            numbers = np.column_stack([table[name].to_numpy() for name in self.layout.names])
            codes = np.array([STATUSES.index(word) for word in table["status"].to_pylist()], dtype=np.int8)
        except (self._arrow.ArrowException, KeyError, ValueError):
            raise self._foreign() from None
        return Rows(self.layout, numbers.reshape(len(codes), -1), codes)

    def _write(self, rows: Rows, path: Path) -> None:
        columns: dict[str, Any] = dict(zip(self.layout.names, rows.numbers.T, strict=True))
        columns["status"] = [STATUSES[code] for code in rows.codes.tolist()]
        self._parquet.write_table(self._arrow.table(columns), path)
