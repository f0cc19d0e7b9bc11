"""The loads of all answers at one D, from tables: ``actuation`` with a row of coefficients in place of every number.

At an equilibrium dE/dq = 0, so dE/dD may be taken with the unknowns held in any way.  ``actuation`` holds the twist
rates at each place x of a section, and counts what they turn.  Here the torques are held, which is the same within the
section, and what they turn is read off the equilibrium itself: the energy per stretch of section m is

    int_0^1 w dx  -  |q_m|^2 / (2 h),

w the bending density and |q_m|^2 / 2 the torsional energy.  Before the first coupled section torques are those that
pass the orifice, and the second term is the sum of T_j^2 / (2 GJ_j).  With b_j = K_j kappa*_j exp(i psi_j),

    w = sum |b_j|^2 (1 / K_j - 1 / sum K) / 2  -  sum over pairs Re[conj(b_i) b_j] / sum K,

whose pairs are the cosines of ``Pairs``.  Of the rate of ln(conj(b_i) b_j h) with D the real part makes a term grow,
the imaginary part turns its angle.  So all of it is linear in cosines and sines of those angles and in squares of
torques and unknowns:

    loads = linear . [cos, sin, 1]  +  squared . [T^2, q^2],      T = torques . [cos, sin, 1].

Which motions make up the force on each tube, and why it has two sides at a kink, is told in ``actuation``.
"""

from __future__ import annotations

import itertools
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.actuation import Loads
from ctr_pvs.actuation import Motion
from ctr_pvs.actuation import pre_curvature_at
from ctr_pvs.robot.robot import Segment
from ctr_pvs.sections import ABSENT
from ctr_pvs.serving import ServingModel

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


class PreparedLoads:
    """Loads and energy of every equilibrium of ``model``, from its z (n + N + 1,) as ``Served`` has it."""

    def __init__(self, model: ServingModel) -> None:
        tubes, domain = model.tubes, model.energy.materials.domain
        self.tubes, self._n, self._energy = tubes, model.n, model.energy  # not the model, which may keep this
        self.kink = domain.kinked_tubes()
        self.kink.flags.writeable = False  # shared by all answers
        kinked = [tube for tube, kink in enumerate(self.kink.tolist()) if kink]
        # Both sides are taken from one number where there is no kink, and so are equal to the last bit.
        minus = {tube: 2 * tubes + place for place, tube in enumerate(kinked)}
        self._sides = np.array([[minus.get(tube, tubes + tube), tubes + tube] for tube in range(tubes)])
        motions = [Motion(domain, tube, 1) for tube in range(tubes)] + [Motion(domain, tube, -1) for tube in kinked]
        self._size = tubes + len(motions)
        rates = _Rates(model, motions)
        self._waves = _waves(model, list(rates.beside))
        self._linear, self._bending = _linear(model, rates, len(self._waves))
        self._squared = _squared(model, rates, len(self._linear))

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


