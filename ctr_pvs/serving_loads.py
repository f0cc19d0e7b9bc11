"""The loads of all answers at one D, from tables: ``actuation`` with a row of coefficients in place of every number.

At an equilibrium dE/dq = 0, so dE/dD may be taken with the unknowns held in any way.  ``actuation`` holds the twist
rates at each place x of a section, and counts what they turn.  Here the torques are held, which is the same within the
section, and what they turn is read off the equilibrium itself: the energy per stretch of section m is

    int_0^1 w dx  -  |q_m|^2 / (2 h),

w the bending density and |q_m|^2 / 2 the torsional energy.  Before the first coupled section torques are those that
pass the orifice, and the second term is the sum of T_j^2 / (2 GJ_j).  With b_j = K_j kappa*_j exp(i psi_j),

    w = sum |b_j|^2 (1 / K_j - 1 / sum K) / 2  -  sum over pairs Re[conj(b_i) b_j] / sum K,

so all of it is linear in cosines and sines of psi_j - psi_i and in squares of torques and unknowns:

    loads = linear . [cos, sin, 1]  +  squared . [T^2, q^2],      T = torques . [cos, sin, 1].

Which rates make up the force on each tube, and why it has two sides at a kink, is told in ``actuation``.
"""

from __future__ import annotations

import itertools
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.actuation import Loads
from ctr_pvs.actuation import boundary_forces
from ctr_pvs.robot import Segment
from ctr_pvs.sections import ABSENT
from ctr_pvs.sections import Domain
from ctr_pvs.serving import ServingModel

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
Indices = NDArray[np.int64]


class PreparedLoads:
    """Loads and energy of every equilibrium of ``model``, from its z (n + N + 1,) as ``Served`` has it."""

    def __init__(self, model: ServingModel) -> None:
        rows = _Rows(model)
        self.tubes, self._n, self._energy = model.tubes, model.n, model.energy  # not the model, which may keep this
        self.kink = rows.domain.kinked_tubes()
        self.kink.flags.writeable = False  # shared by all answers
        kinked = np.flatnonzero(self.kink)
        outputs = np.concatenate([-rows.torque[0], rows.forces(1), rows.forces(-1)[kinked]])
        # Both sides are taken from one number where there is no kink, and so are equal to the last bit.
        self._sides = np.repeat(np.arange(self.tubes, 2 * self.tubes)[:, None], 2, axis=1)
        self._sides[kinked, 0] = 2 * self.tubes + np.arange(len(kinked))
        split, squares = rows.angles.one + 1, rows.angles.one + 1 + len(rows.passing)
        passing = np.flatnonzero(outputs[:, split:squares].any(axis=0))
        linear = np.concatenate([outputs[:, :split], rows.passing[passing, :split]])
        kept = np.flatnonzero(linear.any(axis=0) | (rows.bending != 0.0))
        self._size = len(outputs)
        self._waves = rows.angles.waves()[kept]
        self._linear = linear[:, kept]
        self._bending = rows.bending[kept]
        # Columns for all rows of ``linear`` and all of z, so that nothing need be cut out of them.
        self._squared = np.zeros((len(outputs), len(linear) + model.n + model.tubes + 1))
        self._squared[:, len(outputs) : len(linear)] = outputs[:, split + passing]
        self._squared[:, len(linear) : len(linear) + model.n] = outputs[:, squares:]

    def loads(self, z: Array, twists: bool = True) -> Loads:
        """The loads at the equilibrium ``z``, those of ``actuation.virtual_work_loads`` up to its residual.

        twists : false for tubes that are taken for rigid in torsion, with zeros for unknowns: torques do no work.
        """
        tubes, size = self.tubes, self._size
        parts = self._linear.dot(np.sin(self._waves.dot(z)))
        out = parts[:size]
        if twists:
            parts = np.concatenate((parts, z))
            out = self._squared.dot(parts * parts)
            out += parts[:size]
        return Loads(out[:tubes], out[tubes : 2 * tubes], out.take(self._sides), self.kink)

    def energy(self, z: Array) -> float:
        """Elastic energy [J] at ``z``, straightening in the guide counted."""
        q = z[: self._n]
        return self._constant + 0.5 * float(q.dot(q)) + float(self._bending.dot(np.sin(self._waves.dot(z))))

    @cached_property
    def _constant(self) -> float:
        return self._energy.constant()


