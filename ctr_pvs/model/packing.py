"""The arrays that the kernel reads: one of the robot, one of loads, one of quadrature rules."""

from __future__ import annotations

from functools import lru_cache
from operator import add

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.model.sections import SAME_PLACE
from ctr_pvs.robot.loads import Loads
from ctr_pvs.robot.robot import Robot
from ctr_pvs.robot.robot import Segment

Array = NDArray[np.float64]

#: Columns of ``tubes``: abscissae where a segment starts and ends [m], K and G J [N m^2], turn of the pre-curvature
#: [rad/m], twist per torque [rad/(N m)] and straightening energy [J] from the tube's base to the segment's start; then
#: real and imaginary parts of the coefficients of its pre-curvature.
START, END, BENDING, TORSION, TURN, SOFTNESS, STRAIGHTENING, CURVATURE = range(8)

#: Columns of a point load: tube (from 0), material abscissa X [m], force [N] and moment [N m] in the base frame.
POINT_TUBE, POINT_X, POINT_FORCE, POINT_MOMENT, POINT_WIDTH = 0, 1, 2, 5, 8

#: Most Gauss points of an element, and the highest polynomial degree of its fields.
MOST_NODES = 30
HIGHEST_DEGREE = 25
#: Columns of ``rules[G]``, a row for each of G Gauss points on [0, 1]: place, weight; then orthonormal Legendre
#: polynomials, their integrals from 0, and the integrals from 0 of what interpolates values at the Gauss points.
PLACE, WEIGHT = 0, 1
POLYNOMIAL = 2
INTEGRAL = POLYNOMIAL + HIGHEST_DEGREE + 1
INTERPOLANT = INTEGRAL + HIGHEST_DEGREE + 1
RULE_WIDTH = INTERPOLANT + MOST_NODES


@lru_cache(maxsize=64)
def packed_robot(robot: Robot) -> tuple[Array, NDArray[np.int64]]:
    """The columns above of every segment of every tube (N, S, ..), zeros where a tube has fewer segments than another;
    how many segments each tube has (N,)."""
    segments = np.array([len(tube.segments) for tube in robot.tubes], dtype=np.int64)
    coefficients = max(1, *(len(segment.curvature) for tube in robot.tubes for segment in tube.segments))
    tubes = np.zeros((robot.n_tubes, int(segments.max()), CURVATURE + 2 * coefficients))
    for j, tube in enumerate(robot.tubes):
        softness = straightening = 0.0
        for i, segment in enumerate(tube.segments):
            row = tubes[j, i]
            row[START], row[END] = tube.breaks[i], tube.breaks[i + 1]
            row[BENDING], row[TORSION] = segment.bending_stiffness, segment.torsional_stiffness
            row[TURN], row[SOFTNESS], row[STRAIGHTENING] = segment.turn, softness, straightening
            row[CURVATURE : CURVATURE + 2 * len(segment.curvature)] = np.array(segment.curvature, complex).view(float)
            softness += segment.length / segment.torsional_stiffness
            straightening += straightening_energy(segment)
    return tubes, segments


def straightening_energy(segment: Segment) -> float:
    """int K |kappa*|^2 / 2 [J] along a whole segment; the helical turn drops out of the absolute value."""
    c = np.asarray(segment.curvature, dtype=complex)
    if not len(c):
        return 0.0
    square = np.convolve(c, c.conj()).real
    powers = np.arange(1, len(square) + 1)
    return float(0.5 * segment.bending_stiffness * np.sum(square * segment.length**powers / powers))


def packed_loads(robot: Robot, D: Array, loads: Loads | None) -> Array:
    """``loads`` on ``robot`` at base positions ``D`` (N,) [m], checked by ``check_loads``; empty if nothing acts.

    Flat: first (N, S, 3) force per length [N/m] on each segment of each tube, weight counted, zeros where a tube has
    fewer segments than another; then the columns above of each point load, in order of tube and X, one for a point.
    The tip's is on the end of the tube that ``tip_carrier`` tells.
    """
    if loads is None or loads.is_none:
        return np.empty(0)
    lines = _line_forces(robot, loads)
    points = _point_loads(robot, D, loads)
    return np.array(lines + points) if points or any(lines) else np.empty(0)


def tip_carrier(robot: Robot, D: Array) -> int:
    """The tube whose end is the tip at ``D`` (N,) [m]: the one that reaches farthest, the innermost of equals; with
    nothing out, the innermost that has any length in the guide.  The rule of ``kernel.layout.leader``."""
    depths = D.tolist()
    reach = [tube.length - depth for tube, depth in zip(robot.tubes, depths, strict=True)]
    farthest = max(reach)
    if farthest > SAME_PLACE:
        return max(j for j, end in enumerate(reach) if end >= farthest - SAME_PLACE)
    return max(j for j, depth in enumerate(depths) if depth > SAME_PLACE)


