"""The relaxed robot: the base angles at which no actuator needs to hold a torque.  Every cold start sets out from
there.

It is a minimum of E over the twist *and* the base angles, at the commanded D.  Turning all tubes together changes
nothing, so tube 1 stays at 0.  Of several minima the one nearest to zero base angles is taken.
"""

from __future__ import annotations

import math

from ctr_pvs.kernel.arrays import COUPLED
from ctr_pvs.kernel.arrays import GAUSS
from ctr_pvs.kernel.arrays import GRADIENT
from ctr_pvs.kernel.arrays import LAST_ACTIVE
from ctr_pvs.kernel.arrays import N_ELEMENTS
from ctr_pvs.kernel.arrays import N_UNKNOWNS
from ctr_pvs.kernel.arrays import OTHER
from ctr_pvs.kernel.arrays import REST
from ctr_pvs.kernel.arrays import ROW
from ctr_pvs.kernel.arrays import STEP
from ctr_pvs.kernel.arrays import STIFFNESS
from ctr_pvs.kernel.arrays import TORQUE
from ctr_pvs.kernel.arrays import TURNED_BY
from ctr_pvs.kernel.arrays import WEIGHT
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
from ctr_pvs.kernel.twist.fields import FINE
from ctr_pvs.kernel.twist.newton import twist_size

#: With more tubes than this the starts no longer try every combination of half turns.
MANY_TUBES = 4
#: Base angles closer than this [rad] are one state.
SAME_ANGLE = 1e-5
#: A descent has ended when a full Newton step is shorter than this [rad]; steps it may take.
DESCENDED, MOST_DESCENT = 1e-11, 200
#: Along a soft direction rounding alone asks for steps up to this [rad]: there balance decides.
JITTER = 1e-3
#: Longest turn of a base in one step [rad], first and least shift of a Hessian that is not positive definite, and how
#: the shift changes after a good and a bad step.
LONGEST_TURN, FIRST_SHIFT, EASE, BRAKE = 1.0, 1e-3, 0.2, 8.0
#: A saddle is left by turns of about this size [rad], at most so often.
LEAVE_SADDLE, SADDLES = 0.1, 3
#: Torques below this share of the largest that bending could pull are none.
NO_TORQUE = 1e-13


@compiled
def wrapped(angle: float) -> float:
    """The angle in (-pi, pi]; a rounding error past -pi counts as +pi."""
    turn = 2.0 * math.pi
    rest = math.pi - angle + 1e-9
    return math.pi - (rest - turn * math.floor(rest / turn) - 1e-9)


@compiled
def bending_scale(scene: Scene) -> float:
    """A typical bending energy [J]: sum of |b|^2 / sum K over the coupled elements."""
    total = 0.0
    for m in range(scene.counts[N_ELEMENTS]):
        if scene.marks[m, COUPLED]:
            for row in range(scene.marks[m, ROW], scene.marks[m, ROW] + scene.marks[m, GAUSS]):
                for j in range(scene.base.shape[1]):
                    b = scene.moments[REST, row, j]
                    total += scene.gauss[row, WEIGHT] / scene.line[m, STIFFNESS] * (b.real * b.real + b.imag * b.imag)
    return max(total, 1e-300)