class _Angles:
    """Differences psi_second - psi_first (P,) of two tubes' angles wherever a load depends on one.

    First come all nodes where two curved tubes overlap, then every pair at each boundary with a kink.

    node : (p,) index of the node, for the p first of them.  columns : per boundary and pair of tubes the place in P.
    one : where the 1 is that follows P cosines and P sines.
    """

    def __init__(self, model: ServingModel, sections: Indices, kinks: list[int]) -> None:
        energy, n = model.energy, model.n
        pairs = list(itertools.combinations(range(model.tubes), 2))
        every = np.array(pairs, dtype=np.int64).reshape(-1, 2)
        curved = energy.materials.curved[sections]
        self.node, pair = np.nonzero(curved[:, every[:, 0]] & curved[:, every[:, 1]])
        self.first, self.second = every[pair].T
        self.columns: dict[tuple[int, int, int], int] = {}
        unknowns = model.order[:n]
        at_nodes = energy.angle_map[:, :, unknowns]
        maps = [at_nodes[self.node, self.second] - at_nodes[self.node, self.first]]
        for index in kinks:
            start = len(self.node) + len(self.columns)
            self.columns.update({(index, *ij): start + row for row, ij in enumerate(pairs)})
            here = _boundary_map(model, index)[:, unknowns]
            maps.append(here[every[:, 1]] - here[every[:, 0]])
        self.map = np.concatenate(maps)
        self.turns = np.zeros((len(self.map), model.tubes))
        ends = np.concatenate([every[pair], np.tile(every, (len(kinks), 1))])
        row = np.arange(len(ends))
        self.turns[row, ends[:, 0]] = -1.0
        self.turns[row, ends[:, 1]] = 1.0
        self.one = 2 * len(self.map)

    def waves(self) -> Array:
        """(2 P + 1, n + N + 1): maps (q, alpha, 1) to the angles whose sines are the cosines, the sines and 1."""
        differences = np.column_stack([self.map, self.turns, np.zeros(len(self.map))])
        waves = np.concatenate([differences, differences, np.zeros((1, differences.shape[1]))])
        waves[: len(differences), -1] = 0.5 * np.pi
        waves[-1, -1] = 0.5 * np.pi
        return waves


def _boundary_map(model: ServingModel, index: int) -> Array:
    """(N, finer n) change of psi at boundary ``index`` with the unknowns."""
    space, sections = model.energy.space, model.energy.materials.domain.n_sections
    if not model.finer:
        return np.zeros((model.tubes, 0))
    section = min(index, sections - 1)
    return space.angle_map(section, np.array([float(index - section)]))[0]


