"""Gauss collocation on [0, 1]: integration and interpolation matrices, and how many nodes a curvature law needs.

Reference: E. Hairer, C. Lubich, G. Wanner, "Geometric Numerical Integration", sections II.1.3 and IV.2: the end of a
Gauss collocation step is of twice the order of what lies between, and keeps quadratic invariants.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.basis import gauss_legendre
from ctr_pvs.basis import legendre

Array = NDArray[np.float64]

#: Most nodes of one piece: beyond, two halves are cheaper than a system of all of it.  Fewest: no rate is quite exact.
MOST_NODES = 20
FEWEST_NODES = 3
#: Relative error that rounding leaves.
FLOOR = 1e-14
#: log of the error that poles of the twist would leave with no nodes, and of a margin on every estimate: with these the
#: rule holds for random laws.
LOG_POLES = math.log(0.01)
LOG_MARGIN = math.log(3.0)
#: log of G! / (2 G (2G)!) for each G.
LOG_BETWEEN = [math.lgamma(g + 1) - math.lgamma(2 * g + 1) - math.log(2 * max(g, 1)) for g in range(MOST_NODES + 1)]


class Collocation:
    """Tables of ``nodes`` = G Gauss points x_i, complex where they meet complex values.

    weights (G,) of the quadrature; integrals (G + 1, G) from values at the nodes to the interpolant's integrals from 0
    to each of them and to 1; pairs (G G, G) : row (j, i) holds integrals[i, l] integrals[l, j] over l; identity (G G,);
    ones (G,); half_roll (G + 2, G) real: to half the interpolant at 0, at the nodes and at 1; end (G,): to the last.
    spinors (2, G + 2), rates (5, G + 1): what does not change in the tables of ``Bend.trace``, to be copied.
    """

    __slots__ = ("end", "half_roll", "identity", "integrals", "ones", "pairs", "rates", "spinors", "start", "weights")

    def __init__(self, nodes: int) -> None:
        rule = gauss_legendre(nodes)
        first, last = interpolation(nodes, np.array([0.0, 1.0]))[0]
        inside = interpolation(nodes, rule.x)[1]
        self.weights = rule.weights.astype(complex)
        self.integrals = np.vstack([inside, rule.weights]).astype(complex)
        self.pairs = np.einsum("il,lj->jil", inside, inside).reshape(-1, nodes).astype(complex, order="C")
        self.identity = np.eye(nodes, dtype=complex).ravel()
        self.ones = np.ones(nodes, dtype=complex)
        self.half_roll = 0.5 * np.vstack([first, np.eye(nodes), last])
        self.start, self.end = first.copy(), last.copy()
        self.spinors = np.zeros((2, nodes + 2), dtype=complex)
        self.spinors[0, 0] = 1.0
        self.rates = np.zeros((5, nodes + 1))
        self.rates[3, :-1] = self.rates[4, -1] = 1.0


@lru_cache(maxsize=64)
def collocation(nodes: int) -> Collocation:
    """The tables of ``nodes`` Gauss points, computed once."""
    return Collocation(nodes)


def interpolation(nodes: int, x: Array) -> tuple[Array, Array]:
    """(g, G) matrices from values at the ``nodes`` Gauss points to the interpolant at ``x`` (g,), and to its integral
    from 0."""
    values, integrals = squared_sines(nodes, x) @ interpolator(nodes)
    return values, integrals


def squared_sines(degree: int, x: Array) -> Array:
    """(g, degree + 1) 1 and sin^2(k phi) for k = 1, .. at x = sin^2 phi: polynomials of degree k in ``x`` (g,).

    They are (1 - T_k(1 - 2 x)) / 2 with Chebyshev's T_k, as good to expand in; at 0 all but the first are exactly 0.
    """
    out: Array = np.sin(np.arcsin(np.sqrt(x))[:, None] * np.arange(degree + 1.0))
    out *= out
    out[:, 0] = 1.0
    return out


@lru_cache(maxsize=64)
def interpolator(nodes: int) -> Array:
    """(2, G + 1, G) from values at the ``nodes`` Gauss points to the expansions, in ``squared_sines``, of the
    interpolant and of its integral from 0; by its Legendre expansion."""
    rule = gauss_legendre(nodes)
    weighted = legendre(nodes - 1, rule.x)[0].T * rule.weights
    x = np.sin(np.linspace(0.0, 0.5 * np.pi, nodes + 1)) ** 2
    tables = np.stack(legendre(nodes - 1, x)) @ weighted
    table = np.linalg.solve(squared_sines(nodes, x), tables).astype(float)
    table[1, 0] = 0.0  # there is no integral at 0
    table.flags.writeable = False
    return table


def closed_interpolation(nodes: int, x: Array) -> Array:
    """(g, G + 2) matrix from values at 0, at the ``nodes`` Gauss points and at 1 to the interpolant at ``x`` (g,)."""
    ends = np.array([0.0, 1.0])
    highest = legendre(nodes, np.concatenate([ends, x]))[0][:, -1]  # vanishes at the Gauss points
    first, last = highest[2:] * (1.0 - x) / highest[0], highest[2:] * x / highest[1]
    inside, (at_start, at_end) = interpolation(nodes, x)[0], interpolation(nodes, ends)[0]
    inside = inside - np.outer(first, at_start) - np.outer(last, at_end)
    return np.column_stack([first, inside, last])


def nodes_needed(length: float, curvature: float, rate: float, wave: float, relative: float) -> tuple[int, int]:
    """How to integrate a bend of ``length`` [m]: a number of equal parts, and of Gauss nodes on each.

    curvature : largest |k| [1/m]; rate : how fast k turns or changes [rad/m], the twist rate for curvatures that twist.
    wave : sqrt(coupling) / length [rad/m], 0 without coupling: twist that tubes give each other follows a pendulum's
        equation, whose poles lie pi / (2 wave) or more from the real axis.
    relative : error in position, at the end and in between, over the length of the rod.

    A factor that turns at a constant rate is resolved like (omega h)^G G! / (2G (2G)!) between the nodes, and better at
    the end; poles at the distance d/h let that fall like rho^-G only, with Bernstein's ellipse through them.
    """
    log_error = math.log(max(relative, FLOOR)) - LOG_MARGIN
    parts = 1
    while True:
        h = length / parts
        pole = max(wave, 0.5 * rate) * h if wave else 0.0
        nodes = _nodes((curvature + rate) * h, pole, log_error)
        if nodes <= MOST_NODES:
            return parts, nodes
        parts *= 2


def _nodes(omega: float, pole: float, log_error: float) -> int:
    """Gauss nodes for a turning rate and an inverse distance of poles relative to the piece; one too many if it takes
    more than the most."""
    fewest = FEWEST_NODES
    if pole:
        axis = math.pi / pole
        decay = math.log(axis + math.sqrt(axis * axis + 1.0))
        fewest = max(fewest, math.ceil((LOG_POLES - log_error) / decay))
    log_omega = math.log(max(omega, FLOOR))
    for nodes in range(fewest, MOST_NODES + 1):
        if nodes * log_omega + LOG_BETWEEN[nodes] <= log_error:
            return nodes
    return MOST_NODES + 1
