"""From D to elements: where the tubes overlap beyond the orifice, cut into elements that low polynomials can follow.

A *section* lies between two neighbouring ends of segments; every property is smooth inside.  Where coupling or bending
is strong a section is cut into equal *elements*.  Degrees come from D and the tolerance alone: twist obeys a pendulum
equation, theta'' = lambda sin(theta), whose solutions are analytic up to about pi / (2 sqrt(lambda)) from the section
(of length 1), so Legendre coefficients fall by the size rho of the Bernstein ellipse that reaches there (L. N.
Trefethen, "Approximation Theory and Approximation Practice", chapter 8).  What an estimate then finds too coarse is
raised.
"""

from __future__ import annotations

import math

from ctr_pvs.kernel.arrays import ABSENT
from ctr_pvs.kernel.arrays import ARC
from ctr_pvs.kernel.arrays import AT
from ctr_pvs.kernel.arrays import BENDING
from ctr_pvs.kernel.arrays import BLOCK
from ctr_pvs.kernel.arrays import COUPLED
from ctr_pvs.kernel.arrays import CUT
from ctr_pvs.kernel.arrays import DEGREE
from ctr_pvs.kernel.arrays import ELEMENTS
from ctr_pvs.kernel.arrays import END
from ctr_pvs.kernel.arrays import FACTORS
from ctr_pvs.kernel.arrays import FIRST
from ctr_pvs.kernel.arrays import FLOOR
from ctr_pvs.kernel.arrays import FRAMED_ANGLE
from ctr_pvs.kernel.arrays import GAUSS
from ctr_pvs.kernel.arrays import HIGHEST_DEGREE
from ctr_pvs.kernel.arrays import LAST_COUPLED
from ctr_pvs.kernel.arrays import LEADER
from ctr_pvs.kernel.arrays import LENGTH
from ctr_pvs.kernel.arrays import MOST_NODES
from ctr_pvs.kernel.arrays import N_ELEMENTS
from ctr_pvs.kernel.arrays import N_FACTORS
from ctr_pvs.kernel.arrays import N_NODES
from ctr_pvs.kernel.arrays import N_UNKNOWNS
from ctr_pvs.kernel.arrays import NODES
from ctr_pvs.kernel.arrays import PLACE
from ctr_pvs.kernel.arrays import RAISED
from ctr_pvs.kernel.arrays import REST
from ctr_pvs.kernel.arrays import ROOT
from ctr_pvs.kernel.arrays import ROW
from ctr_pvs.kernel.arrays import SCALE
from ctr_pvs.kernel.arrays import SECTIONS
from ctr_pvs.kernel.arrays import SEGMENT
from ctr_pvs.kernel.arrays import SIZE
from ctr_pvs.kernel.arrays import STIFFNESS
from ctr_pvs.kernel.arrays import SWING
from ctr_pvs.kernel.arrays import TORSION
from ctr_pvs.kernel.arrays import UNKNOWNS
from ctr_pvs.kernel.arrays import WEIGHT
from ctr_pvs.kernel.arrays import Array
from ctr_pvs.kernel.arrays import Ints
from ctr_pvs.kernel.arrays import Kit
from ctr_pvs.kernel.arrays import Scene
from ctr_pvs.kernel.arrays import Sections
from ctr_pvs.kernel.arrays import sections_of
from ctr_pvs.kernel.compiler import compiled
from ctr_pvs.kernel.materials import curved_tubes
from ctr_pvs.kernel.materials import guide_compliance
from ctr_pvs.kernel.materials import is_curved
from ctr_pvs.kernel.materials import pre_curvature
from ctr_pvs.kernel.materials import stiffest_twist
from ctr_pvs.kernel.materials import strongest_bend

#: Places closer than this [m] are one place.  Fixed, so that a kink is found by geometry and not by rounding.
SAME_PLACE = 1e-12
#: The check adds this many polynomial degrees: a Ritz value of low degree is optimistic.
FINER = 2
#: Gauss points beyond the finer degree.
MORE_NODES = 3
#: Square root of a section's coupling, and turn of the backbone and the pre-curvatures [rad], that one element takes
#: on.
BENDS_AN_ELEMENT, TURNS_AN_ELEMENT = 3.5, 4.0
#: Degrees of the first choice: the lowest, the highest (raised and checked ones go up to HIGHEST_DEGREE), and, measured
#: on random robots, what a turn of the pre-curvature or of the backbone along a section adds to its coupling, as a
#: share of its square.
LOWEST_DEGREE, HIGHEST_FIRST = 1, 16
TURN_SHARE = 0.1
#: Measured on random robots: how much faster than by rho coefficients fall.
FASTER = 1.5
#: Error in position over the robot's length that integrating the backbone may leave, as a share of the tolerance's, and
#: what rounding leaves anyway.
INTEGRATION_SHARE, ROUNDING = 0.01, 1e-14


