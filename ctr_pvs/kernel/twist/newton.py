"""One step from command to command: predict, correct, check.

The first Newton step is taken from the old base angles, so it is the tangent prediction.  The check is made at two
degrees more, all in one factorisation: its Cholesky factor proves that the step has kept its branch, and its Newton
step is what the coarser model leaves out.
"""

from __future__ import annotations

import math

from ctr_pvs.kernel.arrays import ANGLE
from ctr_pvs.kernel.arrays import ARC
from ctr_pvs.kernel.arrays import BEFORE
from ctr_pvs.kernel.arrays import COUPLED
from ctr_pvs.kernel.arrays import FIRST
from ctr_pvs.kernel.arrays import GAUSS
from ctr_pvs.kernel.arrays import GRADIENT
from ctr_pvs.kernel.arrays import LAST_COUPLED
from ctr_pvs.kernel.arrays import N_ELEMENTS
from ctr_pvs.kernel.arrays import N_UNKNOWNS
from ctr_pvs.kernel.arrays import NONE
from ctr_pvs.kernel.arrays import OTHER
from ctr_pvs.kernel.arrays import PSI
from ctr_pvs.kernel.arrays import ROOT
from ctr_pvs.kernel.arrays import ROW
from ctr_pvs.kernel.arrays import SCALE
from ctr_pvs.kernel.arrays import SIZE
from ctr_pvs.kernel.arrays import STEP
from ctr_pvs.kernel.arrays import TURNED_BY
from ctr_pvs.kernel.arrays import Array
from ctr_pvs.kernel.arrays import Bench
from ctr_pvs.kernel.arrays import Scene
from ctr_pvs.kernel.arrays import Y
from ctr_pvs.kernel.compiler import compiled
from ctr_pvs.kernel.twist.condensation import factorize
from ctr_pvs.kernel.twist.condensation import substitute
from ctr_pvs.kernel.twist.element import EXACT
from ctr_pvs.kernel.twist.element import LOWERED
from ctr_pvs.kernel.twist.element import WORST
from ctr_pvs.kernel.twist.element import angles_inside
from ctr_pvs.kernel.twist.element import energy_gradient
from ctr_pvs.kernel.twist.element import spread_angles
from ctr_pvs.kernel.twist.element import turn_moments
from ctr_pvs.kernel.twist.element import used

#: A Newton step shorter than this [rad] leaves about its square: time to look at the residual.
LAST_STEP = 2e-6
MOST_STEPS = 12
#: A step that is not shorter than the one before by this factor is not Newton converging.
CONTRACTION = 0.5
#: An equilibrium is accepted when its residual twist [rad] is below this, plus rounding of large base angles: cos and
#: sin lose digits where those are many turns.
RESIDUAL_TWIST, ANGLE_ROUNDING = 1e-11, 64.0 * 2.220446049250313e-16
#: How far the next finer model may differ [rad], as a multiple of tolerance over length, and within which bounds.
SLACK, LEAST_SLACK, MOST_SLACK = 100.0, 1e-6, 0.05


@compiled
def twist_size(scene: Scene, v: Array, finer: int) -> float:
    """A bound of the largest twist angle [rad] that the unknowns v (U,), a vector [sqrt(J)], stand for.

    Inside an element sum_l v_l int_0^x P_l is at most the norm of v there: Bessel's inequality for 1 on [0, x]."""
    most = 0.0
    for j in range(scene.base.shape[1]):
        end = scene.base[ROOT, j] * v[j]
        most = max(most, abs(end))
        for m in range(scene.counts[LAST_COUPLED]):
            if scene.parts[SIZE, m, j] > 0:
                first, squares = scene.parts[FIRST, m, j], 0.0
                for k in range(used(scene.parts[SIZE, m, j], finer)):
                    squares += v[first + k] * v[first + k]
                most = max(most, abs(end) + scene.held[SCALE, m, j] * math.sqrt(squares))
                end += scene.held[SCALE, m, j] * v[first]
    return most


@compiled
def residual_limit(alpha: Array) -> float:
    """Residual twist [rad] that counts as zero at base angles alpha (N,) [rad]."""
    largest = 0.0
    for angle in alpha:
        largest = max(largest, abs(angle))
    return RESIDUAL_TWIST + ANGLE_ROUNDING * largest


@compiled
def slack_of(scene: Scene, tolerance: float) -> float:
    """How far [rad] the converged model may lie from one that meets ``tolerance`` [m] at its tip."""
    length = max(scene.line[scene.counts[N_ELEMENTS], ARC], tolerance)
    return min(max(LEAST_SLACK, SLACK * tolerance / length), MOST_SLACK)


