"""How the sections of one D are cut into pieces: closed arcs, or bends with enough Gauss points for a tolerance.

A choice of D and tolerance alone, whatever the base angles: twist rates are bounded by the largest torques that the
tubes can exert on each other.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.collocation import nodes_needed
from ctr_pvs.materials import Materials
from ctr_pvs.robot import Segment
from ctr_pvs.sections import ABSENT
from ctr_pvs.serving import ServingModel

Array = NDArray[np.float64]

#: Places in a section where the strength of varying pre-curvatures is sampled.
NINE_PLACES = np.linspace(0.0, 1.0, 9)


class Shape(NamedTuple):
    """What a cut section is made of, without its lengths.

    tubes : the curved ones.  parts : equal pieces.  nodes : Gauss points of each of them, 0 for an arc.
    """

    tubes: tuple[int, ...]
    parts: int
    nodes: int


class Cut(NamedTuple):
    """A section and its ``shape``.

    length : of each piece [m].  turn : of an arc's pre-curvature [rad/m].  bend, rate : bounds of |k| [1/m] and of how
    fast k and the roll turn or change [rad/m].
    """

    shape: Shape
    length: float
    turn: float
    bend: float
    rate: float


#: With nothing out, a piece of no length carries the roll.
NOTHING = Cut(Shape((), 1, 0), 0.0, 0.0, 0.0, 0.0)


def cuts(model: ServingModel, shares: Array, relative: float) -> list[Cut]:
    """The cut sections of ``model`` for an error ``relative`` to the length; one at least.

    shares (M, N) : of the tubes in the bending stiffness of each section.
    """
    materials = model.energy.materials
    segments, lengths = materials.domain.segment.tolist(), materials.domain.lengths.tolist()
    coupled, twists = materials.coupled.tolist(), _fastest_twists(model)
    out = []
    for m, (tubes, length, twist) in enumerate(zip(materials.curved_tubes, lengths, twists, strict=True)):
        curved = [materials.segment(j, segments[m][j]) for j in tubes]
        constant = all(len(segment.curvature) == 1 for segment in curved)
        bend, change = _constant(curved, tubes, shares[m]) if constant else _varying(materials, m, shares[m])
        if constant and not coupled[m]:  # the strain is constant in a frame that turns at a constant rate
            turn = curved[0].turn if curved else 0.0
            out.append(Cut(Shape(tuple(tubes), 1, 0), length, turn, bend, abs(turn) + 2.0 * twist))
            continue
        turn = max(abs(materials.segment(j, index).turn) for j, index in enumerate(segments[m]) if index != ABSENT)
        rate = max(twist + turn, change / bend if bend else 0.0)
        panels, wave = 1, 0.0
        if coupled[m]:
            panels, wave = model.energy.space.basis(m).panels, math.sqrt(materials.coupling(m)) / length
        parts, nodes = nodes_needed(length / panels, bend, rate, wave, relative)
        out.append(Cut(Shape(tuple(tubes), panels * parts, nodes), length / (panels * parts), turn, bend, rate))
    return out or [NOTHING]


def _fastest_twists(model: ServingModel) -> list[float]:
    """Bound of the twist rates [rad/m] in each section."""
    pairs, stiffness = model.pairs, model.energy.materials.torsional
    strongest = pairs.amplitude.dot(np.abs(pairs.turns))  # (N,) torque [N m] that the others can exert
    rates = np.divide(strongest, stiffness, out=np.zeros_like(stiffness), where=stiffness > 0.0)
    fastest: list[float] = rates.max(axis=1).tolist()
    return fastest


def _constant(curved: list[Segment], tubes: list[int], share: Array) -> tuple[float, float]:
    """Largest |k| [1/m] and its fastest change [1/m^2] where tubes of constant |pre-curvature| share the bending."""
    return sum(abs(segment.curvature[0]) * share.item(j) for segment, j in zip(curved, tubes, strict=True)), 0.0


def _varying(materials: Materials, m: int, share: Array) -> tuple[float, float]:
    """As ``_constant``, for any pre-curvatures."""
    start, length = materials.domain.boundaries[m], materials.domain.lengths[m]
    bends = np.abs(materials.pre_curvature(m, start + length * NINE_PLACES)) * share
    step = length / (len(NINE_PLACES) - 1)
    return float(bends.sum(axis=1).max()), float(np.abs(np.diff(bends, axis=0)).sum(axis=1).max() / step)
