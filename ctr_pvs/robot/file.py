"""From a robot file to a Robot. What the keys mean stands in `load_robot`; what values may be, mostly in `robot`."""

from __future__ import annotations

import math
import os
import warnings
from collections.abc import Mapping
from dataclasses import replace

from ctr_pvs.errors import RobotFileError
from ctr_pvs.errors import RobotWarning
from ctr_pvs.robot.cross_section import annulus_area
from ctr_pvs.robot.cross_section import annulus_stiffness
from ctr_pvs.robot.cross_section import shear_modulus_from_poisson
from ctr_pvs.robot.cross_section import torsional_from_poisson
from ctr_pvs.robot.file_table import Table
from ctr_pvs.robot.plausibility import implausible
from ctr_pvs.robot.play import NO_PLAY
from ctr_pvs.robot.play import WIDEST
from ctr_pvs.robot.play import PlayWidths
from ctr_pvs.robot.reading.samples import table_pieces
from ctr_pvs.robot.reading.units import SEGMENT_KEYS
from ctr_pvs.robot.reading.units import TUBE_KEYS
from ctr_pvs.robot.reading.units import limits_of
from ctr_pvs.robot.reading.units import segment_in_si
from ctr_pvs.robot.reading.units import segment_tables
from ctr_pvs.robot.reading.units import tube_in_si
from ctr_pvs.robot.robot import DENSITY_RANGE
from ctr_pvs.robot.robot import DIAMETER_RANGE
from ctr_pvs.robot.robot import LARGEST_CURVATURE
from ctr_pvs.robot.robot import LARGEST_TURN
from ctr_pvs.robot.robot import LENGTH_RANGE
from ctr_pvs.robot.robot import MODULUS_RANGE
from ctr_pvs.robot.robot import STIFFNESS_RANGE
from ctr_pvs.robot.robot import Limits
from ctr_pvs.robot.robot import Robot
from ctr_pvs.robot.robot import Segment
from ctr_pvs.robot.robot import Tube
from ctr_pvs.robot.robot import check_diameters
from ctr_pvs.robot.shipped import is_a_name
from ctr_pvs.robot.shipped import shipped_robots
from ctr_pvs.robot.strict_yaml import read_yaml

_MODULI = ("youngs_modulus", "shear_modulus", "poissons_ratio")
_STIFFNESSES = ("bending_stiffness", "torsional_stiffness")
_DIAMETERS = ("inner_diameter", "outer_diameter")
_MATERIAL = (*_MODULI, *_STIFFNESSES, *_DIAMETERS)
_POLYNOMIAL = ("curvature_y", "curvature_z")
_HELIX = ("curvature", "turn")

_TWO_WAYS = (
    "give youngs_modulus, shear_modulus or poissons_ratio, and both diameters, "
    "or else bending_stiffness and torsional_stiffness or poissons_ratio"
)

# A coefficient c_k counts as c_k X^k, so its own size says little; this only keeps sums finite.
_LARGEST_COEFFICIENT = 1e100


def load_robot(path: str | os.PathLike[str]) -> Robot:
    """The robot that a YAML file describes: a path, or the name of a robot that comes with the code (`renda2021`).

    ::

        name: renda2021
        tubes:                       # outermost first
          - name: outer              # becomes part of joint names
            youngs_modulus: 58.0e9   # Pa
            shear_modulus: 21.5e9    # Pa; or poissons_ratio
            inner_diameter: 2.01e-3  # m
            outer_diameter: 2.39e-3  # m
            density: 6.45e3          # kg/m^3; optional, for the weight under gravity
            segments:                # from the base to the tip
              - {length: 93.5e-3}                       # m; straight
              - {length: 92.3e-3, curvature_y: [9.9]}   # polynomial in the segment's own abscissa, 1/m, 1/m^2, ...
        limits:                      # optional, what the actuators can reach
          alpha: {outer: [-3.2, 3.2]}                   # rad
          D: {outer: [0.0, 0.15]}                       # m
        play:                        # optional, widths of the backlash between actuators and tubes
          alpha: {outer: 0.05}                          # rad
          D: {outer: 0.5e-3}                            # m

    In place of the moduli, `bending_stiffness` K and `torsional_stiffness` G J [N m^2] may be given; diameters then
    only serve to check that tubes fit, and for weight. `poissons_ratio` nu in place of the torsional stiffness stands
    for G J = K / (1 + nu), which holds for any round section. A segment may give any of these keys again, for itself:
    for example the stiffnesses of a patterned stretch. A helical segment has `curvature` [1/m] and `turn` [rad/m] in
    place of the polynomials; where its curvature changes along it, `curvature` is a polynomial, too.

    Pre-curvature that was measured: `curvature_table: {s: [..], kappa_y: [..], kappa_z: [..], tolerance: 1e-3}`, or
    `{file: measured.csv}` with these columns, stands in place of a segment's length and polynomials, or of a tube's
    segments; s [m] counts from the base of that segment or tube, and the last one is its length. As few polynomial
    segments as it takes are fitted within the tolerance [1/m].

    Other units and words, only by keys that say so: `length_mm`, `inner_diameter_mm`, `outer_diameter_mm`, a segment's
    `radius` [m] or `radius_mm` of an arc, 1/curvature_y; `straight_length` and `curved_length` [m], or `_mm`, with one
    `curvature` or `radius` in place of segments; `alpha_deg` and `D_mm` among the limits.

    Raises:
        RobotFileError: for anything that cannot be read or breaks a rule, naming file, key path, value and rule.

    Warns:
        RobotWarning: for numbers that look as if they were in another unit, see `robot.plausibility`.
    """
    file = _file(os.fspath(path))
    content = read_yaml(file)
    if not isinstance(content, dict):
        raise RobotFileError(file, "", content, "a mapping with the keys name and tubes")
    top = Table(file, "", content)
    top.refuse_other_keys(("name", "tubes", "limits", "play"))
    name = top.require("name", "the robot's name")
    tubes = tuple(_tube(table) for table in top.tables("tubes", "tube"))
    with top.blamed():
        robot = Robot(name, tubes)  # so that limits are read against names known to be good
        names = [tube.name for tube in tubes]
        robot = replace(robot, limits=_limits(top.table("limits"), names), play=_play(top.table("play"), names))
    for remark in implausible(robot):
        warnings.warn(f"{file}: {remark}", RobotWarning, stacklevel=2)
    return robot


