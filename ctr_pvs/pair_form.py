"""The energy in pairs of tubes, in the form that is quickest to evaluate.

With theta the angle between the turned pre-curvatures of two tubes at a Gauss point,

    E = q.q / 2 - sum amplitude cos(theta) + constant,      theta = phase + alpha_j - alpha_i + d q,

so gradient and Hessian are linear in sin(theta) and cos(theta).  Everything else is a table of the base positions D.
Hessians are in LAPACK's packed storage: the upper triangle, column by column, so that the leading unknowns come first.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.composition import sealed
from ctr_pvs.energy import TorsionEnergy
from ctr_pvs.unknowns import KEPT
from ctr_pvs.unknowns import Unknowns

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

#: Up to this many entries one table that maps (cos, sin) to (Hessian, gradient) is quicker than a matrix product.
LARGEST_TABLE = 40_000


class Pairs:
    """Every two tubes that pull each other at a Gauss point of ``energy``: R rows.

    amplitude, phase (R,) [J], [rad]; turns (R, N) = d theta / d alpha; map (R, n) = d theta / dq, with the columns of q
    in the given ``order``, else in that of ``energy``.
    tubes : the two tubes of each pair; node (R,) : Gauss point of each row; member (pairs, R) : 1 for rows of a pair.
    wave (R,) : amplitude exp(i phase).
    """

    def __init__(self, energy: TorsionEnergy, order: NDArray[np.int64] | slice = slice(None)) -> None:
        space = energy.space
        rows = _rows(space.unknowns)
        self.tubes, self.turns, self._ends = rows.tubes, rows.turns, rows.ends
        self.member, self.node, self.first, self.second = rows.member, rows.node, rows.first, rows.second
        self.wave = energy.moment.take(rows.at_first).conj() * energy.moment.take(rows.at_second)
        self.wave *= energy.coupling.take(rows.node)
        self.amplitude, self.phase = np.abs(self.wave), np.angle(self.wave)
        modes = space.modes.take(rows.second, axis=0) - space.modes.take(rows.first, axis=0)
        self.map = (rows.integrals * modes)[:, order]

    def angles(self, psi: Array) -> Array:
        """theta (R,) [rad] between the turned pre-curvatures, from psi (G, N) at the Gauss points."""
        return self.phase + psi[self.node, self.second] - psi[self.node, self.first]

    def waves(self, n: int) -> Array:
        """(2 R + 2, n + N + 1): maps (q, alpha, 1) to the angles whose sines are cos(theta), sin(theta), 1 and 0."""
        rows = len(self.amplitude)
        table = np.empty((2 * rows + 2, n + self._ends.shape[1]))
        table[:rows, :n] = table[rows:-2, :n] = self.map[:, :n]
        table[-2:, :n] = 0.0
        table[:, n:] = self._ends
        table[:rows, -1] += self.phase
        table[rows:-2, -1] = self.phase
        return table


class _Rows:
    """What the rows of ``Pairs`` are about, whatever the lengths of sections.

    at_first, at_second (R,) : where a table (G, N) has the two tubes.  integrals (R, n) of the unknowns' functions.
    """

    def __init__(self, given: Unknowns) -> None:
        tubes, places = given.composition.bending.shape[1], given.nodes
        first, second = np.triu_indices(tubes, 1)
        curved = given.composition.curved[places.section]
        self.node, pair = np.nonzero(curved[:, first] & curved[:, second])
        self.tubes = list(zip(first.tolist(), second.tolist(), strict=True))
        self.first, self.second = first[pair], second[pair]
        self.member = (np.arange(len(self.tubes))[:, None] == pair).astype(complex)
        self.at_first, self.at_second = self.node * tubes + self.first, self.node * tubes + self.second
        self.integrals = places.integrals[self.node]
        self.turns = np.zeros((len(self.node), tubes))
        row = np.arange(len(self.node))
        self.turns[row, self.first] = -1.0
        self.turns[row, self.second] = 1.0
        #: (2 R + 2, N + 1) the columns of ``Pairs.waves`` for alpha and 1, less the phases
        self.ends = np.zeros((2 * len(row) + 2, tubes + 1))
        self.ends[: len(row), :-1] = self.ends[len(row) : -2, :-1] = self.turns
        self.ends[: len(row), -1] = self.ends[-2, -1] = 0.5 * np.pi
        sealed(self)


@lru_cache(maxsize=KEPT)
def _rows(given: Unknowns) -> _Rows:
    return _Rows(given)


@lru_cache(maxsize=64)
def _packed(n: int) -> tuple[Indices, Indices, Array]:
    """Columns and rows of the entries in packed storage, and 1 for those of the diagonal."""
    column, row = np.tril_indices(n)
    return column, row, (column == row).astype(float)


class PackedForm:
    """Hessian and gradient of the first ``n`` unknowns from the sines of ``Pairs.waves``.

    tangents : whether d(gradient) / d alpha of every tube follows the gradient.
    """

    def __init__(self, pairs: Pairs, n: int, tangents: bool) -> None:
        self.n = n
        self.size = n * (n + 1) // 2
        self.pairs = pairs
        self.turns = pairs.turns if tangents else pairs.turns[:, :0]
        self.sides = 1 + self.turns.shape[1]
        self._column, self._row, self._diagonal = _packed(n)
        rows = len(pairs.amplitude)
        self._map = np.ascontiguousarray(pairs.map.T[:n])
        entries = (self.size + n * self.sides) * (2 * rows + 2)
        self._table = self._tabulate() if entries <= LARGEST_TABLE else None
        if self._table is None:
            self._convex = self._pack((self._map * pairs.amplitude) @ self._map.T)
            self._one = self._pack(np.eye(n))

    def _pack(self, matrix: Array) -> Array:
        return matrix[self._column, self._row]

    def _tabulate(self) -> Array:
        size, n, rows = self.size, self.n, len(self.pairs.amplitude)
        scaled = self._map * self.pairs.amplitude
        table = np.zeros((size + n * self.sides, 2 * rows + 2))
        products = np.multiply(
            scaled.take(self._column, axis=0), self._map.take(self._row, axis=0), table[:size, :rows]
        )
        table[:size, -2] = self._diagonal
        np.negative(products.sum(axis=1), table[:size, -1])
        table[size : size + n, rows:-2] = scaled
        answers = table[size + n :].reshape(self.sides - 1, n, 2 * rows + 2)
        np.multiply(scaled, self.turns.T[:, None, :], answers[:, :, :rows])
        return table

    def terms(self, sines: Array) -> Array:
        """The packed Hessian, then the right-hand sides one by one: gradient less q, and what each alpha adds to it.

        sines : of the angles of ``Pairs.waves``.  The last one, 0 otherwise, says how far every cos(theta) may fall:
        then the Hessian is a lower bound of all those within.
        """
        if self._table is not None:
            return self._table.dot(sines)
        rows = len(self.pairs.amplitude)
        weighted = self.pairs.amplitude * sines[:rows]
        out = np.empty(self.size + self.sides * self.n)
        out[: self.size] = self._pack((self._map * weighted).dot(self._map.T)) + self._one - sines[-1] * self._convex
        sides = out[self.size :].reshape(self.sides, self.n)
        sides[0] = self._map.dot(self.pairs.amplitude * sines[rows : 2 * rows])
        sides[1:] = (self.turns.T * weighted).dot(self._map.T)
        return out

    def unpacked(self, sines: Array) -> Array:
        """The Hessian (n, n); only its lower triangle is set."""
        hessian = np.zeros((self.n, self.n))
        hessian[self._column, self._row] = self.terms(sines)[: self.size]
        return hessian