@compiled
def newton_step(
    scene: Scene, bench: Bench, rules: Array, alpha: Array, turned: Array, finer: int, kind: int, slack: float
) -> bool:
    """Newton's step at alpha (N,) and ``y`` into ``step``, while the base angles turn by ``turned`` (N,);
    false if the Hessian, or its bound by ``kind`` and ``slack``, is not positive definite."""
    energy_gradient(scene, rules, alpha)
    if not factorize(scene, bench, rules, finer, kind, slack, 0.0, -1.0):
        return False
    for u in range(scene.counts[N_UNKNOWNS]):
        scene.vectors[OTHER, u] = -scene.vectors[GRADIENT, u]
    substitute(scene, bench, finer, scene.vectors[OTHER], turned, scene.vectors[STEP], False)
    return True


@compiled
def predict(scene: Scene, bench: Bench, rules: Array, before: Array, alpha: Array) -> None:
    """Moves ``y``, an equilibrium at base angles ``before`` (N,), along the tangent to those at alpha (N,)."""
    turned = bench.lines[TURNED_BY]
    for j in range(len(alpha)):
        turned[j] = alpha[j] - before[j]
    if newton_step(scene, bench, rules, before, turned, 0, EXACT, 0.0):
        for u in range(scene.counts[N_UNKNOWNS]):
            scene.vectors[Y, u] += scene.vectors[STEP, u]


@compiled
def correct(scene: Scene, bench: Bench, rules: Array, alpha: Array, finer: int, unique: bool) -> int:
    """Newton from ``y`` to the equilibrium at alpha (N,) [rad]; the steps it took, or minus them if it failed.

    It keeps to the basin it starts in: it stops rather than take a longer second step.  unique :
    there is but one equilibrium; then steps are only kept from being too long.
    """
    previous, steps = math.inf, 0
    while steps < MOST_STEPS * (4 if unique else 1):
        if not newton_step(scene, bench, rules, alpha, bench.lines[NONE], finer, EXACT, 0.0):
            return -steps - 1
        steps += 1
        size = twist_size(scene, scene.vectors[STEP], finer)
        share = 1.0
        if unique and size > 1.0:
            share = 1.0 / size
        elif not unique and steps > 1 and size > LAST_STEP and not size < CONTRACTION * previous:
            return -steps
        for u in range(scene.counts[N_UNKNOWNS]):
            scene.vectors[Y, u] += share * scene.vectors[STEP, u]
        if size <= LAST_STEP:
            return steps
        previous = size
    return -steps


@compiled
def remember(scene: Scene, rules: Array, alpha: Array) -> None:
    """Fills ``before``: psi of ``y`` at alpha (N,) [rad], a state whose branch is to be kept."""
    spread_angles(scene, alpha, scene.vectors[Y])
    for m in range(scene.counts[N_ELEMENTS]):
        if scene.marks[m, COUPLED]:
            angles_inside(scene, rules, m, scene.held[ANGLE, m], scene.vectors[Y], scene.turns[BEFORE])


@compiled
def largest_turn(scene: Scene) -> float:
    """The most [rad] that the angle between two coupled tubes has changed since ``before``."""
    most = 0.0
    for m in range(scene.counts[N_ELEMENTS]):
        if not scene.marks[m, COUPLED]:
            continue
        for row in range(scene.marks[m, ROW], scene.marks[m, ROW] + scene.marks[m, GAUSS]):
            low, high = math.inf, -math.inf
            for j in range(scene.base.shape[1]):
                if scene.parts[SIZE, m, j] > 1:
                    moved = scene.turns[PSI, row, j] - scene.turns[BEFORE, row, j]
                    low, high = min(low, moved), max(high, moved)
            most = max(most, high - low)
    return most


@compiled
def certainly_convex(scene: Scene, bench: Bench, rules: Array, alpha: Array, reach: float) -> bool:
    """True if the energy is convex, at the finer degree, wherever angles between tubes are within ``reach`` [rad] of
    those of ``y`` at alpha (N,)."""
    energy_gradient(scene, rules, alpha)
    remember(scene, rules, alpha)
    return factorize(scene, bench, rules, 1, LOWERED, reach, 0.0, -1.0)


@compiled
def convex_everywhere(scene: Scene, bench: Bench, rules: Array, alpha: Array) -> bool:
    """True if no rotation of the bases can fold: the energy is convex, at the finer degree, whatever the angles are."""
    for m in range(scene.counts[N_ELEMENTS]):
        if scene.marks[m, COUPLED]:
            angles_inside(scene, rules, m, alpha, scene.vectors[Y], scene.turns[PSI])
            turn_moments(scene, m)
    return factorize(scene, bench, rules, 1, WORST, 0.0, 0.0, -1.0)