def _file(path: str) -> str:
    """The path of the file that is meant."""
    if not is_a_name(path):
        return path
    shipped = shipped_robots()
    if path not in shipped:
        names = ", ".join(shipped) or "none: the folder share/ctr_pvs was not installed"
        raise RobotFileError(path, "", "no such file", f"a robot file, or the name of a shipped robot ({names})")
    return os.fspath(shipped[path])


def _tube(table: Table) -> Tube:
    table.refuse_other_keys(("name", "segments", "density", *_MATERIAL, *TUBE_KEYS, "curvature_table"))
    table = tube_in_si(table)
    name = table.require("name", "the tube's name")
    material = _material(table)
    stretches = []
    for written in segment_tables(table):
        written.refuse_other_keys(("length", *_POLYNOMIAL, *_HELIX, *_MATERIAL, *SEGMENT_KEYS, "curvature_table"))
        entry = segment_in_si(written)
        stretches.append((entry, _overridden(material, _material(entry))))
    density = table.number("density", *DENSITY_RANGE, "kg/m^3") if "density" in table else None
    vary = len({tuple(values.get(key) for key in _DIAMETERS) for _, values in stretches}) > 1
    segments = tuple(segment for entry, values in stretches for segment in _segments(entry, values, vary))
    inner = [values["inner_diameter"] for _, values in stretches if "inner_diameter" in values]
    outer = [values["outer_diameter"] for _, values in stretches if "outer_diameter" in values]
    with table.blamed():
        return Tube(name, segments, min(inner, default=None), max(outer, default=None), density)


def _segments(table: Table, material: Mapping[str, float], diameters_vary: bool) -> tuple[Segment, ...]:
    """One segment, or as many as its curvature table takes."""
    if "curvature_table" in table:
        laws = [(piece.length, piece.coefficients, 0.0) for piece in table_pieces(table)]
    else:
        laws = [(table.number("length", *LENGTH_RANGE, "m"), *_pre_curvature(table))]
    bending_stiffness, torsional_stiffness = _stiffness(table, material)
    # Where diameters vary, those of the tube are a summary, and the area is the segment's own.
    own_area = diameters_vary and all(key in material for key in _DIAMETERS)
    area = annulus_area(*(material[key] for key in _DIAMETERS)) if own_area else None
    # A law of too much curvature is blamed on the key that makes it.
    written = next((key for key in (*_POLYNOMIAL, "curvature") if key in table), "curvature")
    blame = {f"curvature[{index}]": written for _, law, _ in laws for index in range(len(law))}
    with table.blamed(blame):
        return tuple(
            Segment(length, bending_stiffness, torsional_stiffness, law, turn, area) for length, law, turn in laws
        )


def _pre_curvature(table: Table) -> tuple[tuple[complex, ...], float]:
    """(coefficients c_k, turn) as `Segment` takes them."""
    polynomial = [key for key in _POLYNOMIAL if key in table]
    helix = [key for key in _HELIX if key in table]
    if helix and polynomial:
        raise table.error(helix[0], f"either curvature and turn or {polynomial[0]}, not both", "remove one of them")
    if helix:
        for key, what in (("curvature", "the helix' curvature in 1/m"), ("turn", "the helix' turn in rad/m")):
            table.require(key, what, "a helix has both; write curvature_y: [...] for a plane arc")
        turn = table.number("turn", -LARGEST_TURN, LARGEST_TURN, "rad/m")
        if isinstance(table.values["curvature"], list):
            return tuple(map(complex, table.numbers("curvature", -_LARGEST_COEFFICIENT, _LARGEST_COEFFICIENT))), turn
        return (complex(table.number("curvature", -LARGEST_CURVATURE, LARGEST_CURVATURE, "1/m")),), turn
    y, z = (table.numbers(key, -_LARGEST_COEFFICIENT, _LARGEST_COEFFICIENT) for key in _POLYNOMIAL)
    count = max(len(y), len(z))
    y, z = (values + [0.0] * (count - len(values)) for values in (y, z))
    return tuple(map(complex, y, z)), 0.0


