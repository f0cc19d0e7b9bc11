"""Pre-curvature measured along a tube: a table of samples becomes as few polynomial segments as meet a tolerance.

From the base on, each piece is the longest that one polynomial of at most ``HIGHEST_DEGREE`` fits. It is fitted by
least squares in Chebyshev polynomials, which do not lose digits, and judged as it is handed on, in powers of the
abscissa: at each sample it may be off by the tolerance, and between two samples, from the straight line between them,
by no more than the tolerance and a quarter of what the slope of the table changes there, times their distance. A smooth
curve bulges half as much; a polynomial that swings between its samples does not pass.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import Polynomial
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from ctr_pvs.robot.robot import LARGEST_CURVATURE

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

HIGHEST_DEGREE = 9
MOST_PIECES = 40
#: Places between two samples where a piece is judged, as shares of the way from one to the next.
BETWEEN = np.array([0.25, 0.5, 0.75])
#: What may be summed up of the terms of a piece [1/m]: far below what a segment takes, so that few digits cancel.
_LARGEST_SUM = 0.1 * LARGEST_CURVATURE
#: T_k(2 x - 1) in powers of x, a row for each k.
_POWERS = np.array(
    [
        np.pad(chebyshev.Chebyshev.basis(k)(Polynomial([-1.0, 2.0])).coef, (0, HIGHEST_DEGREE - k))
        for k in range(HIGHEST_DEGREE + 1)
    ]
)
#: Steps of the search for a tolerance that would do; each halves what is open of its exponent.
_STEPS = 12


@dataclass(frozen=True)
class Piece:
    """One polynomial: its length [m] and coefficients in 1/m, 1/m^2, .. of its own abscissa, kappa_y + i kappa_z."""

    length: float
    coefficients: tuple[complex, ...]


class Samples:
    """A table.

    Args:
        s: (n,) places [m], rising, n at least 2.
        kappa: (n,) kappa_y + i kappa_z [1/m].
    """

    def __init__(self, s: Array, kappa: ComplexArray) -> None:
        self.s, self.kappa = s, kappa
        slopes = np.diff(kappa) / np.diff(s)
        bends = np.pad(np.abs(np.diff(slopes)), 1, mode="constant")
        # From the chord of an interval h, a curve whose slope changes by b over it departs by b h / 8.
        self._bulge = 0.25 * np.diff(s) * np.maximum(bends[:-1], bends[1:])

    def pieces(self, tolerance: float) -> list[Piece] | None:
        """Pieces that fit within the tolerance [1/m]; None if it takes more than ``MOST_PIECES``."""
        found = list(itertools.islice(self._all_pieces(tolerance), MOST_PIECES + 1))
        return found if len(found) <= MOST_PIECES else None

    def tolerance_that_would_do(self, too_small: float) -> float:
        """A tolerance [1/m] above one that is `too_small`, with two digits, close to the smallest that is not."""
        low, high = np.log10(too_small), np.log10(2.0 * float(np.abs(self.kappa).max()) + 2.0 * too_small)
        for _ in range(_STEPS):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if self.pieces(10.0**middle) is None else (low, middle)
        enough = _two_digits(10.0**high)
        while self.pieces(enough) is None:  # a larger tolerance may take a piece more now and then
            enough = _two_digits(1.1 * enough)
        return enough

    def _all_pieces(self, tolerance: float) -> Iterator[Piece]:
        begin, last = 0, len(self.s) - 1
        while begin < last:
            end, piece = self._longest(begin, tolerance)
            yield piece
            begin = end

    def _longest(self, begin: int, tolerance: float) -> tuple[int, Piece]:
        """The sample where the longest piece from `begin` ends, and the piece. Two samples always fit."""
        last = len(self.s) - 1
        good, piece = begin + 1, self._fit(begin, begin + 1, tolerance)
        assert piece is not None
        step, bad = 1, last + 1
        while bad - good > 1:  # first in steps that double, then between what fits and what does not
            end = min(good + step, last) if bad > last else (good + bad) // 2
            longer = self._fit(begin, end, tolerance)
            if longer is None:
                bad = end
            else:
                good, piece, step = end, longer, 2 * step
        return good, piece

    def _fit(self, begin: int, end: int, tolerance: float) -> Piece | None:
        """The polynomial of lowest degree that fits the samples from `begin` to `end`, both included."""
        s, kappa = self.s[begin : end + 1] - self.s[begin], self.kappa[begin : end + 1]
        degree = min(HIGHEST_DEGREE, end - begin)
        # One QR decomposition serves all degrees: its first columns span the polynomials of lower ones.
        q, r = np.linalg.qr(chebyshev.chebvander(2.0 * s / s[-1] - 1.0, degree))
        along = q.T @ kappa
        off = np.abs(np.cumsum(q * along, axis=1) - kappa[:, None]).max(axis=0)
        for d in np.flatnonzero(off <= tolerance).tolist():
            series = np.asarray(np.linalg.solve(r[: d + 1, : d + 1], along[: d + 1]), dtype=np.complex128)
            coefficients = _in_powers(series, float(s[-1]))
            within = tolerance + self._bulge[begin:end, None]
            if _is_good(s, kappa, coefficients, tolerance, within):
                return Piece(float(s[-1]), tuple(coefficients.tolist()))
        return _chord(s, kappa) if end == begin + 1 else None


def _two_digits(tolerance: float) -> float:
    """Rounded up."""
    unit = 10.0 ** (np.floor(np.log10(tolerance)) - 1.0)
    return float(f"{np.ceil(tolerance / unit) * unit:.1e}")


def _in_powers(series: ComplexArray, length: float) -> ComplexArray:
    """Coefficients of the powers of X [m] in [0, length] of a Chebyshev series in 2 X / length - 1."""
    count = len(series)
    return np.asarray(series @ _POWERS[:count, :count] / length ** np.arange(count))


def _is_good(s: Array, kappa: ComplexArray, coefficients: ComplexArray, tolerance: float, within: Array) -> bool:
    """Whether a polynomial is close to its samples, and to the chords between them."""
    if np.sum(np.abs(coefficients) * s[-1] ** np.arange(len(coefficients))) > _LARGEST_SUM:
        return False
    value = Polynomial(coefficients)
    places = s[:-1, None] + BETWEEN * np.diff(s)[:, None]
    chords = kappa[:-1, None] + BETWEEN * np.diff(kappa)[:, None]
    at_samples = np.abs(value(s) - kappa).max() <= tolerance
    return bool(at_samples and (np.abs(value(places) - chords) <= within).all())


def _chord(s: Array, kappa: ComplexArray) -> Piece:
    """The straight line between two samples, also where rounding is all that the tolerance would leave."""
    return Piece(float(s[1]), (complex(kappa[0]), complex((kappa[1] - kappa[0]) / s[1])))