@compiled
def cut_sections(tubes: Array, segments: Ints, D: Array, sections: Sections) -> int:
    """Fills start and segment of ``sections`` for base positions D (N,) [m]; how many there are.

    Goes from the orifice outwards; ends of segments within SAME_PLACE of the first of them are one boundary.
    """
    N = len(segments)
    start, segment = sections.start, sections.segment
    start[0] = 0.0
    here = segment[0]
    for j in range(N):
        i = 0
        while i < segments[j] and tubes[j, i, END] - D[j] <= SAME_PLACE:
            i += 1
        here[j] = i if i < segments[j] else ABSENT
    q = 0
    while True:
        end = math.inf
        for j in range(N):
            if segment[q, j] != ABSENT:
                end = min(end, tubes[j, segment[q, j], END] - D[j])
        if end == math.inf:
            return q
        q += 1
        start[q] = end
        last = q == len(segment)
        for j in range(N):
            i = segment[q - 1, j]
            if i != ABSENT and tubes[j, i, END] - D[j] <= end + SAME_PLACE:
                i = i + 1 if i + 1 < segments[j] else ABSENT
            if not last:
                segment[q, j] = i
        if last:
            return q


@compiled
def nodes_for_turn(turn: float, relative: float) -> int:
    """Gauss points that integrate a factor turning by ``turn`` [rad] to an error ``relative``, also in between: the
    interpolation error turn^G G! / (2 G (2 G)!)."""
    error, G = 0.25 * turn, 1
    while error > relative and G < MOST_NODES:
        error *= turn * G / ((2.0 * G + 1.0) * (2.0 * G + 2.0))
        G += 1
    return G


@compiled
def plan_sections(
    tubes: Array, D: Array, sections: Sections, count: int, tolerance: float, raised: int, floor: int, reach: Array
) -> tuple[int, int, int, int]:
    """Fills parts, degree, nodes and coupled of the first ``count`` sections.

    tolerance [m] of the tip; ``raised`` degrees more than its first choice, and no less than ``floor``.  Returns how
    many elements, Gauss points, unknowns and factors all sections need; ``swing`` of the scene into reach (1,) [m].
    """
    N = len(D)
    length = sections.start[count]
    relative = max(INTEGRATION_SHARE * tolerance / max(length, tolerance), ROUNDING)
    swing = 0.0
    for q in range(count - 1, -1, -1):
        a, b = sections.start[q], sections.start[q + 1]
        here = sections.segment[q]
        curved, _, _ = curved_tubes(tubes, here)
        sections.coupled[q] = 1 if curved > 1 else 0
        swing += strongest_bend(tubes, here, D, 0.5 * (a + b)) * (b - a) * (length - 0.5 * (a + b))
    reach[0] = swing
    elements, nodes, unknowns, factors, coupled_beyond = 0, 0, N, 0, False
    for q in range(count - 1, -1, -1):
        a, b = sections.start[q], sections.start[q + 1]
        here = sections.segment[q]
        curved, turn, constant = curved_tubes(tubes, here)
        coupling, bend = 0.0, 0.0
        for third in range(3):
            s = a + (0.02 + 0.48 * third) * (b - a)
            bend = max(bend, strongest_bend(tubes, here, D, s))
            if curved > 1:
                coupling = max(coupling, stiffest_twist(tubes, here, D, s))
            if constant:
                break
        coupling *= (b - a) ** 2
        turned = (bend + turn) * (b - a)
        bends = math.sqrt(coupling)
        parts = max(1, math.ceil(bends / BENDS_AN_ELEMENT))
        present, straight = 0, 0
        for j in range(N):
            if here[j] != ABSENT:
                present += 1
                if not is_curved(tubes, j, here[j]):
                    straight += 1
        if curved > 1:
            parts = max(parts, math.ceil(turned / TURNS_AN_ELEMENT))
            bandwidth = (coupling + TURN_SHARE * turned**2) / parts**2
            width = math.pi / math.sqrt(max(bandwidth, 1e-6))
            rho = width + math.hypot(width, 1.0)
            motion = swing * min(1.0, coupling)
            needed = math.log(max(motion / tolerance, 1.0)) / math.log(FASTER * rho) - 1.0
            degree = min(max(LOWEST_DEGREE, math.ceil(needed)), HIGHEST_FIRST) + raised
            degree = min(max(degree, floor), HIGHEST_DEGREE - FINER)
            fewest = nodes_for_turn((turned + bends) / parts, relative)
            count_nodes = min(max(degree + FINER + MORE_NODES, fewest), MOST_NODES)
            size = (present - straight) * (degree + FINER + 1) + straight
            coupled_beyond = True
        else:
            degree = 0
            if constant:
                count_nodes = 1 if curved == 0 else 2
            else:
                parts = max(1, math.ceil(turned / TURNS_AN_ELEMENT))
                fewest = nodes_for_turn(turned / parts + 1.0, relative)
                count_nodes = min(max(8, fewest), MOST_NODES)
            size = present if coupled_beyond else 0
        sections.parts[q], sections.degree[q], sections.nodes[q] = parts, degree, count_nodes
        elements += parts
        nodes += parts * count_nodes
        unknowns += parts * size
        factors += parts * size * (size + N + 1)
    return elements, nodes, unknowns, factors


