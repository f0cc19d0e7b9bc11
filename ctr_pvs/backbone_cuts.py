"""How the sections of one D are cut into pieces: closed arcs, or bends with enough Gauss points for a tolerance.

A choice of D and tolerance alone, whatever the base angles: twist rates are bounded by the largest torques that the
tubes can exert on each other.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ctr_pvs.collocation import nodes_needed
from ctr_pvs.materials import Materials
from ctr_pvs.sections import ABSENT
from ctr_pvs.serving import ServingModel

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

    length : of each piece [m].  turn : of the pre-curvatures, at most [rad/m]; an arc's with its sign.
    bend, rate : bounds of |k| [1/m] and of how fast k and the roll turn or change [rad/m].
    strengths : what each curved tube adds to the curvature: its share of the bending, times its pre-curvature [1/m]
    unless that ``varies`` along the section.
    """

    shape: Shape
    length: float
    turn: float
    bend: float
    rate: float
    strengths: list[complex]
    varies: bool


#: With nothing out, a piece of no length carries the roll.
NOTHING = Cut(Shape((), 1, 0), 0.0, 0.0, 0.0, 0.0, [], varies=False)


def cuts(model: ServingModel, relative: float) -> list[Cut]:
    """The cut sections of ``model`` for an error ``relative`` to the length; one at least."""
    strongest = model.pairs.amplitude.dot(np.abs(model.pairs.turns)).tolist()  # torque [N m] of the others on each tube
    return [_cut(model, m, strongest, relative) for m in range(model.energy.materials.domain.n_sections)] or [NOTHING]


def _cut(model: ServingModel, m: int, strongest: list[float], relative: float) -> Cut:
    """Section m, its tubes turned by torques of ``strongest`` (N,) [N m] at most."""
    materials = model.energy.materials
    tubes, bending = materials.curved_tubes[m], materials.bending[m].tolist()
    length, coupled = materials.domain.lengths.item(m), materials.coupled.item(m)
    present = {j: materials.segment(j, i) for j, i in enumerate(materials.domain.segment[m].tolist()) if i != ABSENT}
    twist = max([strongest[j] / segment.torsional_stiffness for j, segment in present.items()])
    curved, total = [present[j] for j in tubes], sum(bending)
    shares = [bending[j] / total for j in tubes]
    if any([len(segment.curvature) > 1 for segment in curved]):
        bend, change = _sampled(materials, m, tubes, shares)
        varies, strengths = True, shares
    else:
        values = [share * segment.curvature[0] for share, segment in zip(shares, curved, strict=True)]
        bend, change = sum(map(abs, values)), 0.0
        varies = any([segment.turn for segment in curved])
        strengths = shares if varies else values
        if not coupled:  # the strain is constant in a frame that turns at a constant rate
            turn = curved[0].turn if curved else 0.0
            shape = Shape(tuple(tubes), 1, 0)
            return Cut(shape, length, turn, bend, abs(turn) + 2.0 * twist, strengths, varies)
    turn = max([abs(segment.turn) for segment in present.values()])
    rate = max(twist + turn, change / bend if bend else 0.0)
    panels, wave = 1, 0.0
    if coupled:
        panels, wave = model.energy.space.basis(m).panels, math.sqrt(materials.coupling(m)) / length
    parts, nodes = nodes_needed(length / panels, bend, rate, wave, relative)
    parts *= panels
    return Cut(Shape(tuple(tubes), parts, nodes), length / parts, turn, bend, rate, strengths, varies)


def _sampled(materials: Materials, m: int, tubes: list[int], shares: list[float]) -> tuple[float, float]:
    """Largest |k| [1/m] and its fastest change [1/m^2] in section m, by samples."""
    start, length = materials.domain.boundaries[m], materials.domain.lengths[m]
    bends = np.abs(materials.pre_curvature(m, start + length * NINE_PLACES)[:, tubes]) * shares
    step = length / (len(NINE_PLACES) - 1)
    return float(bends.sum(axis=1).max()), float(np.abs(np.diff(bends, axis=0)).sum(axis=1).max() / step)
