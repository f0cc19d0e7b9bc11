"""The smallest model that meets a tolerance: which polynomial degree each coupled section gets.

The first choice comes from the base positions D alone.  Twist obeys a pendulum equation, theta'' = lambda sin(theta),
whose solutions are analytic up to a distance of about pi / (2 sqrt(lambda)) from the section (of length 1), so Legendre
coefficients fall geometrically, by the size rho of the Bernstein ellipse that reaches there (L. N. Trefethen,
"Approximation Theory and Approximation Practice", chapter 8).  The estimate of the answer itself then has the last
word: degrees rise until it is met.  So the choice depends on command and tolerance and on nothing before them.
"""

from __future__ import annotations

import math

import numpy as np

from ctr_pvs.basis import gauss_legendre
from ctr_pvs.materials import Materials
from ctr_pvs.twist import panels_needed

#: Degrees above the first choice, tried in turn until the estimate is within tolerance.
RAISES = (0, 1, 3, 6, 10, 15, 21)
LOWEST_DEGREE, HIGHEST_DEGREE = 1, 28
#: Measured on random robots: how much faster than by rho coefficients fall, and what a turn of the pre-curvature
#: along a section [rad] adds to its coupling, as a share of its square.
FASTER = 1.5
TURN_SHARE = 0.1
#: Gauss points for a first look at the pre-curvatures.
GLANCE = 4


def first_degrees(materials: Materials, tolerance: float) -> tuple[int, ...]:
    """Degree of the torques in each section from D alone; 0 where nothing couples the tubes."""
    degrees = [0] * materials.domain.n_sections
    coupled = np.flatnonzero(materials.coupled)
    if not len(coupled):
        return tuple(degrees)
    swing = _swing(materials, int(coupled[0]))
    for m in coupled.tolist():
        coupling = materials.coupling(m)
        panels = panels_needed(coupling)
        bandwidth = (coupling + TURN_SHARE * _turn(materials, m) ** 2) / panels**2
        degrees[m] = _degree(bandwidth, swing * min(1.0, coupling), tolerance)
    return tuple(degrees)


def raised_degrees(degrees: tuple[int, ...], by: int) -> tuple[int, ...]:
    """``degrees`` with those of the coupled sections raised."""
    return tuple(degree + by if degree else 0 for degree in degrees)


def _degree(bandwidth: float, motion: float, tolerance: float) -> int:
    """Degree at which a tip motion [m] that falls by rho with each degree is within tolerance [m]."""
    width = math.pi / math.sqrt(max(bandwidth, 1e-6))
    rho = FASTER * (width + math.hypot(width, 1.0))
    needed = math.log(max(motion / tolerance, 1.0)) / math.log(rho) - 1.0
    return min(max(LOWEST_DEGREE, math.ceil(needed)), HIGHEST_DEGREE)


def _swing(materials: Materials, first: int) -> float:
    """Motion of the tip [m] if all tubes turned by 1 rad from section ``first`` on, added up without sign."""
    rule, length, total = gauss_legendre(GLANCE), materials.domain.length, 0.0
    for m in range(first, materials.domain.n_sections):
        s = materials.domain.boundaries[m] + rule.x * materials.domain.lengths[m]
        kappa = np.abs(materials.pre_curvature(m, s)) @ materials.bending[m] / materials.bending[m].sum()
        total += float(materials.domain.lengths[m] * (rule.weights * (length - s)) @ kappa)
    return total


def _turn(materials: Materials, m: int) -> float:
    """Largest turn [rad] of a tube's pre-curvature along section m."""
    segments = materials.domain.segment[m]
    turns = [abs(materials.segment(j, segments[j]).turn) for j in materials.curved_tubes[m]]
    return float(max(turns) * materials.domain.lengths[m])
