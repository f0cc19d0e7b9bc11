"""How the tip moves with the tubes' parameters, at held bases and without a load: reciprocity, in plain numpy.

An equilibrium is G(psi; p)[eta] = 0 for every variation eta of the twist angles, with

    G = sum_j int (GJ_j psi_j' eta_j' + t_j eta_j) ds + guide,   t_j = Im(conj(Z) b_j) / S,

b_j = K_j kappa_j exp(i psi_j), Z and S the sums of b_j and K_j over the tubes at s.  A parameter p moves the tip by

    d tip / d p = (d tip / d p at held psi) - (d G / d p at held psi)[lambda],

where lambda, the rate of psi with a force (a moment) on the tip, comes from one linear solve with the Hessian of the
energy, whatever the number of parameters.  Both parts are integrals over the backbone.  Where a parameter moves the end
of a segment, what jumps there counts as a point: the density of G, for torsion in its complementary form
(torque times torque over GJ), and the curvature, by which everything beyond is turned.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.answer.engine import Engine
from ctr_pvs.answer.shape import TorsionShape
from ctr_pvs.answer.state import State
from ctr_pvs.model.basis import gauss_legendre
from ctr_pvs.model.basis import legendre
from ctr_pvs.model.materials import Materials

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Ints = NDArray[np.int64]

#: Gauss points and polynomials of an element more than its degree in the kernel.
MORE_NODES, MORE_DEGREES = 4, 2


@dataclass(frozen=True, eq=False)
class TubeRates:
    """Rates (6, ...) of the tip, position [m] then rotation [rad] in base axes.

    bending, torsion, curvature (6, N) : with the logarithms of every tube's K, GJ and pre-curvature.
    length : with the length [m] of each segment, one (6, segments) for each tube.
    """

    bending: Array
    torsion: Array
    curvature: Array
    length: tuple[Array, ...]


@lru_cache(maxsize=128)
def _polynomials(degree: int, nodes: int) -> tuple[Array, Array]:
    """``legendre`` at the Gauss points; read-only, as every caller gets the same."""
    values, integrals = legendre(degree, gauss_legendre(nodes).x)
    values.flags.writeable = integrals.flags.writeable = False
    return values, integrals


def _cross(a: Array, b: Array) -> Array:
    """(g, 3); numpy's own takes ten times as long for so few."""
    (ax, ay, az), (bx, by, bz) = a.T, b.T
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=1)


class _Points:
    """Places along the backbone, each in a section: fields and frames there.

    s (g,) [m]; section (g,); torque (g, N) of twist [N m]; K, GJ (g, N) [N m^2]; turned (g, N) exp(i psi); b, Z, S as
    above; turn (2, g, 6) : what a unit of curvature along
    the Bishop frame's y and z does to the tip.
    """

    def __init__(
        self, engine: Engine, state: State, materials: Materials, section: NDArray[np.int64], s: Array
    ) -> None:
        self.s, self.section = s, section
        position, orientation = engine.poses(state.vector, s)
        psi, self.torque = engine.angles(state.vector, s)
        self.K, self.GJ = materials.bending[section], materials.torsional[section]
        kappa = np.zeros((len(s), engine.robot.n_tubes), dtype=complex)
        for m in range(materials.domain.n_sections):
            here = section == m
            kappa[here] = materials.pre_curvature(m, s[here])
        self.turned = np.exp(1j * psi)
        self.b = self.K * kappa * self.turned
        self.Z, self.S = self.b.sum(axis=1), self.K.sum(axis=1)
        arm = state.tip[:3] - position
        y, z = _bishop(orientation, psi[:, materials.domain.leader])
        self.turn = np.stack([np.hstack([_cross(y, arm), y]), np.hstack([_cross(z, arm), z])])

    def slope(self, materials: Materials) -> Complex:
        """(g, N) derivative of the pre-curvature [1/m^2]."""
        out = np.zeros_like(self.b)
        for m in range(materials.domain.n_sections):
            out[self.section == m] = materials.pre_curvature_rate(m, self.s[self.section == m])
        return out

    def moved_tip(self, curvature: Complex) -> Array:
        """(g, ..., 6) how changes of ``curvature`` (g, ...), per length, move the tip."""
        y, z = self.turn.reshape(2, len(self.s), *(1,) * (curvature.ndim - 1), 6)
        return np.asarray(curvature.real[..., None] * y + curvature.imag[..., None] * z)


def _bishop(orientation: Array, roll: Array) -> tuple[Array, Array]:
    """y and z axes (g, 3) of the Bishop frame, from quaternions x, y, z, w of a tube's material frame and its angle."""
    x, y, z, w = orientation.T
    second = np.stack([2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)], axis=1)
    third = np.stack([2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)], axis=1)
    cos, sin = np.cos(roll)[:, None], np.sin(roll)[:, None]
    return cos * second - sin * third, sin * second + cos * third


