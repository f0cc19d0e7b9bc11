"""The smallest model that meets a tolerance: which polynomial degree each coupled section gets.

A degree is enough when no point of the backbone, the tip among them, is off by more than the tolerance.  Twist obeys a
pendulum equation, theta'' = lambda sin(theta), whose solutions are analytic up to a distance of about
pi / (2 sqrt(lambda)) from the section (of length 1), so their Legendre coefficients fall geometrically, by the size rho
of the Bernstein ellipse that reaches there (L. N. Trefethen, "Approximation Theory and Approximation Practice", chapter
8).  Twist of a high degree moves the tip much less than what lies before it, as the tip sums it up along the section
with weights as smooth as the solution: the tip error falls by rho twice.

The first choice of degrees comes from the base positions D alone.  The estimate of the answer itself then has the last
word: degrees rise until it is met.  So the choice depends on command and tolerance and on nothing before them.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.basis import gauss_legendre
from ctr_pvs.materials import Materials
from ctr_pvs.twist import panels_needed

Array = NDArray[np.float64]

#: Degrees above the first choice, tried in turn until the estimate is within tolerance.
RAISES = (0, 1, 3, 6, 10, 15, 21)
LOWEST_DEGREE, HIGHEST_DEGREE = 1, 28
#: Measured on random robots: how much faster than by rho coefficients fall, and what a turn of the pre-curvature or of
#: the backbone along a section [rad] adds to its coupling, as a share of its square.
FASTER = 1.5
TURN_SHARE = 0.1
#: How much of a twist of degree k is let count for the tip, over rho^-k.
CAUTION = 15.0
#: Gauss points for a first look at the pre-curvatures.
GLANCE = 4


def first_degrees(materials: Materials, tolerance: float) -> tuple[int, ...]:
    """Degree of the torques in each section from D alone; 0 where nothing couples the tubes."""
    degrees = [0] * materials.domain.n_sections
    coupled = materials.composition.coupled_sections.tolist()
    if coupled:
        s, bend = _glance(materials)
        swing = _swing(materials, coupled[0], s, bend)
        turns = _turns(materials, bend)
        for m in coupled:
            coupling = materials.coupling(m)
            degrees[m] = _degree(_ellipse(coupling, turns[m]), swing * min(1.0, coupling), tolerance)
    return tuple(degrees)


def raised_degrees(degrees: tuple[int, ...], by: int) -> tuple[int, ...]:
    """``degrees`` with those of the coupled sections raised."""
    return tuple(degree + by if degree else 0 for degree in degrees)


def ellipse(materials: Materials, m: int) -> float:
    """The size rho by which Legendre coefficients fall with each degree on the panels of section m."""
    return _ellipse(materials.coupling(m), _turns(materials, _glance(materials)[1])[m])


def _ellipse(coupling: float, turn: float) -> float:
    bandwidth = coupling + TURN_SHARE * turn**2
    width = math.pi / math.sqrt(max(bandwidth / panels_needed(coupling) ** 2, 1e-6))
    return width + math.hypot(width, 1.0)


def tip_share(rho: float, degree: NDArray[np.int64]) -> Array:
    """Share of a twist of each ``degree`` (...) of its Legendre polynomials that is taken to count for the tip."""
    return np.minimum(1.0, CAUTION * rho ** -(degree - 1.0))


def _degree(rho: float, motion: float, tolerance: float) -> int:
    """Degree at which a motion [m] of the backbone that falls by rho with each degree is within tolerance [m]."""
    needed = math.log(max(motion / tolerance, 1.0)) / math.log(FASTER * rho) - 1.0
    return min(max(LOWEST_DEGREE, math.ceil(needed)), HIGHEST_DEGREE)


def _glance(materials: Materials) -> tuple[Array, Array]:
    """(g, M) some places [m] of each section, and the curvature [1/m] there if all tubes bent to the same side, (1, M)
    where it is constant."""
    domain, made = materials.domain, materials.composition
    s = domain.boundaries[:-1] + gauss_legendre(GLANCE).x[:, None] * domain.lengths
    bend = made.constant_bend
    return s, (np.abs(materials.pre_curvature(made.sections, s)) * made.share).sum(axis=2) if bend is None else bend


def _swing(materials: Materials, first: int, s: Array, bend: Array) -> float:
    """Motion of the tip [m] if all tubes turned by 1 rad from section ``first`` on, added up without sign."""
    weights, domain = gauss_legendre(GLANCE).weights, materials.domain
    return float(weights.dot((domain.length - s) * bend)[first:].dot(domain.lengths[first:]))


def _turns(materials: Materials, bend: Array) -> list[float]:
    """Largest turn [rad] of a tube's pre-curvature, and of the backbone if all bent it to the same side, along each
    section."""
    turns: list[float] = ((materials.composition.fastest_turn + bend.max(axis=0)) * materials.domain.lengths).tolist()
    return turns
