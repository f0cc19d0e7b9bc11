"""Where a snap lands: the gradient flow of the energy in the torsional metric, from the last stable state, at the
command just past the fold.

With strong coupling a twist kink drifts along nearly flat energy before it leaves, so the method takes long steps when
nothing happens: linearly implicit Euler steps, once whole and twice half, extrapolated; their difference is the error.
"""

from __future__ import annotations

from ctr_pvs.kernel.arrays import GRADIENT
from ctr_pvs.kernel.arrays import N_UNKNOWNS
from ctr_pvs.kernel.arrays import NONE
from ctr_pvs.kernel.arrays import OTHER
from ctr_pvs.kernel.arrays import STEP
from ctr_pvs.kernel.arrays import Array
from ctr_pvs.kernel.arrays import Bench
from ctr_pvs.kernel.arrays import Scene
from ctr_pvs.kernel.arrays import Y
from ctr_pvs.kernel.compiler import compiled
from ctr_pvs.kernel.twist.condensation import factorize
from ctr_pvs.kernel.twist.condensation import substitute
from ctr_pvs.kernel.twist.element import EXACT
from ctr_pvs.kernel.twist.element import energy_gradient
from ctr_pvs.kernel.twist.element import energy_value
from ctr_pvs.kernel.twist.fields import COARSE
from ctr_pvs.kernel.twist.newton import correct
from ctr_pvs.kernel.twist.newton import twist_size

#: First displacement [rad] along the direction that has lost its stiffness.
NUDGE = 1e-3
#: The flow may have come to rest when the unbalanced torque would twist less than this [rad]; Newton then tries to end
#: it, and must not go farther than this.
AT_REST, LAST_WAY = 1e-4, 1e-2
#: Longest time of the flow, in which a twist that only its own stiffness holds decays in 1; error [rad] of one step.
LONGEST_FLOW, FLOW_ERROR = 1e9, 1e-3
#: First shift that makes a Hessian at a fold positive definite, and rounds of inverse iteration to its softest
#: direction.
FIRST_SHIFT, ROUNDS = 1e-8, 4


@compiled
def soften(scene: Scene, bench: Bench, tubes: Array, rules: Array, alpha: Array) -> None:
    """The direction that has lost its stiffness at ``y`` and alpha (N,) into ``other``, of a twist of
    NUDGE, to the side where the energy is lower."""
    energy_gradient(scene, bench, tubes, rules, alpha)
    shift = FIRST_SHIFT
    while not factorize(scene, bench, rules, COARSE, EXACT, 0.0, shift, -1.0):
        shift *= 4.0
    U = scene.counts[N_UNKNOWNS]
    for u in range(U):
        scene.vectors[OTHER, u] = 1.0 + 0.1 * (u % 7)
    for _ in range(ROUNDS):
        substitute(scene, bench, COARSE, scene.vectors[OTHER], bench.lines[NONE], scene.vectors[STEP], False)
        size = max(twist_size(scene, scene.vectors[STEP], COARSE), 1e-300)
        for u in range(U):
            scene.vectors[OTHER, u] = scene.vectors[STEP, u] * NUDGE / size
    for u in range(U):
        scene.vectors[Y, u] += scene.vectors[OTHER, u]
    ahead = energy_value(scene, tubes, rules, alpha)
    for u in range(U):
        scene.vectors[Y, u] -= 2.0 * scene.vectors[OTHER, u]
    behind = energy_value(scene, tubes, rules, alpha)
    for u in range(U):
        scene.vectors[Y, u] += scene.vectors[OTHER, u]
        if behind < ahead:
            scene.vectors[OTHER, u] = -scene.vectors[OTHER, u]


@compiled
def euler_step(scene: Scene, bench: Bench, tubes: Array, rules: Array, alpha: Array, time: float, out: Array) -> bool:
    """One linearly implicit Euler step of the flow from ``y`` into ``out`` (U,); false if ``time`` is too
    long."""
    energy_gradient(scene, bench, tubes, rules, alpha)
    if not factorize(scene, bench, rules, COARSE, EXACT, 0.0, 1.0 / time, -1.0):
        return False
    for u in range(scene.counts[N_UNKNOWNS]):
        scene.vectors[OTHER, u] = -scene.vectors[GRADIENT, u]
    substitute(scene, bench, COARSE, scene.vectors[OTHER], bench.lines[NONE], scene.vectors[STEP], False)
    for u in range(scene.counts[N_UNKNOWNS]):
        out[u] = scene.vectors[Y, u] + scene.vectors[STEP, u]
    return True


@compiled
def flow(scene: Scene, bench: Bench, tubes: Array, rules: Array, alpha: Array, clock: Array, steps: int) -> int:
    """Follows the gradient flow from ``y`` at alpha (N,) for at most ``steps`` steps: 1 at a stable equilibrium,
    0 if there is more to go, -1 if it does not come to rest.

    clock (3,) : time so far, next step, and the quiet that Newton waits for; to begin with 0, 0.1 and AT_REST.
    """
    U = scene.counts[N_UNKNOWNS]
    start, whole, half = bench.rows[0], bench.rows[1], bench.rows[2]
    for _ in range(steps):
        energy_gradient(scene, bench, tubes, rules, alpha)
        if twist_size(scene, scene.vectors[GRADIENT], COARSE) < clock[2]:
            for u in range(U):
                start[u] = scene.vectors[Y, u]
            taken, _ = correct(scene, bench, tubes, rules, alpha, False, 0.0)
            if taken > 0 and factorize(scene, bench, rules, COARSE, EXACT, 0.0, 0.0, -1.0):
                for u in range(U):
                    whole[u] = scene.vectors[Y, u] - start[u]
                if twist_size(scene, whole, COARSE) < LAST_WAY:
                    return 1
            for u in range(U):
                scene.vectors[Y, u] = start[u]
            clock[2] *= 0.1  # still drifting: wait until it is quieter before trying again
        for u in range(U):
            start[u] = scene.vectors[Y, u]
        good = euler_step(scene, bench, tubes, rules, alpha, clock[1], whole)
        good = good and euler_step(scene, bench, tubes, rules, alpha, 0.5 * clock[1], half)
        if good:
            for u in range(U):
                scene.vectors[Y, u] = half[u]
            good = euler_step(scene, bench, tubes, rules, alpha, 0.5 * clock[1], half)
        error = 1e300
        if good:
            for u in range(U):
                whole[u] = half[u] - whole[u]
            error = twist_size(scene, whole, COARSE)
        if error > FLOW_ERROR:
            for u in range(U):
                scene.vectors[Y, u] = start[u]
            clock[1] *= 0.25 if error > 1e299 else max(0.2, 0.8 * (FLOW_ERROR / error) ** 0.5)
            continue
        for u in range(U):
            scene.vectors[Y, u] = half[u] + whole[u]
        clock[0] += clock[1]
        clock[1] *= min(4.0, 0.8 * (FLOW_ERROR / max(error, 1e-12)) ** 0.5)
        if clock[0] > LONGEST_FLOW:
            return -1
    return 0
