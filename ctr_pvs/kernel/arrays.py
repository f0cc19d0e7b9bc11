"""The arrays that kernel functions share, under names: what a robot is, what one scene needs, where results go.

A ``NamedTuple`` of arrays is all that the kernel has for an object: Numba takes it apart into plain arrays.  All of
them are views of three arrays that the caller owns, so that a call from Python hands over few arguments and a loop
allocates nothing:

tubes (N, S, ..) and segments (N,) : the robot, rules (G, G, ..) : quadrature; their columns are those of
    ``ctr_pvs.model.packing``;
floats, ints : the workspace of one thread, of the capacity that ``ints`` begins with.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.kernel.compiler import compiled
from ctr_pvs.kernel.compiler import entry_point
from ctr_pvs.model.packing import BENDING as BENDING
from ctr_pvs.model.packing import CURVATURE as CURVATURE
from ctr_pvs.model.packing import END as END
from ctr_pvs.model.packing import HIGHEST_DEGREE as HIGHEST_DEGREE
from ctr_pvs.model.packing import INTEGRAL as INTEGRAL
from ctr_pvs.model.packing import INTERPOLANT as INTERPOLANT
from ctr_pvs.model.packing import MOST_NODES as MOST_NODES
from ctr_pvs.model.packing import PLACE as PLACE
from ctr_pvs.model.packing import POLYNOMIAL as POLYNOMIAL
from ctr_pvs.model.packing import SOFTNESS as SOFTNESS
from ctr_pvs.model.packing import START as START
from ctr_pvs.model.packing import STRAIGHTENING as STRAIGHTENING
from ctr_pvs.model.packing import TORSION as TORSION
from ctr_pvs.model.packing import TURN as TURN
from ctr_pvs.model.packing import WEIGHT as WEIGHT

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Complex = NDArray[np.complex128]

#: Capacities that ``ints`` begins with, and how many of its entries those take.
SECTIONS, ELEMENTS, NODES, UNKNOWNS, FACTORS = range(5)
CAPACITIES = 5

#: Vectors of unknowns that a workspace has room for beside a scene's own.
ROWS = 42

#: A tube that is not there, in tables of segments.
ABSENT = -1

#: Entries of ``Scene.counts``.
N_ELEMENTS, N_NODES, N_UNKNOWNS, N_FACTORS, LAST_COUPLED, RAISED, FLOOR, CUT, LEADER = range(9)
COUNTS = 9


#: Of a ``Scene``: rows of ``base``, columns of ``line``, rows of ``held``, columns of ``marks``, rows of ``parts``,
#: rows of ``moments``, ``turns`` and ``vectors``, columns of ``bends``.
AT, ROOT, SWING, FRAMED_ANGLE = range(4)
ARC, LENGTH, STIFFNESS, POSITION = range(4)
LINE = 6
SCALE, ANGLE, TORQUE = range(3)
COUPLED, DEGREE, GAUSS, ROW, BLOCK = range(5)
SEGMENT, FIRST, SIZE = range(3)
REST, TURNED = range(2)
PSI, BEFORE, RATE, PULL = range(4)
Y, GRADIENT, STEP, OTHER, FRAMED = range(5)
BEND, TRIAL, SPINOR = range(3)
#: Of a ``Bench``: rows of ``squares``, ``lines`` and ``moved``.
BEYOND, NEAR, BASE = range(3)
FORCE, BENT, TURNED_BY, NONE, ALPHA_RATE, D_RATE = range(6)
EXPLICIT, ANSWERED = range(2)


class Kit(NamedTuple):
    """What every entry point is given: the robot, the quadrature rules and the workspace of one thread, see above."""

    tubes: Array
    segments: Ints
    rules: Array
    floats: Array
    ints: Ints


class Scene(NamedTuple):
    """The elements of one D, and the state that was last evaluated on them.  M elements of N tubes, G Gauss points in
    all, U unknowns.  Few arrays of many rows, because Numba hands each array over word by word in every call.

    An element is a stretch between two neighbouring ends of segments, or a part of it.  Psi is known from the guide's
    unknowns, the first N of y, and those of the elements: psi_j(x) = psi_j(0) + scale_j sum_l y_jl int_0^x P_l.  The
    torsional energy is y.y / 2 [J].

    counts : see N_ELEMENTS ...
    base (4, N) : AT, D [m]; ROOT, root of the guide's compliance [rad/sqrt(J)]; SWING, its first entry the most [m]
    that
        the tip can move per twist [rad].
    line (M + 1, 6) : ARC, where an element starts [m]; its LENGTH [m]; STIFFNESS, sum of K [N m^2]; POSITION .. of its
        start [m].  frame (M + 1, 2) : how the Bishop frame has turned there since the orifice, see ``frames``.
    held (3, M + 1, N) : SCALE of an element [rad/sqrt(J)]; ANGLE, psi at its start [rad]; TORQUE that bending beyond
    pulls
        there [N m].
    marks (M, 5) : COUPLED, 1 where two curved tubes or more overlap; DEGREE of the polynomials; GAUSS, number of
    points,
        and ROW of the first; BLOCK, where its factors begin.
    parts (3, M, N) : SEGMENT or ABSENT; FIRST unknown of a tube; SIZE, how many it has at the finer degree.
    gauss (G, 2) : PLACE, arc length [m]; WEIGHT [m].
    moments (2, G, N) : K kappa* at REST [N m], and TURNED by exp(i psi).
    turns (4, G, N) : PSI [rad]; psi BEFORE, of the state whose branch is to be kept [rad]; RATE, psi' [rad/m]; PULL [N
    m]. bends (G, 4) : BEND, k_y + i k_z of the backbone in the Bishop frame [1/m]; TRIAL, room; SPINOR, SPINOR + 1, how
    the
        frame has turned since the element's start.
    vectors (5, U) : unknowns Y, GRADIENT, STEP and an OTHER [sqrt(J)]; FRAMED, those whose frames stand here.
    """

    counts: Ints
    base: Array
    line: Array
    frame: Complex
    held: Array
    marks: Ints
    parts: Ints
    gauss: Array
    moments: Complex
    turns: Array
    bends: Complex
    vectors: Array


#: Entries of a state: which degrees it has (``layout.plan_sections``), how many unknowns; the bound of its residual
#: twist [rad], the estimate of its tip error [m], the Newton steps spent, whether tubes twist (see below), how many
#: unknowns were solved for, and a bound [m] of how far what two more degrees twist would swing any place of the
#: backbone; the tip's position [m] and unit quaternion x, y, z, w.  Then come alpha (N,), D (N,), torques (N,) [N m]
#: and the unknowns.
S_RAISED, S_FLOOR, S_UNKNOWNS, S_RESIDUAL, S_ESTIMATE, S_STEPS, S_TWISTS, S_SOLVED, S_SWUNG = range(9)
S_TIP, S_ROLL, STATE = 9, 12, 16
#: Whether tubes twist: they do; they would, but by too little to count; they are taken for rigid in torsion.
TWISTED, UNTWISTED, RIGID = 1.0, -1.0, 0.0


class Sections(NamedTuple):
    """What D cuts the robot into before elements are made of it.  start (Q + 1,) [m]; segment (Q, N); parts (Q,)
    elements of each; degree, nodes, coupled (Q,) of each of those."""

    start: Array
    segment: Ints
    parts: Ints
    degree: Ints
    nodes: Ints
    coupled: Ints


class Bench(NamedTuple):
    """Where the kernel works.

    factors : of every element, Cholesky factor and what couples it to its start.
    squares (3, N, N) : stiffness of what lies BEYOND, of an element's NEAR end, and at the BASE.
    lines (6, N) : FORCE and turns (BENT) on the way through the elements; TURNED_BY, what the bases turn by; NONE,
    zeros;
        ALPHA_RATE and D_RATE, a direction.
    row (n,) : of one element's unknowns; offset (N,) : first unknown of each tube inside an element.
    space (6, 3), sites (2, MOST_NODES, 3) : vectors of space; series (HIGHEST_DEGREE + 2, 7) : Legendre coefficients.
    rows (ROWS, U) : vectors of unknowns.
    ends (M + 1,) : motion of the elements' ends; moved (2, M + 1, N) : rates of psi there, EXPLICIT and ANSWERED; rates
        (M + 1, N + 3) : energies per motion.
    """

    factors: Array
    squares: Array
    lines: Array
    row: Array
    space: Array
    sites: Array
    series: Array
    rows: Array
    ends: Array
    moved: Array
    rates: Array
    offset: Ints


@entry_point("UniTuple(int64, 2)(int64, int64[::1])")
def workspace_sizes(tubes: int, capacity: Ints) -> tuple[int, int]:
    """How many floats and ints a workspace of this ``capacity`` (CAPACITIES,) takes."""
    sections, elements, nodes, unknowns = capacity[SECTIONS], capacity[ELEMENTS], capacity[NODES], capacity[UNKNOWNS]
    floats = sections + 1 + 2 * scene_floats(tubes, elements, nodes, unknowns)
    floats += capacity[FACTORS] + 3 * tubes * tubes + 6 * tubes + tubes * (HIGHEST_DEGREE + 1)
    floats += 18 + 6 * MOST_NODES + 7 * (HIGHEST_DEGREE + 2) + ROWS * unknowns + (elements + 1) * (3 * tubes + 4)
    ints = CAPACITIES + sections * (tubes + 4) + 2 * scene_ints(tubes, elements) + tubes
    return floats, ints


@compiled
def scene_floats(tubes: int, elements: int, nodes: int, unknowns: int) -> int:
    """How many floats a scene takes."""
    return 4 * tubes + (elements + 1) * (LINE + 4 + 3 * tubes) + nodes * (10 + 8 * tubes) + 5 * unknowns


@compiled
def scene_ints(tubes: int, elements: int) -> int:
    """How many ints a scene takes."""
    return COUNTS + elements * (5 + 3 * tubes)


@compiled
def scene_of(kit: Kit, which: int) -> Scene:
    """Scene number ``which`` (0 or 1) of a workspace."""
    floats, ints, tubes = kit.floats, kit.ints, len(kit.segments)
    sections, elements, nodes, unknowns = ints[SECTIONS], ints[ELEMENTS], ints[NODES], ints[UNKNOWNS]
    f = sections + 1 + which * scene_floats(tubes, elements, nodes, unknowns)
    i = CAPACITIES + sections * (tubes + 4) + which * scene_ints(tubes, elements)
    e1 = elements + 1
    base = floats[f : f + 4 * tubes].reshape(4, tubes)
    f += 4 * tubes
    line = floats[f : f + LINE * e1].reshape(e1, LINE)
    f += LINE * e1
    frame = floats[f : f + 4 * e1].view(np.complex128).reshape(e1, 2)
    f += 4 * e1
    held = floats[f : f + 3 * e1 * tubes].reshape(3, e1, tubes)
    f += 3 * e1 * tubes
    gauss = floats[f : f + 2 * nodes].reshape(nodes, 2)
    f += 2 * nodes
    moments = floats[f : f + 4 * nodes * tubes].view(np.complex128).reshape(2, nodes, tubes)
    f += 4 * nodes * tubes
    turns = floats[f : f + 4 * nodes * tubes].reshape(4, nodes, tubes)
    f += 4 * nodes * tubes
    bends = floats[f : f + 8 * nodes].view(np.complex128).reshape(nodes, 4)
    f += 8 * nodes
    vectors = floats[f : f + 5 * unknowns].reshape(5, unknowns)
    counts = ints[i : i + COUNTS]
    i += COUNTS
    marks = ints[i : i + 5 * elements].reshape(elements, 5)
    i += 5 * elements
    parts = ints[i : i + 3 * elements * tubes].reshape(3, elements, tubes)
    return Scene(counts, base, line, frame, held, marks, parts, gauss, moments, turns, bends, vectors)


@compiled
def sections_of(kit: Kit) -> Sections:
    """The sections of a workspace."""
    floats, ints, tubes = kit.floats, kit.ints, len(kit.segments)
    sections = ints[SECTIONS]
    i = CAPACITIES
    start = floats[: sections + 1]
    segment = ints[i : i + sections * tubes].reshape(sections, tubes)
    i += sections * tubes
    parts = ints[i : i + sections]
    degree = ints[i + sections : i + 2 * sections]
    nodes = ints[i + 2 * sections : i + 3 * sections]
    coupled = ints[i + 3 * sections : i + 4 * sections]
    return Sections(start, segment, parts, degree, nodes, coupled)


@compiled
def bench_of(kit: Kit) -> Bench:
    """Where the kernel works in a workspace."""
    floats, ints, tubes = kit.floats, kit.ints, len(kit.segments)
    sections, elements, nodes, unknowns = ints[SECTIONS], ints[ELEMENTS], ints[NODES], ints[UNKNOWNS]
    f = sections + 1 + 2 * scene_floats(tubes, elements, nodes, unknowns)
    i = CAPACITIES + sections * (tubes + 4) + 2 * scene_ints(tubes, elements)
    e1 = elements + 1
    factors = floats[f : f + ints[FACTORS]]
    f += ints[FACTORS]
    squares = floats[f : f + 3 * tubes * tubes].reshape(3, tubes, tubes)
    f += 3 * tubes * tubes
    lines = floats[f : f + 6 * tubes].reshape(6, tubes)
    f += 6 * tubes
    row = floats[f : f + tubes * (HIGHEST_DEGREE + 1)]
    f += tubes * (HIGHEST_DEGREE + 1)
    space = floats[f : f + 18].reshape(6, 3)
    f += 18
    sites = floats[f : f + 6 * MOST_NODES].reshape(2, MOST_NODES, 3)
    f += 6 * MOST_NODES
    series = floats[f : f + 7 * (HIGHEST_DEGREE + 2)].reshape(HIGHEST_DEGREE + 2, 7)
    f += 7 * (HIGHEST_DEGREE + 2)
    rows = floats[f : f + ROWS * unknowns].reshape(ROWS, unknowns)
    f += ROWS * unknowns
    ends = floats[f : f + e1]
    f += e1
    moved = floats[f : f + 2 * e1 * tubes].reshape(2, e1, tubes)
    f += 2 * e1 * tubes
    rates = floats[f : f + e1 * (tubes + 3)].reshape(e1, tubes + 3)
    offset = ints[i : i + tubes]
    return Bench(factors, squares, lines, row, space, sites, series, rows, ends, moved, rates, offset)
