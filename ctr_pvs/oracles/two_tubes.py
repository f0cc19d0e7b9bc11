"""Closed forms for two tubes with constant pre-curvatures over one overlap of length L_c.

In sigma = (s - start of the overlap) / L_c, the angle theta between the two planes of curvature obeys the pendulum's
equation, with the guide and whatever lies straight before the overlap as a twisting lead of relative length b:

    theta'' = lambda sin(theta),      theta(0) = alpha + b theta'(0),      theta'(1) = 0,
    lambda = L_c^2 kappa_1 kappa_2 [K_1 K_2 / sum K] (1/GJ_1 + 1/GJ_2).

The equation, its solution for two tubes of constant curvature and the snap that follows from it: P. E. Dupont, J. Lock,
E. Butler, "Torsional Kinematic Model for Concentric Tube Robots", ICRA 2009, and with B. Itkowitz, "Design and Control
of Concentric-Tube Robots", IEEE Trans. Robotics 26(2), 2010.  With straight lengths before the overlap: R. Xu,
S. F. Atashzar, R. V. Patel, "Kinematic Instability in Concentric-Tube Robots: Modeling and Analysis", BioRob 2014.  The
two parameters, the snap-free test and the stability function at theta = pi: H. B. Gilbert, R. J. Hendrick,
R. J. Webster III, "Elastic Stability of Concentric Tube Robots: A Stability Measure and Design Test", IEEE Trans.
Robotics 32(1), 2016.

All equilibria are one curve alpha(theta_1), theta_1 = theta(1) the angle at the tip.  With k = cos(theta_1 / 2),
k' = sin(theta_1 / 2), u = sqrt(lambda) and Jacobi's functions of u at modulus k,

    theta(0) = 2 arccos(k cd u) = 2 atan2(k', k cn u),      theta'(0) = -2 sqrt(lambda) k k' sn u / dn u.

The branch through theta_1 = 0 is stable up to its first fold, d alpha / d theta_1 = 0.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from numpy.typing import NDArray
from scipy.optimize import brentq

from ctr_pvs.errors import FieldError
from ctr_pvs.oracles.tube_pair import TubePair
from ctr_pvs.oracles.tube_pair import materials_at
from ctr_pvs.oracles.tube_pair import tube_pair
from ctr_pvs.robot.robot import Robot

Array = NDArray[np.float64]

#: Largest lambda for which the elliptic functions keep their digits.
LARGEST_LAMBDA = 100.0
#: Folds are looked for between samples at equal steps of ln tan(theta_1 / 2), from -ENDS to ENDS: they crowd at
#: theta_1 = 0, where strong pairs fold, and at pi, where weak ones do.
SAMPLES, ENDS = 2001, 18.0
#: Relative difference below which two sections count as the same material.
SAME = 1e-9


@dataclass(frozen=True)
class Fold:
    """Where the stable branch ends: tip angle theta_1 and relative base angle alpha [rad], both between the planes of
    curvature."""

    theta_tip: float
    alpha: float


@dataclass(frozen=True)
class TwoTubes:
    """The pair in numbers without a unit.

    Args:
        lam: lambda > 0, how strongly the tubes pull against their torsional stiffness.
        b: length of the lead that would twist as much as the real one does, relative to the overlap.
        plane_offset: rad; the plane of tube 2's pre-curvature against that of tube 1 at equal base angles.
            Angles of this class are measured between these planes: alpha = alpha_2 - alpha_1 + plane_offset.

    Raises:
        FieldError: for lambda outside (0, 100] or a negative b.
    """

    lam: float
    b: float
    plane_offset: float = 0.0

    def __post_init__(self) -> None:
        if not 0.0 < self.lam <= LARGEST_LAMBDA:
            raise FieldError("lam", self.lam, f"lambda above 0, at most {LARGEST_LAMBDA:g}")
        if not 0.0 <= self.b < math.inf:
            raise FieldError("b", self.b, "b of at least 0")

    @property
    def snap_free(self) -> bool:
        """True if every rotation has exactly one equilibrium (Gilbert et al. 2016)."""
        root = math.sqrt(self.lam)
        return root < 0.5 * math.pi and self.b * root * math.tan(root) < 1.0

    def base(self, theta_tip: ArrayLike) -> tuple[Array, Array]:
        """theta(0) [rad] and theta'(0) [rad per L_c] for tip angles of any shape."""
        k, k_, sn, cn, dn, _ = self._elliptic(theta_tip)
        turns = 2.0 * np.pi * np.round(np.asarray(theta_tip) / (2.0 * np.pi))
        theta = turns + 2.0 * np.arctan2(k_, k * cn)
        return theta, -2.0 * math.sqrt(self.lam) * k * k_ * sn / dn

    def alpha(self, theta_tip: ArrayLike) -> Array:
        """Relative base angle [rad] that belongs to each tip angle; grows by 2 pi with it, and is odd."""
        theta, rate = self.base(theta_tip)
        return theta - self.b * rate

    def slope(self, theta_tip: ArrayLike) -> Array:
        """d alpha / d theta_1: 0 at folds; at theta_1 = pi it is the stability function S."""
        k, k_, sn, cn, dn, area = self._elliptic(theta_tip)
        theta = cn + k * k * area * sn / dn
        rate = math.sqrt(self.lam) * (k_ * k_ * sn / dn - k * k * area * cn / dn**2)
        return np.asarray(theta - self.b * rate)

    def _elliptic(self, theta_tip: ArrayLike) -> tuple[Array, Array, Array, Array, Array, Array]:
        half = 0.5 * np.asarray(theta_tip, dtype=float)
        half = half - np.pi * np.round(half / np.pi)  # one period of theta_1; |half| <= pi/2
        k, k_ = np.cos(half), np.sin(half)
        return k, k_, *_jacobi(math.sqrt(self.lam), k, np.abs(k_))

    @cached_property
    def folds(self) -> tuple[Fold, ...]:
        """All folds with theta_1 in (0, pi), by theta_1; those in (-pi, 0) mirror them."""
        tips = 2.0 * np.arctan(np.exp(np.linspace(-ENDS, ENDS, SAMPLES)))
        slopes = self.slope(tips)
        changes = np.flatnonzero((slopes[:-1] > 0.0) != (slopes[1:] > 0.0))
        exact = [_zero(self.slope, tips[i], tips[i + 1]) for i in changes]
        return tuple(Fold(tip, float(self.alpha(tip))) for tip in exact)

    @property
    def snap(self) -> Fold | None:
        """Where the stable branch through alpha = 0 ends as alpha grows; None for a pair that never snaps."""
        return self.folds[0] if self.folds else None

    def equilibria(self, alpha: float) -> Array:
        """All tip angles theta_1 in equilibrium at ``alpha`` [rad], in increasing order.

        Angles are not wrapped: theta_1 + 2 pi belongs to alpha + 2 pi.
        """
        # Between neighbouring folds alpha is monotone: one sign change, one root.
        folds = np.array([fold.theta_tip for fold in self.folds])
        knots = np.concatenate([-folds[::-1], folds, [np.pi]])
        reach = float(np.abs(self.alpha(knots) - knots).max()) + 2.0 * np.pi
        turns = np.arange(np.floor((alpha - reach) / (2.0 * np.pi)), np.ceil((alpha + reach) / (2.0 * np.pi)) + 1.0)
        places = (knots + 2.0 * np.pi * turns[:, None]).ravel()
        values = self.alpha(places) - alpha
        pieces = np.flatnonzero((values[:-1] >= 0.0) != (values[1:] >= 0.0))
        return np.array([self._tip_between(places[i], places[i + 1], alpha) for i in pieces])

    def stable_tip(self, alpha: float) -> float | None:
        """theta_1 at ``alpha`` on the branch through alpha = 0; None past its ends."""
        end = Fold(np.inf, np.inf) if self.snap is None else self.snap
        if not abs(alpha) <= end.alpha:
            return None
        tip = min(end.theta_tip, abs(alpha))  # the tip never turns farther than the base
        return math.copysign(self._tip_between(0.0, tip, abs(alpha)), alpha)

    def _tip_between(self, low: float, high: float, alpha: float) -> float:
        return _zero(lambda tip: self.alpha(tip) - alpha, low, high)