@compiled
def align(scene: Scene, out: Array, work: Array) -> None:
    """Base angles (N,) that align the tubes' mean pre-curvatures, that of tube 1 being 0: the phases of the strongest
    direction of sum b b^*, by its power iteration.  work (4, N) : room."""
    N = len(out)
    re, im, next_re, next_im = work[0], work[1], work[2], work[3]
    for j in range(N):
        re[j], im[j] = 1.0, 0.1 * j
    for _ in range(60):
        for j in range(N):
            next_re[j], next_im[j] = 1e-30, 0.0
        for m in range(scene.counts[N_ELEMENTS]):
            if scene.marks[m, COUPLED]:
                for row in range(scene.marks[m, ROW], scene.marks[m, ROW] + scene.marks[m, GAUSS]):
                    along = 0j
                    for j in range(N):
                        along += scene.moments[REST, row, j].conjugate() * complex(re[j], im[j])
                    along *= scene.gauss[row, WEIGHT] / scene.line[m, STIFFNESS]
                    for j in range(N):
                        value = scene.moments[REST, row, j] * along
                        next_re[j] += value.real
                        next_im[j] += value.imag
        size = 0.0
        for j in range(N):
            size += next_re[j] ** 2 + next_im[j] ** 2
        size = math.sqrt(size)
        for j in range(N):
            re[j], im[j] = next_re[j] / size, next_im[j] / size
    for j in range(N):
        strong = math.hypot(re[j], im[j]) > 1e-9
        out[j] = -math.atan2(im[j], re[j]) if strong else 0.0
    first = out[0]
    for j in range(N):
        strong = math.hypot(re[j], im[j]) > 1e-9
        out[j] = wrapped(out[j] - first) if strong else 0.0


@compiled
def is_balanced(scene: Scene, scale: float) -> bool:
    """True if no torque acts on any base, and none on the unknowns would twist."""
    for j in range(scene.base.shape[1]):
        if abs(scene.held[TORQUE, 0, j]) > NO_TORQUE * scale:
            return False
    return twist_size(scene, scene.vectors[GRADIENT], FINE) <= NO_TORQUE


@compiled
def at_rest(scene: Scene, bench: Bench, tubes: Array, rules: Array, alpha: Array, scale: float) -> bool:
    """True if no torque acts on any base or unknown at ``y``, and the energy is convex there."""
    energy_gradient(scene, bench, tubes, rules, alpha)
    if not is_balanced(scene, scale):
        return False
    return factorize(scene, bench, rules, FINE, EXACT, 0.0, 0.0, 1e-9 * scale)


@compiled
def descend(scene: Scene, bench: Bench, tubes: Array, rules: Array, alpha: Array, scale: float) -> bool:
    """Goes down from ``y`` and the base angles alpha (N,), both changed, to a minimum; false if none is reached.

    Newton with a shifted Hessian, accepted where the energy falls."""
    shift, saddles = 0.0, 0
    value = energy_value(scene, tubes, rules, alpha)
    for _ in range(MOST_DESCENT):
        energy_gradient(scene, bench, tubes, rules, alpha)
        while not factorize(scene, bench, rules, FINE, EXACT, 0.0, shift, max(shift, 1e-12) * scale):
            shift = max(FIRST_SHIFT, BRAKE * shift)
        longest = free_step(scene, bench, alpha)
        if longest < DESCENDED or (longest < JITTER and is_balanced(scene, scale)):
            if shift == 0.0:
                return True
            if not factorize(scene, bench, rules, FINE, EXACT, 0.0, 0.0, 1e-9 * scale):
                saddles += 1
                if saddles > SADDLES:
                    return False
                for j in range(1, len(alpha)):
                    alpha[j] += LEAVE_SADDLE * (1.0 - 0.3 * j)
                value = energy_value(scene, tubes, rules, alpha)
            shift = 0.0
            continue
        share = min(1.0, LONGEST_TURN / longest)
        take_step(scene, bench, alpha, share)
        ahead = energy_value(scene, tubes, rules, alpha)
        if ahead <= value + 1e-14 * scale:
            value = ahead
            shift = shift * EASE if shift * EASE > 1e-9 else 0.0
        else:
            take_step(scene, bench, alpha, -share)
            shift = max(FIRST_SHIFT, BRAKE * shift)
            if shift > 1e12:
                return False
    return False