class _Adjoint:
    """lambda, the rate of psi with a force and a moment on the tip.

    angle (g, N, 6) and torque (g, N, 6) : lambda and GJ lambda' at the points; guide (N, 6) : its torque in the guide.
    """

    def __init__(self, engine: Engine, state: State, materials: Materials, elements: Array, points: _Points,
                 element: Ints, weights: Array) -> None:  # fmt: skip
        self.N, self.elements = engine.robot.n_tubes, elements
        self.degrees = [int(degree) + MORE_DEGREES if inside else 0 for inside, degree in elements[:, 2:].tolist()]
        self.GJ = materials.torsional[materials.domain.locate(elements[:, :2].mean(axis=1))]
        self.root = np.sqrt(materials.guide_compliance)
        self.first = self.N + np.concatenate([[0], np.cumsum([self.N * (d + 1) for d in self.degrees])]).astype(int)
        self.nodes = np.bincount(element).tolist()
        map_, slope = self._map(points.s, element)
        pull = self._pull(points, weights, map_)
        # The frame that the tip's rotation is told of is a tube's: it turns with that tube's end.
        end = self._map(elements[-1:, 1], np.array([len(elements)]))[0][0, materials.domain.leader]
        pull[:, 3:] += end[:, None] * tangent(state)
        self.unknowns = np.linalg.solve(self._hessian(points, weights, map_), pull)
        self.angle, self.torque = map_ @ self.unknowns, points.GJ[..., None] * (slope @ self.unknowns)
        guided = self.root[:, None] > 0.0
        held = self.unknowns[: self.N]
        self.guide = np.divide(held, self.root[:, None], out=np.zeros_like(held), where=guided)

    def at(self, s: Array, element: Ints) -> tuple[Array, Array]:
        """lambda and its torque (g, N, 6) at arc lengths s (g,) [m] in the elements of these numbers."""
        map_, slope = self._map(s, element)
        return map_ @ self.unknowns, self.GJ[element][..., None] * (slope @ self.unknowns)

    def _map(self, s: Array, element: Ints) -> tuple[Array, Array]:
        """(g, N, U) psi and psi' per unknown; as in the kernel the unknowns' energy is half their square."""
        tubes = np.arange(self.N)
        out, slope = np.zeros((2, len(s), self.N, int(self.first[-1])))
        out[:, tubes, tubes] = self.root
        for m, (start, end) in enumerate(self.elements[:, :2].tolist()):
            d, h = self.degrees[m], end - start
            scale = np.sqrt(np.divide(h, self.GJ[m], out=np.zeros(self.N), where=self.GJ[m] > 0.0))
            columns = self.first[m] + (d + 1) * tubes
            out[np.flatnonzero(element > m)[:, None], tubes, columns] = scale
            here = np.flatnonzero(element == m)
            if not len(here):
                continue
            at_nodes = len(here) == self.nodes[m] and len(s) > len(self.nodes)
            values, integrals = _polynomials(d, len(here)) if at_nodes else legendre(d, (s[here] - start) / h)
            for j in range(self.N):
                span = slice(int(columns[j]), int(columns[j]) + d + 1)
                out[here, j, span], slope[here, j, span] = scale[j] * integrals, scale[j] / h * values
        return out, slope

    @staticmethod
    def _hessian(points: _Points, weights: Array, map_: Array) -> Array:
        """(U, U): see ``solve.dense``."""
        share = weights / points.S
        diagonal = share[:, None] * (points.Z.conj()[:, None] * points.b).real
        flat = map_.reshape(-1, map_.shape[2])
        root = np.sqrt(share)[:, None]
        along = np.einsum("gn,gnu->gu", root * points.b.real, map_)
        across = np.einsum("gn,gnu->gu", root * points.b.imag, map_)
        hessian = (flat * diagonal.reshape(-1, 1)).T @ flat - along.T @ along - across.T @ across
        hessian[np.diag_indices(len(hessian))] += 1.0
        return np.asarray(hessian)

    @staticmethod
    def _pull(points: _Points, weights: Array, map_: Array) -> Array:
        """(U, 6) rates of the tip with the unknowns: what unit forces and moments on it do to the balance."""
        rate = weights[:, None, None] * points.moved_tip(1j * points.b / points.S[:, None])
        return map_.reshape(-1, map_.shape[2]).T @ rate.reshape(-1, 6)


