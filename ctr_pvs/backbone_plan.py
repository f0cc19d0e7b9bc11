"""The backbone of one D, prepared: from the unknowns of a solve to the pieces of the rod in a few array operations.

Angles are linear in z = (q, alpha, 1), and the curvature of a section is a sum of the turned pre-curvatures of its
tubes, so both come from tables.  Where one tube is curved the piece is a closed arc, elsewhere a bend sampled at Gauss
points, as many as the largest torques that the tubes can exert may ask for: a choice of D and tolerance alone.
"""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.backbone import Backbone
from ctr_pvs.backbone import poses
from ctr_pvs.basis import gauss_legendre
from ctr_pvs.collocation import nodes_needed
from ctr_pvs.pieces import Arc
from ctr_pvs.pieces import Bend
from ctr_pvs.pieces import Piece
from ctr_pvs.pieces import State
from ctr_pvs.pose_plan import PosePlan
from ctr_pvs.sections import ABSENT
from ctr_pvs.serving import ServingModel

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
#: Section, places (g,) in [0, 1], and what the curvature there is multiplied by: half the length of a bend.
Places: TypeAlias = tuple[int, Array, float]


def backbone_plan(model: ServingModel, tolerance: float, tube: int | None) -> BackbonePlan:
    """The plan of ``model`` for ``tolerance`` [m] and ``tube`` (the leader if None), made when first asked for."""
    leader = model.energy.materials.domain.leader if tube is None else tube
    return model.prepare((tolerance, leader), lambda model: BackbonePlan(model, tolerance, leader))


