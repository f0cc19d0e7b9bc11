"""Pieces of a rod: closed forms and spectral solutions of its Bishop frame and its position.

The frame is the unit quaternion a + b j with complex a = w + i x and b = y + i z.  With the body rate (0, k_y, k_z),
k = k_y + i k_z, its equations are linear:

    a' = -conj(k) b / 2,    b' = k a / 2,

and the tangent is (|a|^2 - |b|^2, -2i a b): the integrals p of a b and r of |b|^2 give the position (s - 2 r, -2i p).
A turn psi of the material about the tangent takes (a, b) to (a e, b conj(e)), e = exp(i psi / 2).

A ``State`` (a, b, p, r, s) is what one piece hands to the next; s is the arc length so far.  Along a piece, the columns
of *spinors* are a and conj(b): both turn by e with the material, and a change of the start frame mixes them linearly.
*Paths* hold p and r + i s.
"""

from __future__ import annotations

import cmath
import math
from collections import OrderedDict

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import zgesv

from ctr_pvs.collocation import closed_interpolation
from ctr_pvs.collocation import collocation
from ctr_pvs.collocation import interpolation

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
State = tuple[complex, complex, complex, float, float]

ORIFICE: State = (1.0 + 0.0j, 0.0j, 0.0j, 0.0, 0.0)
#: Added to a rate [rad/m] that is divided by: a straight arc then needs no case of its own.
TINY = 1e-30
#: Rates of turning whose circular functions an ``ArcPlaces`` keeps.
KEPT = 8
ONES = np.ones((4, 1))
IMAGINARY = np.array(1j)


def _chained(
    a: complex, b: complex, p: complex, r: float, s: float, A: complex, B: complex, P: complex, R: float, h: float
) -> State:
    """The state (a, b, p, r, s) carried over a piece of length h that takes the identity to (A, B, P, R)."""
    b_conj = b.conjugate()
    beta, straight = b.real * b.real + b.imag * b.imag, h - 2.0 * R
    p += a * a * P - b * b * P.conjugate() + straight * (a * b)
    r += R + beta * straight + 2.0 * (a * b_conj * P).real
    return a * A - b * B.conjugate(), a * B + b * A.conjugate(), p, r, s + h


class ArcPlaces:
    """Places ``s`` (n,) [m] from the start of an arc; keeps the circular functions of the last few rates there."""

    __slots__ = ("_half", "_kept", "_line")

    def __init__(self, s: Array) -> None:
        self._half = 0.5j * s
        self._line = np.zeros((len(s), 4))
        self._line[:, 2] = s
        self._line[:, 3] = 1.0
        self._kept: OrderedDict[tuple[float, float], tuple[Array, Array]] = OrderedDict()

    def circle(self, omega: float, turn: float) -> tuple[Array, Array]:
        """(n, 4) exp(i turn s / 2) times cos, sin of omega s / 2, and (n, 4) sin cos, sin^2, s, 1.

        A tube that is only turned keeps its rates: at one D most arcs come back.
        """
        kept = self._kept.get((omega, turn))
        if kept is None:
            z = np.exp(self._half * omega)
            line = self._line.copy()
            line.view(complex)[:, 0] = z * z.imag
            spinors = np.empty((len(z), 2), dtype=complex)
            spinors[:, 0], spinors[:, 1] = z.real, z.imag
            if turn:
                spinors *= np.exp(self._half * turn)[:, None]
            kept = self._kept[omega, turn] = spinors.view(float), line
            if len(self._kept) > KEPT:
                self._kept.popitem(last=False)
        return kept


