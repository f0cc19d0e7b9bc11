"""Torques carried from the elements of one command to those of another: warm starts, and finer or coarser models."""

from __future__ import annotations

import math

from ctr_pvs.kernel.arrays import ANGLE
from ctr_pvs.kernel.arrays import ARC
from ctr_pvs.kernel.arrays import BEFORE
from ctr_pvs.kernel.arrays import COUPLED
from ctr_pvs.kernel.arrays import FIRST
from ctr_pvs.kernel.arrays import GAUSS
from ctr_pvs.kernel.arrays import LEAD
from ctr_pvs.kernel.arrays import LENGTH
from ctr_pvs.kernel.arrays import MU
from ctr_pvs.kernel.arrays import MU_SIZE
from ctr_pvs.kernel.arrays import N_ELEMENTS
from ctr_pvs.kernel.arrays import PLACE
from ctr_pvs.kernel.arrays import POLYNOMIAL
from ctr_pvs.kernel.arrays import ROOT
from ctr_pvs.kernel.arrays import ROW
from ctr_pvs.kernel.arrays import SCALE
from ctr_pvs.kernel.arrays import SEGMENT
from ctr_pvs.kernel.arrays import SIZE
from ctr_pvs.kernel.arrays import WEIGHT
from ctr_pvs.kernel.arrays import Array
from ctr_pvs.kernel.arrays import Scene
from ctr_pvs.kernel.arrays import Y
from ctr_pvs.kernel.compiler import compiled
from ctr_pvs.kernel.twist.fields import mu_scale
from ctr_pvs.kernel.twist.fields import spread_angles


@compiled
def alike(old: Scene, new: Scene) -> bool:
    """True if elements correspond one to one: the same segments, cut into as many parts."""
    if old.counts[N_ELEMENTS] != new.counts[N_ELEMENTS]:
        return False
    for m in range(old.counts[N_ELEMENTS]):
        for j in range(old.base.shape[1]):
            if old.parts[SEGMENT, m, j] != new.parts[SEGMENT, m, j]:
                return False
    return True


@compiled
def carry(old: Scene, new: Scene, rules: Array) -> None:
    """Gives ``new`` the unknowns whose torques are those of ``old``: coefficient by coefficient where elements
    correspond, else at equal arc lengths."""
    same = alike(old, new)
    for j in range(old.base.shape[1]):
        torque = guide_torque(old, j)
        new.vectors[Y, j] = new.base[ROOT, j] * torque
        for m in range(new.counts[N_ELEMENTS]):
            if new.parts[SIZE, m, j] == 0:
                continue
            first = new.parts[FIRST, m, j]
            if same:
                ratio = new.held[SCALE, m, j] / old.held[SCALE, m, j] if old.parts[SIZE, m, j] > 0 else 0.0
                for k in range(new.parts[SIZE, m, j]):
                    value = old.vectors[Y, old.parts[FIRST, m, j] + k] if k < old.parts[SIZE, m, j] else 0.0
                    new.vectors[Y, first + k] = ratio * value
            else:
                sample(old, new, rules, m, j)
    if new.counts[LEAD] > 0:
        carry_mu(old, new, rules, same)


@compiled
def carry_mu(old: Scene, new: Scene, rules: Array, same: bool) -> None:
    """Gives ``new`` the mu of ``old``, none where no load acted."""
    for m in range(new.counts[N_ELEMENTS]):
        size, first = new.marks[m, MU_SIZE], new.marks[m, MU]
        for k in range(2 * size):
            new.vectors[Y, first + k] = 0.0
        if same:
            before, ratio = old.marks[m, MU_SIZE], mu_scale(old, m) / mu_scale(new, m)
            for k in range(min(size, before)):
                for side in range(2):
                    value = old.vectors[Y, old.marks[m, MU] + side * before + k]
                    new.vectors[Y, first + side * size + k] = ratio * value
            continue
        G = new.marks[m, GAUSS]
        for g in range(G if size > 0 else 0):
            mu = mu_between(old, new.gauss[new.marks[m, ROW] + g, PLACE])
            mu *= rules[G, g, WEIGHT] / mu_scale(new, m)
            for k in range(size):
                new.vectors[Y, first + k] += mu.real * rules[G, g, POLYNOMIAL + k]
                new.vectors[Y, first + size + k] += mu.imag * rules[G, g, POLYNOMIAL + k]


@compiled
def mu_between(scene: Scene, s: float) -> complex:
    """mu [N m] at the arc length s [m]; none past the tips."""
    M = scene.counts[N_ELEMENTS]
    m = find_element(scene, s)
    if M == 0 or s > scene.line[M, ARC] or scene.marks[m, MU_SIZE] == 0:
        return 0j
    first, size = scene.marks[m, MU], scene.marks[m, MU_SIZE]
    x = 2.0 * (s - scene.line[m, ARC]) / scene.line[m, LENGTH] - 1.0
    value, before, here = 0j, 0.0, 1.0
    for k in range(size):
        y = complex(scene.vectors[Y, first + k], scene.vectors[Y, first + size + k])
        value += y * here * math.sqrt(2.0 * k + 1.0)
        before, here = here, ((2.0 * k + 1.0) * x * here - k * before) / (k + 1.0)
    return mu_scale(scene, m) * value


