"""The energy in pairs of tubes, in the form that is quickest to evaluate.

With theta the angle between the turned pre-curvatures of two tubes at a Gauss point,

    E = q.q / 2 - sum amplitude cos(theta) + constant,      theta = phase + alpha_j - alpha_i + d q,

so gradient and Hessian are linear in sin(theta) and cos(theta).  Everything else is a table of the base positions D.
Hessians are in LAPACK's packed storage: the upper triangle, column by column, so that the leading unknowns come first.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.energy import TorsionEnergy

Array = NDArray[np.float64]

#: Up to this many entries one table that maps (cos, sin) to (Hessian, gradient) is quicker than a matrix product.
LARGEST_TABLE = 40_000


class Pairs:
    """Every two tubes that pull each other at a Gauss point of ``energy``: R rows.

    amplitude, phase (R,) [J], [rad]; turns (R, N) = d theta / d alpha; map (R, n) = d theta / dq, with the columns of q
    in the given ``order``, else in that of ``energy``.
    tubes : the two tubes of each pair; pair, node (R,) : which of them a row is about, and which Gauss point.
    """

    def __init__(self, energy: TorsionEnergy, order: NDArray[np.int64] | slice = slice(None)) -> None:
        first, second = np.triu_indices(energy.materials.robot.n_tubes, 1)
        product = energy.moment[:, first].conj() * energy.moment[:, second]
        node, pair = np.nonzero(product)
        product = product[node, pair]
        self.tubes, self.pair = list(zip(first.tolist(), second.tolist(), strict=True)), pair
        self.first, self.second, self.node = first[pair], second[pair], node
        self.amplitude = energy.coupling[node] * np.abs(product)
        self.phase = np.angle(product)
        self.map = (energy.angle_map[node, self.second] - energy.angle_map[node, self.first])[:, order]
        self.turns = np.zeros((len(node), energy.materials.robot.n_tubes))
        row = np.arange(len(node))
        self.turns[row, self.first] = -1.0
        self.turns[row, self.second] = 1.0

    def angles(self, psi: Array) -> Array:
        """theta (R,) [rad] between the turned pre-curvatures, from psi (G, N) at the Gauss points."""
        return self.phase + psi[self.node, self.second] - psi[self.node, self.first]

    def waves(self, n: int) -> Array:
        """(2 R + 2, n + N + 1): maps (q, alpha, 1) to the angles whose sines are cos(theta), sin(theta), 1 and 0."""
        rows, tubes = self.turns.shape
        table = np.zeros((2 * rows + 2, n + tubes + 1))
        for start, quarter in ((0, 0.5 * np.pi), (rows, 0.0)):
            part = slice(start, start + rows)
            table[part, :n] = self.map[:, :n]
            table[part, n:-1] = self.turns
            table[part, -1] = self.phase + quarter
        table[2 * rows, -1] = 0.5 * np.pi
        return table


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
        self._column, self._row = np.tril_indices(n)
        rows = len(pairs.amplitude)
        self.map = np.ascontiguousarray(pairs.map[:, :n])
        entries = (self.size + n * self.sides) * (2 * rows + 2)
        self._table = self._tabulate() if entries <= LARGEST_TABLE else None
        if self._table is None:
            self._convex = self._pack((self.map.T * pairs.amplitude) @ self.map)
            self._one = self._pack(np.eye(n))

    def _pack(self, matrix: Array) -> Array:
        return matrix[self._column, self._row]

    def _tabulate(self) -> Array:
        rows, scaled = len(self.pairs.amplitude), self.map.T * self.pairs.amplitude
        table = np.zeros((self.size + self.n * self.sides, 2 * rows + 2))
        table[: self.size, :rows] = scaled[self._column] * self.map.T[self._row]
        table[: self.size, 2 * rows] = self._column == self._row
        table[: self.size, 2 * rows + 1] = -table[: self.size, :rows].sum(axis=1)
        table[self.size : self.size + self.n, rows : 2 * rows] = scaled
        answers = scaled[None] * self.turns.T[:, None, :]
        table[self.size + self.n :, :rows] = answers.reshape(self.n * (self.sides - 1), rows)
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
        out[: self.size] = self._pack((self.map.T * weighted).dot(self.map)) + self._one - sines[-1] * self._convex
        sides = out[self.size :].reshape(self.sides, self.n)
        sides[0] = self.map.T.dot(self.pairs.amplitude * sines[rows : 2 * rows])
        sides[1:] = (self.turns.T * weighted).dot(self.map)
        return out

    def unpacked(self, sines: Array) -> Array:
        """The Hessian (n, n); only its lower triangle is set."""
        hessian = np.zeros((self.n, self.n))
        hessian[self._column, self._row] = self.terms(sines)[: self.size]
        return hessian