class Arc:
    """Curvature k(s) = ``curvature`` exp(i ``turn`` s) [1/m] over ``length`` [m].

    In a frame that turns with k the strain is constant, so that everything is a closed form.  The material's angle is
    ``roll`` [rad] at the start and changes by ``roll_rate`` [rad/m].
    """

    __slots__ = ("curvature", "length", "roll", "roll_rate", "turn")
    nodes = 0

    def __init__(
        self, length: float, curvature: complex, turn: float = 0.0, roll: float = 0.0, roll_rate: float = 0.0
    ) -> None:
        self.length, self.curvature, self.turn, self.roll, self.roll_rate = length, curvature, turn, roll, roll_rate

    @property
    def start_roll(self) -> float:
        return self.roll

    @property
    def end_roll(self) -> float:
        return self.roll + self.roll_rate * self.length

    def advance(self, state: State) -> State:
        """The state at the end."""
        a, b, p, r, s = state
        h, k, turn = self.length, self.curvature, self.turn
        if not k:
            ab = a * b
            return a, b, p + h * ab, r + h * (b.real * b.real + b.imag * b.imag), s + h
        # From the identity: a = cos + n sin, b = m sin in a frame that turns with k, arguments omega s / 2.
        omega = math.hypot(turn, abs(k)) + TINY
        n, m = 1j * (turn / omega), k / omega
        x = 0.5 * omega * h
        cos, sin = math.cos(x), math.sin(x)
        squares = 0.5 * h - sin * cos / omega
        A, B = cos + n * sin, m * sin
        if turn:
            e = cmath.rect(1.0, 0.5 * turn * h)
            A, B = A * e.conjugate(), B * e
        P, R = m * (sin * sin / omega + n * squares), (m.real * m.real + m.imag * m.imag) * squares
        return (A, B, P, R, h) if s == 0.0 else _chained(a, b, p, r, s, A, B, P, R, h)

    def _other(self, a: complex, b: complex, omega: float) -> tuple[complex, complex]:
        """The a1, b1 of the turning frame a cos + a1 sin, b cos + b1 sin, arguments omega s / 2."""
        n, m = 1j * (self.turn / omega), self.curvature / omega
        return a * n - b * m.conjugate(), a * m - n * b

    @staticmethod
    def prepare(s: Array, length: float, nodes: int) -> ArcPlaces:
        """``s`` (n,) [m] from the start of an arc, prepared for ``trace``."""
        return ArcPlaces(s)

    def trace(self, state: State, places: ArcPlaces, spinors: Array, paths: Array, rolled: bool) -> None:
        """Writes spinors (n, 4), those of the material if ``rolled``, and paths (n, 4): real and imaginary parts."""
        a, b, p, r, s = state
        omega = math.hypot(self.turn, abs(self.curvature)) + TINY
        a1, b1 = self._other(a, b, omega)
        c, c1 = b.conjugate(), b1.conjugate()
        m0, m2, r0, r2 = a * b, a1 * b1, (b * c).real, (b1 * c1).real
        m1, r1 = a * b1 + a1 * b, 2.0 * (b * c1).real
        turn = -self.turn
        if rolled:
            turn += self.roll_rate
            e = cmath.rect(1.0, 0.5 * self.roll)
            a, c, a1, c1 = a * e, c * e, a1 * e, c1 * e
        table = np.array((
            a, c, 1j * a, 1j * c, a1, c1, 1j * a1, 1j * c1,
            (m0 - m2) / omega, (r0 - r2) / omega, m1 / omega, r1 / omega,
            0.5 * (m0 + m2), complex(0.5 * (r0 + r2), 1.0), p, complex(r, s),
        )).view(float).reshape(8, 4)  # fmt: skip
        circle, line = places.circle(omega, turn)
        circle.dot(table[:4], spinors)
        line.dot(table[4:], paths)


class BendPlaces:
    """Matrices of a bend with G nodes to n places ``x`` in [0, 1].

    spinors (n, G + 2) from the start, the nodes and the end; paths (n, G + 1) from rates at the nodes and the start.
    """

    __slots__ = ("paths", "spinors")

    def __init__(self, nodes: int, length: float, x: Array) -> None:
        self.spinors = closed_interpolation(nodes, x)
        self.paths = np.column_stack([length * interpolation(nodes, x)[1], np.ones(len(x))])