@compiled
def drop_finer(scene: Scene, finer: int) -> None:
    """Sets the unknowns of ``scene`` that only check, its ``finer`` highest degrees, to 0."""
    for m in range(scene.counts[N_ELEMENTS]):
        for j in range(scene.base.shape[1]):
            if scene.parts[SIZE, m, j] > 1:
                for k in range(scene.parts[SIZE, m, j] - finer, scene.parts[SIZE, m, j]):
                    scene.vectors[Y, scene.parts[FIRST, m, j] + k] = 0.0
        first, size = scene.marks[m, MU], scene.marks[m, MU_SIZE]
        for k in range(max(size - finer, 0), size):
            scene.vectors[Y, first + k], scene.vectors[Y, first + size + k] = 0.0, 0.0


@compiled
def sample(old: Scene, new: Scene, rules: Array, m: int, j: int) -> None:
    """The unknowns of tube j in element m of ``new`` whose torque is nearest to that of ``old``."""
    G, size, first = new.marks[m, GAUSS], new.parts[SIZE, m, j], new.parts[FIRST, m, j]
    for k in range(size):
        new.vectors[Y, first + k] = 0.0
    for g in range(G):
        row = new.marks[m, ROW] + g
        torque = torque_at(old, new.gauss[row, PLACE], j) * new.gauss[row, WEIGHT] / new.line[m, LENGTH]
        for k in range(size):
            new.vectors[Y, first + k] += new.held[SCALE, m, j] * torque * rules[G, g, POLYNOMIAL + k]


@compiled
def guide_torque(scene: Scene, j: int) -> float:
    """Torque [N m] of tube j in the guide; where that has no length, at the orifice."""
    if scene.base[ROOT, j] > 0.0:
        return float(scene.vectors[Y, j] / scene.base[ROOT, j])
    return torque_at(scene, 0.0, j)


@compiled
def torque_at(scene: Scene, s: float, j: int) -> float:
    """Torque [N m] of tube j at the arc length s [m]; none past the tips."""
    M = scene.counts[N_ELEMENTS]
    m = find_element(scene, s)
    if M == 0 or s > scene.line[M, ARC] or scene.parts[SIZE, m, j] == 0:
        return 0.0
    x = 2.0 * (s - scene.line[m, ARC]) / scene.line[m, LENGTH] - 1.0
    value, before, here = 0.0, 0.0, 1.0
    for k in range(scene.parts[SIZE, m, j]):
        value += scene.vectors[Y, scene.parts[FIRST, m, j] + k] * here * math.sqrt(2.0 * k + 1.0)
        before, here = here, ((2.0 * k + 1.0) * x * here - k * before) / (k + 1.0)
    return float(value / scene.held[SCALE, m, j])


@compiled
def find_element(scene: Scene, s: float) -> int:
    """The element that holds the arc length s [m]; a boundary counts to the one before it, the orifice to the first."""
    low, high = 0, max(scene.counts[N_ELEMENTS] - 1, 0)
    while low < high:
        middle = (low + high + 1) // 2
        if scene.line[middle, ARC] < s:
            low = middle
        else:
            high = middle - 1
    return low


@compiled
def angle_at(scene: Scene, s: float, j: int) -> float:
    """psi [rad] of tube j at the arc length s [m], from ``angle`` and the unknowns; past its tip its last angle."""
    M = scene.counts[N_ELEMENTS]
    if M == 0 or s >= scene.line[M, ARC]:
        return float(scene.held[ANGLE, M, j])
    m = find_element(scene, s)
    if scene.parts[SIZE, m, j] == 0:
        return float(scene.held[ANGLE, m, j])
    x = 2.0 * (s - scene.line[m, ARC]) / scene.line[m, LENGTH] - 1.0
    value = scene.vectors[Y, scene.parts[FIRST, m, j]] * 0.5 * (x + 1.0)
    before, here = 1.0, x
    for k in range(1, scene.parts[SIZE, m, j]):  # int_0^x P_k = (L_(k+1) - L_(k-1)) / (2 sqrt(2 k + 1))
        after = ((2.0 * k + 1.0) * x * here - k * before) / (k + 1.0)
        value += scene.vectors[Y, scene.parts[FIRST, m, j] + k] * (after - before) / (2.0 * math.sqrt(2.0 * k + 1.0))
        before, here = here, after
    return float(scene.held[ANGLE, m, j] + scene.held[SCALE, m, j] * value)


@compiled
def remember_from(old: Scene, new: Scene, rules: Array, alpha: Array) -> None:
    """Fills ``before`` of ``new``: psi of the state ``y`` at its base angles alpha (N,) [rad], at equal places of
    elements that correspond, else at equal arc lengths."""
    spread_angles(old, alpha, old.vectors[Y])
    same = alike(old, new)
    for m in range(new.counts[N_ELEMENTS]):
        if not new.marks[m, COUPLED]:
            continue
        for row in range(new.marks[m, ROW], new.marks[m, ROW] + new.marks[m, GAUSS]):
            for j in range(len(alpha)):
                s = new.gauss[row, PLACE]
                if same:
                    s = old.line[m, ARC] + (s - new.line[m, ARC]) * old.line[m, LENGTH] / new.line[m, LENGTH]
                new.turns[BEFORE, row, j] = angle_at(old, s, j)