class _Rates:
    """dE/dD [N] along F ``motions`` of the N tubes of ``model``, by what it is to be multiplied with.

    one : (F,) with 1.
    growth : (F, R) with the model's R terms -amplitude exp(i theta): the rates [1/m] of their logarithms.
    beside : (F,) complex, with exp(i (psi_second - psi_first)) at angles that are not among those of the model: by
        section, x, first and second tube.
    twisting : (F) with the squared torque that passes a boundary: by boundary and tube.
    lengthening : (F, M) rates [1/m] of the logarithms of the sections' lengths.
    section : (G,) of each node.  stored : (G, N) bending energy [J] there of each tube without the others.
    """

    def __init__(self, model: ServingModel, motions: list[Motion]) -> None:
        self._model, self._energy, self.motions = model, model.energy, motions
        self._materials = model.energy.materials
        ends = np.array([(motion.near, motion.far) for motion in motions])
        self._near, self._stretch = ends[:, 0], ends[:, 1] - ends[:, 0]
        self.lengthening = self._stretch / self._materials.domain.lengths
        self.beside: dict[tuple[int, float, int, int], ComplexArray] = {}
        self.twisting: dict[tuple[int, int], list[float]] = {}
        self._kappa = np.empty_like(self._energy.moment)
        self.section = np.empty(len(self._kappa), dtype=np.int64)
        for node, part in zip(self._energy.nodes, self._energy.slices, strict=True):
            self.section[part], self._kappa[part] = node.section, node.kappa
        self.stored = self._stored()
        self._stretching()
        if not all(_uniform(segment) for tube in self._materials.robot.tubes for segment in tube.segments):
            self._sliding()
        self._uncoupled()
        self._lead()
        for row, motion in enumerate(motions):
            self._guide(row, motion)
            for boundary, segments in motion.opens:
                self._thin(row, motion.side, boundary, segments)

    def _stored(self) -> Array:
        bending = self._materials.bending
        stiffness = (bending.sum(axis=1)[:, None] - bending) * bending  # K^2 (1 / K - 1 / sum K), times sum K
        return (0.5 * self._energy.coupling)[:, None] * stiffness.take(self.section, axis=0) * np.abs(self._kappa) ** 2

    def _stretching(self) -> None:
        """The coupled sections' bending is in proportion to their lengths."""
        stretched = self.lengthening.take(self.section, axis=1)
        self.one: Array = stretched.dot(self.stored.sum(axis=1))
        self.growth: Array | ComplexArray = stretched.take(self._model.pairs.node, axis=1)

    def _sliding(self) -> None:
        """The coupled sections' bending changes as other pre-curvatures come to their nodes."""
        energy, pairs, kappa = self._energy, self._model.pairs, self._kappa
        x, slope = np.empty(len(kappa)), np.empty_like(kappa)
        for node, part in zip(energy.nodes, energy.slices, strict=True):
            x[part], slope[part] = node.rule.x, self._materials.pre_curvature_rate(node.section, node.s)
        bent, moved = kappa != 0.0, self._moved(x)
        # Where kappa* is 0 any finite number will do: the tube has no energy of its own there, and is in no pair.
        growth = (moved * (slope / np.where(bent, kappa, 1.0))).reshape(len(moved), kappa.size)
        self.one += 2.0 * growth.real.dot(self.stored.ravel())
        place = pairs.node * self._model.tubes
        of_pairs = growth.take(place + pairs.first, axis=1).conj() + growth.take(place + pairs.second, axis=1)
        self.growth = self.growth + of_pairs
        for g, tube in np.argwhere((slope != 0.0) & ~bent).tolist():
            # Its product with another one has no logarithm, but a rate.
            rate = energy.coupling[g] * self._materials.bending[self.section[g], tube] * slope[g, tube].conj()
            for other in np.flatnonzero(bent[g]).tolist():
                place_and_tubes = int(self.section[g]), float(x[g]), tube, other
                self.beside[place_and_tubes] = -rate * energy.moment[g, other] * moved[:, g, tube]

    def _moved(self, x: Array) -> Array:
        """(F, G, N) dX_j / dD of the material at the nodes: their own motion, and the slide of the tube that moves."""
        nodes = self._near.take(self.section, axis=1) + self._stretch.take(self.section, axis=1) * x
        moved = np.repeat(nodes[:, :, None], self._model.tubes, axis=2)
        for row, motion in enumerate(self.motions):
            moved[row, :, motion.tube] += 1.0
        return moved

    def _uncoupled(self) -> None:
        """Where one tube is curved its density slides along with it: an end gains the density found there."""
        for m, curved in enumerate(self._materials.curved_tubes):
            stiffness = self._materials.bending[m].tolist()
            if len(curved) == 1 and stiffness[curved[0]] < sum(stiffness):  # else it is alone, in its own shape
                tube, own = curved[0], stiffness[curved[0]]
                share = 0.5 * own * (1.0 - own / sum(stiffness))
                kappa = self._materials.pre_curvature(m, self._materials.domain.boundaries[m : m + 2])[:, tube]
                start, end = (share * np.abs(kappa) ** 2).tolist()
                for row, motion in enumerate(self.motions):
                    slide = float(motion.tube == tube)
                    self.one[row] += (motion.far[m] + slide) * end - (motion.near[m] + slide) * start

    def _lead(self) -> None:
        """Before the first coupled section stretching releases what the torques of the guide have stored."""
        for m, stiffness in enumerate(self._materials.torsional[: self._energy.space.first].tolist()):
            for row, motion in enumerate(self.motions):
                for tube, own in enumerate(stiffness):
                    if own:
                        self._twist(row, 0, tube, motion.far[m] - motion.near[m], own)

    def _guide(self, row: int, motion: Motion) -> None:
        """What goes into the guide is straightened, and the torque twists it."""
        if motion.guided != ABSENT:
            segment = self._materials.segment(motion.tube, motion.guided)
            kappa = pre_curvature_at(self._materials, motion.tube, motion.guided, 0)
            self.one[row] += 0.5 * segment.bending_stiffness * abs(kappa) ** 2
            self._twist(row, 0, motion.tube, 1.0, segment.torsional_stiffness)

    def _thin(self, row: int, side: int, boundary: int, segments: list[int]) -> None:
        """Energy per length of a section without length that opens at ``boundary`` with one of ``segments`` per
        tube."""
        moments, stiffness = {}, {}
        for tube, index in enumerate(segments):
            if index != ABSENT:
                segment = self._materials.segment(tube, index)
                stiffness[tube] = segment.bending_stiffness
                moments[tube] = stiffness[tube] * pre_curvature_at(self._materials, tube, index, boundary)
                self._twist(row, boundary, tube, side, segment.torsional_stiffness)
        total = sum(stiffness.values())
        for tube, moment in moments.items():
            self.one[row] += side * 0.5 * abs(moment) ** 2 * (1.0 / stiffness[tube] - 1.0 / total)
        section = min(boundary, self._materials.domain.n_sections - 1)
        for (first, before), (second, after) in itertools.combinations(moments.items(), 2):
            if before and after:
                place_and_tubes = section, float(boundary - section), first, second
                waves = self.beside.setdefault(place_and_tubes, np.zeros(len(self.motions), dtype=complex))
                waves[row] -= side * before.conjugate() * after / total

    def _twist(self, row: int, boundary: int, tube: int, growth: float, stiffness: float) -> None:
        """Minus T^2 / (2 GJ) for each length that grows with the torque of ``boundary``."""
        values = self.twisting.setdefault((boundary, tube), [0.0] * len(self.motions))
        values[row] -= 0.5 * growth / stiffness


