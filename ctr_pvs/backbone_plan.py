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
    waves, shares, curvatures (W,) : of each wave, the indices in a flat table of places and tubes, in one of sections
    and tubes, and among the ``curved`` curvatures: those of arcs, then those at the Gauss points.
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
        waves = [
            (place * tubes + j, section[place] * tubes + j, index)
            for index, place in enumerate(arcs + points)
            for j in shapes[section[place]].tubes
        ]
        self.waves, self.shares, self.curvatures = np.array(waves, dtype=int).reshape(-1, 3).T.copy()
        self.curved = len(arcs) + len(points)
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
        shares = materials.bending / materials.bending.sum(axis=1, keepdims=True)
        self._cuts = cuts(model, shares, self._relative)
        self._layout = _layout(tuple([cut.shape for cut in self._cuts]), tube, model.tubes)
        self.order = self._layout.order
        self.lengths = [cut.length for cut in self._cuts for _ in range(cut.shape.parts)]
        self._arcs = [(self._cuts[m].length, self._cuts[m].turn) for m in self._layout.arcs]
        self._bends = [(self._cuts[m].length, self._cuts[m].shape.nodes) for m in self._layout.bends]
        self.angles = self._angle_table(model)
        self.curvature = self._curvature_table(model, shares)
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
        for shape, length, _, bend, rate in self._cuts:
            parts, nodes = (1, shape.nodes) if shape.nodes else nodes_needed(length, bend, rate, 0.0, self._relative)
            if parts > 1:
                return None
            out += [nodes] * shape.parts
        return out

    def _pose_plan(self, count: int, nodes: list[int]) -> PosePlan:
        rolls, arcs = self.angles[len(self.curvature) :], len(self._arcs)
        rolls_of = rolls[:arcs], rolls[arcs : 2 * arcs], rolls[3 * arcs :]
        return PosePlan(count, self.order, self.lengths, nodes, rolls_of)

    def _angle_table(self, model: ServingModel) -> Array:
        """``angles``."""
        layout, tubes = self._layout, np.arange(model.tubes)
        maps = np.concatenate([model.energy.space.angle_map(m, x) for m, x in enumerate(layout.x)])
        psi = np.zeros((len(maps), model.tubes, model.n + model.tubes + 1))
        psi[:, :, : model.n] = maps[:, :, model.order[: model.n]]
        psi[:, tubes, model.n + tubes] = 1.0
        rows = psi.reshape(-1, psi.shape[2])
        table = rows[layout.rows]
        waves, arcs = len(layout.waves), len(layout.arcs)
        table[:waves, -1] += 0.5 * np.pi  # a cosine
        if arcs:
            rates = table[2 * waves + arcs : 2 * waves + 3 * arcs]
            rates -= rows[layout.starts]
            rates /= np.array([[length + TINY] for length, _ in self._arcs * 2])
        return table

    def _curvature_table(self, model: ServingModel, shares: Array) -> Array:
        """``curvature``."""
        layout, materials = self._layout, model.energy.materials
        boundaries = materials.domain.boundaries.tolist()
        kappa = np.zeros((layout.slices[-1].stop, model.tubes), dtype=complex)
        for m, (cut, places, x) in enumerate(zip(self._cuts, layout.slices, layout.x, strict=True)):
            if cut.shape.tubes:
                values = materials.pre_curvature(m, x * (cut.length * cut.shape.parts) + boundaries[m])
                kappa[places] = values * (0.5 * cut.length) if cut.shape.nodes else values
        moved = kappa.ravel()[layout.waves] * shares.ravel()[layout.shares]
        count, row = len(moved), np.arange(len(moved))
        table = np.zeros((2 * count, layout.curved), dtype=complex)
        table[row, layout.curvatures], table[count + row, layout.curvatures] = moved, 1j * moved
        return table.view(float)