class _Rows:
    """The rates of ``actuation`` as rows of coefficients (C,): P cosines, P sines, 1, squared torques and unknowns.

    right, left : (M, C) [N] per motion of a section's far and near end.  slide : (N, C) [N] per slide of each tube's
    material under fixed ends.  torque : (N, C) [N m] by boundary, the orifice and those with kinks; passing : the same
    in one table, in the order of their squares.  bending : (2 P + 1,) bending energy [J] that depends on q.
    """

    def __init__(self, model: ServingModel) -> None:
        self.model, self.energy = model, model.energy
        self.materials = model.energy.materials
        self.domain: Domain = self.materials.domain
        kinks = [index for index, events in enumerate(self.domain.events) if len(events) > (index > 0)]
        sections = [np.full(len(node.s), node.section) for node in self.energy.nodes]
        self.section = np.concatenate([np.zeros(0, dtype=np.int64), *sections])
        self.angles = _Angles(model, self.section, kinks)
        self.boundaries = sorted({0, *kinks})
        self.size = self.angles.one + 1 + len(self.boundaries) * model.tubes + model.n
        self.right = np.zeros((self.domain.n_sections, self.size))
        self.left = np.zeros_like(self.right)
        self.slide = np.zeros((model.tubes, self.size))
        self.bending = np.zeros(self.angles.one + 1)
        self._uncoupled()
        if model.n:
            self._coupled()
            self._twist()
        self.torque = {index: self._torque(index) for index in self.boundaries}
        self.passing = np.concatenate([self.torque[index] for index in self.boundaries])

    def write(self, table: Array, rows: Indices, columns: Indices, values: ComplexArray) -> None:
        """Adds Re[values exp(i (psi_second - psi_first))] to ``rows`` of ``table``, at distinct places."""
        table[rows, columns] += values.real
        table[rows, self.angles.one // 2 + columns] -= values.imag

    def square(self, boundary: int, tube: int) -> int:
        """Column of the squared torque that passes ``boundary`` in ``tube``."""
        return self.angles.one + 1 + self.boundaries.index(boundary) * self.model.tubes + tube

    def _uncoupled(self) -> None:
        """Where at most one tube is curved its density slides along with it: an end gains the density found there."""
        for m in np.flatnonzero(self.materials.curved.any(axis=1) & ~self.materials.coupled).tolist():
            tube = int(np.flatnonzero(self.materials.curved[m])[0])
            segment, stiffness = int(self.domain.segment[m, tube]), float(self.materials.bending[m, tube])
            share = 0.5 * stiffness * (1.0 - stiffness / float(self.materials.bending[m].sum()))
            start, end = (share * abs(self.pre_curvature(tube, segment, at)) ** 2 for at in (m, m + 1))
            self.right[m, self.angles.one], self.left[m, self.angles.one] = end, -start
            self.slide[tube, self.angles.one] += end - start

    def pre_curvature(self, tube: int, segment: int, boundary: int) -> complex:
        """kappa* [1/m] of a tube's segment where it lies on ``boundary``."""
        material = self.materials.robot.tubes[tube]
        place = self.domain.boundaries[boundary] + self.domain.D[tube] - material.breaks[segment]
        return complex(material.segments[segment].pre_curvature(place))

    def _coupled(self) -> None:
        """Bending of the coupled sections, node by node and pair by pair."""
        energy, angles, half = self.energy, self.angles, self.angles.one // 2
        x, rate = np.concatenate([node.rule.x for node in energy.nodes]), self._moment_rate()
        self._single_tubes(x, rate)
        node, first, second = angles.node, angles.first, angles.second
        column, row = np.arange(len(node)), self.section[node]
        before, after = energy.moment[node, first].conj(), energy.moment[node, second]
        share = -energy.coupling[node]
        product = share * before * after
        by_first, by_second = share * rate[node, first].conj() * after, share * before * rate[node, second]
        both = by_first + by_second
        right = product / self.domain.lengths[row] + x[node] * both
        self.write(self.right, row, column, right)
        self.write(self.left, row, column, both - right)
        self.write(self.slide, first, column, by_first)
        self.write(self.slide, second, column, by_second)
        self.bending[column], self.bending[half + column] = product.real, -product.imag
        self._pull = 1j * product

    def _moment_rate(self) -> ComplexArray:
        """(G, N) derivative of K kappa* [N] along each tube at the nodes."""
        rates = [self.materials.pre_curvature_rate(node.section, node.s) for node in self.energy.nodes]
        return self.materials.bending[self.section] * np.concatenate(rates)

    def _single_tubes(self, x: Array, rate: ComplexArray) -> None:
        """The part of the coupled sections' energy that each tube has without the others."""
        energy, one = self.energy, self.angles.one
        bending, length = self.materials.bending[self.section], self.domain.lengths[self.section]
        total = bending.sum(axis=1)[:, None]
        share = np.divide(1.0, bending, out=np.zeros_like(bending), where=bending > 0.0) - 1.0 / total
        share *= energy.coupling[:, None] * total
        stored = 0.5 * (share * np.abs(energy.moment) ** 2).sum(axis=1)
        slide = share * (energy.moment.conj() * rate).real
        both = slide.sum(axis=1)
        right = stored / length + x * both
        sections = np.arange(self.domain.n_sections)[:, None] == self.section
        self.right[:, one] += sections.dot(right)
        self.left[:, one] += sections.dot(both - right)
        self.slide[:, one] += slide.sum(axis=0)
        self.bending[one] = stored.sum()

    def _twist(self) -> None:
        """Minus |q_m|^2 / (2 h), and minus T^2 / (2 GJ) before the first coupled section."""
        model, space = self.model, self.energy.space
        unknown, start = model.order[: model.n], self.size - model.n
        for block in space.blocks:
            if block.section >= 0:
                inside = np.flatnonzero((block.columns.start <= unknown) & (unknown < block.columns.stop))
                self._release(block.section, start + inside, 0.5 / self.domain.lengths[block.section])
        for m in range(space.first):
            tubes = np.flatnonzero(self.materials.torsional[m])
            self._release(m, self.square(0, 0) + tubes, 0.5 / self.materials.torsional[m, tubes])

    def _release(self, m: int, columns: Indices, values: Array | float) -> None:
        self.right[m, columns] -= values
        self.left[m, columns] += values

    def _torque(self, boundary: int) -> Array:
        """(N, C) torque [N m] that passes ``boundary``: what bending beyond it pulls."""
        table = np.zeros((self.model.tubes, self.size))
        if self.model.n:
            column = np.flatnonzero(self.section[self.angles.node] >= boundary)
            pull = self._pull[column]
            self.write(table, self.angles.first[column], column, pull)
            self.write(table, self.angles.second[column], column, -pull)
        return table

    def forces(self, side: int) -> Array:
        """(N, C) dE/dD [N] towards ``side`` (+1, -1)."""
        return self.slide + boundary_forces(self.domain, self, side)

    def thin(self, index: int, segments: Indices) -> Array:
        row, one = np.zeros(self.size), self.angles.one
        present: list[tuple[int, Segment, complex]] = []
        for tube in np.flatnonzero(segments != ABSENT).tolist():
            segment = self.materials.segment(tube, int(segments[tube]))
            kappa = self.pre_curvature(tube, int(segments[tube]), index)
            present.append((tube, segment, segment.bending_stiffness * kappa))
            row[self.square(index, tube)] -= 0.5 / segment.torsional_stiffness
        total = sum(segment.bending_stiffness for _, segment, _ in present)
        for _, segment, moment in present:
            row[one] += 0.5 * abs(moment) ** 2 * (1.0 / segment.bending_stiffness - 1.0 / total)
        for (first, _, before), (second, _, after) in itertools.combinations(present, 2):
            column, product = self.angles.columns[index, first, second], before.conjugate() * after / total
            row[column] -= product.real
            row[one // 2 + column] += product.imag
        return row

    def guide(self, tube: int, segment: int) -> Array:
        row, guided = np.zeros(self.size), self.materials.segment(tube, segment)
        row[self.angles.one] = 0.5 * guided.bending_stiffness * abs(self.pre_curvature(tube, segment, 0)) ** 2
        row[self.square(0, tube)] = -0.5 / guided.torsional_stiffness
        return row