def _material(table: Table) -> dict[str, float]:
    """The material keys given at one level, a tube's or a segment's, checked on their own."""
    material = {}
    for keys, low, high, unit in (
        (("youngs_modulus", "shear_modulus"), *MODULUS_RANGE, "Pa"),
        (_STIFFNESSES, *STIFFNESS_RANGE, "N m^2"),
        (_DIAMETERS, *DIAMETER_RANGE, "m"),
    ):
        material.update({key: table.number(key, low, high, unit) for key in keys if key in table})
    if "poissons_ratio" in table:
        material["poissons_ratio"] = _poissons_ratio(table)
    _refuse_two_ways(table)
    if all(key in material for key in _DIAMETERS):
        with table.blamed():
            check_diameters(material["inner_diameter"], material["outer_diameter"])
    return material


def _refuse_two_ways(table: Table) -> None:
    """Raises where one level gives a stiffness twice. A ratio may stand beside the bending stiffness alone."""
    moduli = [key for key in _MODULI if key in table]
    stiffnesses = [key for key in _STIFFNESSES if key in table]
    if moduli == ["poissons_ratio"]:
        stiffnesses = [key for key in stiffnesses if key == "torsional_stiffness"]
    if moduli and stiffnesses:
        raise table.error(stiffnesses[0], f"stiffness given one way, but {moduli[0]} is here too", _TWO_WAYS)
    if "shear_modulus" in table and "poissons_ratio" in table:
        raise table.error("poissons_ratio", "either shear_modulus or poissons_ratio, not both", "remove one of them")


def _poissons_ratio(table: Table) -> float:
    value = table.number("poissons_ratio", -1.0, 0.5)
    if value == -1.0:  # the shear modulus would be infinite
        raise table.error("poissons_ratio", "a number above -1 and at most 0.5")
    return value


def _overridden(tube: Mapping[str, float], segment: Mapping[str, float]) -> dict[str, float]:
    """The tube's material with the segment's own in its place, also where that puts it another way.

    Only moduli need room made for them: where stiffnesses are there as well, `_stiffness` looks no further. A ratio
    alone says anew how stiff the same section is in torsion.
    """
    replaced: set[str] = set()
    if "youngs_modulus" in segment or "shear_modulus" in segment:
        replaced.update(_STIFFNESSES)
    if "poissons_ratio" in segment:
        replaced.add("torsional_stiffness")
    if "shear_modulus" in segment or "poissons_ratio" in segment:
        replaced.update(("shear_modulus", "poissons_ratio"))
    return {key: value for key, value in tube.items() if key not in replaced} | dict(segment)


def _stiffness(table: Table, material: Mapping[str, float]) -> tuple[float, float]:
    """(K, G J) [N m^2] of one segment; errors stand at the segment, though its tube may hold the missing key."""

    def require(key: str, what: str) -> float:
        if key not in material:
            raise table.error(key, f"{what}, for the segment or its whole tube", _TWO_WAYS)
        return material[key]

    if any(key in material for key in _DIAMETERS):
        inner, outer = (require(key, "both diameters or neither") for key in _DIAMETERS)
        with table.blamed():
            check_diameters(inner, outer)
    if any(key in material for key in _STIFFNESSES):
        bending = require("bending_stiffness", "both stiffnesses")
        if "torsional_stiffness" not in material and "poissons_ratio" in material:
            return bending, torsional_from_poisson(bending, material["poissons_ratio"])
        return bending, require("torsional_stiffness", "both stiffnesses")
    youngs_modulus = require("youngs_modulus", "Young's modulus in Pa")
    if "poissons_ratio" in material:
        shear_modulus = shear_modulus_from_poisson(youngs_modulus, material["poissons_ratio"])
    else:
        shear_modulus = require("shear_modulus", "the shear modulus in Pa")
    inner, outer = (require(key, "a diameter in m") for key in _DIAMETERS)
    return annulus_stiffness(youngs_modulus, shear_modulus, inner, outer)


def _limits(table: Table, names: list[str]) -> Limits:
    table.refuse_other_keys(("alpha", "alpha_deg", "D", "D_mm"))
    alpha = limits_of(table, "alpha", "alpha_deg", "deg", math.pi / 180.0, names)
    return Limits(alpha, limits_of(table, "D", "D_mm", "mm", 1e-3, names))


def _play(table: Table, names: list[str]) -> PlayWidths:
    table.refuse_other_keys(tuple(WIDEST))
    widths = {}
    for kind, widest in WIDEST.items():
        entries = table.table(kind)
        entries.refuse_other_keys(names, "tube")
        widths[kind] = tuple(entries.number(name, 0.0, widest) if name in entries else 0.0 for name in names)
    return PlayWidths(**widths) if any(map(any, widths.values())) else NO_PLAY
