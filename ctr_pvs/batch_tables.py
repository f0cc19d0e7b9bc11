"""The prepared model of ``serving`` for many base positions of one layout.

In unknowns u that stand for angles, the tables do not depend on D.  A section's columns are those of ``twist`` times
the square root of the section's length, so that its torsional energy is |u|^2 / (2 length).  The lead's columns are
the angles by which it turns every twisting tube against the first of them; with g_j the tubes' torsional stiffnesses
from base to the first coupled section and G their sum, its energy is u.Q u / 2, Q = diag(g) - g g^T / G.  What depends
on D then are the lengths, the g_j, and the amplitudes of the pairs: see ``batch_values``.

Features of a state are the rows (u, turn of each tube over the lead, its torque there): all angles are linear in them.
"""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.batch_layout import Layout
from ctr_pvs.batch_linear import Scratch
from ctr_pvs.batch_linear import packed_entries
from ctr_pvs.energy import TorsionEnergy
from ctr_pvs.serving import ServingModel
from ctr_pvs.serving import raised

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


class Tables:
    """What ``degree`` in the sections of ``layout`` means for n unknowns, and for the finer ones that check.

    waves (R, n + N + 1) : from (u, alpha, 1) to the angles of the pairs; without the phases where they depend on D.
    pull (n, R), finer_pull (finer, R) : from amplitude * sin to the gradient less Q u.
    hessian, finer_hessian (packed, R + Q) : from amplitude * cos and the ``entries`` of ``Values`` to the Hessian.
    swings (W, finer + 2 N) : from a change's features to the angles that swing the tip.
    """

    def __init__(self, layout: Layout, degree: tuple[int, ...]) -> None:
        self.layout, self.degree, self.scratch = layout, degree, Scratch()
        self.serving = model = ServingModel(TorsionEnergy(layout.materials, raised(degree)), degree)
        self.energy, self.space = model.energy, model.energy.space
        self.n, self.finer, self.tubes = model.n, model.finer, layout.tubes
        self._angle_rows: dict[tuple[int, tuple[float, ...], int], Array] = {}
        self._label_columns()
        self.turns = model.pairs.turns
        self.pairs = len(self.turns)
        self.difference = self._differences()
        self.waves = np.zeros((self.pairs, self.n + self.tubes + 1))
        self.waves[:, : self.n], self.waves[:, self.n : -1] = self.difference[:, : self.n], self.turns
        if layout.constant:
            self.waves[:, -1] = model.pairs.phase
        self.pull = np.ascontiguousarray(self.difference[:, : self.n].T)
        self.finer_pull = np.ascontiguousarray(self.difference.T)
        self.hessian, self.finer_hessian = self._hessian(self.n), self._hessian(self.finer)
        self._places()
        self.squares = self._squares()
        self.swings, self.swing_list = self._swings()
        self.products = np.einsum(
            "wc,rc,cm->wrm", self.swings[:, : self.n], self.difference[:, : self.n], self.member[: self.n]
        )
        self.same = np.einsum("rc,cm->rm", self.difference[:, : self.n] ** 2, self.member[: self.n])

    def _label_columns(self) -> None:
        """section (finer,) of each column, -1 for the lead; label : what it is, whatever the degree; leading : tubes
        that twist in the lead; lead : number of its columns; member (finer, M) : columns of each section."""
        sections, labels = [], []
        self.leading: list[int] = []
        for block in self.space.blocks:
            size = block.basis.degree + 1
            for r, panel, k in itertools.product(range(block.frame.shape[1]), range(block.basis.panels), range(size)):
                sections.append(block.section)
                labels.append((block.section, r, panel, k))
            if block.section < 0:
                self.leading = np.flatnonzero(block.frame.any(axis=1)).tolist()
        order = self.serving.order
        self.section = np.array(sections, dtype=np.int64)[order]
        self.label = [labels[i] for i in order]
        self.lead = max(0, len(self.leading) - 1)
        self.member = np.zeros((self.finer, self.layout.sections))
        self.member[np.arange(self.lead, self.finer), self.section[self.lead :]] = 1.0
        lengths = self.layout.materials.domain.lengths
        self._root = np.ones(self.finer)
        self._root[self.lead :] = np.sqrt(lengths[self.section[self.lead :]])

    def _differences(self) -> Array:
        """(R, finer) d theta / du."""
        out = self.serving.pairs.map / self._root
        out[:, : self.lead] = self.turns[:, self.leading[1:]]
        return np.ascontiguousarray(out)

    def angle_rows(self, m: int, x: tuple[float, ...], n: int) -> Array:
        """(g, N, n + 2 N) from features with ``n`` unknowns to psi - alpha at the places ``x`` of a section from the
        first coupled one on."""
        key = (m, x, n)
        if key not in self._angle_rows:
            self._angle_rows[key] = self._angle_rows_at(m, np.array(x), n)
        return self._angle_rows[key]

    def _angle_rows_at(self, m: int, x: Array, n: int) -> Array:
        out = np.zeros((len(x), self.tubes, n + 2 * self.tubes))
        out[:, :, self.lead : n] = (self.space.angle_map(m, x)[:, :, self.serving.order] / self._root)[
            :, :, self.lead : n
        ]
        for j in self.leading:
            out[:, j, n + j] = 1.0
        return out

    def _hessian(self, n: int) -> Array:
        """(packed, R + Q); the Q entries are one per section, then the lead's lower triangle."""
        row, column = packed_entries(n)
        lead = packed_entries(self.lead)
        out = np.zeros((len(row), self.pairs + self.layout.sections + len(lead[0])))
        out[:, : self.pairs] = (self.difference[:, row] * self.difference[:, column]).T
        diagonal = np.flatnonzero((row == column) & (row >= self.lead))
        out[diagonal, self.pairs + self.section[row[diagonal]]] = 1.0
        for index, (i, j) in enumerate(zip(*lead, strict=True)):
            out[np.flatnonzero((row == i) & (column == j))[0], self.pairs + self.layout.sections + index] = 1.0
        return out

    def _places(self) -> None:
        """node_section (R,), and for each pair at a node the places, tubes and weights that make its amplitude."""
        energy = self.energy
        first, second = np.triu_indices(self.tubes, 1)
        node, pair = np.nonzero(energy.moment[:, first].conj() * energy.moment[:, second])
        owner = np.concatenate([np.zeros(0, dtype=np.int64), *(np.full(len(n.s), n.section) for n in energy.nodes)])
        place = np.concatenate([np.zeros(0), *(n.rule.x for n in energy.nodes)])
        weight = np.concatenate([np.zeros(0), *(n.rule.weights / n.bending.sum() for n in energy.nodes)])
        self.node_section, self.place, self.weight = owner[node], place[node], weight[node]
        self.first, self.second = first[pair], second[pair]

    def _squares(self) -> Array:
        """(G N, M) squared size of each tube's angle at the nodes per unit of u / sqrt(length), section by section."""
        rows = [np.zeros((0, self.tubes, self.finer))]
        rows += [
            self.space.angle_map(node.section, node.rule.x)[:, :, self.serving.order] for node in self.energy.nodes
        ]
        u = np.concatenate(rows) / self._root
        u[:, :, : self.lead] = 0.0
        return (u**2 @ self.member).reshape(len(u) * self.tubes, self.layout.sections)

    def _swings(self) -> tuple[Array, list[tuple[int, int, Array, Array]]]:
        """The angles that swing the tip; for each group of rows section, tube, and the places and weights whose arms
        add up (a row of each place, or one for all where the angles keep their proportion)."""
        rows, groups = [np.zeros((0, self.finer + 2 * self.tubes))], []
        one = np.ones(1)
        for node in self.energy.all_nodes if self.layout.coupled else []:
            m, x, weights = node.section, node.rule.x, node.rule.weights
            for j in self.layout.curved(m):
                if m < self.layout.first:
                    here = np.zeros((1, self.finer + 2 * self.tubes))
                    here[0, self.finer + self.tubes + j] = float(j in self.leading)
                elif m > self.layout.last:
                    here = self._angle_rows_at(m, one, self.finer)[:, j]
                else:
                    here = self._angle_rows_at(m, x, self.finer)[:, j]
                rows.append(here)
                groups.append((m, j, x, weights))
        return np.concatenate(rows), groups

    def embedding(self, other: Tables) -> Indices:
        """For each of this table's n unknowns the column of the same one of ``other``'s n, or -1."""
        known = {label: index for index, label in enumerate(other.label[: other.n])}
        return np.array([known.get(label, -1) for label in self.label[: self.n]], dtype=np.int64)
