"""Tips of many rods at once: the pieces of ``backbone_plan`` with arrays over the rows.

A state of the rod (a, b, p, r) is that of ``pieces``, each an array (rows,); the arc length is known beforehand.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.basis import gauss_legendre
from ctr_pvs.batch_layout import Geometry
from ctr_pvs.batch_layout import hashed
from ctr_pvs.batch_linear import circle
from ctr_pvs.batch_linear import product
from ctr_pvs.batch_tables import Tables
from ctr_pvs.batch_values import Values
from ctr_pvs.collocation import FEWEST_NODES
from ctr_pvs.collocation import FLOOR
from ctr_pvs.collocation import LOG_BETWEEN
from ctr_pvs.collocation import LOG_MARGIN
from ctr_pvs.collocation import LOG_POLES
from ctr_pvs.collocation import MOST_NODES
from ctr_pvs.collocation import Collocation
from ctr_pvs.collocation import collocation
from ctr_pvs.pieces import TINY
from ctr_pvs.sections import ABSENT

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
Indices = NDArray[np.int64]
State: TypeAlias = tuple[ComplexArray, ComplexArray, ComplexArray, Array]

#: Half the angle [rad] of one piece up to which it is solved by going round, and when that has converged.
MILD = 1.5
ROUND_OFF = 1e-17


def tips(values: Values, u: Array, alpha: Array, tolerance: float) -> tuple[Array, Array]:
    """Positions (3, rows) [m] and orientations (4, rows) of the tips for unknowns ``u`` (n, rows) and ``alpha``
    (N, rows), integrated for an error of ``tolerance`` [m]."""
    geometry, features = values.geometry, values.features(u)
    division = _division(values, tolerance)
    if division.shape[-1] == 1:
        return _Rods(values.tables, geometry, division[..., 0], features, alpha).tips()
    position, orientation = np.empty((3, u.shape[1])), np.empty((4, u.shape[1]))
    key = hashed(division.reshape(-1, division.shape[-1]))
    for value in np.unique(key):
        rows = np.flatnonzero(key == value)
        part = Geometry(geometry.layout, geometry.D[:, rows])
        rods = _Rods(values.tables, part, division[..., rows[0]], features[:, rows], alpha[:, rows])
        position[:, rows], orientation[:, rows] = rods.tips()
    return position, orientation


class _Rods:
    """Rods of one layout; ``division`` (M, 2) parts and Gauss points of each section, 0 for an arc."""

    def __init__(self, tables: Tables, geometry: Geometry, division: Indices, features: Array, alpha: Array) -> None:
        self.tables, self.geometry, self.division = tables, geometry, division.tolist()
        self.layout, self.materials = tables.layout, tables.layout.materials
        self.features, self.alpha = features, alpha
        self.torque = features[len(features) - tables.tubes :]

    def tips(self) -> tuple[Array, Array]:
        state: State | None = None
        for m, (parts, nodes) in enumerate(self.division):
            for piece, h in self._bends(m, parts, nodes) if nodes else [self._arc(m)]:
                state = piece if state is None else _advance(state, piece, h)
        if state is None:  # nothing is out
            state = np.ones(1, dtype=complex), np.zeros(1, dtype=complex), np.zeros(1, dtype=complex), np.zeros(1)
        a, b, p, r = state
        cos, sin = circle(0.5 * self._end_roll())
        turn = _complex(cos, sin) / np.sqrt(_square(a) + _square(b))
        a, b = a * turn, b * turn.conj()
        orientation = np.array([a.imag, b.real, b.imag, a.real])
        position = np.empty((3, orientation.shape[1]))
        position[0], position[1], position[2] = self.geometry.length - 2.0 * r, 2.0 * p.imag, -2.0 * p.real
        return position, orientation

    def _end_roll(self) -> Array:
        leader = self.materials.domain.leader
        last = self.layout.sections - 1
        return self._angles(last, leader, (1.0,))[0] if last >= 0 else self.alpha[leader]

    def _angles(self, m: int, tube: int, x: tuple[float, ...]) -> Array:
        """(g, rows) psi at the places ``x`` of section m."""
        if m < self.layout.first or not self.layout.coupled:
            before = self.geometry.lead_before(m)[tube]
            soft = before + np.array(x)[:, None] * (self.geometry.lengths[m] * self.layout.softness[m, tube])
            return np.asarray(self.alpha[tube] + soft * self.torque[tube])
        psi = product(self.tables.angle_rows(m, x, self.tables.n)[:, tube], self.features)
        psi += self.alpha[tube]
        return np.asarray(psi)

    def _share(self, m: int, tube: int, x: tuple[float, ...]) -> ComplexArray:
        bending = self.materials.bending[m]
        return self.geometry.pre_curvature(m, tube, np.array(x)) * (bending[tube] / bending.sum())

    def _arc(self, m: int) -> tuple[State, Array]:
        """See ``pieces.Arc``: the strain is constant in a frame that turns with the curvature."""
        curved = self.layout.curved(m)
        h: Array = self.geometry.lengths[m]
        if not curved:
            zero: ComplexArray = np.zeros(1, dtype=complex)
            return (zero + 1.0, zero, zero, np.zeros(1)), h
        tube = curved[0]
        turn: Array | float = self.materials.segment(tube, int(self.materials.domain.segment[m, tube])).turn
        if m > self.layout.last:  # no torque is left that could twist the tube
            psi = self._angles(m, tube, (0.0,))[0]
        else:
            psi, end = self._angles(m, tube, (0.0, 1.0))
            turn = turn + (end - psi) / h
        share = self._share(m, tube, (0.0,))[0]
        omega = np.hypot(turn, np.abs(share)) + TINY
        cos, sin = circle(0.5 * omega * h)
        bent, turned = (share / omega) * _complex(*circle(psi)), turn / omega
        far = 0.5 * h - sin * cos / omega
        p = bent * _complex(sin * sin / omega, turned * far)
        r = far * (np.abs(share) / omega) ** 2
        a, b = _complex(cos, turned * sin), bent * sin
        if np.any(turn):
            e = _complex(*circle(0.5 * turn * h))
            a, b = a * e.conj(), b * e
        return (a, b, p, np.asarray(r)), h

    def _bends(self, m: int, parts: int, nodes: int) -> Iterator[tuple[State, Array]]:
        count = parts * self.tables.space.basis(m).panels
        x = tuple(gauss_legendre(nodes, count).x.tolist())
        h = self.geometry.lengths[m] / count
        half = np.zeros((len(x), self.alpha.shape[1]), dtype=complex)
        most = np.zeros(1)
        for tube in self.layout.curved(m):
            share = self._share(m, tube, x) * (0.5 * h)
            half += share * _complex(*circle(self._angles(m, tube, x)))
            most = most + np.abs(share).max(axis=0)
        for start in range(0, len(x), nodes):
            yield _bend(half[start : start + nodes], float(most.max()), h), h


def _bend(half: ComplexArray, most: float, h: Array) -> State:
    """From the identity at the start: a, b, p, r at the end of bends of length ``h`` with half the curvature times the
    length ``half`` (G, rows), of size ``most`` at most; see ``pieces.Bend``.

    Where the bend is mild the fixed point a = 1 - S conj(K) b, b = S K a is found by going round: like the series of a
    cosine, it converges faster than the system can be eliminated.
    """
    nodes = len(half)
    table = collocation(nodes)
    inside, weights = table.integrals.real[:nodes], table.weights.real
    if most < MILD:
        a, product, b = _rounds(half, most, inside)
    else:
        a = _eliminated(half, table)
        product = half * a
        b = _applied(inside, product)
    conj = half.conj()
    conj *= b
    fall = _applied(weights[None], conj)[0]
    B = _applied(weights[None], product)[0]
    r = weights @ _square(b)
    p = _applied(weights[None], a * b)[0]
    return 1.0 - fall, B, h * p, h * r


def _rounds(half: ComplexArray, most: float, inside: Array) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    """a, K a and b at the nodes."""
    conj = half.conj()
    product = half
    b = _applied(inside, half)
    term, count = 0.5 * most * most, 2
    spare = np.empty_like(half)
    while True:
        np.multiply(conj, b, out=spare)
        a = _applied(inside, spare)
        np.subtract(1.0, a, out=a)
        product = np.multiply(half, a, out=spare)
        b = _applied(inside, product)
        term *= most * most / ((count + 1) * (count + 2))
        count += 2
        if term < ROUND_OFF:
            return a, product, b


def _eliminated(half: ComplexArray, table: Collocation) -> ComplexArray:
    """a at the nodes, by the matrix of ``pieces.Bend.solve``."""
    nodes, rows = half.shape
    matrix = (table.pairs.real @ half.conj()).reshape(nodes, nodes, rows) * half[:, None]
    matrix = matrix.transpose(2, 1, 0) + np.eye(nodes)
    return np.ascontiguousarray(np.linalg.solve(matrix, np.ones((nodes, 1)))[:, :, 0].T)


def _advance(state: State, piece: State, h: Array) -> State:
    """A piece appended; see ``pieces.Bend.advance``."""
    a, b, p, r = state
    A, B, P, R = piece
    left = h - 2.0 * R
    conj = b.conj()
    ab = a * b
    p = p + ab * left + a * a * P - b * b * P.conj()
    r = r + R + _square(b) * left + 2.0 * (a * conj * P).real
    return a * A - b * B.conj(), a * B + b * A.conj(), p, r


def _applied(table: Array, values: ComplexArray) -> ComplexArray:
    """A real matrix times complex values (G, rows)."""
    return product(table, values.view(float)).view(complex)


def _complex(real: Array, imag: Array) -> ComplexArray:
    out = np.empty(np.shape(real), dtype=complex)
    out.real, out.imag = real, imag
    return out


def _square(z: ComplexArray) -> Array:
    return z.real * z.real + z.imag * z.imag


def _division(values: Values, tolerance: float) -> Indices:
    """(M, 2, K) parts and Gauss points of each section, 0 where it is an arc; as ``backbone_cuts`` has them."""
    if tolerance not in values.divisions:
        values.divisions[tolerance] = _divided(values, tolerance)
    return values.divisions[tolerance]


def _divided(values: Values, tolerance: float) -> Indices:
    tables = values.tables
    layout, geometry = tables.layout, values.geometry
    materials, segments = layout.materials, layout.materials.domain.segment
    strongest = np.abs(tables.turns).T @ values.amplitude  # (N, K) torques that tubes can exert
    relative = tolerance / np.maximum(geometry.length, tolerance)
    places = np.linspace(0.0, 1.0, 9)
    out = np.zeros((layout.sections, 2, geometry.D.shape[1]), dtype=np.int64)
    for m in range(layout.sections):
        curved = layout.curved(m)
        if m not in layout.coupled and all(
            len(materials.segment(j, int(segments[m, j])).curvature) == 1 for j in curved
        ):
            continue
        bending = materials.bending[m]
        present = np.flatnonzero(segments[m] != ABSENT).tolist()
        share = [np.abs(geometry.pre_curvature(m, j, places)) * (bending[j] / bending.sum()) for j in curved]
        bend = sum(share).max(axis=0)
        step = geometry.lengths[m] / (len(places) - 1)
        change = sum(np.abs(np.diff(part, axis=0)) for part in share).max(axis=0) / step
        turn = max(abs(materials.segment(j, int(segments[m, j])).turn) for j in present)
        twist = np.max([strongest[j] * layout.softness[m, j] for j in present], axis=0)
        length = geometry.lengths[m] / tables.space.basis(m).panels
        wave = np.sqrt(geometry.coupling(m)) / geometry.lengths[m] if m in layout.coupled else np.zeros(1)
        rate = np.maximum(twist + turn, np.divide(change, bend, out=np.zeros_like(change), where=bend > 0.0))
        out[m] = _nodes_needed(*np.broadcast_arrays(length, bend, rate, wave, relative))
    return out


def _nodes_needed(length: Array, curvature: Array, rate: Array, wave: Array, relative: Array) -> Indices:
    """(2, K) ``collocation.nodes_needed``."""
    log_error = np.log(np.maximum(relative, FLOOR)) - LOG_MARGIN
    parts = np.ones(len(length), dtype=np.int64)
    while True:
        h = length / parts
        axis = np.pi / np.maximum(np.maximum(wave, 0.5 * rate) * h, FLOOR)
        poles = np.ceil((LOG_POLES - log_error) / np.log(axis + np.sqrt(axis * axis + 1.0)))
        fewest = np.maximum(FEWEST_NODES, np.where(wave > 0.0, poles, 0.0))
        log_omega = np.log(np.maximum((curvature + rate) * h, FLOOR))
        nodes = np.full(len(h), MOST_NODES + 1, dtype=np.int64)
        for count in range(MOST_NODES, FEWEST_NODES - 1, -1):
            enough = (count >= fewest) & (count * log_omega + LOG_BETWEEN[count] <= log_error)
            nodes[enough] = count
        if np.all(nodes <= MOST_NODES):
            return np.stack([parts, nodes])
        parts = np.where(nodes > MOST_NODES, 2 * parts, parts)
