"""From D and loads to elements: the sections that D cuts, divided into elements, with everything that does not depend
on the state."""

from __future__ import annotations

import math

from ctr_pvs.kernel.arrays import ABSENT
from ctr_pvs.kernel.arrays import ARC
from ctr_pvs.kernel.arrays import AT
from ctr_pvs.kernel.arrays import AT_X
from ctr_pvs.kernel.arrays import BENDING
from ctr_pvs.kernel.arrays import COUPLED
from ctr_pvs.kernel.arrays import CUT
from ctr_pvs.kernel.arrays import DEGREE
from ctr_pvs.kernel.arrays import ELEMENTS
from ctr_pvs.kernel.arrays import FIRST
from ctr_pvs.kernel.arrays import FLOOR
from ctr_pvs.kernel.arrays import FRAMED_ANGLE
from ctr_pvs.kernel.arrays import GAUSS
from ctr_pvs.kernel.arrays import LAST_ACTIVE
from ctr_pvs.kernel.arrays import LEAD
from ctr_pvs.kernel.arrays import LEADER
from ctr_pvs.kernel.arrays import LENGTH
from ctr_pvs.kernel.arrays import LOADED
from ctr_pvs.kernel.arrays import LOADS
from ctr_pvs.kernel.arrays import MOMENT
from ctr_pvs.kernel.arrays import MOMENTS
from ctr_pvs.kernel.arrays import MU
from ctr_pvs.kernel.arrays import MU_HERE
from ctr_pvs.kernel.arrays import MU_SIZE
from ctr_pvs.kernel.arrays import N_ELEMENTS
from ctr_pvs.kernel.arrays import N_FAR
from ctr_pvs.kernel.arrays import N_LOADS
from ctr_pvs.kernel.arrays import N_NODES
from ctr_pvs.kernel.arrays import N_POINTS
from ctr_pvs.kernel.arrays import N_UNKNOWNS
from ctr_pvs.kernel.arrays import NODES
from ctr_pvs.kernel.arrays import PER_LENGTH
from ctr_pvs.kernel.arrays import PLACE
from ctr_pvs.kernel.arrays import POINT
from ctr_pvs.kernel.arrays import POINT_FORCE
from ctr_pvs.kernel.arrays import POINT_MOMENT
from ctr_pvs.kernel.arrays import RAISED
from ctr_pvs.kernel.arrays import REST
from ctr_pvs.kernel.arrays import ROOT
from ctr_pvs.kernel.arrays import ROW
from ctr_pvs.kernel.arrays import SCALE
from ctr_pvs.kernel.arrays import SECTIONS
from ctr_pvs.kernel.arrays import SEGMENT
from ctr_pvs.kernel.arrays import SIZE
from ctr_pvs.kernel.arrays import STATICS
from ctr_pvs.kernel.arrays import STIFFNESS
from ctr_pvs.kernel.arrays import SWING
from ctr_pvs.kernel.arrays import TORSION
from ctr_pvs.kernel.arrays import TUBE
from ctr_pvs.kernel.arrays import UNKNOWNS
from ctr_pvs.kernel.arrays import WEIGHT
from ctr_pvs.kernel.arrays import WIDEST
from ctr_pvs.kernel.arrays import Array
from ctr_pvs.kernel.arrays import Ints
from ctr_pvs.kernel.arrays import Kit
from ctr_pvs.kernel.arrays import Scene
from ctr_pvs.kernel.arrays import Sections
from ctr_pvs.kernel.compiler import compiled
from ctr_pvs.kernel.materials import guide_compliance
from ctr_pvs.kernel.materials import is_curved
from ctr_pvs.kernel.materials import pre_curvature
from ctr_pvs.kernel.sections import FINER
from ctr_pvs.kernel.sections import SAME_PLACE
from ctr_pvs.kernel.sections import cut_sections
from ctr_pvs.kernel.sections import first_point
from ctr_pvs.kernel.sections import mark_loaded
from ctr_pvs.kernel.sections import norm
from ctr_pvs.kernel.sections import plan_sections
from ctr_pvs.kernel.sections import stiffness_of
from ctr_pvs.kernel.workspace import sections_of


