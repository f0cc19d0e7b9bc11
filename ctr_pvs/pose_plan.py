"""Poses at equal spacing on the backbone of one D, prepared.

Frames are sampled at a few Gauss points of every piece, all at once, and carried from there to the poses by one matrix;
the tangents at the same points are integrated by another.  Closed arcs need fewer points than poses.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.backbone import QUATERNION
from ctr_pvs.backbone import Backbone
from ctr_pvs.backbone import orientation_of
from ctr_pvs.basis import gauss_legendre
from ctr_pvs.collocation import interpolation
from ctr_pvs.pieces import TINY
from ctr_pvs.pieces import Arc
from ctr_pvs.pieces import Bend
from ctr_pvs.pieces import Piece
from ctr_pvs.pieces import State

if TYPE_CHECKING:
    from ctr_pvs.backbone_plan import BackbonePlan

Array = NDArray[np.float64]


#: i / 2, as an array: numpy multiplies by a Python complex number at twice the cost.
HALF_I = np.array(0.5j)
#: From integrals of the real and imaginary parts of a b and |b|^2 to positions less the arc length along x.
FROM_RATES = np.array([[0.0, 0.0, -2.0], [0.0, 2.0, 0.0], [-2.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
NORMALISE = np.full(4, -0.5)
THREE_HALVES = np.array(1.5)


class PosePlan:
    """``count`` poses of ``plan``.

    s (count,) [m]; frames, integrals (count, K) : from values at the K Gauss points of all pieces, arcs first, to the
    poses, and to integrals from the orifice.
    """

    def __init__(self, plan: BackbonePlan, count: int, nodes: list[int]) -> None:
        lengths, order = plan.lengths, plan.arcs_first
        self._ends = np.cumsum(lengths)
        self.s = np.linspace(0.0, self._ends[-1], count)
        self.frames, self.integrals = (np.zeros((count, sum(nodes))) for _ in range(2))
        self._owner = np.repeat(np.eye(len(nodes))[order], [nodes[index] for index in order], axis=0)
        first = 0
        for index in order:
            self._interpolate(index, slice(first, first + nodes[index]), lengths[index])
            first += nodes[index]
        arcs = order[: len(plan.arcs)]
        self._on_arc = sum(nodes[index] for index in arcs)
        self._arc_owner = self._owner[: self._on_arc, arcs]
        self._half_places = 0.5 * plan.places(nodes)[: self._on_arc, None] * self._arc_owner
        self._rolls = plan.roll_rows(nodes)

    def _interpolate(self, index: int, columns: slice, length: float) -> None:
        """Fills ``frames`` and ``integrals`` for the Gauss points of one piece."""
        end, nodes = self._ends[index], columns.stop - columns.start
        start = self._ends[index - 1] if index else 0.0
        beyond = self.s > end
        here = (self.s > start) & ~beyond
        if index == 0:
            here |= self.s == 0.0
        x = np.clip((self.s[here] - start) / max(length, TINY), 0.0, 1.0)
        values, inside = interpolation(nodes, x)
        self.frames[here, columns], self.integrals[here, columns] = values, length * inside
        self.integrals[beyond, columns] = length * gauss_legendre(nodes).weights

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
