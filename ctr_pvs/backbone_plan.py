"""The backbone of one D, prepared: from the unknowns of a solve to the pieces of the rod in a few array operations.

Angles are linear in z = (q, alpha, 1), and the curvature of a section is a sum of the turned pre-curvatures of its
tubes, so both come from tables.  Where one tube is curved the piece is a closed arc, elsewhere a bend sampled at Gauss
points.  Which numbers stand where in the tables depends on the order of the pieces alone, and comes again from D to D.
"""

from __future__ import annotations

from functools import lru_cache
from itertools import accumulate
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.backbone import Backbone
from ctr_pvs.backbone import poses
from ctr_pvs.backbone_cuts import Shape
from ctr_pvs.backbone_cuts import cuts
from ctr_pvs.basis import gauss_legendre
from ctr_pvs.collocation import nodes_needed
from ctr_pvs.pieces import TINY
from ctr_pvs.pieces import Arc
from ctr_pvs.pieces import Bend
from ctr_pvs.pieces import Piece
from ctr_pvs.pieces import State
from ctr_pvs.pose_plan import PosePlan
from ctr_pvs.serving import ServingModel

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

#: Orders of pieces whose layouts are kept.
KEPT = 64
#: Places in an arc, relative to its length: between them its angles are linear.
ENDS = np.array([0.0, 1.0])


def backbone_plan(model: ServingModel, tolerance: float, tube: int | None) -> BackbonePlan:
    """The plan of ``model`` for ``tolerance`` [m] and ``tube`` (the leader if None), made when first asked for."""
    leader = model.energy.materials.domain.leader if tube is None else tube
    return model.prepare((tolerance, leader), lambda model: BackbonePlan(model, tolerance, leader))


class Layout:
    """Where the numbers of a ``BackbonePlan`` stand, for sections of these ``shapes`` and the rolls of ``tube``.

    P places: both ends of the A arcs and the B Gauss points of all bends, along the rod.  W waves: a curved tube at the
    start of an arc or at a Gauss point.

    order : kinds of the pieces along the rod, true for an arc.  arcs, bends : the sections of all arcs and all bends.
    x : the places of each section, relative to its length; slices : where they stand among the P.
    waves, strengths, entries (W,) : of each wave, the indices in a flat table of places and tubes, among the curved
    tubes of all sections, and in a flat table of waves and curvatures.  curved : number of curvatures, arcs first.
    rows (2 W + 3 A + B,), starts (2 A,) : indices of places and tubes that the rows of ``BackbonePlan.angles`` come
    from, and of what is to be taken off where they are rates.
    """

    def __init__(self, shapes: tuple[Shape, ...], tube: int, tubes: int) -> None:
        self.order = [not shape.nodes for shape in shapes for _ in range(shape.parts)]
        self.arcs = [m for m, shape in enumerate(shapes) if not shape.nodes]
        self.bends = [m for m, shape in enumerate(shapes) if shape.nodes for _ in range(shape.parts)]
        self.x = [gauss_legendre(shape.nodes, shape.parts).x if shape.nodes else ENDS for shape in shapes]
        self.slices = [slice(*ends) for ends in pairwise(accumulate(map(len, self.x), initial=0))]
        section = [m for m, x in enumerate(self.x) for _ in x]
        arcs = [self.slices[m].start for m in self.arcs]
        points = [place for place, m in enumerate(section) if shapes[m].nodes]
        curved = [(m, j) for m, shape in enumerate(shapes) for j in shape.tubes]
        number = {pair: index for index, pair in enumerate(curved)}
        waves = [
            (place * tubes + j, number[section[place], j], index)
            for index, place in enumerate(arcs + points)
            for j in shapes[section[place]].tubes
        ]
        self.waves, self.strengths, curvatures = np.array(waves, dtype=int).reshape(-1, 3).T.copy()
        self.curved = len(arcs) + len(points)
        self.entries = np.arange(len(waves)) * self.curved + curvatures
        self.identity = np.eye(tubes)
        # Rates of the roll, then of the curved tube: where there is none, the start is taken off itself.
        rates: list[tuple[int, ...]] = [(place, place + 1, tube) for place in arcs]
        for place, m in zip(arcs, self.arcs, strict=True):
            rates.append((place, place + 1, *shapes[m].tubes) if shapes[m].tubes else (place, place, tube))
        start, end, turned = np.array(rates, dtype=int).reshape(-1, 3).T
        self.starts = start * tubes + turned
        rolls = np.array(points, dtype=int) * tubes + tube
        self.rows = np.concatenate([self.waves] * 2 + [self.starts[: len(arcs)], end * tubes + turned, rolls])


_layout = lru_cache(maxsize=KEPT)(Layout)