@compiled
def fill_elements(
    tubes: Array, segments: Ints, rules: Array, D: Array, sections: Sections, count: int, scene: Scene
) -> None:
    """Makes the elements of the first ``count`` sections, and what the guide holds, in ``scene``."""
    N = len(D)
    last, lead = 0, 3 if count > 0 and sections.loaded[0] else 0
    for q in range(count):
        if sections.coupled[q]:
            last = q + 1
    m, node, unknown, active = 0, 0, N, 0
    for q in range(count):
        here = sections.segment[q]
        h = (sections.start[q + 1] - sections.start[q]) / sections.parts[q]
        G, degree = sections.nodes[q], sections.degree[q]
        for part in range(sections.parts[q]):
            scene.line[m, ARC] = sections.start[q] + part * h
            scene.line[m, LENGTH], scene.line[m, STIFFNESS] = h, stiffness_of(tubes, here)
            scene.marks[m, COUPLED], scene.marks[m, DEGREE] = sections.coupled[q], degree
            scene.marks[m, GAUSS], scene.marks[m, ROW] = G, node
            for j in range(N):
                i = here[j]
                scene.parts[SEGMENT, m, j] = i
                scene.parts[FIRST, m, j] = unknown
                size = 0
                scene.held[SCALE, m, j] = 0.0
                if i != ABSENT and q < last:
                    curved = is_curved(tubes, j, i) and sections.coupled[q]
                    size = degree + FINER + 1 if curved else 1
                    scene.held[SCALE, m, j] = math.sqrt(h / tubes[j, i, TORSION])
                scene.parts[SIZE, m, j] = size
                unknown += size
            scene.marks[m, LOADED], scene.marks[m, MU] = sections.loaded[q], unknown
            scene.marks[m, MU_SIZE] = degree + FINER + 1 if sections.loaded[q] else 0
            unknown += 2 * scene.marks[m, MU_SIZE]
            for g in range(G):
                s = scene.line[m, ARC] + h * rules[G, g, PLACE]
                scene.gauss[node, PLACE], scene.gauss[node, WEIGHT] = s, h * rules[G, g, WEIGHT]
                scene.bends[node, MU_HERE], scene.bends[node, MOMENT] = 0.0, 0.0
                for j in range(N):
                    i = here[j]
                    if i == ABSENT:
                        scene.moments[REST, node, j] = 0.0
                    else:
                        scene.moments[REST, node, j] = tubes[j, i, BENDING] * pre_curvature(tubes, j, i, s + D[j])
                node += 1
            m += 1
        if sections.coupled[q]:
            active = m
    scene.line[m, ARC] = sections.start[count]
    for j in range(N):
        scene.base[AT, j] = D[j]
        scene.base[ROOT, j] = math.sqrt(guide_compliance(tubes, segments, j, D[j]))
    scene.counts[N_ELEMENTS], scene.counts[N_NODES], scene.counts[N_UNKNOWNS] = m, node, unknown
    scene.counts[LAST_ACTIVE], scene.counts[LEAD] = active, lead
    scene.counts[LEADER] = leader(tubes, segments, scene)


