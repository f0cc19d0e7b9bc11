"""The `full` level: the seed's PVS model as the stationary points of one energy.

    E(q) = sum over sections int  sum_j GJ_j psi_j'^2 / 2 + sum_j K_j |kappa_1 exp(-i theta_j) - kappa*_j|^2 / 2  ds

with kappa_1 the leading tube's curvature in its own frame, theta_j = psi_j - psi_1 and all strains linear in q.
dE/dq = 0 is eq. (26), (33), (35); ``projection`` writes these as the seed does, and a test shows that both agree to
rounding.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from ctr_pvs.model.basis import gauss_legendre
from ctr_pvs.model.materials import Materials
from ctr_pvs.model.materials import SectionNodes
from ctr_pvs.model.materials import section_nodes
from ctr_pvs.model.shape import Shape
from ctr_pvs.pvs.space import FullSpace
from ctr_pvs.pvs.strain_basis import StrainBasis

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

#: Strain directions this much softer than the stiffest are dependent columns of the basis.
DEPENDENT = 1e-13


@dataclass(frozen=True, eq=False)
class _Stack:
    """Everything the energy needs at all Gauss points (G,): maps, weights [m], stiffnesses and pre-curvatures (G, N).

    bending is 0 in the guide and where a single tube has its rest shape: there nothing bends against anything.
    """

    rate: Array
    turn: Array
    curvature: Array
    weight: Array
    torsional: Array
    bending: Array
    kappa: ComplexArray
    angle: Array
    reference: Array


class FullEnergy:
    """E at one command (alpha, D) for one family of bases, as a function of q (n,).

    nodes : Gauss points per section; enough for polynomials of degree about ``nodes`` - 4.
    """

    def __init__(self, materials: Materials, alpha: Array, basis: StrainBasis, nodes: int = 12) -> None:
        self.materials, self.alpha = materials, alpha
        self.space = FullSpace(materials, alpha, basis)
        self.n = self.space.n
        self.rule = gauss_legendre(nodes)
        self._stack = self._tabulate()

    def _tabulate(self) -> _Stack:
        rows: list[tuple[Array | ComplexArray, ...]] = []
        x, tubes = self.rule.x, self.materials.robot.n_tubes
        for number, section in enumerate(self.space.sections):
            if not section.tubes:
                continue
            maps = self.space.maps(number, x)
            bending, kappa = np.zeros((len(x), tubes)), np.zeros((len(x), tubes), dtype=complex)
            if section.bends and len(section.tubes) > 1:
                bending[:] = self.materials.bending[section.index]
                kappa = self.materials.pre_curvature(section.index, section.start + section.length * x)
            lead = section.lead
            rows.append(
                (
                    maps.rate,
                    maps.angle - maps.angle[:, lead : lead + 1],
                    maps.curvature,
                    section.length * self.rule.weights,
                    np.tile(section.torsional, (len(x), 1)),
                    bending,
                    kappa,
                    maps.angle,
                    np.tile(self.alpha - self.alpha[lead], (len(x), 1)),
                )
            )
        return _Stack(*(np.concatenate(column) for column in zip(*rows, strict=True)))

    def _state(self, q: Array) -> tuple[ComplexArray, ComplexArray, Array]:
        """Leading curvature u (G,), turned moments K_j kappa*_j exp(i theta_j) (G, N) and twist rates (G, N)."""
        stack = self._stack
        bent = stack.curvature @ q
        moments = stack.bending * stack.kappa * np.exp(1j * (stack.reference + stack.turn @ q))
        return bent[:, 0] + 1j * bent[:, 1], moments, stack.rate @ q

    def value(self, q: Array) -> float:
        """E [J] without the constant of the straightened guide."""
        stack = self._stack
        u, _, rate = self._state(q)
        strain = u[:, None] * np.exp(-1j * (stack.reference + stack.turn @ q)) - stack.kappa
        density = np.sum(stack.torsional * rate**2 + stack.bending * np.abs(strain) ** 2, axis=1)
        return 0.5 * float(stack.weight @ density)

    def gradient(self, q: Array) -> Array:
        """dE/dq (n,)."""
        stack = self._stack
        u, moments, rate = self._state(q)
        torsion = stack.weight[:, None] * stack.torsional * rate
        bending = stack.weight * (stack.bending.sum(axis=1) * u - moments.sum(axis=1))
        turning = -stack.weight[:, None] * (moments.conj() * u[:, None]).imag
        gradient = np.tensordot(torsion, stack.rate, 2) + np.tensordot(turning, stack.turn, 2)
        return gradient + bending.real @ stack.curvature[:, 0] + bending.imag @ stack.curvature[:, 1]

    def hessian(self, q: Array) -> Array:
        """d2E/dq2 (n, n)."""
        stack = self._stack
        u, moments, _ = self._state(q)
        turn = stack.turn.reshape(-1, self.n)
        stiffness = stack.weight[:, None] * (moments.conj() * u[:, None]).real
        hessian = self.torsion_metric + (turn * stiffness.reshape(-1, 1)).T @ turn
        total = (stack.weight * stack.bending.sum(axis=1))[:, None]
        across, along = stack.curvature[:, 0], stack.curvature[:, 1]
        hessian += (total * across).T @ across + (total * along).T @ along
        swing = stack.weight[:, None] * moments
        mixed = across.T @ np.einsum("gj,gjn->gn", swing.imag, stack.turn)
        mixed -= along.T @ np.einsum("gj,gjn->gn", swing.real, stack.turn)
        return hessian + mixed + mixed.T

    @cached_property
    def torsion_metric(self) -> Array:
        """(n, n) torsional energy's second derivative: the metric of the stability margin."""
        rate = self._stack.rate.reshape(-1, self.n)
        return (rate * (self._stack.weight[:, None] * self._stack.torsional).reshape(-1, 1)).T @ rate

    def size(self, q: Array) -> float:
        """Largest angle [rad] that a change of coordinates (n,) stands for: twist, or curvature times length."""
        turned = float(np.abs(self._stack.angle @ q).max(initial=0.0))
        bent = float(np.abs(self._stack.curvature @ q).max(initial=0.0))
        return max(turned, bent * self.materials.domain.length)

    def step(self, q: Array) -> Array:
        """The Newton step (n,) at ``q``: the smallest one where columns of the basis depend on each other."""
        scale = 1.0 / np.sqrt(np.maximum(np.diag(self.rigid_metric), 1e-300))
        values, vectors = eigh(self.hessian(q) * np.outer(scale, scale))
        kept = np.abs(values) > DEPENDENT * np.abs(values).max()
        projected = vectors[:, kept].T @ (scale * self.gradient(q))
        return -scale * (vectors[:, kept] @ (projected / values[kept]))

    @cached_property
    def rigid_metric(self) -> Array:
        """(n, n) stiffness of strains alone, twist not turning anything: scales coordinates of any unit."""
        stack = self._stack
        total = (stack.weight * stack.bending.sum(axis=1))[:, None]
        across, along = stack.curvature[:, 0], stack.curvature[:, 1]
        return self.torsion_metric + (total * across).T @ across + (total * along).T @ along

    def project(self, shape: Shape) -> Array:
        """The coordinates (n,) whose strains are nearest to those of ``shape``, weighted by stiffness."""
        stack = self._stack
        rates, curvature = [], []
        guide = (shape.angle_at_boundaries[0] - self.alpha) / np.maximum(self.materials.guide_compliance, 1e-300)
        for section in self.space.sections:
            if not section.tubes:
                continue
            if section.bends:
                rates.append(shape.twist_rate(section.index, self.rule.x))
                frame = np.exp(-1j * shape.angle(section.index, self.rule.x)[:, section.lead])
                curvature.append(shape.curvature(section.index, self.rule.x) * frame)
            else:
                held = np.divide(guide, section.torsional, out=np.zeros_like(guide), where=section.torsional > 0.0)
                rates.append(np.tile(held, (len(self.rule.x), 1)))
                curvature.append(np.zeros(len(self.rule.x), dtype=complex))
        k = np.concatenate(curvature)
        torsion = stack.weight[:, None] * stack.torsional * np.concatenate(rates)
        bending = stack.weight * stack.bending.sum(axis=1) * k
        right = np.tensordot(torsion, stack.rate, 2)
        right += bending.real @ stack.curvature[:, 0] + bending.imag @ stack.curvature[:, 1]
        return np.asarray(np.linalg.lstsq(self.rigid_metric, right, rcond=1e-14)[0], dtype=np.float64)

    def section_nodes(self) -> list[SectionNodes]:
        """The Gauss points beyond the orifice, as loads read them."""
        bent = [section.index for section in self.space.sections if section.bends]
        return [section_nodes(self.materials, m, self.rule) for m in bent]
