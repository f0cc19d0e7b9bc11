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

#: Capacities that ``ints`` begins with, and how many of its entries those take.  WIDEST: rows of the largest matrix of
#: one element; LOADS: floats of packed loads.
SECTIONS, ELEMENTS, NODES, UNKNOWNS, WIDEST, LOADS = range(6)
CAPACITIES = 6

#: Rows of the springs of one element, summed.
SUMS = HIGHEST_DEGREE + 2
#: Vectors of unknowns that a workspace has room for beside a scene's own.
ROWS = 42

#: A tube that is not there, in tables of segments.
ABSENT = -1

#: Entries of ``Scene.counts``.  LEAD: 3 under load, else 0; N_LOADS: floats of packed
#: loads; MOMENTS: how many of the N_POINTS points have a moment.
(
    N_ELEMENTS,
    N_NODES,
    N_UNKNOWNS,
    LAST_ACTIVE,
    RAISED,
    FLOOR,
    CUT,
    LEADER,
    LEAD,
    N_LOADS,
    N_POINTS,
    MOMENTS,
) = range(12)
COUNTS = 12

#: Columns of a packed point load, see ``model.packing``.
TUBE, AT_X, POINT_FORCE, POINT_MOMENT = 0, 1, 2, 5
POINT = 8

#: Of a ``Scene``: rows of ``base``, columns of ``line``, ``statics`` and ``axes``, rows of ``held``, columns of
#: ``marks``, rows of ``parts``, rows of ``moments``, ``turns`` and ``vectors``, columns of ``bends``.
AT, ROOT, SWING, FRAMED_ANGLE = range(4)
ARC, LENGTH, STIFFNESS, POSITION = range(4)
LINE = 6
N_FAR, PER_LENGTH, MOMENT_FAR = 0, 3, 6
STATICS = 9
TANGENT, NORMAL, BINORMAL, AXIAL, TURNING = 0, 3, 6, 9, 10
AXES = 13
SCALE, ANGLE, TORQUE = range(3)
COUPLED, DEGREE, GAUSS, ROW, LOADED, MU, MU_SIZE = range(7)
MARKS = 7
SEGMENT, FIRST, SIZE = range(3)
REST, TURNED = range(2)
PSI, BEFORE, RATE, PULL = range(4)
Y, GRADIENT, STEP, OTHER, FRAMED = range(5)
BEND, TRIAL, SPINOR, MU_HERE, MOMENT = 0, 1, 2, 4, 5
BENDS = 6
#: Of a ``Bench``: rows of ``squares``, ``lines`` and ``moved``.
BEYOND, BASE = range(2)
FORCE, BENT, TURNED_BY, NONE, ALPHA_RATE, D_RATE, TORQUES, WRENCH = range(8)
LINES = 8
EXPLICIT, ANSWERED = range(2)