@compiled
def fill_statics(tubes: Array, D: Array, loads: Array, scene: Scene) -> None:
    """Puts ``loads`` on the elements of ``scene``: the force of all beyond is known whatever the shape is."""
    M, N = scene.counts[N_ELEMENTS], len(D)
    scene.counts[N_LOADS], scene.counts[MOMENTS] = len(loads), 0
    scene.counts[N_POINTS] = (len(loads) - first_point(tubes)) // POINT if len(loads) > 0 else 0
    for i in range(len(loads)):
        scene.loads[i] = loads[i]
    for m in range(M + 1):
        for i in range(STATICS):
            scene.statics[m, i] = 0.0
    for p in range(first_point(tubes) if len(loads) > 0 else 0, len(loads), POINT):
        s = loads[p + AT_X] - D[int(loads[p + TUBE])]
        at = 0
        while at < M and scene.line[at, ARC] < s - SAME_PLACE:
            at += 1
        scene.point_at[(p - first_point(tubes)) // POINT] = at
        scene.counts[MOMENTS] += 1 if norm(loads, p + POINT_MOMENT) > 0.0 else 0
        for i in range(3):
            scene.statics[max(at, 1) - 1, N_FAR + i] += loads[p + POINT_FORCE + i] if at > 0 else 0.0
    for m in range(M - 1 if len(loads) > 0 else -1, -1, -1):
        for j in range(N):
            i = scene.parts[SEGMENT, m, j]
            for c in range(3 if i != ABSENT else 0):
                scene.statics[m, PER_LENGTH + c] += loads[3 * (j * tubes.shape[1] + i) + c]
        for c in range(3):
            near = scene.statics[m, N_FAR + c] + scene.line[m, LENGTH] * scene.statics[m, PER_LENGTH + c]
            scene.statics[m - 1 if m > 0 else M, N_FAR + c] += near


@compiled
def leader(tubes: Array, segments: Ints, scene: Scene) -> int:
    """The tube that reaches farthest, the innermost of equals: poses carry its material frame.  With nothing out, the
    innermost that has any length in the guide."""
    M = scene.counts[N_ELEMENTS]
    found = 0
    for j in range(len(segments)):
        if (scene.parts[SEGMENT, M - 1, j] != ABSENT) if M > 0 else (scene.base[AT, j] > SAME_PLACE):
            found = j
    return found


@compiled
def holds(scene: Scene, D: Array, loads: Array, raised: int, floor: int) -> bool:
    """True if ``scene`` is cut for D (N,) [m], these packed ``loads`` and degrees."""
    if scene.counts[CUT] != 1 or scene.counts[RAISED] != raised or scene.counts[FLOOR] != floor:
        return False
    if scene.counts[N_LOADS] != len(loads):
        return False
    for j in range(len(D)):
        if scene.base[AT, j] != D[j]:
            return False
    for i in range(len(loads)):
        if scene.loads[i] != loads[i]:
            return False
    return True


@compiled
def prepare(kit: Kit, scene: Scene, D: Array, loads: Array, tolerance: float, raised: int, floor: int) -> bool:
    """Cuts ``scene`` for D (N,) [m] and packed ``loads`` unless it is so already; false if the workspace is too small:
    the capacities that are needed then stand in its ``ints``, negative.

    tolerance [m], raised, floor : see ``plan_sections``.  A workspace only ever sees one tolerance.
    """
    if holds(scene, D, loads, raised, floor):
        return True
    ints, sections = kit.ints, sections_of(kit)
    scene.counts[CUT] = 0
    most = 1 + len(loads) // POINT
    for j in range(len(D)):
        most += kit.segments[j]
    if most > ints[SECTIONS] or len(loads) > ints[LOADS]:
        ints[SECTIONS], ints[LOADS] = -max(most, ints[SECTIONS]), max(len(loads), ints[LOADS])
        return False
    count = cut_sections(kit.tubes, kit.segments, D, loads, sections)
    mark_loaded(kit.tubes, D, loads, sections, count)
    elements, nodes, unknowns, widest = plan_sections(
        kit.tubes, D, sections, count, tolerance, raised, floor, scene.base[SWING]
    )
    if (
        elements > ints[ELEMENTS] or nodes > ints[NODES] or unknowns > ints[UNKNOWNS] or widest > ints[WIDEST]
    ):  # fmt: skip
        ints[SECTIONS] = -ints[SECTIONS]
        ints[ELEMENTS], ints[NODES], ints[UNKNOWNS], ints[WIDEST] = elements, nodes, unknowns, widest
        return False
    scene.base[FRAMED_ANGLE, 0] = math.nan
    fill_elements(kit.tubes, kit.segments, kit.rules, D, sections, count, scene)
    fill_statics(kit.tubes, D, loads, scene)
    scene.counts[RAISED], scene.counts[FLOOR], scene.counts[CUT] = raised, floor, 1
    return True
