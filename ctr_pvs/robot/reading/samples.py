"""The key `curvature_table` of a robot file: from its text, or a CSV file beside it, to polynomial pieces."""

from __future__ import annotations

import csv
import os

import numpy as np

from ctr_pvs.errors import RobotFileError
from ctr_pvs.robot.file_table import Table
from ctr_pvs.robot.reading.curvature_table import MOST_PIECES
from ctr_pvs.robot.reading.curvature_table import Piece
from ctr_pvs.robot.reading.curvature_table import Samples
from ctr_pvs.robot.robot import LENGTH_RANGE
from ctr_pvs.robot.strict_yaml import read_text

#: 1/m; off by this much all along in one direction, 0.2 m of tube end 0.02 mm beside the table.
TOLERANCE = 1e-3
_TOLERANCES = (1e-9, 1e3)  # 1/m
_LARGEST_SAMPLE = 1e4  # 1/m
_SAME_LENGTH = 1e-9  # m; how well the last place and a length that is given must agree
_COLUMNS = ("s", "kappa_y", "kappa_z")


def table_pieces(segment: Table) -> list[Piece]:
    """The pieces of the `curvature_table` of a segment in SI units, from its base side on."""
    table = segment.table("curvature_table")
    table.refuse_other_keys((*_COLUMNS, "file", "tolerance"))
    for key in ("curvature_y", "curvature_z", "curvature", "turn"):
        if key in segment:
            raise segment.error(key, f"either curvature_table or {key}, not both", "remove one of them")
    columns = _from_file(table) if "file" in table else table
    tolerance = table.number("tolerance", *_TOLERANCES, "1/m") if "tolerance" in table else TOLERANCE
    samples = _samples(columns)
    if "length" in segment:
        length, last = segment.number("length", *LENGTH_RANGE, "m"), float(samples.s[-1])
        if abs(length - last) > _SAME_LENGTH:
            raise segment.error("length", f"the last s of the curvature_table, {last:.9g} m", "or leave it away")
    pieces = samples.pieces(tolerance)
    if pieces is None:
        rule = f"a table that {MOST_PIECES} polynomials fit within tolerance {tolerance:g} 1/m"
        enough = f"tolerance: {samples.tolerance_that_would_do(tolerance):g} would do; or smooth the samples"
        raise RobotFileError(columns.file, columns.path, f"{len(samples.s)} samples that need more", rule, enough)
    return pieces


def _samples(columns: Table) -> Samples:
    """The table; the first s is 0, at the base of the segment or tube that it belongs to."""
    columns.require("s", "a list of places in m, from 0 at the base of this segment or tube")
    s = columns.numbers("s", 0.0, LENGTH_RANGE[1], "m")
    if len(s) < 2:
        raise columns.error("s", "at least two places")
    if s[0] != 0.0:
        raise RobotFileError(columns.file, columns.at("s[0]"), s[0], "0, the base of this segment or tube")
    for index in range(1, len(s)):
        if not s[index] - s[index - 1] >= LENGTH_RANGE[0]:
            rule = f"a place at least {LENGTH_RANGE[0]:g} m after the one before, {s[index - 1]:g} m"
            raise RobotFileError(columns.file, columns.at(f"s[{index}]"), s[index], rule)
    kappa = [columns.numbers(key, -_LARGEST_SAMPLE, _LARGEST_SAMPLE, "1/m") for key in _COLUMNS[1:]]
    for key, values in zip(_COLUMNS[1:], kappa, strict=True):
        if key in columns and len(values) != len(s):
            raise RobotFileError(columns.file, columns.at(key), f"{len(values)} values", f"{len(s)}, one for each s")
    if not any(kappa):
        raise columns.error("kappa_y", "kappa_y or kappa_z, or both, in 1/m", "add one of them")
    y, z = (np.array(values or [0.0] * len(s)) for values in kappa)
    return Samples(np.array(s), y + 1j * z)


def _from_file(table: Table) -> Table:
    """The columns of the CSV file beside the robot file."""
    for key in _COLUMNS:
        if key in table:
            raise table.error(key, f"either file or {key}, not both", "remove one of them")
    name = table.require("file", "the name of a CSV file beside this one")
    if not isinstance(name, str):
        raise table.error("file", "the name of a CSV file beside this one")
    path = os.path.join(os.path.dirname(table.file), name)
    rows = list(csv.reader(read_text(path, "a CSV file").splitlines()))
    header = [cell.strip() for cell in rows[0]] if rows else []
    columns = Table(path, "", dict.fromkeys(header))
    columns.refuse_other_keys(_COLUMNS, "column")
    if len(set(header)) < len(header):
        raise RobotFileError(path, "", ", ".join(header), "every column once")
    values: dict[str, list[object]] = {key: [] for key in header}
    for line, row in enumerate(rows[1:], start=2):
        if len(row) != len(header):
            raise RobotFileError(path, f"line {line}", ",".join(row), f"{len(header)} numbers, {', '.join(header)}")
        for key, cell in zip(header, row, strict=True):
            values[key].append(_number(path, f"line {line}, {key}", cell))
    return Table(path, "", values)


def _number(path: str, place: str, cell: str) -> float:
    try:
        return float(cell)
    except ValueError:
        raise RobotFileError(path, place, cell, "a number") from None