class Scene(NamedTuple):
    """The elements of one D, and the state that was last evaluated on them.  M elements of N tubes, G Gauss points in
    all, U unknowns.  Few arrays of many rows, because Numba hands each array over word by word in every call.

    An element is a stretch between two neighbouring ends of segments or points of load, or a part of it.  Psi is known
    from the guide's unknowns, the first N of y, and those of the elements: psi_j(x) = psi_j(0) + scale_j sum_l y_jl
    int_0^x P_l.  Where a load acts beyond, the bending moment mu that it causes is unknown too, mu(x) = sqrt(sum K / h)
    sum_l y_l P_l, and k = (sum_j b_j + mu) / sum K.  The energy of torsion and of mu is y.y / 2 [J].

    counts : see N_ELEMENTS ...
    base (4, N) : AT, D [m]; ROOT, root of the guide's compliance [rad/sqrt(J)]; SWING, its first entry the most [m]
        that the tip can move per twist [rad].
    line (M + 1, 6) : ARC, where an element starts [m]; its LENGTH [m]; STIFFNESS, sum of K [N m^2]; POSITION .. of its
        start [m].  frame (M + 1, 2) : how the Bishop frame has turned there since the orifice, see ``frames``.
    statics (M + 1, 9) : N_FAR, force [N] and MOMENT_FAR, moment [N m] of all loads from an element's far end on;
        PER_LENGTH, load on it [N/m]; row M: force and moment of all beyond the orifice.
    held (3, M + 1, N) : SCALE of an element [rad/sqrt(J)]; ANGLE, psi at its start [rad]; TORQUE that bending beyond
        pulls there [N m].
    marks (M, 7) : COUPLED, 1 where fields vary inside: two curved tubes or more overlap, or it is LOADED, a load acts
        beyond; DEGREE of the polynomials; GAUSS, number of points, and ROW of the first; MU, first unknown of mu_y,
        MU_SIZE, how many, those of mu_z after them.
    parts (3, M, N) : SEGMENT or ABSENT; FIRST unknown of a tube; SIZE, how many it has at the finer degree.
    gauss (G, 2) : PLACE, arc length [m]; WEIGHT [m].  axes (G, 13) : TANGENT, NORMAL, BINORMAL of the Bishop frame in
        base axes; AXIAL, the moment of the loads beyond along the tangent [N m]; TURNING, room for a turn of the frame
        [rad]; under load.
    moments (2, G, N) : K kappa* at REST [N m], and TURNED by exp(i psi).
    turns (4, G, N) : PSI [rad]; psi BEFORE, of the state whose branch is to be kept [rad]; RATE, psi' [rad/m]; PULL
        [N m].
    bends (G, 6) : BEND, k_y + i k_z of the backbone in the Bishop frame [1/m]; TRIAL, room; SPINOR, SPINOR + 1, how the
        frame has turned since the element's start; MU_HERE, mu; MOMENT, the moment of the loads beyond [N m].
    vectors (5, U) : unknowns Y, GRADIENT, STEP and an OTHER [sqrt(J)]; FRAMED, those whose frames stand here.
    loads (L,) : packed loads, see ``model.packing``; point_at (L / 8,) : the elements at whose start the points are.
    """

    counts: Ints
    base: Array
    line: Array
    frame: Complex
    statics: Array
    held: Array
    marks: Ints
    parts: Ints
    gauss: Array
    axes: Array
    moments: Complex
    turns: Array
    bends: Complex
    vectors: Array
    loads: Array
    point_at: Ints


#: Entries of a state: which degrees it has (``layout.plan_sections``), how many unknowns; the bound of its residual
#: twist [rad], the estimate of its tip error [m], the Newton steps spent, whether tubes twist (see below), how many
#: unknowns were solved for, and a bound [m] of how far what two more degrees twist would swing any place of the
#: backbone; the tip's position [m] and unit quaternion x, y, z, w; how many floats its loads take.  Then come
#: alpha (N,), D (N,), torques (N,) [N m], the packed loads and the unknowns.
S_RAISED, S_FLOOR, S_UNKNOWNS, S_RESIDUAL, S_ESTIMATE, S_STEPS, S_TWISTS, S_SOLVED, S_SWUNG = range(9)
S_TIP, S_ROLL, S_LOADS, STATE = 9, 12, 16, 17
#: Whether tubes twist: they do; they would, but by too little to count; they are taken for rigid in torsion.
TWISTED, UNTWISTED, RIGID = 1.0, -1.0, 0.0


class Sections(NamedTuple):
    """What D cuts the robot into before elements are made of it.  start (Q + 1,) [m]; pulls (2, Q), force [N] and
    moment [N m] of the loads beyond, bounds; segment (Q, N); parts (Q,) elements of each; degree, nodes, coupled,
    loaded (Q,) of each of those."""

    start: Array
    pulls: Array
    segment: Ints
    parts: Ints
    degree: Ints
    nodes: Ints
    coupled: Ints
    loaded: Ints


class Bench(NamedTuple):
    """Where the kernel works.

    factors (M, W, W), sides (M, W), swings (M, 3, W) : of every element, in the first of its W rows, its factorised
        matrix, a right-hand side, and under load how the frame at its end turns with its unknowns and its start.
    squares (2, N + 3, N + 3) : stiffness of what lies BEYOND and at the BASE.
    lines (8, N + 6) : FORCE and turns (BENT) on the way through the elements; TURNED_BY, what the bases turn by; NONE,
        zeros; ALPHA_RATE and D_RATE, a direction; TORQUES at the bases [N m]; WRENCH, its first six, on the tip.
    sums (SUMS, SUMS) : springs of one element.  row (W,) : of one element's unknowns; offset (N,) : first unknown of
        each tube inside an element.
    spread (3 (MOST_NODES + 4) W,) : how an element's frame turns with its unknowns, see ``loaded.hessian``.
    space (6, 3), sites (2, MOST_NODES, 3) : vectors of space; series (HIGHEST_DEGREE + 2, 7) : Legendre coefficients.
    rows (ROWS, U) : vectors of unknowns.
    ends (M + 1,) : motion of the elements' ends; moved (2, M + 1, N + 3) : rates of frame and psi there, EXPLICIT and
        ANSWERED; rates (M + 1, N + 3) : energies per motion.
    """

    factors: Array
    sides: Array
    swings: Array
    squares: Array
    sums: Array
    lines: Array
    row: Array
    spread: Array
    space: Array
    sites: Array
    series: Array
    rows: Array
    ends: Array
    moved: Array
    rates: Array
    offset: Ints