class Bend:
    """Curvature k and roll given at the G Gauss nodes of a piece, solved by collocation over all of it.

    length [m]; half_bend (G,) [rad], complex: k length / 2; roll (G,) [rad], the material's angle.  ``nodes_needed``
    tells how many.
    """

    __slots__ = ("_solution", "half_bend", "length", "nodes", "roll")

    def __init__(self, length: float, half_bend: ComplexArray, roll: Array) -> None:
        self.length, self.half_bend, self.roll = length, half_bend, roll
        self.nodes = len(half_bend)
        self._solution: tuple[ComplexArray, ComplexArray, complex, complex, complex, float] | None = None

    @property
    def start_roll(self) -> float:
        return float(collocation(self.nodes).start.dot(self.roll))

    @property
    def end_roll(self) -> float:
        return float(collocation(self.nodes).end.dot(self.roll))

    def solve(self) -> tuple[ComplexArray, ComplexArray, complex, complex, complex, float]:
        """From the identity at the start: spinors (2, G) and b (G,) at the nodes, and a, b, p, r at the end.

        With S the integration matrix and K = k h / 2: a = 1 - S conj(K) b, b = S K a; b is eliminated.
        """
        if self._solution is None:
            table, h = collocation(self.nodes), self.length
            half = self.half_bend
            rows = np.empty((3, self.nodes), dtype=complex)  # conj(K), a, conj(b)
            matrix = table.pairs.dot(np.conjugate(half, rows[0]))
            matrix *= half.repeat(self.nodes)
            matrix += table.identity
            rows[1] = a = zgesv(matrix.reshape(self.nodes, self.nodes).T, table.ones, 1, 0)[2]
            integrals = table.integrals.dot(half * a)
            b = integrals[:-1]
            np.conjugate(b, rows[2])
            fall, p, r = rows.dot(b * table.weights).tolist()
            self._solution = rows[1:], b, 1.0 - fall, integrals.item(-1), h * p, h * r.real
        return self._solution

    def advance(self, state: State) -> State:
        """The state at the end."""
        a, b, p, r, s = state
        _, _, A, B, P, R = self._solution or self.solve()
        return (A, B, P, R, self.length) if s == 0.0 else _chained(a, b, p, r, s, A, B, P, R, self.length)

    @staticmethod
    def prepare(s: Array, length: float, nodes: int) -> BendPlaces:
        """``s`` (n,) [m] from the start of a bend of that length and number of nodes, prepared for ``trace``."""
        return BendPlaces(nodes, length, s / length)

    def trace(self, state: State, places: BendPlaces, spinors: Array, paths: Array, rolled: bool) -> None:
        """Writes spinors (n, 4), those of the material if ``rolled``, and paths (n, 4): real and imaginary parts."""
        a, b, p, r, s = state
        inner, inner_b, A, B, _, _ = self.solve()
        table = collocation(self.nodes)
        local = table.spinors.copy()
        local[:, 1:-1] = inner
        local[0, -1], local[1, -1] = A, B.conjugate()
        products = inner * inner_b
        rates = table.rates.copy()
        rates[0, :-1] = products[0].real
        rates[1, :-1] = products[0].imag
        rates[2, :-1] = products[1].real
        if rolled:
            local *= np.exp(IMAGINARY * table.half_roll.dot(self.roll))
        a_conj, b_conj = a.conjugate(), b.conjugate()
        square, other, mixed, cross = a * a, b * b, a * b, a * b_conj
        beta = (b * b_conj).real
        mixing = np.array((
            a, b_conj, -b, a_conj,
            square - other, 2.0 * cross.real, 1j * (square + other), -2.0 * cross.imag,
            -2.0 * mixed, 1.0 - 2.0 * beta, mixed, complex(beta, 1.0), p, complex(r, s),
        ))  # fmt: skip
        parts = places.spinors.dot(local.T.dot(mixing[:4].reshape(2, 2)).view(float))
        # Between the nodes the norm is that of a polynomial.
        np.divide(parts, np.sqrt((parts * parts).dot(ONES)), spinors)
        places.paths.dot(rates.T.dot(mixing[4:].view(float).reshape(5, 4)), paths)


Piece = Arc | Bend
