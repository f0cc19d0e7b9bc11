"""Units of other codes' files: said, never guessed. Only moduli tell by their size: in Pa they are 1e7 and more, which
in MPa or GPa nothing is."""

from __future__ import annotations

from collections.abc import Iterable

from ctr_pvs.errors import RobotFileError

#: By kind of quantity: words and factors.
UNITS = {
    "length": {"m": 1.0, "mm": 1e-3},
    "modulus": {"Pa": 1.0, "MPa": 1e6, "GPa": 1e9},
    "curvature": {"1/m": 1.0, "1/mm": 1e3},
    "angle": {"rad": 1.0, "deg": 0.017453292519943295},
}
WORDS = tuple(word for factors in UNITS.values() for word in factors)
_KIND = {
    **dict.fromkeys(("length", "straight", "curved", "outer_diameter", "inner_diameter", "radius", "beta"), "length"),
    **dict.fromkeys(("youngs_modulus", "shear_modulus"), "modulus"),
    **dict.fromkeys(("curvature", "u_x", "u_y"), "curvature"),
    "theta": "angle",
}
_SUFFIXES = {"_mm": 1e-3, "_deg": UNITS["angle"]["deg"]}
_SMALLEST_MODULUS = 1e7  # Pa


class Units:
    """What is known of a file's units.

    Args:
        file: for errors.
        words: of ``WORDS``, at most one of a kind.
    """

    def __init__(self, file: str, words: Iterable[str]) -> None:
        self._file = file
        self._known: dict[str, str] = {}
        for word in words:
            kind = next((kind for kind, factors in UNITS.items() if word in factors), None)
            if kind is None or self._known.setdefault(kind, word) != word:
                rule = f"units of {', '.join(WORDS)}, one of each kind"
                raise RobotFileError(file, "units", word, rule)

    def stripped(self, key: str) -> str:
        """A key without the unit that it may end in."""
        suffix = self._suffix(key)
        return key[: -len(suffix)] if suffix else key

    def scaled(self, where: str, quantity: str, key: str, value: float) -> float:
        """A value in SI units."""
        kind = _KIND.get(quantity)
        if kind is None or value == 0.0:
            return value
        suffix = self._suffix(key)
        if suffix:
            return _SUFFIXES[suffix] * value
        word = self._known.get(kind) or self._by_others(kind, value)
        if word is None:
            choices = ", ".join(UNITS[kind])
            rule = f"a known unit, which the file does not say ({choices})"
            raise RobotFileError(
                self._file, f"{where}.{key}", value, rule, f"give it: --units {next(iter(UNITS[kind]))}"
            )
        return UNITS[kind][word] * value

    def _by_others(self, kind: str, value: float) -> str | None:
        if kind == "modulus" and value >= _SMALLEST_MODULUS:
            return "Pa"
        return "1/m" if kind == "curvature" and self._known.get("length") == "m" else None

    @staticmethod
    def _suffix(key: str) -> str:
        return next((suffix for suffix in _SUFFIXES if key.lower().endswith(suffix)), "")