class Kit(NamedTuple):
    """What every entry point is given: the robot, the quadrature rules and the workspace of one thread, see above; and
    what is in that: two scenes and the bench."""

    tubes: Array
    segments: Ints
    rules: Array
    floats: Array
    ints: Ints
    scenes: tuple[Scene, Scene]
    bench: Bench


@entry_point("UniTuple(int64, 2)(int64, int64[::1])")
def workspace_sizes(tubes: int, capacity: Ints) -> tuple[int, int]:
    """How many floats and ints a workspace of this ``capacity`` (CAPACITIES,) takes."""
    sections, elements, unknowns = capacity[SECTIONS], capacity[ELEMENTS], capacity[UNKNOWNS]
    floats = 3 * sections + 1 + 2 * scene_floats(tubes, capacity)
    floats += capacity[WIDEST] * (elements * (capacity[WIDEST] + 4) + 3 * (MOST_NODES + 4) + 1)
    floats += (2 * (tubes + 3) + LINES) * (tubes + 6) + SUMS * SUMS
    floats += 18 + 6 * MOST_NODES + 7 * (HIGHEST_DEGREE + 2) + ROWS * unknowns + (elements + 1) * (3 * tubes + 10)
    ints = CAPACITIES + sections * (tubes + 5) + 2 * scene_ints(tubes, capacity) + tubes
    return floats, ints


@compiled
def scene_floats(tubes: int, capacity: Ints) -> int:
    """How many floats a scene takes."""
    ends, nodes = capacity[ELEMENTS] + 1, capacity[NODES]
    floats = 4 * tubes + ends * (LINE + 4 + STATICS + 3 * tubes) + nodes * (2 + AXES + 2 * BENDS + 8 * tubes)
    return floats + 5 * capacity[UNKNOWNS] + capacity[LOADS]


@compiled
def scene_ints(tubes: int, capacity: Ints) -> int:
    """How many ints a scene takes."""
    return COUNTS + capacity[ELEMENTS] * (MARKS + 3 * tubes) + capacity[LOADS] // POINT + 1


@compiled
def kit_of(tubes: Array, segments: Ints, rules: Array, floats: Array, ints: Ints) -> Kit:
    """What an entry point was given, with the arrays of the workspace under their names: to be called once, as making
    views takes a while (1 us of a step of 15)."""
    N = len(segments)
    scenes = scene_of(floats, ints, N, 0), scene_of(floats, ints, N, 1)
    return Kit(tubes, segments, rules, floats, ints, scenes, bench_of(floats, ints, N))