def stability_function(lam: float, b: float) -> float:
    """S at theta = pi: cos(sqrt(lambda)) - b sqrt(lambda) sin(sqrt(lambda)); 0 at the critical lambda (Gilbert et al.
    2016)."""
    root = math.sqrt(lam)
    return math.cos(root) - b * root * math.sin(root)


def critical_lambda(b: float) -> float:
    """The smallest lambda at which a pair with lead ``b`` >= 0 can snap: the first zero of the stability function.

    Raises:
        FieldError: for a b that is negative or not finite.
    """
    if not 0.0 <= b < math.inf:
        raise FieldError("b", b, "a finite b of at least 0")
    if b == 0.0:
        return 0.25 * math.pi**2
    # S falls from 1 to -b pi / 2 on the way to sqrt(lambda) = pi / 2.
    root = brentq(lambda r: math.cos(r) - b * r * math.sin(r), 0.0, 0.5 * math.pi, xtol=1e-16, rtol=1e-15)
    return float(root) ** 2


def two_tube_parameters(robot: Robot, D: ArrayLike) -> TwoTubes:
    """lambda, b and the plane offset of ``robot`` at base positions ``D`` (N,) [m].

    Straight stretches past the orifice count to the lead, with their own stiffness.  Helical pre-curvatures of equal
    turn keep their planes at one angle and are as good as constant ones.  More than two tubes are fine as long as only
    two are curved where they overlap.

    Raises:
        CommandError: for a D that the robot cannot take.
        FieldError: where the pair is not of this kind: no overlap, more than two tubes, or properties that vary.
    """
    materials = materials_at(robot, D)
    pair = tube_pair(materials)
    if pair is None:
        count = int((materials.curved & materials.coupled[:, None]).any(axis=0).sum())
        raise FieldError("robot", f"{count} at these D", "two pre-curved tubes that overlap, no fewer and no more")
    pulls, compliances = _sampled(pair)
    if np.ptp(pulls.real) + np.ptp(pulls.imag) > SAME * abs(pulls[0]) or np.ptp(compliances) > SAME * compliances[0]:
        rule = "stiffnesses, curvatures and the angle between their planes constant along the overlap"
        raise FieldError("robot", robot.name, rule, "ctr_pvs.equilibria takes any two tubes")
    length = sum(section.length for section in pair.sections)
    lam = length**2 * float(abs(pulls[0])) * float(compliances[0])
    return TwoTubes(lam, pair.lead / (float(compliances[0]) * length), float(np.angle(pulls[0])))


