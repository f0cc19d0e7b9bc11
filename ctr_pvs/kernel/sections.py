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
from ctr_pvs.kernel.arrays import AT_X
from ctr_pvs.kernel.arrays import AXIAL
from ctr_pvs.kernel.arrays import BENDING
from ctr_pvs.kernel.arrays import END
from ctr_pvs.kernel.arrays import HIGHEST_DEGREE
from ctr_pvs.kernel.arrays import MOST_NODES
from ctr_pvs.kernel.arrays import POINT
from ctr_pvs.kernel.arrays import POINT_FORCE
from ctr_pvs.kernel.arrays import POINT_MOMENT
from ctr_pvs.kernel.arrays import TORSION
from ctr_pvs.kernel.arrays import TUBE
from ctr_pvs.kernel.arrays import Array
from ctr_pvs.kernel.arrays import Ints
from ctr_pvs.kernel.arrays import Sections
from ctr_pvs.kernel.compiler import compiled
from ctr_pvs.kernel.materials import curved_tubes
from ctr_pvs.kernel.materials import is_curved
from ctr_pvs.kernel.materials import pre_curvature
from ctr_pvs.kernel.materials import stiffest_twist
from ctr_pvs.kernel.materials import strongest_bend

#: Places closer than this [m] are one place.  Fixed, so that a kink is found by geometry and not by rounding.
SAME_PLACE = 1e-12
#: The check adds this many polynomial degrees: a Ritz value of low degree is optimistic.
FINER = 2
#: Gauss points beyond the finer degree.
MORE_NODES, MORE_LOADED = 3, 1
#: Square root of a section's coupling, and turn of the backbone and the pre-curvatures [rad], that one element takes
#: on.
BENDS_AN_ELEMENT, TURNS_AN_ELEMENT = 3.5, 4.0
#: Degrees of the first choice: the lowest, the highest (raised and checked ones go up to HIGHEST_DEGREE), and, measured
#: on random robots, what a turn of the pre-curvature or of the backbone along a section adds to its coupling, as a
#: share of its square.
LOWEST_DEGREE, HIGHEST_FIRST = 1, 16
TURN_SHARE = 0.1
#: Where a load acts, if only one of size 0 that rates are asked for, the tip is taken to move by this share of the
#: length at least.
LEAST_MOTION = 0.01
#: Measured on random robots: how much faster than by rho coefficients fall.
FASTER = 1.5
#: Error in position over the robot's length that integrating the backbone may leave, as a share of the tolerance's, and
#: what rounding leaves anyway.
INTEGRATION_SHARE, ROUNDING = 0.01, 1e-14


