"""The arrays that the kernel reads: one of the robot, one of quadrature rules."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.robot.robot import Robot
from ctr_pvs.robot.robot import Segment

Array = NDArray[np.float64]

#: Columns of ``tubes``: abscissae where a segment starts and ends [m], K and G J [N m^2], turn of the pre-curvature
#: [rad/m], twist per torque [rad/(N m)] and straightening energy [J] from the tube's base to the segment's start; then
#: real and imaginary parts of the coefficients of its pre-curvature.
START, END, BENDING, TORSION, TURN, SOFTNESS, STRAIGHTENING, CURVATURE = range(8)

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
