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
