"""Keys that say their unit, and the short form of a tube: turned into the keys that a robot file has in SI units.

Values are checked here, in the unit they were written in, so that an error shows the number that stands in the file.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ctr_pvs.robot.file_table import Table
from ctr_pvs.robot.robot import DIAMETER_RANGE
from ctr_pvs.robot.robot import LARGEST_CURVATURE
from ctr_pvs.robot.robot import LENGTH_RANGE

_DIAMETERS_MM = {"inner_diameter_mm": DIAMETER_RANGE, "outer_diameter_mm": DIAMETER_RANGE}
_SMALLEST_RADIUS, _LARGEST_RADIUS = 1.0 / LARGEST_CURVATURE, 1e6  # m
_RADII = ("radius", "radius_mm")
#: Keys of a segment and of a tube's short form that are turned into others.
SEGMENT_KEYS = ("length_mm", *_DIAMETERS_MM, *_RADII)
SHORT_FORM = ("straight_length", "curved_length", "straight_length_mm", "curved_length_mm", "curvature", *_RADII)
TUBE_KEYS = (*_DIAMETERS_MM, *SHORT_FORM)

_IN_MM = {
    **_DIAMETERS_MM,
    "length_mm": LENGTH_RANGE,
    "straight_length_mm": (0.0, LENGTH_RANGE[1]),
    "curved_length_mm": LENGTH_RANGE,
    "radius_mm": (-_LARGEST_RADIUS, _LARGEST_RADIUS),
}


def tube_in_si(table: Table) -> Table:
    """The mapping of a tube without keys in mm; the radius of its short form is a curvature."""
    return _in_si(table, "curvature")


def segment_in_si(table: Table) -> Table:
    """The mapping of a segment without keys in mm; its radius is the constant term of its curvature_y."""
    return _in_si(table, "curvature_y")


def _in_si(table: Table, curvature: str) -> Table:
    values: dict[Any, Any] = {}
    for key, value in table.values.items():
        name, written = key, value
        if key in _IN_MM:
            name = key.removesuffix("_mm")
            low, high = _IN_MM[key]
            written = table.number(key, 1e3 * low, 1e3 * high, "mm") / 1e3
            _refuse_both(table, key, name)
        values[name] = written
    if "radius" in values:
        radius = _radius(table, values)
        del values["radius"]
        values[curvature] = 1.0 / radius if curvature == "curvature" else [1.0 / radius]
    return Table(table.file, table.path, values)


def _radius(table: Table, values: dict[Any, Any]) -> float:
    """The radius of curvature [m] among the `values` that were made of a table."""
    key = "radius" if "radius" in table else "radius_mm"
    for other in ("curvature", "curvature_y", "curvature_z", "turn", "curvature_table"):
        _refuse_both(table, key, other)
    radius = Table(table.file, table.path, values).number("radius", -_LARGEST_RADIUS, _LARGEST_RADIUS, "m")
    if abs(radius) < _SMALLEST_RADIUS:
        raise table.error(key, f"a radius of curvature of at least {_SMALLEST_RADIUS:g} m", "a straight tube has none")
    return radius


def _refuse_both(table: Table, key: str, other: str) -> None:
    if other in table:
        raise table.error(key, f"either {key} or {other}, not both", "remove one of them")


def segment_tables(tube: Table) -> list[Table]:
    """The mappings of a tube's segments, from its base to its tip; `tube` in SI units.

    A tube has `segments`, or the short form `straight_length`, `curved_length` with one `curvature` or `radius`, or
    one `curvature_table` for its whole length.
    """
    short = [key for key in ("straight_length", "curved_length", "curvature") if key in tube]
    ways = [*(key for key in ("segments", "curvature_table") if key in tube), *short[:1]]
    if len(ways) > 1:
        rule = f"either {ways[0]} or {ways[1]}, not both"
        raise tube.error(ways[1], rule, "the segments hold all lengths and pre-curvatures")
    if ways == ["curvature_table"]:
        return [Table(tube.file, tube.path, {"curvature_table": tube.values["curvature_table"]})]
    return _short_form(tube) if short else tube.tables("segments", "segment")


def _short_form(tube: Table) -> list[Table]:
    found: list[Mapping[str, Any]] = []
    if "straight_length" in tube:
        straight = tube.number("straight_length", 0.0, LENGTH_RANGE[1], "m")
        found += [{"length": straight}] if straight else []
    if "curved_length" in tube or "straight_length" not in tube:
        curved = tube.number("curved_length", *LENGTH_RANGE, "m")
        tube.require("curvature", "the curvature of the curved length in 1/m", "or its radius in m, 1/curvature")
        curvature = tube.number("curvature", -LARGEST_CURVATURE, LARGEST_CURVATURE, "1/m")
        found.append({"length": curved, "curvature_y": [curvature]})
    elif "curvature" in tube:
        raise tube.error("curved_length", "the length in m that has the curvature", "add this key")
    if not found:
        raise tube.error("straight_length", "a tube with a length", "give straight_length or curved_length")
    return [Table(tube.file, tube.path, values) for values in found]


def limits_of(limits: Table, kind: str, scaled: str, unit: str, factor: float, names: list[str]) -> tuple[Any, ...]:
    """The limits of one kind for each tube in turn, as they stand, or where they stand under the key `scaled`, in
    `unit`s of `factor`, converted."""
    if scaled not in limits:
        entries = limits.table(kind)
        entries.refuse_other_keys(names, "tube")
        return tuple(entries.values.get(name) for name in names)
    _refuse_both(limits, scaled, kind)
    entries = limits.table(scaled)
    entries.refuse_other_keys(names, "tube")
    return tuple(_scaled_range(entries, name, unit, factor) if name in entries else None for name in names)


def _scaled_range(entries: Table, name: str, unit: str, factor: float) -> tuple[float, float]:
    ends = entries.numbers(name, -1e9, 1e9, unit)
    if len(ends) != 2 or ends[0] > ends[1]:
        raise entries.error(name, f"two numbers in {unit}, the lower and the upper limit")
    return factor * ends[0], factor * ends[1]