@compiled
def fill_elements(
    tubes: Array, segments: Ints, rules: Array, D: Array, sections: Sections, count: int, scene: Scene
) -> None:
    """Makes the elements of the first ``count`` sections, and what the guide holds, in ``scene``."""
    N = len(D)
    last = 0
    for q in range(count):
        if sections.coupled[q]:
            last = q + 1
    m, node, unknown, block, coupled_elements = 0, 0, N, 0, 0
    for q in range(count):
        here = sections.segment[q]
        h = (sections.start[q + 1] - sections.start[q]) / sections.parts[q]
        G, degree = sections.nodes[q], sections.degree[q]
        stiffness = 0.0
        for j in range(N):
            if here[j] != ABSENT:
                stiffness += tubes[j, here[j], BENDING]
        for part in range(sections.parts[q]):
            scene.line[m, ARC] = sections.start[q] + part * h
            scene.line[m, LENGTH], scene.line[m, STIFFNESS] = h, stiffness
            scene.marks[m, COUPLED], scene.marks[m, DEGREE] = sections.coupled[q], degree
            scene.marks[m, GAUSS], scene.marks[m, ROW], scene.marks[m, BLOCK] = G, node, block
            n = 0
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
                n += size
            block += n * (n + N + 1)
            for g in range(G):
                s = scene.line[m, ARC] + h * rules[G, g, PLACE]
                scene.gauss[node, PLACE], scene.gauss[node, WEIGHT] = s, h * rules[G, g, WEIGHT]
                for j in range(N):
                    i = here[j]
                    if i == ABSENT:
                        scene.moments[REST, node, j] = 0.0
                    else:
                        scene.moments[REST, node, j] = tubes[j, i, BENDING] * pre_curvature(tubes, j, i, s + D[j])
                node += 1
            m += 1
        if sections.coupled[q]:
            coupled_elements = m
    scene.line[m, ARC] = sections.start[count]
    for j in range(N):
        scene.base[AT, j] = D[j]
        scene.base[ROOT, j] = math.sqrt(guide_compliance(tubes, segments, j, D[j]))
    scene.counts[N_ELEMENTS], scene.counts[N_NODES], scene.counts[N_UNKNOWNS] = m, node, unknown
    scene.counts[N_FACTORS], scene.counts[LAST_COUPLED] = block, coupled_elements
    scene.counts[LEADER] = leader(tubes, segments, scene)


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
def holds(scene: Scene, D: Array, raised: int, floor: int) -> bool:
    """True if ``scene`` is cut for D (N,) [m] and these degrees."""
    if scene.counts[CUT] != 1 or scene.counts[RAISED] != raised or scene.counts[FLOOR] != floor:
        return False
    for j in range(len(D)):
        if scene.base[AT, j] != D[j]:
            return False
    return True


@compiled
def prepare(kit: Kit, scene: Scene, D: Array, tolerance: float, raised: int, floor: int) -> bool:
    """Cuts ``scene`` for D (N,) [m] unless it is so already; false if the workspace is too small: the capacities that
    are needed then stand in its ``ints``, negative.

    tolerance [m], raised, floor : see ``plan_sections``.  A workspace only ever sees one tolerance.
    """
    if holds(scene, D, raised, floor):
        return True
    ints, sections = kit.ints, sections_of(kit)
    scene.counts[CUT] = 0
    count = cut_sections(kit.tubes, kit.segments, D, sections)
    reach = scene.base[SWING]
    elements, nodes, unknowns, factors = plan_sections(kit.tubes, D, sections, count, tolerance, raised, floor, reach)
    if elements > ints[ELEMENTS] or nodes > ints[NODES] or unknowns > ints[UNKNOWNS] or factors > ints[FACTORS]:
        ints[SECTIONS] = -ints[SECTIONS]
        ints[ELEMENTS], ints[NODES], ints[UNKNOWNS], ints[FACTORS] = elements, nodes, unknowns, factors
        return False
    scene.base[FRAMED_ANGLE, 0] = math.nan
    fill_elements(kit.tubes, kit.segments, kit.rules, D, sections, count, scene)
    scene.counts[RAISED], scene.counts[FLOOR], scene.counts[CUT] = raised, floor, 1
    return True
