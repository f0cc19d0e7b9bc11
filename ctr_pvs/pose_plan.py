"""Poses at equal spacing on the backbone of one D, prepared.

Frames are sampled at a few Gauss points of every piece, all at once, and carried from there to the poses by one matrix;
the tangents at the same points are integrated by another.  Closed arcs need fewer points than poses.
"""

from __future__ import annotations

import math
from functools import lru_cache
from itertools import accumulate

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.backbone import QUATERNION
from ctr_pvs.backbone import Backbone
from ctr_pvs.backbone import orientation_of
from ctr_pvs.basis import gauss_legendre
from ctr_pvs.collocation import interpolator
from ctr_pvs.collocation import squared_sines
from ctr_pvs.pieces import TINY
from ctr_pvs.pieces import Arc
from ctr_pvs.pieces import Bend
from ctr_pvs.pieces import Piece
from ctr_pvs.pieces import State

Array = NDArray[np.float64]


#: i / 2, as an array: numpy multiplies by a Python complex number at twice the cost.
HALF_I = np.array(0.5j)
#: From integrals of the real and imaginary parts of a b and |b|^2 to positions less the arc length along x.
FROM_RATES = np.array([[0.0, 0.0, -2.0], [0.0, 2.0, 0.0], [-2.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
NORMALISE = np.full(4, -0.5)
THREE_HALVES = np.array(1.5)
#: Orders of pieces whose layouts are kept.
KEPT = 64


class Layout:
    """What does not depend on the lengths of pieces of these kinds (true for an arc) with ``nodes`` Gauss points each.

    K Gauss points of all pieces: those of arcs first, ``on_arcs`` of them.

    columns : of each piece along the rod, its Gauss points.  piece (K,) : the piece of each.
    owner (K, pieces) : 1 where the Gauss point lies on the piece; arcs (on_arcs, A), places (on_arcs, A) : for arcs
    alone, 1 and the place relative to the length of the arc.  is_arc (pieces,).
    """

    def __init__(self, order: tuple[bool, ...], nodes: tuple[int, ...]) -> None:
        self.is_arc = np.array(order)
        arcs_first = sorted(range(len(order)), key=lambda index: not order[index])
        counts = [nodes[index] for index in arcs_first]
        ends = dict(zip(arcs_first, accumulate(counts), strict=True))
        self.columns = [slice(ends[index] - count, ends[index]) for index, count in enumerate(nodes)]
        self.piece = np.repeat(arcs_first, counts)
        self.owner = np.eye(len(nodes))[self.piece]
        self.on_arcs = sum(count for is_arc, count in zip(order, nodes, strict=True) if is_arc)
        self.arcs = self.owner[: self.on_arcs, self.is_arc]
        x = np.concatenate([gauss_legendre(count).x for count in counts])
        self.places = x[: self.on_arcs, None] * self.arcs


_layout = lru_cache(maxsize=KEPT)(Layout)


@lru_cache(maxsize=KEPT)
def _equal_spacing(count: int) -> Array:
    """(count,) from 0 to 1."""
    return np.linspace(0.0, 1.0, count)


class PosePlan:
    """``count`` poses on pieces of these kinds (true for an arc), ``lengths`` [m] and Gauss points ``nodes``.

    rolls : matrices from z to the rolls at the starts of arcs, to the rates of these, and to the rolls at the Gauss
    points of bends.

    s (count,) [m]; frames, integrals (count, K) : from values at the K Gauss points of all pieces, arcs first, to the
    poses, and to integrals from the orifice.
    """

    def __init__(
        self,
        count: int,
        order: list[bool],
        lengths: list[float],
        nodes: list[int],
        rolls: tuple[Array, Array, Array],
    ) -> None:
        layout, length = _layout(tuple(order), tuple(nodes)), np.array(lengths)
        boundaries = np.array([0.0, *accumulate(lengths)])
        self.s = _equal_spacing(count) * boundaries[-1]
        here = boundaries[1:-1].searchsorted(self.s)  # a boundary counts to the piece before it
        x = np.minimum((self.s - boundaries[here]) / (length + TINY)[here], 1.0)
        self.frames, self.integrals = self._interpolators(layout, nodes, x, boundaries)
        self.integrals *= length[layout.piece]
        self._owner, self._arc_owner, self._on_arc = layout.owner, layout.arcs, layout.on_arcs
        places = layout.places * length[layout.is_arc]
        self._half_places = 0.5 * places
        starts, rates, points = rolls
        self._rolls = np.concatenate([layout.arcs.dot(starts) + places.dot(rates), points])

    def _interpolators(self, layout: Layout, nodes: list[int], x: Array, boundaries: Array) -> Array:
        """(2, count, K) ``frames``, and ``integrals`` relative to the lengths of pieces, for poses at ``x`` (count,)
        of theirs."""
        out = np.zeros((2, len(x), len(layout.piece)))
        functions = squared_sines(max(nodes), x)
        first, ends = 0, self.s.searchsorted(boundaries[1:], "right").tolist()
        for columns, count, last in zip(layout.columns, nodes, ends, strict=True):
            out[:, first:last, columns] = functions[first:last, : count + 1] @ interpolator(count)
            out[1, last:, columns] = gauss_legendre(count).weights
            first = last
        return out

    def poses(self, pieces: list[Piece], states: list[State], z: Array) -> Backbone:
        """The poses of ``pieces``, which ``z`` gives by the plan, with ``states`` at their ends."""
        local = self._local(pieces)
        # From frames that set out from the identity to those that set out from where their piece starts.
        starts = np.array([(a, b.conjugate(), -b, a.conjugate()) for a, b, _, _, _ in states[:-1]])
        mixing = self._owner.dot(starts.view(float)).view(complex)
        spinors = local[:, :1] * mixing[:, :2]
        spinors += local[:, 1:] * mixing[:, 2:]
        # Rates of the paths of ``pieces``: a b and |b|^2.
        rates = spinors * spinors[:, 1:].conj()
        position = self.integrals.dot(rates.view(float)).dot(FROM_RATES)
        position[:, 0] += self.s
        spinors *= np.exp(self._rolls.dot(z) * HALF_I)[:, None]
        orientation = self.frames.dot(spinors.view(float)).dot(QUATERNION)
        # Between Gauss points the norm is that of a polynomial, nearly 1: one Newton step of its inverse square root.
        orientation *= (orientation * orientation).dot(NORMALISE)[:, None] + THREE_HALVES
        roll = 0.5 * pieces[0].start_roll
        orientation[0] = math.sin(roll), 0.0, 0.0, math.cos(roll)
        orientation[-1] = orientation_of(states[-1], pieces[-1].end_roll)
        return Backbone(self.s, position, orientation)

    def _local(self, pieces: list[Piece]) -> NDArray[np.complex128]:
        """(K, 2) a and conj(b) at the Gauss points, each piece set out from the identity."""
        out = np.empty((len(self._owner), 2), dtype=complex)
        if self._on_arc:
            out[: self._on_arc] = self._on_arcs([piece for piece in pieces if isinstance(piece, Arc)])
        if self._on_arc < len(out):
            solved = [piece.solve()[0].T for piece in pieces if isinstance(piece, Bend)]
            out[self._on_arc :] = solved[0] if len(solved) == 1 else np.concatenate(solved)
        return out

    def _on_arcs(self, arcs: list[Arc]) -> NDArray[np.complex128]:
        """(points, 2) by the closed form of ``Arc``: (cos + i turn / omega sin) e and conj(k) / omega sin e."""
        rates: list[float] = []
        shares: list[float] = []
        for arc in arcs:
            omega = math.hypot(arc.turn, abs(arc.curvature)) + TINY
            rates += (omega, -arc.turn)
            shares += (arc.turn / omega, arc.curvature.real / omega, -arc.curvature.imag / omega)
        circles = np.exp(1j * self._half_places.dot(np.array(rates).reshape(-1, 2)))
        wave = circles[:, 0]
        out = np.empty(circles.shape, dtype=complex)
        parts = out.view(float)
        parts[:, 0] = wave.real
        parts[:, 1:] = self._arc_owner.dot(np.array(shares).reshape(-1, 3)) * wave.imag[:, None]
        out *= circles[:, 1:]
        return out
