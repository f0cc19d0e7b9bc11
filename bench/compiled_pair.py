"""Two tubes, compiled: Newton for the twist, and the backbone, written out by hand for Numba.

Only for two uniform tubes that are both curved in one section beyond the orifice, with constant curvatures; before and
after it at most one of them is.  With the relative twist theta = psi_2 - psi_1 and the torque T of tube 2 (tube 1 has
-T), constant up to that section and a polynomial in it,

    E = lead T_0^2 / 2 + int (g T^2 / 2 - w cos(theta + phase)) ds,   theta = alpha_2 - alpha_1 + lead T_0 + int g T ds,

with g = 1 / GJ_1 + 1 / GJ_2 and w = K_1 K_2 |kappa_1 kappa_2| / (K_1 + K_2).

What the arrays of ``numba_kernel.Pair`` mean: ``pair`` = start and length of the section, length of the robot, lead, g,
w, phase, and per tube 1 / GJ and D.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

START, LENGTH, TOTAL, LEAD, SOFT, WELL, PHASE, SOFT_1, SOFT_2, D_1, D_2 = range(11)
LAST_STEP, MAX_STEPS = 1e-8, 12
ROOT_15, ROOT_06 = math.sqrt(15.0), math.sqrt(0.6)


@njit
def solve(pair, integrals, weights, alpha, q):
    """Newton from ``q`` (n,), [T_0, coefficients of T], which is overwritten; the number of steps, or -1.

    integrals (g, n - 1) : of the functions of T from 0 to the Gauss points; weights (g,).
    """
    nodes, n = integrals.shape[0], q.shape[0]
    soft, h = pair[SOFT], pair[LENGTH]
    gradient, hessian, slope = np.empty(n), np.empty((n, n)), np.empty(n)
    slope[0] = pair[LEAD]
    for count in range(1, MAX_STEPS + 1):
        hessian[:] = 0.0
        gradient[0] = pair[LEAD] * q[0]
        hessian[0, 0] = pair[LEAD]
        for k in range(1, n):
            gradient[k] = h * soft * q[k]
            hessian[k, k] = h * soft
        for g in range(nodes):
            theta = alpha[1] - alpha[0] + pair[PHASE] + pair[LEAD] * q[0]
            for k in range(1, n):
                slope[k] = h * soft * integrals[g, k - 1]
                theta += slope[k] * q[k]
            force = pair[WELL] * h * weights[g] * math.sin(theta)
            stiffness = pair[WELL] * h * weights[g] * math.cos(theta)
            for i in range(n):
                gradient[i] += force * slope[i]
                for k in range(i + 1):
                    hessian[i, k] += stiffness * slope[i] * slope[k]
        if not cholesky_step(hessian, gradient):
            return -1
        size = abs(pair[LEAD] * gradient[0])
        for k in range(1, n):
            size += abs(h * soft * gradient[k])
        for k in range(n):
            q[k] -= gradient[k]
        if size < LAST_STEP:
            return count
    return -1


@njit
def cholesky_step(a, b):
    """Solve a x = b in place, from the lower half of ``a``; false if ``a`` is not positive definite."""
    n = b.shape[0]
    for j in range(n):
        for k in range(j):
            a[j, j] -= a[j, k] * a[j, k]
        if not a[j, j] > 0.0:
            return False
        a[j, j] = math.sqrt(a[j, j])
        for i in range(j + 1, n):
            for k in range(j):
                a[i, j] -= a[i, k] * a[j, k]
            a[i, j] /= a[j, j]
    for i in range(n):
        for k in range(i):
            b[i] -= a[i, k] * b[k]
        b[i] /= a[i, i]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            b[i] -= a[k, i] * b[k]
        b[i] /= a[i, i]
    return True


@njit
def twist(pair, q, s):
    """Angles of both tubes at ``s`` less their base angles."""
    along = min(max((s - pair[START]) / pair[LENGTH], 0.0), 1.0)
    inside = 0.0
    if along > 0.0:  # orthonormal Legendre polynomials, integrated
        y = 2.0 * along - 1.0
        before, here = 1.0, y
        inside = q[1] * along
        for k in range(1, q.shape[0] - 1):
            after = ((2.0 * k + 1.0) * y * here - k * before) / (k + 1.0)
            inside += q[k + 1] * (after - before) / (2.0 * math.sqrt(2.0 * k + 1.0))
            before, here = here, after
        inside *= pair[LENGTH]
    reach = min(s, pair[START])
    one = -pair[SOFT_1] * (q[0] * (pair[D_1] + reach) + inside)
    two = pair[SOFT_2] * (q[0] * (pair[D_2] + reach) + inside)
    return one, two


@njit
def curvature(pair, moments, m, q, alpha, s):
    """k_y, k_z of the backbone at ``s`` in section m; moments (sections, 4) : of both tubes over their stiffness."""
    one, two = twist(pair, q, s)
    one, two = alpha[0] + one, alpha[1] + two
    c1, s1, c2, s2 = math.cos(one), math.sin(one), math.cos(two), math.sin(two)
    y = moments[m, 0] * c1 - moments[m, 1] * s1 + moments[m, 2] * c2 - moments[m, 3] * s2
    z = moments[m, 0] * s1 + moments[m, 1] * c1 + moments[m, 2] * s2 + moments[m, 3] * c2
    return y, z


@njit
def bracket(a, b, out):
    """Lie bracket of se(3), rotations first."""
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]
    out[3] = a[1] * b[5] - a[2] * b[4] + a[4] * b[2] - a[5] * b[1]
    out[4] = a[2] * b[3] - a[0] * b[5] + a[5] * b[0] - a[3] * b[2]
    out[5] = a[0] * b[4] - a[1] * b[3] + a[3] * b[1] - a[4] * b[0]


@njit
def advance(frame, h, k, work):
    """``frame`` (3, 4) over one step of length ``h``, with curvatures ``k`` (3, 2) at its Gauss points: sixth-order
    Magnus."""
    first, second, third, inner, outer, sum_1, sum_2 = work
    for part in (first, second, third):
        part[:] = 0.0
    for i in range(2):
        first[1 + i] = h * k[1, i]
        second[1 + i] = ROOT_15 / 3.0 * h * (k[2, i] - k[0, i])
        third[1 + i] = 10.0 / 3.0 * h * (k[2, i] - 2.0 * k[1, i] + k[0, i])
    first[3] = h
    bracket(second, first, inner)
    for i in range(6):
        sum_1[i] = 2.0 * third[i] + inner[i]
    bracket(first, sum_1, outer)
    for i in range(6):
        sum_1[i] = -20.0 * first[i] - third[i] + inner[i]
        sum_2[i] = second[i] + outer[i] / 60.0
    bracket(sum_1, sum_2, outer)
    for i in range(6):
        first[i] += third[i] / 12.0 - outer[i] / 240.0
    move(frame, first)


@njit
def move(frame, v):
    """``frame`` times the exponential of ``v`` (6,)."""
    x, y, z = v[0], v[1], v[2]
    square = x * x + y * y + z * z
    angle = math.sqrt(square)
    if angle < 1e-2:
        one = 1.0 - square / 6.0 * (1.0 - square / 20.0)
        half = 0.5 - square / 24.0 * (1.0 - square / 30.0)
        sixth = 1.0 / 6.0 - square / 120.0 * (1.0 - square / 42.0)
    else:
        one = math.sin(angle) / angle
        half = 2.0 * (math.sin(0.5 * angle) / angle) ** 2
        sixth = (angle - math.sin(angle)) / (square * angle)
    dot = x * v[3] + y * v[4] + z * v[5]
    cx, cy, cz = y * v[5] - z * v[4], z * v[3] - x * v[5], x * v[4] - y * v[3]
    px = v[3] * (1.0 - sixth * square) + half * cx + sixth * dot * x
    py = v[4] * (1.0 - sixth * square) + half * cy + sixth * dot * y
    pz = v[5] * (1.0 - sixth * square) + half * cz + sixth * dot * z
    c = 1.0 - half * square
    for i in range(3):
        a, b, d = frame[i, 0], frame[i, 1], frame[i, 2]
        frame[i, 3] += a * px + b * py + d * pz
        along = half * (a * x + b * y + d * z)
        frame[i, 0] = c * a + one * (b * z - d * y) + along * x
        frame[i, 1] = c * b + one * (d * x - a * z) + along * y
        frame[i, 2] = c * d + one * (a * y - b * x) + along * z


@njit
def backbone(pair, bounds, moments, alpha, q, stops, longest, positions, orientations):
    """Positions (n, 3) and quaternions (n, 4) of the inner tube's frame at increasing ``stops`` (n,); steps no longer
    than ``longest`` (sections,)."""
    frame = np.zeros((3, 4))
    for i in range(3):
        frame[i, i] = 1.0
    work = (np.empty(6), np.empty(6), np.empty(6), np.empty(6), np.empty(6), np.empty(6), np.empty(6))
    k = np.empty((3, 2))
    s, m = 0.0, 0
    for index in range(stops.shape[0]):
        while s < stops[index]:
            while bounds[m + 1] <= s:
                m += 1
            end = min(stops[index], bounds[m + 1])
            count = max(1, math.ceil((end - s) / longest[m] - 1e-9))
            h = (end - s) / count
            for step in range(count):
                middle = s + (step + 0.5) * h
                for i in range(3):
                    k[i] = curvature(pair, moments, m, q, alpha, middle + 0.5 * h * ROOT_06 * (i - 1))
                advance(frame, h, k, work)
            s = end
        for i in range(3):
            positions[index, i] = frame[i, 3]
        quaternion(frame, alpha[1] + twist(pair, q, s)[1], orientations[index])


@njit
def quaternion(frame, roll, out):
    """x, y, z, w of ``frame`` turned about its tangent by ``roll``; w is not negative before the turn."""
    r = frame
    w = 0.5 * math.sqrt(max(0.0, 1.0 + r[0, 0] + r[1, 1] + r[2, 2]))  # no backbone here bends back by half a turn
    x, y, z = (r[2, 1] - r[1, 2]) / (4.0 * w), (r[0, 2] - r[2, 0]) / (4.0 * w), (r[1, 0] - r[0, 1]) / (4.0 * w)
    c, s = math.cos(0.5 * roll), math.sin(0.5 * roll)
    out[0], out[1], out[2], out[3] = x * c + w * s, y * c + z * s, z * c - y * s, w * c - x * s