class BackbonePlan:
    """Tables for ``model`` and an integration error of ``tolerance`` [m]; rolls are those of ``tube``.

    order : kinds of the pieces along the rod, true for an arc; lengths [m] of all pieces.
    angles (2 W + 3 A + B, n + N + 1) : from z to the angles whose sines are cos and sin of psi, tube by tube and place
    by place; then to the starts of all arcs, their rates and the turning of their pre-curvature; then to the rolls at
    the Gauss points of bends.
    curvature (2 W, 2 (A + B)) : from these sines to curvatures, real and imaginary parts by turns: at the starts of
    arcs [1/m], then at the Gauss points of bends, times half their lengths [rad].
    """

    def __init__(self, model: ServingModel, tolerance: float, tube: int) -> None:
        materials = model.energy.materials
        self._relative = tolerance / max(materials.domain.length, tolerance)
        self._cuts = cuts(model, self._relative)
        self._layout = _layout(tuple([cut.shape for cut in self._cuts]), tube, model.tubes)
        self.order = self._layout.order
        self.lengths = [cut.length for cut in self._cuts for _ in range(cut.shape.parts)]
        self._arcs = [(self._cuts[m].length, self._cuts[m].turn) for m in self._layout.arcs]
        self._bends = [(self._cuts[m].length, self._cuts[m].shape.nodes) for m in self._layout.bends]
        self.angles = self._angle_table(model)
        self.curvature = self._curvature_table(model)
        self._pose_plans: dict[int, PosePlan | None] = {}

    def pieces(self, z: Array) -> list[Piece]:
        """The pieces for unknowns and base angles ``z`` of the model."""
        angles, waves = self.angles.dot(z), len(self.curvature)
        k = np.sin(angles[:waves]).dot(self.curvature).view(complex)
        count, rolls = len(self._arcs), angles[waves:]
        starts, turns = k[:count].tolist(), rolls[: 3 * count].tolist()
        arc, bend, place, angle = 0, 0, count, 3 * count
        pieces: list[Piece] = []
        for is_arc in self.order:
            if is_arc:
                length, turn = self._arcs[arc]
                turning = turns[arc + 2 * count]
                pieces.append(Arc(length, starts[arc], turn + turning, turns[arc], turns[arc + count]))
                arc += 1
            else:
                length, nodes = self._bends[bend]
                pieces.append(Bend(length, k[place : place + nodes], rolls[angle : angle + nodes]))
                place, angle, bend = place + nodes, angle + nodes, bend + 1
        return pieces

    def backbone(self, z: Array, pieces: list[Piece], states: list[State], count: int) -> Backbone:
        """``count`` poses at equal spacing for ``z``, which gave ``pieces`` with these ``states`` at their ends."""
        if count not in self._pose_plans:
            nodes = self._gauss_points()
            self._pose_plans[count] = None if nodes is None else self._pose_plan(count, nodes)
        plan = self._pose_plans[count]
        if plan is None:
            return poses(pieces, np.linspace(0.0, sum(self.lengths), count))
        return plan.poses(pieces, states, z)

    def _gauss_points(self) -> list[int] | None:
        """Gauss points from which poses on each piece can be interpolated; None if a piece would need too many."""
        out = []
        for cut in self._cuts:
            parts, nodes = 1, cut.shape.nodes
            if not nodes:
                parts, nodes = nodes_needed(cut.length, cut.bend, cut.rate, 0.0, self._relative)
            if parts > 1:
                return None
            out += [nodes] * cut.shape.parts
        return out

    def _pose_plan(self, count: int, nodes: list[int]) -> PosePlan:
        rolls, arcs = self.angles[len(self.curvature) :], len(self._arcs)
        rolls_of = rolls[:arcs], rolls[arcs : 2 * arcs], rolls[3 * arcs :]
        return PosePlan(count, self.order, self.lengths, nodes, rolls_of)

    def _angle_table(self, model: ServingModel) -> Array:
        """``angles``."""
        layout, n = self._layout, model.n
        maps = np.concatenate([model.energy.space.angle_map(m, x) for m, x in enumerate(layout.x)])
        psi = np.zeros((len(maps), model.tubes, n + model.tubes + 1))
        psi[:, :, :n] = maps[:, :, model.order[:n]]
        psi[:, :, n:-1] = layout.identity
        rows = psi.reshape(-1, psi.shape[2])
        table = rows[layout.rows]
        waves, arcs = len(layout.waves), len(layout.arcs)
        table[:waves, -1] = 0.5 * np.pi  # a cosine
        rates = table[2 * waves + arcs : 2 * waves + 3 * arcs]
        rates -= rows[layout.starts]
        rates /= np.array([length + TINY for length, _ in self._arcs * 2])[:, None]
        return table

    def _curvature_table(self, model: ServingModel) -> Array:
        """``curvature``."""
        layout, materials = self._layout, model.energy.materials
        strengths = [
            0.5 * cut.length * strength if cut.shape.nodes else strength
            for cut in self._cuts
            for strength in cut.strengths
        ]
        kappa: ComplexArray = np.array(strengths, dtype=complex)[layout.strengths]
        if any([cut.varies for cut in self._cuts]):
            law = np.ones((layout.slices[-1].stop, model.tubes), dtype=complex)
            for m, (cut, places, x) in enumerate(zip(self._cuts, layout.slices, layout.x, strict=True)):
                if cut.varies:
                    s = materials.domain.boundaries[m] + materials.domain.lengths[m] * x
                    law[places] = materials.pre_curvature(m, s)
            kappa *= law.ravel()[layout.waves]
        table = np.zeros((2, len(kappa) * layout.curved), dtype=complex)
        table[0, layout.entries], table[1, layout.entries] = kappa, 1j * kappa
        return table.reshape(-1, layout.curved).view(float)