@compiled
def cut_sections(tubes: Array, segments: Ints, D: Array, loads: Array, sections: Sections) -> int:
    """Fills start and segment of ``sections`` for base positions D (N,) [m] and packed ``loads``; how many there are.

    Goes from the orifice outwards; ends of segments, and points of load, within SAME_PLACE of the first of them are one
    boundary.
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
        for p in range(first_point(tubes), len(loads), POINT):
            s = loads[p + AT_X] - D[int(loads[p + TUBE])]
            if start[q] + SAME_PLACE < s < end - SAME_PLACE:
                end = s
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
def first_point(tubes: Array) -> int:
    """Where the point loads begin in packed loads: after a force per length for every segment of every tube."""
    return 3 * tubes.shape[0] * tubes.shape[1]


@compiled
def mark_loaded(tubes: Array, D: Array, loads: Array, sections: Sections, count: int) -> None:
    """Fills ``loaded`` of the first ``count`` sections, 1 where a load acts on it or beyond, and ``pulls``."""
    N = len(D)
    force, moment = 0.0, 0.0
    for q in range(count - 1, -1, -1):
        end, h = sections.start[q + 1], sections.start[q + 1] - sections.start[q]
        sections.loaded[q] = sections.loaded[q + 1] if q + 1 < count else 0
        for p in range(first_point(tubes) if len(loads) > 0 else 0, len(loads), POINT):
            if abs(loads[p + AT_X] - D[int(loads[p + TUBE])] - end) <= SAME_PLACE:
                force += norm(loads, p + POINT_FORCE)
                moment += norm(loads, p + POINT_MOMENT)
                sections.loaded[q] = 1  # even where it is zero: rates are asked for
        per_length = 0.0
        for j in range(N if len(loads) > 0 else 0):
            if sections.segment[q, j] != ABSENT:
                per_length += norm(loads, 3 * (j * tubes.shape[1] + sections.segment[q, j]))
        force += per_length * h
        moment += force * h
        if per_length > 0.0:
            sections.loaded[q] = 1
        sections.pulls[0, q], sections.pulls[1, q] = force, moment


@compiled
def norm(v: Array, i: int) -> float:
    """Length of the three numbers of v from entry i on."""
    return math.sqrt(v[i] * v[i] + v[i + 1] * v[i + 1] + v[i + 2] * v[i + 2])


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
    """Fills parts, degree, nodes and coupled of the first ``count`` sections, of which ``loaded`` is known.

    tolerance [m] of the tip; ``raised`` degrees more than its first choice, and no less than ``floor``.  Returns how
    many elements, Gauss points, unknowns and rows of one matrix all sections need; ``swing`` of the scene into
    reach (1,) [m].
    """
    N = len(D)
    length = sections.start[count]
    relative = max(INTEGRATION_SHARE * tolerance / max(length, tolerance), ROUNDING)
    swing = 0.0
    for q in range(count - 1, -1, -1):
        a, b = sections.start[q], sections.start[q + 1]
        here = sections.segment[q]
        curved, _, _ = curved_tubes(tubes, here)
        sections.coupled[q] = 1 if curved > 1 or sections.loaded[q] else 0
        bend = strongest_bend(tubes, here, D, 0.5 * (a + b)) + loads_bend(tubes, sections, q)
        swing += bend * (b - a) * (length - 0.5 * (a + b))
    reach[0] = swing
    lead = 3 if count > 0 and sections.loaded[0] else 0
    widest = max(N + 3, AXIAL)  # ``row`` of the bench also takes the nine numbers of three axes
    elements, nodes, unknowns, active_beyond = 0, 0, N, False
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
        pulled = loads_bend(tubes, sections, q)
        coupling = (coupling + loads_stiffness(tubes, here, D, sections, q, a)) * (b - a) ** 2
        turned = (bend + pulled + turn) * (b - a)
        bends = math.sqrt(coupling)
        parts = max(1, math.ceil(bends / BENDS_AN_ELEMENT))
        present, straight = 0, 0
        for j in range(N):
            if here[j] != ABSENT:
                present += 1
                if not is_curved(tubes, j, here[j]):
                    straight += 1
        if sections.coupled[q]:
            parts = max(parts, math.ceil(turned / TURNS_AN_ELEMENT))
            bandwidth = (coupling + TURN_SHARE * turned**2) / parts**2
            width = math.pi / math.sqrt(max(bandwidth, 1e-6))
            rho = width + math.hypot(width, 1.0)
            motion = swing * min(1.0, coupling)
            if sections.loaded[q]:
                motion = max(motion, LEAST_MOTION * length)
            needed = math.log(max(motion / tolerance, 1.0)) / math.log(FASTER * rho) - 1.0
            degree = min(max(LOWEST_DEGREE, math.ceil(needed)), HIGHEST_FIRST) + raised
            degree = min(max(degree, floor), HIGHEST_DEGREE - FINER)
            fewest = nodes_for_turn((turned + bends) / parts, relative)
            more = MORE_LOADED if sections.loaded[q] else MORE_NODES
            count_nodes = min(max(degree + FINER + more, fewest), MOST_NODES)
            size = (present - straight) * (degree + FINER + 1) + straight
            if sections.loaded[q]:
                size += 2 * (degree + FINER + 1)
            active_beyond = True
        else:
            degree = 0
            if constant:
                count_nodes = 1 if curved == 0 else 2
            else:
                parts = max(1, math.ceil(turned / TURNS_AN_ELEMENT))
                fewest = nodes_for_turn(turned / parts + 1.0, relative)
                count_nodes = min(max(8, fewest), MOST_NODES)
            size = present if active_beyond else 0
        sections.parts[q], sections.degree[q], sections.nodes[q] = parts, degree, count_nodes
        elements += parts
        nodes += parts * count_nodes
        unknowns += parts * size
        widest = max(widest, size + lead + N)
    return elements, nodes, unknowns, widest


@compiled
def loads_bend(tubes: Array, sections: Sections, q: int) -> float:
    """A bound of the curvature [1/m] that the loads cause in section q."""
    if not sections.loaded[q]:
        return 0.0
    return float(sections.pulls[1, q] / stiffness_of(tubes, sections.segment[q]))


@compiled
def stiffness_of(tubes: Array, here: Ints) -> float:
    """Sum of K [N m^2] of the tubes ``here`` (N,)."""
    total = 0.0
    for j in range(len(here)):
        if here[j] != ABSENT:
            total += tubes[j, here[j], BENDING]
    return total


@compiled
def loads_stiffness(tubes: Array, here: Ints, D: Array, sections: Sections, q: int, s: float) -> float:
    """How strongly the loads pull the bending and the twist of section q, relative to what resists and per square of
    length [1/m^2], as ``stiffest_twist`` for coupling: a bound."""
    if not sections.loaded[q]:
        return 0.0
    stiffness = stiffness_of(tubes, here)
    pull = sections.pulls[0, q] / stiffness
    for j in range(len(here)):
        if here[j] != ABSENT:
            moment = tubes[j, here[j], BENDING] * abs(pre_curvature(tubes, j, here[j], s + D[j]))
            pull = max(pull, sections.pulls[1, q] * moment / (stiffness * tubes[j, here[j], TORSION]))
    return float(pull)
