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
from ctr_pvs.kernel.arrays import LAST_ACTIVE
from ctr_pvs.kernel.arrays import LEAD
from ctr_pvs.kernel.arrays import LENGTH
from ctr_pvs.kernel.arrays import MU
from ctr_pvs.kernel.arrays import MU_SIZE
from ctr_pvs.kernel.arrays import N_ELEMENTS
from ctr_pvs.kernel.arrays import N_LOADS
from ctr_pvs.kernel.arrays import N_UNKNOWNS
from ctr_pvs.kernel.arrays import NONE
from ctr_pvs.kernel.arrays import OTHER
from ctr_pvs.kernel.arrays import PSI
from ctr_pvs.kernel.arrays import ROOT
from ctr_pvs.kernel.arrays import ROW
from ctr_pvs.kernel.arrays import SCALE
from ctr_pvs.kernel.arrays import SIZE
from ctr_pvs.kernel.arrays import STEP
from ctr_pvs.kernel.arrays import STIFFNESS
from ctr_pvs.kernel.arrays import TURNED_BY
from ctr_pvs.kernel.arrays import Array
from ctr_pvs.kernel.arrays import Bench
from ctr_pvs.kernel.arrays import Scene
from ctr_pvs.kernel.arrays import Y
from ctr_pvs.kernel.compiler import compiled
from ctr_pvs.kernel.loaded.tangent import solve_tangent
from ctr_pvs.kernel.twist.condensation import factorize
from ctr_pvs.kernel.twist.element import EXACT
from ctr_pvs.kernel.twist.element import LOWERED
from ctr_pvs.kernel.twist.element import WORST
from ctr_pvs.kernel.twist.element import energy_gradient
from ctr_pvs.kernel.twist.fields import COARSE
from ctr_pvs.kernel.twist.fields import FINE
from ctr_pvs.kernel.twist.fields import angles_inside
from ctr_pvs.kernel.twist.fields import spread_angles
from ctr_pvs.kernel.twist.fields import turn_moments
from ctr_pvs.kernel.twist.fields import used
from ctr_pvs.kernel.twist.fields import used_bending

#: A Newton step shorter than this [rad] leaves about its square; one of an older factorisation leaves a tenth at most.
LAST_STEP, LAST_CHORD = 2e-6, 1e-8
MOST_STEPS = 12
#: After a step shorter than this [rad] its factorisation serves again, while each step with it is shorter than the one
#: before by the second number: a factorisation costs about as much as a gradient and a solution, under load more.
CHORD, CHORD_CONTRACTION = 0.05, 0.1
#: A step that is not shorter than the one before by this factor is not Newton converging.
CONTRACTION = 0.5
#: Under load nothing proves that a step keeps its branch: its correction must be this much shorter than the tangent.
LOADED_CONTRACTION = 0.25
#: An equilibrium is accepted when its residual twist [rad] is below this, plus rounding of large base angles: cos and
#: sin lose digits where those are many turns.
RESIDUAL_TWIST, ANGLE_ROUNDING = 1e-11, 64.0 * 2.220446049250313e-16
#: How far the next finer model may differ [rad], as a multiple of tolerance over length, and within which bounds.
SLACK, LEAST_SLACK, MOST_SLACK = 100.0, 1e-6, 0.05


@compiled
def twist_size(scene: Scene, v: Array, which: int) -> float:
    """A bound of the largest angle [rad], of twist or of how mu turns the frame, that the unknowns v (U,), a vector
    [sqrt(J)], stand for.

    Inside an element sum_l v_l int_0^x P_l is at most the norm of v there: Bessel's inequality for 1 on [0, x]."""
    most = 0.0
    for j in range(scene.base.shape[1]):
        end = scene.base[ROOT, j] * v[j]
        most = max(most, abs(end))
        for m in range(scene.counts[LAST_ACTIVE]):
            if scene.parts[SIZE, m, j] > 0:
                first, squares = scene.parts[FIRST, m, j], 0.0
                for k in range(used(scene.parts[SIZE, m, j], which)):
                    squares += v[first + k] * v[first + k]
                most = max(most, abs(end) + scene.held[SCALE, m, j] * math.sqrt(squares))
                end += scene.held[SCALE, m, j] * v[first]
    bent = 0.0
    for m in range(scene.counts[LAST_ACTIVE] if scene.counts[LEAD] > 0 else 0):
        first, squares = scene.marks[m, MU], 0.0
        size, count = scene.marks[m, MU_SIZE], used_bending(scene.marks[m, MU_SIZE], which)
        for k in range(count):
            squares += v[first + k] * v[first + k] + v[first + size + k] * v[first + size + k]
        bent += math.sqrt(squares * scene.line[m, LENGTH] / scene.line[m, STIFFNESS])
    return max(most, bent)


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
    scene: Scene, bench: Bench, tubes: Array, rules: Array, alpha: Array, turned: Array, which: int
) -> bool:  # fmt: skip
    """Newton's step at alpha (N,) and ``y`` into ``step``, while the base angles turn by ``turned`` (N,);
    false if the Hessian is not positive definite."""
    energy_gradient(scene, bench, tubes, rules, alpha)
    if not factorize(scene, bench, rules, which, EXACT, 0.0, 0.0, -1.0):
        return False
    chord_step(scene, bench, turned, which)
    return True