def _uniform(segment: Segment) -> bool:
    """True if the pre-curvature is the same all along the segment."""
    return len(segment.curvature) <= 1 and not segment.turn


def _waves(model: ServingModel, beside: list[tuple[int, float, int, int]]) -> Array:
    """(C, n + N + 1) the model's own waves, then those that give cosines and sines of the angles ``beside`` them."""
    if not beside:
        return model.waves
    space, solved = model.energy.space, model.order[: model.n]
    places = dict.fromkeys((section, x) for section, x, _, _ in beside)
    psi = {place: space.angle_map(place[0], np.array([place[1]]))[0][:, solved] for place in places}
    table = np.zeros((2, len(beside), model.waves.shape[1]))
    for row, (section, x, first, second) in enumerate(beside):
        table[:, row, : model.n] = psi[section, x][second] - psi[section, x][first]
        table[:, row, model.n + first], table[:, row, model.n + second] = -1.0, 1.0
    table[0, :, -1] = 0.5 * np.pi
    return np.concatenate([model.waves, *table])


def _linear(model: ServingModel, rates: _Rates, columns: int) -> tuple[Array, Array]:
    """What is to be multiplied with the sines of ``_waves`` (columns,): rows for N loads along alpha, F along D and
    for the torques whose squares count, those in the guide excepted; and a row for the bending energy."""
    pairs, tubes, rows = model.pairs, model.tubes, model.rows
    force, passing = slice(tubes, tubes + len(rates.motions)), [key for key in rates.twisting if key[0]]
    table, energy = np.zeros((force.stop + len(passing), columns)), np.zeros(columns)
    pull = pairs.turns.T * pairs.amplitude
    table[:tubes, rows : 2 * rows] = pull
    table[force, :rows] = -pairs.amplitude * rates.growth.real
    table[force, rows : 2 * rows] = pairs.amplitude * rates.growth.imag
    table[force, 2 * rows] = rates.one
    for column, wave in enumerate(rates.beside.values(), start=2 * rows + 2):
        table[force, column], table[force, len(rates.beside) + column] = wave.real, -wave.imag
    for row, (boundary, tube) in enumerate(passing, start=force.stop):
        table[row, rows : 2 * rows] = pull[tube] * (rates.section[pairs.node] >= boundary)
    energy[:rows], energy[2 * rows] = -pairs.amplitude, rates.stored.sum()
    return table, energy


def _squared(model: ServingModel, rates: _Rates, size: int) -> Array:
    """(N + F, size + n + N + 1) what is to be multiplied with the squares of all ``size`` rows of ``_linear`` and all
    of z, so that nothing need be cut out of them; the torques in the guide are the loads along alpha."""
    tubes = model.tubes
    table = np.zeros((tubes + len(rates.motions), size + model.n + tubes + 1))
    force, passing = table[tubes:], itertools.count(len(table))
    for (boundary, tube), twisting in rates.twisting.items():
        force[:, next(passing) if boundary else tube] = twisting
    unknowns = np.zeros((len(force), model.finer))
    for block in model.energy.space.blocks:
        if block.section >= 0:
            unknowns[:, block.columns] = -0.5 * rates.lengthening[:, block.section, None]
    force[:, size : size + model.n] = unknowns[:, model.order[: model.n]]
    return table