@compiled
def free_step(scene: Scene, bench: Bench, alpha: Array) -> float:
    """Newton's step of unknowns and base angles into ``step`` and ``TURNED_BY``; its longest turn [rad]."""
    for u in range(scene.counts[N_UNKNOWNS]):
        scene.vectors[OTHER, u] = -scene.vectors[GRADIENT, u]
    for j in range(len(alpha)):
        bench.lines[TURNED_BY, j] = -scene.held[TORQUE, 0, j]
    substitute(scene, bench, FINE, scene.vectors[OTHER], bench.lines[TURNED_BY], scene.vectors[STEP], True)
    longest = twist_size(scene, scene.vectors[STEP], FINE)
    for j in range(len(alpha)):
        longest = max(longest, abs(bench.lines[TURNED_BY, j]))
    return longest


@compiled
def take_step(scene: Scene, bench: Bench, alpha: Array, share: float) -> None:
    """Moves unknowns and base angles by a share of the step."""
    for u in range(scene.counts[N_UNKNOWNS]):
        scene.vectors[Y, u] += share * scene.vectors[STEP, u]
    for j in range(len(alpha)):
        alpha[j] += share * bench.lines[TURNED_BY, j]


@compiled
def nearer(a: Array, b: Array) -> bool:
    """True if base angles a (N,) are nearer to zero than b; of equals, those with the larger first angle that
    differs."""
    size_a, size_b = 0.0, 0.0
    for j in range(len(a)):
        size_a, size_b = max(size_a, abs(a[j])), max(size_b, abs(b[j]))
    if abs(size_a - size_b) > 1e-6:
        return size_a < size_b
    for j in range(len(a)):
        if abs(a[j] - b[j]) > 1e-6:
            return bool(a[j] > b[j])
    return False


@compiled
def relax(scene: Scene, bench: Bench, tubes: Array, rules: Array, best: Array, work: Array) -> int:
    """The relaxed state: base angles into ``best`` (N,), unknowns into ``y``.

    1: found; 2: found, and others are as near to zero; 0: the search finds no minimum.  work (6, N) : room.
    """
    N = len(best)
    alpha, aligned, best_y = work[0], work[1], bench.rows[0]
    scale = bending_scale(scene)
    for j in range(N):
        best[j] = alpha[j] = 0.0
    for u in range(scene.counts[N_UNKNOWNS]):
        scene.vectors[Y, u] = 0.0
    if scene.counts[LAST_ACTIVE] == 0 or at_rest(scene, bench, tubes, rules, alpha, scale):
        return 1
    align(scene, aligned, work[2:6])
    starts = 2 ** (N - 1) if N <= MANY_TUBES else 1
    found, several = 0, False
    for start in range(-1, starts):
        for j in range(N):
            alpha[j] = 0.0 if start < 0 else aligned[j]
            if start >= 0 and j > 0 and (start >> (j - 1)) & 1:
                alpha[j] += math.pi
        for u in range(scene.counts[N_UNKNOWNS]):
            scene.vectors[Y, u] = 0.0
        if not descend(scene, bench, tubes, rules, alpha, scale):
            continue
        apart, size, size_best = 0.0, 0.0, 0.0
        for j in range(N):
            alpha[j] = wrapped(alpha[j])
            apart = max(apart, abs(alpha[j] - best[j]))
            size, size_best = max(size, abs(alpha[j])), max(size_best, abs(best[j]))
        if found and apart > SAME_ANGLE and abs(size - size_best) < SAME_ANGLE:
            several = True
        elif found and size < size_best - SAME_ANGLE:
            several = False
        if not found or nearer(alpha, best):
            for j in range(N):
                best[j] = alpha[j]
            for u in range(scene.counts[N_UNKNOWNS]):
                best_y[u] = scene.vectors[Y, u]
        found = 1
    for u in range(scene.counts[N_UNKNOWNS]):
        scene.vectors[Y, u] = best_y[u]
    for j in range(N):
        if abs(abs(best[j]) - math.pi) < SAME_ANGLE:  # +pi and -pi: one shape, two histories
            several = True
    return 2 if found and several else found
