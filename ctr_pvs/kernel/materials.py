"""What the tubes are made of at a place: pre-curvatures, and how strongly overlapping tubes pull at each other."""

from __future__ import annotations

import cmath
import math

from ctr_pvs.kernel.arrays import ABSENT
from ctr_pvs.kernel.arrays import BENDING
from ctr_pvs.kernel.arrays import CURVATURE
from ctr_pvs.kernel.arrays import END
from ctr_pvs.kernel.arrays import SOFTNESS
from ctr_pvs.kernel.arrays import START
from ctr_pvs.kernel.arrays import TORSION
from ctr_pvs.kernel.arrays import TURN
from ctr_pvs.kernel.arrays import Array
from ctr_pvs.kernel.arrays import Ints
from ctr_pvs.kernel.compiler import compiled


@compiled
def pre_curvature(tubes: Array, j: int, i: int, X: float) -> complex:
    """kappa_y + i kappa_z [1/m] of segment i of tube j at the tube's abscissa X [m]."""
    x = X - tubes[j, i, START]
    value = 0j
    for k in range(tubes.shape[2] - 2, CURVATURE - 1, -2):
        value = value * x + complex(tubes[j, i, k], tubes[j, i, k + 1])
    turn = tubes[j, i, TURN]
    return value * cmath.exp(1j * turn * x) if turn != 0.0 else value


@compiled
def is_constant(tubes: Array, j: int, i: int) -> bool:
    """True if only a constant turn changes the pre-curvature of segment i of tube j."""
    for k in range(CURVATURE + 2, tubes.shape[2]):
        if tubes[j, i, k] != 0.0:
            return False
    return True


@compiled
def is_curved(tubes: Array, j: int, i: int) -> bool:
    """True if segment i of tube j is pre-curved anywhere."""
    for k in range(CURVATURE, tubes.shape[2]):
        if tubes[j, i, k] != 0.0:
            return True
    return False


@compiled
def stiffest_twist(tubes: Array, here: Ints, D: Array, s: float) -> float:
    """The most that the tubes ``here`` (N,) of one section can pull each other's twist at arc length s [m], relative to
    torsion and per square of length [1/m^2]: for two tubes lambda / h^2 of the stability literature, for more a bound
    of the largest eigenvalue of G^-1/2 (Laplacian of |b_i| |b_j| / sum K) G^-1/2."""
    N = len(here)
    total, moments, stiffness = 0.0, 0.0, 0.0
    for j in range(N):
        if here[j] != ABSENT:
            stiffness += tubes[j, here[j], BENDING]
            moments += tubes[j, here[j], BENDING] * abs(pre_curvature(tubes, j, here[j], s + D[j]))
    worst = 0.0
    for j in range(N):
        if here[j] != ABSENT:
            moment = tubes[j, here[j], BENDING] * abs(pre_curvature(tubes, j, here[j], s + D[j]))
            pull = moment * (moments - moment) / (stiffness * tubes[j, here[j], TORSION])
            total += pull
            worst = max(worst, pull)
    return min(total, 2.0 * worst)


@compiled
def strongest_bend(tubes: Array, here: Ints, D: Array, s: float) -> float:
    """Curvature [1/m] at arc length s [m] of one section if all its tubes bent it to the same side."""
    moment, stiffness = 0.0, 0.0
    for j in range(len(here)):
        if here[j] != ABSENT:
            stiffness += tubes[j, here[j], BENDING]
            moment += tubes[j, here[j], BENDING] * abs(pre_curvature(tubes, j, here[j], s + D[j]))
    return moment / stiffness


@compiled
def curved_tubes(tubes: Array, here: Ints) -> tuple[int, float, bool]:
    """Of one section: how many tubes are curved, the fastest turn [rad/m], and whether only turns change them."""
    curved, turn, constant = 0, 0.0, True
    for j in range(len(here)):
        if here[j] != ABSENT and is_curved(tubes, j, here[j]):
            curved += 1
            turn = max(turn, abs(tubes[j, here[j], TURN]))
            constant = constant and is_constant(tubes, j, here[j])
    return curved, turn, constant


@compiled
def guide_compliance(tubes: Array, segments: Ints, j: int, D: float) -> float:
    """Twist per torque of tube j's guided part, int_0^D dX / GJ [rad/(N m)]."""
    if D <= 0.0:
        return 0.0
    i = guided_segment(tubes, segments, j, D)
    return tubes[j, i, SOFTNESS] + (min(D, tubes[j, i, END]) - tubes[j, i, START]) / tubes[j, i, TORSION]


@compiled
def guided_segment(tubes: Array, segments: Ints, j: int, D: float) -> int:
    """The segment of tube j just behind the orifice, the first one if its base is there."""
    i = segments[j] - 1
    while i > 0 and tubes[j, i, START] >= D:
        i -= 1
    return i


@compiled
def pre_curvature_rate(tubes: Array, j: int, i: int, X: float) -> complex:
    """d/dX of ``pre_curvature`` [1/m^2]."""
    x, turn = X - tubes[j, i, START], tubes[j, i, TURN]
    rate, power = 0j, (tubes.shape[2] - CURVATURE) // 2 - 1
    for k in range(tubes.shape[2] - 2, CURVATURE, -2):
        rate = rate * x + power * complex(tubes[j, i, k], tubes[j, i, k + 1])
        power -= 1
    if turn != 0.0:
        rate = rate * complex(math.cos(turn * x), math.sin(turn * x)) + 1j * turn * pre_curvature(tubes, j, i, X)
    return rate