@compiled
def chord_step(scene: Scene, bench: Bench, turned: Array, which: int) -> None:
    """The step from the present gradient with the last factorisation, into ``step``."""
    for u in range(scene.counts[N_UNKNOWNS]):
        scene.vectors[OTHER, u] = -scene.vectors[GRADIENT, u]
    solve_tangent(scene, bench, which, scene.vectors[OTHER], turned, scene.vectors[STEP], 1.0)


@compiled
def predict(scene: Scene, bench: Bench, tubes: Array, rules: Array, before: Array, alpha: Array) -> float:
    """Moves ``y``, an equilibrium at base angles ``before`` (N,), along the tangent to those at alpha (N,): a Newton
    step, which under changed loads or D takes their change along.  How far [rad]; infinite if there is no tangent."""
    turned = bench.lines[TURNED_BY]
    for j in range(len(alpha)):
        turned[j] = alpha[j] - before[j]
    if not newton_step(scene, bench, tubes, rules, before, turned, COARSE):
        return math.inf
    for u in range(scene.counts[N_UNKNOWNS]):
        scene.vectors[Y, u] += scene.vectors[STEP, u]
    return twist_size(scene, scene.vectors[STEP], COARSE)


@compiled
def correct(
    scene: Scene, bench: Bench, tubes: Array, rules: Array, alpha: Array, unique: bool, first: float
) -> tuple[int, float]:
    """Newton from ``y`` to the equilibrium at alpha (N,) [rad]: the steps it took, or minus them if it failed, and how
    far they went in all [rad].  The gradient there stays in ``scene``.

    It keeps to the basin it starts in: it stops rather than take a longer second step.  unique :
    there is but one equilibrium; then steps are only kept from being too long.  first : length [rad] of the step that
    predicted ``y``, which the next one under load must not come near; 0 if none did.
    """
    steps, way, size, previous, chord = 0, 0.0, math.inf, math.inf, 0.0 < first < CHORD
    if first > 0.0:
        size = first
        if scene.counts[N_LOADS] > 0:
            previous = LOADED_CONTRACTION / CONTRACTION * first
    limit = residual_limit(alpha)
    energy_gradient(scene, bench, tubes, rules, alpha)
    while size > (LAST_CHORD if chord else LAST_STEP) or twist_size(scene, scene.vectors[GRADIENT], COARSE) > limit:
        if steps == MOST_STEPS * (4 if unique else 1):
            return -steps, way
        steps += 1
        if not chord and not factorize(scene, bench, rules, COARSE, EXACT, 0.0, 0.0, -1.0):
            return -steps, way
        chord_step(scene, bench, bench.lines[NONE], COARSE)
        size = twist_size(scene, scene.vectors[STEP], COARSE)
        if chord and size > LAST_CHORD and not size < CHORD_CONTRACTION * previous:
            size, chord = math.inf, False
            continue
        share = 1.0
        if unique and size > 1.0:
            share = 1.0 / size
        elif not unique and size > LAST_STEP and not size < CONTRACTION * previous:
            return -steps, way
        for u in range(scene.counts[N_UNKNOWNS]):
            scene.vectors[Y, u] += share * scene.vectors[STEP, u]
        way += share * size
        chord, previous = size < CHORD, size
        energy_gradient(scene, bench, tubes, rules, alpha)
    return steps, way


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
def certainly_convex(scene: Scene, bench: Bench, tubes: Array, rules: Array, alpha: Array, reach: float) -> bool:
    """True if the energy is convex, at the finer degree, wherever angles between tubes are within ``reach`` [rad] of
    those of ``y`` at alpha (N,)."""
    energy_gradient(scene, bench, tubes, rules, alpha)
    remember(scene, rules, alpha)
    return factorize(scene, bench, rules, FINE, LOWERED, reach, 0.0, -1.0)


@compiled
def convex_everywhere(scene: Scene, bench: Bench, rules: Array, alpha: Array) -> bool:
    """True if no rotation of the bases can fold: the energy is convex, at the finer degree, whatever the angles are."""
    for m in range(scene.counts[N_ELEMENTS]):
        if scene.marks[m, COUPLED]:
            angles_inside(scene, rules, m, alpha, scene.vectors[Y], scene.turns[PSI])
            turn_moments(scene, m)
    return factorize(scene, bench, rules, FINE, WORST, 0.0, 0.0, -1.0)