def tube_rates(shape: TorsionShape, lengths: bool = True) -> TubeRates:
    """Of the ``shape`` of a stable equilibrium without loads; without ``lengths`` those columns are empty, which takes
    half the time."""
    engine, state, materials = shape.engine, shape.state, shape.materials
    robot, N = engine.robot, engine.robot.n_tubes
    if not materials.domain.n_sections:
        none = np.zeros((6, N))
        return TubeRates(none, none, none, tuple(np.zeros((6, len(tube.segments))) for tube in robot.tubes))
    elements = engine.elements(state.vector)
    rules = [gauss_legendre(int(d if inside else 0) + MORE_NODES) for inside, d in elements[:, 2:].tolist()]
    stretches = elements[:, :2].tolist()
    s = np.concatenate([a + (b - a) * rule.x for (a, b), rule in zip(stretches, rules, strict=True)])
    weights = np.concatenate([(b - a) * rule.weights for (a, b), rule in zip(stretches, rules, strict=True)])
    element = np.repeat(np.arange(len(rules)), [len(rule.x) for rule in rules])
    points = _Points(engine, state, materials, materials.domain.locate(s), s)
    adjoint = _Adjoint(engine, state, materials, elements, points, element, weights)
    scaled = _scaled(points, adjoint.angle, points.b)
    held = points.K / points.S[:, None]
    share = _density(points, adjoint.angle)[:, None] * held[..., None]  # (g, N, 6): S grows with K
    stiffened = -points.moved_tip(points.Z[:, None] / points.S[:, None] * held) + share
    twisted = np.divide(points.torque, points.GJ, out=np.zeros_like(points.torque), where=points.GJ > 0.0)
    guide = engine.angles(state.vector, np.array([-1.0]))[1][0] * materials.guide_compliance
    return TubeRates(
        np.einsum("g,gnc->cn", weights, scaled + stiffened),
        -np.einsum("g,gn,gnc->cn", weights, twisted, adjoint.torque) - (guide[:, None] * adjoint.guide).T,
        np.einsum("g,gnc->cn", weights, scaled),
        _lengths(engine, state, materials, points, weights, adjoint) if lengths else (),
    )


def tangent(state: State) -> Array:
    """(3,) of the backbone at the tip."""
    x, y, z, w = state.tip[3:7]
    return np.array([1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)])


def _scaled(points: _Points, angle: Array, change: Complex) -> Array:
    """(g, N, 6) how the tip moves, per length, where b_j of one tube at a time gets ``change`` (g, N) more."""
    pulled = np.einsum("gn,gnc->gc", points.b, angle)
    balance = change.conj()[..., None] * pulled[:, None] + (points.Z.conj()[:, None] * change)[..., None] * angle
    return points.moved_tip(change / points.S[:, None]) - balance.imag / points.S[:, None, None]


def _density(points: _Points, angle: Array) -> Array:
    """(g, 6) sum_j t_j lambda_j [N m]."""
    torque = (points.Z.conj()[:, None] * points.b).imag / points.S[:, None]
    return np.einsum("gn,gnc->gc", torque, angle)


def _lengths(
    engine: Engine, state: State, materials: Materials, points: _Points, weights: Array, adjoint: _Adjoint
) -> tuple[Array, ...]:
    """Rates with the length of each segment: what lies beyond in the tube moves on, what lies in the guide changes."""
    robot, domain, D = engine.robot, materials.domain, state.D
    ends, torsion = _moved_ends(engine, state, materials, adjoint)
    slid = np.einsum(
        "g,gnc->gnc", weights, _scaled(points, adjoint.angle, -points.K * points.slope(materials) * points.turned)
    )
    guide = engine.angles(state.vector, np.array([-1.0]))[1][0][:, None] * adjoint.guide  # (N, 6)
    out = []
    for j, tube in enumerate(robot.tubes):
        rates = np.zeros((6, len(tube.segments)))
        for i, segment in enumerate(tube.segments):
            beyond = domain.segment[points.section, j] > i
            rates[:, i] = slid[beyond, j].sum(axis=0)
            for m, events in enumerate(domain.events[1:]):
                if any(event.tube == j and event.before >= i for event in events):
                    rates[:, i] += (ends[m] + torsion[m, j]) / len(events)
            if tube.breaks[i + 1] <= D[j]:
                at_orifice = tube.segments[int(domain.guide_segment[j])].torsional_stiffness
                rates[:, i] += guide[j] * (1.0 / segment.torsional_stiffness - 1.0 / at_orifice)
        out.append(rates)
    return tuple(out)


def _moved_ends(
    engine: Engine, state: State, materials: Materials, adjoint: _Adjoint
) -> tuple[Array, Array]:  # fmt: skip
    """Rates (M, 6) of the tip with the places of the ends of the M sections [m], and what torsion adds (M, N, 6) where
    the end is one of tube j's."""
    domain = materials.domain
    M, s = domain.n_sections, domain.boundaries[1:]
    before = _Points(engine, state, materials, np.arange(M), s)
    last = np.searchsorted(adjoint.elements[:, 1], s - 1e-9)
    angle, torque = adjoint.at(s, last)
    curvature, density = before.Z / before.S, _density(before, angle)
    after = _Points(engine, state, materials, np.arange(1, M), s[:-1])
    curvature[:-1] -= after.Z / after.S
    density[:-1] -= _density(after, angle[:-1])
    rates = before.moved_tip(curvature) - density
    rates[-1, :3] += tangent(state)
    softer = np.zeros_like(before.GJ)
    both = (before.GJ[:-1] > 0.0) & (after.GJ > 0.0)
    softer[:-1][both] = 1.0 / before.GJ[:-1][both] - 1.0 / after.GJ[both]
    return rates, (softer * before.torque)[..., None] * torque