@compiled
def scene_of(floats: Array, ints: Ints, tubes: int, which: int) -> Scene:
    """Scene number ``which`` (0 or 1) of a workspace."""
    elements, nodes, unknowns = ints[ELEMENTS], ints[NODES], ints[UNKNOWNS]
    f = 3 * ints[SECTIONS] + 1 + which * scene_floats(tubes, ints)
    i = CAPACITIES + ints[SECTIONS] * (tubes + 5) + which * scene_ints(tubes, ints)
    e1 = elements + 1
    base = floats[f : f + 4 * tubes].reshape(4, tubes)
    f += 4 * tubes
    line = floats[f : f + LINE * e1].reshape(e1, LINE)
    f += LINE * e1
    frame = floats[f : f + 4 * e1].view(np.complex128).reshape(e1, 2)
    f += 4 * e1
    statics = floats[f : f + STATICS * e1].reshape(e1, STATICS)
    f += STATICS * e1
    held = floats[f : f + 3 * e1 * tubes].reshape(3, e1, tubes)
    f += 3 * e1 * tubes
    gauss = floats[f : f + 2 * nodes].reshape(nodes, 2)
    f += 2 * nodes
    axes = floats[f : f + AXES * nodes].reshape(nodes, AXES)
    f += AXES * nodes
    moments = floats[f : f + 4 * nodes * tubes].view(np.complex128).reshape(2, nodes, tubes)
    f += 4 * nodes * tubes
    turns = floats[f : f + 4 * nodes * tubes].reshape(4, nodes, tubes)
    f += 4 * nodes * tubes
    bends = floats[f : f + 2 * BENDS * nodes].view(np.complex128).reshape(nodes, BENDS)
    f += 2 * BENDS * nodes
    vectors = floats[f : f + 5 * unknowns].reshape(5, unknowns)
    f += 5 * unknowns
    loads = floats[f : f + ints[LOADS]]
    counts = ints[i : i + COUNTS]
    i += COUNTS
    marks = ints[i : i + MARKS * elements].reshape(elements, MARKS)
    i += MARKS * elements
    parts = ints[i : i + 3 * elements * tubes].reshape(3, elements, tubes)
    i += 3 * elements * tubes
    point_at = ints[i : i + ints[LOADS] // POINT + 1]
    return Scene(
        counts, base, line, frame, statics, held, marks, parts, gauss, axes, moments, turns, bends, vectors, loads,
        point_at,
    )  # fmt: skip


@compiled
def sections_of(kit: Kit) -> Sections:
    """The sections of a workspace."""
    floats, ints, tubes = kit.floats, kit.ints, len(kit.segments)
    sections = ints[SECTIONS]
    i = CAPACITIES
    start = floats[: sections + 1]
    pulls = floats[sections + 1 : 3 * sections + 1].reshape(2, sections)
    segment = ints[i : i + sections * tubes].reshape(sections, tubes)
    rest = ints[i + sections * tubes : i + sections * (tubes + 5)].reshape(5, sections)
    return Sections(start, pulls, segment, rest[0], rest[1], rest[2], rest[3], rest[4])


@compiled
def bench_of(floats: Array, ints: Ints, tubes: int) -> Bench:
    """Where the kernel works in a workspace."""
    elements, unknowns, widest = ints[ELEMENTS], ints[UNKNOWNS], ints[WIDEST]
    f = 3 * ints[SECTIONS] + 1 + 2 * scene_floats(tubes, ints)
    i = CAPACITIES + ints[SECTIONS] * (tubes + 5) + 2 * scene_ints(tubes, ints)
    e1, ends = elements + 1, tubes + 3
    factors = floats[f : f + elements * widest * widest].reshape(elements, widest, widest)
    f += elements * widest * widest
    sides = floats[f : f + elements * widest].reshape(elements, widest)
    f += elements * widest
    swings = floats[f : f + 3 * elements * widest].reshape(elements, 3, widest)
    f += 3 * elements * widest
    squares = floats[f : f + 2 * ends * ends].reshape(2, ends, ends)
    f += 2 * ends * ends
    sums = floats[f : f + SUMS * SUMS].reshape(SUMS, SUMS)
    f += SUMS * SUMS
    lines = floats[f : f + LINES * (tubes + 6)].reshape(LINES, tubes + 6)
    f += LINES * (tubes + 6)
    row = floats[f : f + widest]
    f += widest
    spread = floats[f : f + 3 * (MOST_NODES + 4) * widest]
    f += 3 * (MOST_NODES + 4) * widest
    space = floats[f : f + 18].reshape(6, 3)
    f += 18
    sites = floats[f : f + 6 * MOST_NODES].reshape(2, MOST_NODES, 3)
    f += 6 * MOST_NODES
    series = floats[f : f + 7 * (HIGHEST_DEGREE + 2)].reshape(HIGHEST_DEGREE + 2, 7)
    f += 7 * (HIGHEST_DEGREE + 2)
    rows = floats[f : f + ROWS * unknowns].reshape(ROWS, unknowns)
    f += ROWS * unknowns
    ends_move = floats[f : f + e1]
    f += e1
    moved = floats[f : f + 2 * e1 * ends].reshape(2, e1, ends)
    f += 2 * e1 * ends
    rates = floats[f : f + e1 * ends].reshape(e1, ends)
    offset = ints[i : i + tubes]
    return Bench(
        factors, sides, swings, squares, sums, lines, row, spread, space, sites, series, rows, ends_move, moved, rates,
        offset,
    )  # fmt: skip
