"""The elastic energy E(q; alpha, D) at the `torsion` level, its gradient and its Hessian.

With no load outside, the bending part of the seed's eq. (26)/(33) is solved at each point by
``k = (sum K_j)^-1 sum K_j R(psi_j) kappa*_j``, and what is left is

    E = q.q / 2  +  sum over sections int  w(psi) ds  +  straightening in the guide,
    w = sum K_j |kappa*_j - exp(-i psi_j) k|^2 / 2,      psi = alpha + A q,

in complex notation for the two bending directions (kappa_y + i kappa_z).  Everything the package reports is a
derivative of this one scalar.  Only coupled sections depend on psi; in all others w is a constant of the section.
"""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.basis import GaussRule
from ctr_pvs.basis import gauss_legendre
from ctr_pvs.lazy import lazy
from ctr_pvs.materials import Materials
from ctr_pvs.model.materials import SectionNodes
from ctr_pvs.model.materials import bending_density
from ctr_pvs.model.materials import shared_curvature
from ctr_pvs.twist import Degrees
from ctr_pvs.twist import TwistSpace

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

#: Gauss points in a section where psi is not needed: exact for pre-curvatures up to degree 7, near exact for helices.
PLAIN_NODES = 8


class TorsionEnergy:
    """E at one D and one choice of polynomial degrees, as a function of q (n,) and alpha (N,).

    n : number of unknowns; nodes : the coupled sections' Gauss points; angle_map (G, N, n) : psi = alpha + A q there.
    s (G,) [m] : where they are; moment (G, N) : K_j kappa*_j [N m]; coupling (G,) : weight over sum of K.
    """

    def __init__(self, materials: Materials, degree: Degrees) -> None:
        self.materials = materials
        self.space = TwistSpace(materials, degree)
        self.n = self.space.n
        domain, places = materials.domain, self.space.unknowns.nodes
        lengths = domain.lengths.take(places.section)
        self.s = domain.boundaries.take(places.section) + lengths * places.x
        self.moment = places.bending * materials.pre_curvature(places.section, self.s)
        self.coupling = lengths * places.share  # quadrature weight over total bending stiffness

    @lazy
    def angle_map(self) -> Array:
        return self.space.unknowns.nodes.integrals[:, None, :] * self.space.modes

    @lazy
    def nodes(self) -> list[SectionNodes]:
        return [self._nodes(m, self.space.basis(m).rule) for m in self.materials.composition.coupled_sections.tolist()]

    def _nodes(self, m: int, rule: GaussRule) -> SectionNodes:
        domain = self.materials.domain
        length = domain.lengths[m]
        s = domain.boundaries[m] + length * rule.x
        kappa = self.materials.pre_curvature(m, s)
        return SectionNodes(m, rule, s, length * rule.weights, self.materials.bending[m], kappa)

    @lazy
    def slices(self) -> list[slice]:
        """Where the nodes of each section are among all."""
        ends = np.cumsum([0, *(len(node.s) for node in self.nodes)])
        return [slice(a, b) for a, b in itertools.pairwise(ends)]

    @lazy
    def plain_nodes(self) -> list[SectionNodes]:
        """Gauss points of the sections whose energy does not depend on psi."""
        rule = gauss_legendre(PLAIN_NODES)
        return [self._nodes(int(m), rule) for m in np.flatnonzero(~self.materials.coupled)]

    @lazy
    def all_nodes(self) -> list[SectionNodes]:
        """Gauss points of every section, from the orifice on."""
        return sorted([*self.nodes, *self.plain_nodes], key=lambda node: node.section)

    def angles(self, q: Array, alpha: Array) -> Array:
        """psi (G, N) [rad] at the nodes."""
        return alpha + self.angle_map @ q

    def turned_moments(self, psi: Array) -> ComplexArray:
        """(G, N) K_j kappa*_j exp(i psi_j) [N m] at the nodes."""
        return self.moment * np.exp(1j * psi)

    def torque_density(self, moments: ComplexArray) -> Array:
        """(G, N) derivative of E with respect to psi at the nodes (quadrature weights included) [N m]."""
        total = moments.sum(axis=1).conj()
        return self.coupling[:, None] * (total[:, None] * moments).imag

    def value(self, q: Array, alpha: Array) -> float:
        """E [J] up to the constants of ``constant``: the part that depends on q."""
        psi = self.angles(q, alpha)
        bending = sum(_relaxed_energy(node, psi[part]) for node, part in zip(self.nodes, self.slices, strict=True))
        return 0.5 * float(q @ q) + bending

    def constant(self) -> float:
        """Energy [J] that does not depend on twist: uncoupled sections and straightening in the guide."""
        plain = sum(_relaxed_energy(node, np.zeros(node.kappa.shape)) for node in self.plain_nodes)
        return plain + float(self.materials.straightening_energy.sum())

    def gradient(self, q: Array, alpha: Array) -> Array:
        """dE/dq (n,) [sqrt(J)]."""
        torque = self.torque_density(self.turned_moments(self.angles(q, alpha)))
        return q + np.tensordot(torque, self.angle_map, 2)

    def derivatives(self, q: Array, alpha: Array) -> tuple[Array, Array]:
        """dE/dq (n,) and d2E/dq2 (n, n)."""
        moments = self.turned_moments(self.angles(q, alpha))
        gradient = q + np.tensordot(self.torque_density(moments), self.angle_map, 2)
        hessian = self.curvature_form(moments, self.angle_map)
        hessian[np.diag_indices(self.n)] += 1.0
        return gradient, hessian

    def curvature_form(self, moments: ComplexArray, directions: Array) -> Array:
        """(p, p) second derivative of the bending energy along psi-directions (G, N, p).

        w'' = (delta_ij Re(conj(Z) b_j) - Re(conj(b_i) b_j)) / sum K with b the turned moments and Z their sum: a
        diagonal minus a form of rank two at each node.
        """
        total = moments.sum(axis=1).conj()
        diagonal = self.coupling[:, None] * (total[:, None] * moments).real
        flat = directions.reshape(diagonal.size, directions.shape[2])
        root = np.sqrt(self.coupling)[:, None]
        along = np.einsum("gn,gnp->gp", root * moments.real, directions)
        across = np.einsum("gn,gnp->gp", root * moments.imag, directions)
        return (flat * diagonal.reshape(-1, 1)).T @ flat - along.T @ along - across.T @ across

    def torque_change(self, moments: ComplexArray, change: ComplexArray, part: slice) -> Array:
        """(g, N, P) change of ``torque_density`` at the nodes ``part`` for changes (g, N, P) of their turned
        moments."""
        here = moments[part]
        total = here.sum(axis=1).conj()
        swing = change.sum(axis=1).conj()
        mixed = swing[:, None, :] * here[:, :, None] + total[:, None, None] * change
        return self.coupling[part, None, None] * mixed.imag


def _relaxed_energy(node: SectionNodes, psi: Array) -> float:
    """Bending energy [J] of a section whose curvature is in balance at every point; psi (g, N)."""
    k = shared_curvature(node.bending, node.bending * node.kappa * np.exp(1j * psi))
    return float(node.weight @ bending_density(node.bending, node.kappa, psi, k))
