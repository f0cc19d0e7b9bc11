"""Where the cold starts of many base positions set out: their relaxed robots."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.batch_layout import Layout
from ctr_pvs.batch_tables import Tables
from ctr_pvs.continuation import DEGREES
from ctr_pvs.energy import TorsionEnergy
from ctr_pvs.materials import Materials
from ctr_pvs.relaxed import SAME_ANGLE
from ctr_pvs.relaxed import Relaxed
from ctr_pvs.relaxed import relaxed_state
from ctr_pvs.relaxed import wrapped as wrapped
from ctr_pvs.sections import piecewise_domain
from ctr_pvs.serving import raised
from ctr_pvs.twist import TwistSpace

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(eq=False)
class Start:
    """Relaxed robots of K base positions, or of all of a layout (K = 1).

    alpha (N, K) base angles; found (K,) false where there is none; several (K,) where others are as near to zero.
    relaxed : their unknowns, None where they have no twist.
    """

    alpha: Array
    found: Mask
    several: Mask
    relaxed: list[Relaxed | None] | None = None

    def unknowns(self, tables: Tables, D: Array) -> Array:
        """(n, K) at the base positions ``D`` (N, K)."""
        if self.relaxed is None:
            return np.zeros((tables.n, 1))
        out = np.zeros((tables.n, len(self.relaxed)))
        for column, relaxed in enumerate(self.relaxed):
            if relaxed is not None:
                out[:, column] = _converted(tables, relaxed, D[:, column])
        return out


def start_of(layout: Layout, D: Array) -> Start:
    """The relaxed robots at ``D`` (N, K)."""
    aligned = _aligned(layout)
    if aligned is not None:
        half_turn = np.abs(np.abs(aligned) - np.pi) < SAME_ANGLE
        return Start(aligned[:, None], np.ones(1, dtype=bool), np.array([bool(half_turn.any())]))
    every = [relaxed_state(_energy(layout, base, DEGREES[0])) for base in D.T]
    found = np.array([relaxed is not None for relaxed in every])
    zero = np.zeros(layout.tubes)
    alpha = np.array([zero if relaxed is None else relaxed.alpha for relaxed in every]).T
    several = np.array([relaxed is not None and relaxed.several for relaxed in every])
    return Start(alpha, found, several, every)


def _energy(layout: Layout, D: Array, degree: int) -> TorsionEnergy:
    return TorsionEnergy(Materials(layout.robot, piecewise_domain(layout.robot, D)), degree)


def _aligned(layout: Layout) -> Array | None:
    """(N,) base angles where all tubes bend to the same side, if that is where nothing twists: each keeps one direction
    of pre-curvature in all coupled sections, and all hang together with the first.  None if it takes a search."""
    if not layout.coupled:
        return np.zeros(layout.tubes)
    if not layout.constant:
        return None
    direction: dict[int, float] = {}
    together = {0}
    for m in layout.coupled:
        tubes = layout.curved(m)
        if together.isdisjoint(tubes):
            return None
        together.update(tubes)
        for j in tubes:
            segment = layout.materials.segment(j, int(layout.materials.domain.segment[m, j]))
            angle = float(np.angle(segment.curvature[0]))
            if direction.setdefault(j, angle) != angle:
                return None
    out = np.zeros(layout.tubes)
    for j, angle in direction.items():
        out[j] = wrapped(np.array(direction[0] - angle))
    return out


def _converted(tables: Tables, relaxed: Relaxed, D: Array) -> Array:
    """(n,) unknowns of the torques of ``relaxed``."""
    layout = tables.layout
    materials = Materials(layout.robot, piecewise_domain(layout.robot, D))
    space = TwistSpace(materials, raised(tables.degree))
    q = space.coordinates(relaxed.torques)[tables.serving.order[: tables.n]]
    u = q * np.sqrt(materials.domain.lengths[tables.section[: tables.n]])
    if tables.lead:
        before = layout.softness[: layout.first].T @ materials.domain.lengths[: layout.first]
        turn = relaxed.torques.guide * (materials.guide_compliance + before)
        u[: tables.lead] = turn[tables.leading[1:]] - turn[tables.leading[0]]
    return np.asarray(u)
