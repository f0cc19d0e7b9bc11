"""What to write in place of a key that robot files do not have. Other codes have other habits, so a hint names the
conversion with its factor: a name alone would let a number in the wrong unit through."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

#: What a key may end in: the unit meant here, and what one of the other is in it.
_SUFFIXES = {
    "mm": ("m", "1 mm is 1e-3 m"),
    "cm": ("m", "1 cm is 1e-2 m"),
    "um": ("m", "1 um is 1e-6 m"),
    "inch": ("m", "1 inch is 25.4e-3 m"),
    "gpa": ("Pa", "1 GPa is 1e9 Pa"),
    "mpa": ("Pa", "1 MPa is 1e6 Pa"),
    "deg": ("rad", "1 deg is 0.0174532925 rad"),
    "deg_per_mm": ("rad/m", "1 deg/mm is 17.4532925 rad/m"),
    "per_mm": ("1/m", "1/mm is 1e3 1/m"),
    "g_cm3": ("kg/m^3", "1 g/cm^3 is 1e3 kg/m^3"),
    "nmm2": ("N m^2", "1 N mm^2 is 1e-6 N m^2"),
}
#: Names of others, in lower case, and ours.
_NAMES = {
    "od": "outer_diameter",
    "outer_dia": "outer_diameter",
    "diameter_outer": "outer_diameter",
    "id": "inner_diameter",
    "inner_dia": "inner_diameter",
    "diameter_inner": "inner_diameter",
    "e": "youngs_modulus",
    "g": "shear_modulus",
    "nu": "poissons_ratio",
    "poisson": "poissons_ratio",
    "poisson_ratio": "poissons_ratio",
    "ei": "bending_stiffness",
    "gj": "torsional_stiffness",
    "rho": "density",
    "straight_length": "length",
    "curved_length": "length",
    "length_straight": "straight_length",
    "length_curved": "curved_length",
    "kappa": "curvature",
    "kappa_y": "curvature_y",
    "kappa_z": "curvature_z",
    "radius_of_curvature": "radius",
    "theta": "alpha",
}
#: Names of others whose numbers are not ours, in lower case.
_CONVERSIONS = {
    "beta": "D = -beta, in m: [low, high] of beta is [-high, -low] of D, and a robot file has it under limits only",
    "outer_radius": "outer_diameter = 2 * outer_radius, in m",
    "inner_radius": "inner_diameter = 2 * inner_radius, in m",
    "u_x": "curvature_y: [u_x], in 1/m, see docs/conventions.md",
    "u_y": "curvature_z: [u_y], in 1/m, see docs/conventions.md",
    "pitch": "turn = 6.28318531 / pitch, in rad/m, with the pitch in m along the tube",
    "bend_angle": "curvature = bend_angle / curved_length, in 1/m, with the angle in rad",
}


def remedy(key: str, known: Iterable[str]) -> str:
    """What to do about a `key` that is none of the `known`."""
    known = tuple(known)
    lower = key.lower()
    if lower in _CONVERSIONS:
        return f"write {_CONVERSIONS[lower]}"
    for suffix, (unit, factor) in _SUFFIXES.items():
        name = _ours(key[: -len(suffix) - 1], known) if lower.endswith(f"_{suffix}") else None
        if name is not None:
            return f"write {name} in {unit}; {factor}"
    name = _ours(key, known)
    if name is not None:
        return f"write {name}, in SI units"
    near = difflib.get_close_matches(key, known, n=1)
    if not near:
        return "remove it"
    in_what = ", in SI units" if key.startswith(f"{near[0]}_") else ""
    return f"did you mean {near[0]!r}{in_what}?"


def _ours(name: str, known: tuple[str, ...]) -> str | None:
    """The known key that others call `name`."""
    ours = name if name in known else _NAMES.get(name.lower())
    return ours if ours in known else None