def _zero(function: Callable[[float], Array], low: float, high: float) -> float:
    """The zero between two places; the better one of these if rounding hides the change of sign."""
    at_low, at_high = float(function(low)), float(function(high))
    if at_low * at_high >= 0.0:
        return low if abs(at_low) < abs(at_high) else high
    return float(brentq(lambda place: float(function(place)), low, high, xtol=1e-300, rtol=1e-14))


def _sampled(pair: TubePair) -> tuple[NDArray[np.complex128], Array]:
    """c [N] and 1/GJ_1 + 1/GJ_2 at places along the overlap; c is 0 in an uncoupled gap."""
    pulls, compliances = [], []
    for section in pair.sections:
        s = section.start + section.length * np.linspace(0.0, 1.0, 12)
        pulls.append(pair.pull(section.index, s))
        compliances.append(np.full(len(s), section.compliance))
    return np.concatenate(pulls), np.concatenate(compliances)


def _jacobi(u: float, k: Array, k_: Array) -> tuple[Array, Array, Array, Array]:
    """sn u, cn u, dn u and int_0^u cn^2 at modulus ``k``, complementary modulus ``k_`` >= 0.

    By the arithmetic-geometric mean (Abramowitz and Stegun, 16.4 and 17.6).  Taking k_ itself and not 1 - k^2 keeps the
    digits where k is near 1, and the integral, (E - k_^2 u) / k^2 in Legendre's terms, where it is near 0.
    """
    a, b = np.ones_like(k_), np.maximum(k_, 1e-30)  # at k_ = 0 the mean would never settle
    means, ratios = [], []  # a_i, and c_i / k^2 with c_i = (a_{i-1} - b_{i-1}) / 2
    share = 0.5 / (1.0 + b)
    while True:
        a, b = 0.5 * (a + b), np.sqrt(a * b)
        means.append(a)
        ratios.append(share)
        if np.all(k * k * share <= 1e-16 * a) or len(means) == 16:
            break
        share = k * k * share**2 / (2.0 * (a + b))
    amplitude = 2.0 ** len(means) * means[-1] * u
    area = 0.5 * u * (1.0 - k * k * sum(2.0 ** (i + 1) * r * r for i, r in enumerate(ratios)))
    for mean, ratio in zip(reversed(means), reversed(ratios), strict=True):
        area = area + ratio * np.sin(amplitude)
        amplitude = 0.5 * (amplitude + np.arcsin(np.clip(k * k * ratio * np.sin(amplitude) / mean, -1.0, 1.0)))
    sn, cn = np.sin(amplitude), np.cos(amplitude)
    return sn, cn, np.hypot(k_, k * cn), area