def _line_forces(robot: Robot, loads: Loads) -> list[float]:
    """(N, S, 3), flat, force per length [N/m]; no weight where density or area is not known."""
    most = max([len(tube.segments) for tube in robot.tubes])
    if not loads.line_forces and not any(loads.gravity):
        return [0.0] * (3 * most * robot.n_tubes)
    lines = np.zeros((robot.n_tubes, most, 3))
    for j, force in loads.line_forces.items():
        lines[j, : len(robot.tubes[j].segments)] = force
    for j, tube in enumerate(robot.tubes):
        for i, area in enumerate(tube.areas):
            if tube.density is not None and area is not None:
                lines[j, i] += tube.density * area * np.array(loads.gravity)
    return lines.ravel().tolist()


def _point_loads(robot: Robot, D: Array, loads: Loads) -> list[float]:
    """Rows of the columns above, flat, without those that are zero."""
    wrenches = [(point.tube, point.X, point.force + point.moment) for point in loads.point_forces]
    if any(loads.tip_force) or any(loads.tip_moment):
        carrier = tip_carrier(robot, D)
        wrenches.append((carrier, robot.tubes[carrier].length, loads.tip_force + loads.tip_moment))
    at: dict[tuple[int, float], tuple[float, ...]] = {}
    for tube, X, wrench in wrenches:
        before = at.get((tube, X))
        at[tube, X] = wrench if before is None else tuple(map(add, before, wrench))
    rows: list[float] = []
    for (tube, X), total in sorted(at.items()):
        if any(total):
            rows += (tube, X, *total)
    return rows


def line_floats(robot: Robot) -> int:
    """How many floats of packed loads are forces per length: 3 for every segment of every tube, as many as the tube
    with most of them has."""
    return 3 * robot.n_tubes * max(len(tube.segments) for tube in robot.tubes)


def has_moments(robot: Robot, loads: Array) -> bool:
    """True if a point moment is among packed ``loads``."""
    return bool(loads[line_floats(robot) :].reshape(-1, POINT_WIDTH)[:, POINT_MOMENT:].any())


def on_common_points(robot: Robot, before: Array, after: Array) -> tuple[Array, Array]:
    """Two packed loads with the same rows of points, zeros where one has no load: what lies between them on a straight
    line is packed too.  Equal loads come back as they are."""
    if np.array_equal(before, after):
        return before, after
    lines = line_floats(robot)
    rows: list[dict[tuple[float, float], Array]] = []
    for loads in (before, after):
        points = loads[lines:].reshape(-1, POINT_WIDTH)
        rows.append({(row[POINT_TUBE], row[POINT_X]): row for row in points})
    places = sorted({*rows[0], *rows[1]})
    packed = []
    for loads, known in zip((before, after), rows, strict=True):
        parts = [loads[:lines] if len(loads) else np.zeros(lines)]
        parts += [known.get(place, np.array([*place, *[0.0] * (POINT_WIDTH - 2)])) for place in places]
        packed.append(np.concatenate(parts))
    return packed[0], packed[1]


def with_tip_point(robot: Robot, D: Array, loads: Array) -> Array:
    """Packed ``loads`` with a row for the tip at ``D`` (N,) [m], of zeros if none acts there: so that rates with a load
    on it can be asked for.  ``loads`` themselves if they have that row."""
    lines, carrier = line_floats(robot), tip_carrier(robot, D)
    place = [carrier, robot.tubes[carrier].length]
    if len(loads) and (loads[lines:].reshape(-1, POINT_WIDTH)[:, :2] == place).all(axis=1).any():
        return loads
    tip = np.concatenate([np.zeros(lines), place, np.zeros(POINT_WIDTH - 2)])
    return on_common_points(robot, loads, tip)[0]


@lru_cache(maxsize=1)
def quadrature_rules() -> Array:
    """The columns above of every rule (MOST_NODES + 1, MOST_NODES, RULE_WIDTH)."""
    rules = np.zeros((MOST_NODES + 1, MOST_NODES, RULE_WIDTH))
    degrees = np.arange(max(MOST_NODES, HIGHEST_DEGREE) + 1)
    norm = np.sqrt(2.0 * degrees + 1.0)
    for G in range(1, MOST_NODES + 1):
        y, w = np.polynomial.legendre.leggauss(G)
        raw = np.polynomial.legendre.legvander(y, len(degrees))
        values = raw[:, :-1] * norm
        # int_0^x P_k follows from (2k+1) L_k = (L_(k+1) - L_(k-1))'.
        integrals = np.empty_like(values)
        integrals[:, 0] = 0.5 * (y + 1.0)
        integrals[:, 1:] = (raw[:, 2:] - raw[:, :-2]) / (2.0 * norm[1:])
        rule = rules[G, :G]
        rule[:, PLACE], rule[:, WEIGHT] = 0.5 * (y + 1.0), 0.5 * w
        rule[:, POLYNOMIAL:INTEGRAL] = values[:, : HIGHEST_DEGREE + 1]
        rule[:, INTEGRAL:INTERPOLANT] = integrals[:, : HIGHEST_DEGREE + 1]
        rule[:, INTERPOLANT : INTERPOLANT + G] = integrals[:, :G] @ (values[:, :G].T * (0.5 * w))
    return rules