class BackbonePlan:
    """Tables for ``model`` and an integration error of ``tolerance`` [m]; rolls are those of ``tube``.

    waves (2 W, n + N + 1) : from z to the angles whose sines are cos and sin of psi, tube by tube and place by place.
    curvature (2 P, 2 W) : from these sines to P curvatures, real and imaginary parts by turns: at the starts of all
    arcs [1/m], then at the Gauss points of all bends, times half their lengths [rad].
    rolls (3 arcs + Gauss points, n + N + 1) : from z to start, rate and turn of each arc, then rolls at Gauss points.
    bends : length and number of Gauss points of each; arcs : length and turn of the pre-curvature of each.
    order : kinds of the pieces along the rod, true for an arc.
    """

    def __init__(self, model: ServingModel, tolerance: float, tube: int) -> None:
        self._model, self._tube = model, tube
        self._materials = model.energy.materials
        self._relative = tolerance / max(self._materials.domain.length, tolerance)
        self._strongest = self._largest_torques()
        self.arcs: list[tuple[float, float]] = []
        self.bends: list[tuple[float, int]] = []
        self.order: list[bool] = []
        self._arc_rates: list[tuple[float, float]] = []  # largest curvature and turning of each arc [1/m], [rad/m]
        self._pose_plans: dict[int, PosePlan | None] = {}
        places, rolls = self._lay_out()
        self._tabulate(places)
        self.rolls = np.array(rolls).reshape(-1, model.waves.shape[1])

    def pieces(self, z: Array) -> list[Piece]:
        """The pieces for unknowns and base angles ``z`` of the model."""
        k = self.curvature.dot(np.sin(self.waves.dot(z))).view(complex)
        rolls = self.rolls.dot(z)
        count = len(self.arcs)
        starts, turns = k[:count].tolist(), rolls[: 3 * count].tolist()
        arc, bend, place, angle = 0, 0, count, 3 * count
        pieces: list[Piece] = []
        for is_arc in self.order:
            if is_arc:
                length, turn = self.arcs[arc]
                roll, rate, turning = turns[3 * arc : 3 * arc + 3]
                pieces.append(Arc(length, starts[arc], turn + turning, roll, rate))
                arc += 1
            else:
                length, nodes = self.bends[bend]
                pieces.append(Bend(length, k[place : place + nodes], rolls[angle : angle + nodes]))
                place, angle, bend = place + nodes, angle + nodes, bend + 1
        return pieces

    def backbone(self, z: Array, pieces: list[Piece], states: list[State], count: int) -> Backbone:
        """``count`` poses at equal spacing for ``z``, which gave ``pieces`` with these ``states`` at their ends."""
        if count not in self._pose_plans:
            nodes = self._gauss_points()
            self._pose_plans[count] = None if nodes is None else PosePlan(self, count, nodes)
        plan = self._pose_plans[count]
        if plan is None:
            return poses(pieces, np.linspace(0.0, sum(self.lengths), count))
        return plan.poses(pieces, states, z)

    @property
    def lengths(self) -> list[float]:
        """Of all pieces [m]."""
        arcs, bends = iter(self.arcs), iter(self.bends)
        return [next(arcs)[0] if is_arc else next(bends)[0] for is_arc in self.order]

    def _gauss_points(self) -> list[int] | None:
        """Gauss points from which poses on each piece can be interpolated; None if a piece would need too many."""
        bends, arcs = iter(self.bends), iter(self._arc_rates)
        out = []
        for is_arc, length in zip(self.order, self.lengths, strict=True):
            if not is_arc:
                out.append(next(bends)[1])
                continue
            parts, nodes = nodes_needed(length, *next(arcs), 0.0, self._relative)
            if parts > 1:
                return None
            out.append(nodes)
        return out

    @property
    def arcs_first(self) -> list[int]:
        """The pieces, all arcs before all bends."""
        return sorted(range(len(self.order)), key=lambda index: not self.order[index])

    def places(self, nodes: list[int]) -> Array:
        """(K,) distances [m] of the Gauss points from the starts of their pieces, arcs first."""
        return np.concatenate([self.lengths[index] * gauss_legendre(nodes[index]).x for index in self.arcs_first])

    def roll_rows(self, nodes: list[int]) -> Array:
        """(K, n + N + 1) from z to the rolls at the Gauss points, arcs first."""
        arcs = self.arcs_first[: len(self.arcs)]
        rows = [
            self.rolls[3 * arc]
            + self.lengths[index] * gauss_legendre(nodes[index]).x[:, None] * self.rolls[3 * arc + 1]
            for arc, index in enumerate(arcs)
        ]
        return np.concatenate([*rows, self.rolls[3 * len(arcs) :]])

    def _lay_out(self) -> tuple[list[Places], list[Array]]:
        """Fills ``arcs``, ``bends`` and ``order``; the places (section, x) of the curvatures, the rows of the rolls."""
        starts: list[Places] = []
        inside: list[Places] = []
        arc_rolls: list[Array] = []
        bend_rolls: list[Array] = []
        for m in range(self._materials.domain.n_sections):
            if self._is_arc(m):
                self._add_arc(m, starts, arc_rolls)
            else:
                self._add_bends(m, inside, bend_rolls)
        if not self.order:  # nothing is out: a piece of no length carries the roll
            self.arcs, self.order, self._arc_rates = [(0.0, 0.0)], [True], [(0.0, 0.0)]
            at_orifice = self._angle_rows(0, np.zeros(1))[0, self._tube]
            arc_rolls = [at_orifice, 0.0 * at_orifice, 0.0 * at_orifice]
        return starts + inside, arc_rolls + bend_rolls

    def _is_arc(self, m: int) -> bool:
        """True where the strain is constant in a frame that turns at a constant rate."""
        if self._materials.coupled[m]:
            return False
        segments = self._materials.domain.segment[m]
        curved = self._materials.curved_tubes[m]
        return all(len(self._materials.segment(j, int(segments[j])).curvature) == 1 for j in curved)

    def _add_arc(self, m: int, starts: list[Places], rolls: list[Array]) -> None:
        length = float(self._materials.domain.lengths[m])
        start, end = self._angle_rows(m, np.array([0.0, 1.0]))
        rates = (end - start) / length
        curved = self._materials.curved_tubes[m]
        turn, turning = 0.0, np.zeros(rates.shape[1])
        if curved:
            segment = self._materials.segment(curved[0], int(self._materials.domain.segment[m, curved[0]]))
            turn, turning = segment.turn, rates[curved[0]]
        bend = float(np.abs(self._share(m, np.zeros(1))).sum())
        self._arc_rates.append((bend, abs(turn) + 2.0 * self._fastest_twist(m)))
        self.arcs.append((length, turn))
        self.order.append(True)
        starts.append((m, np.zeros(1), 1.0))
        rolls += [start[self._tube], rates[self._tube], turning]

    def _add_bends(self, m: int, inside: list[Places], rolls: list[Array]) -> None:
        panels = self._model.energy.space.basis(m).panels
        length = float(self._materials.domain.lengths[m]) / panels
        parts, nodes = self._division(m, length)
        x = gauss_legendre(nodes, panels * parts).x
        inside.append((m, x, 0.5 * length / parts))
        rolls.extend(self._angle_rows(m, x)[:, self._tube])
        self.bends += [(length / parts, nodes)] * (panels * parts)
        self.order += [False] * (panels * parts)

    def _division(self, m: int, length: float) -> tuple[int, int]:
        """Parts and Gauss points for panels of ``length`` [m], whatever the base angles."""
        materials = self._materials
        places = np.linspace(0.0, 1.0, 9)
        share = np.abs(self._share(m, places))
        present = np.flatnonzero(materials.domain.segment[m] != ABSENT)
        twist = self._fastest_twist(m)
        turn = max(abs(materials.segment(int(j), int(materials.domain.segment[m, j])).turn) for j in present)
        bend = float(share.sum(axis=1).max())
        step = float(materials.domain.lengths[m]) / (len(places) - 1)
        change = float(np.abs(np.diff(share, axis=0)).sum(axis=1).max()) / step
        wave = math.sqrt(materials.coupling(m)) / (length * self._model.energy.space.basis(m).panels)
        rate = max(twist + turn, change / bend if bend else 0.0)
        return nodes_needed(length, bend, rate, wave if materials.coupled[m] else 0.0, self._relative)

    def _largest_torques(self) -> Array:
        """(N,) bound of the torque [N m] that the others can exert on each tube."""
        pairs = self._model.pairs
        bound: Array = np.abs(pairs.turns).T @ pairs.amplitude
        return bound

    def _fastest_twist(self, m: int) -> float:
        """Bound of the twist rates [rad/m] in section m."""
        stiffness = self._materials.torsional[m]
        present = stiffness > 0.0
        return float((self._strongest[present] / stiffness[present]).max())

    def _share(self, m: int, x: Array) -> ComplexArray:
        """(g, N) what the pre-curvature of each tube adds to the backbone's at the places ``x`` of section m [1/m]."""
        s = self._materials.domain.boundaries[m] + x * self._materials.domain.lengths[m]
        bending = self._materials.bending[m]
        share: ComplexArray = self._materials.pre_curvature(m, s) * (bending / bending.sum())
        return share

    def _angle_rows(self, m: int, x: Array) -> Array:
        """(g, N, n + N + 1) from z to psi at the places ``x`` (g,) of section m."""
        model = self._model
        rows = np.zeros((len(x), model.tubes, model.waves.shape[1]))
        rows[:, :, : model.n] = model.energy.space.angle_map(m, x)[:, :, model.order[: model.n]]
        rows[:, np.arange(model.tubes), model.n + np.arange(model.tubes)] = 1.0
        return rows

    def _tabulate(self, places: list[Places]) -> None:
        """Fills ``waves`` and ``curvature``."""
        materials = self._materials
        angles, shares, place = [np.zeros((0, self._model.waves.shape[1]))], [np.zeros(0, complex)], [np.zeros(0, int)]
        start = 0
        for m, x, factor in places:
            tubes = materials.curved_tubes[m]
            share = factor * self._share(m, x)
            angles.append(self._angle_rows(m, x)[:, tubes].reshape(-1, self._model.waves.shape[1]))
            shares.append(share[:, tubes].ravel())
            place.append(np.repeat(start + np.arange(len(x)), len(tubes)))
            start += len(x)
        psi, kappa, at = np.concatenate(angles), np.concatenate(shares), np.concatenate(place)
        count, row = len(psi), np.arange(len(psi))
        self.waves = np.vstack([psi, psi])
        self.waves[:count, -1] += 0.5 * np.pi  # a cosine
        self.curvature = np.zeros((2 * max(start, len(self.arcs)), 2 * count))
        self.curvature[2 * at, row], self.curvature[2 * at, count + row] = kappa.real, -kappa.imag
        self.curvature[2 * at + 1, row], self.curvature[2 * at + 1, count + row] = kappa.imag, kappa.real
