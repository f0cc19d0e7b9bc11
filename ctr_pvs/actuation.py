"""Actuation loads by virtual work: tau_alpha = dE/dalpha and tau_D = dE/dD, straightening in the guide counted.

At an equilibrium dE/dq = 0, so only the explicit dependence on the command counts.  Strains are held at each place
x = (s - s_m) / h of their section while

* material slides: a node of section m carries material of tube j that moves with dX_j = ds + dD_j;
* section ends move: a boundary that belongs to tube j moves with -dD_j;
* the guide swallows tube: it grows more compliant, and new material is straightened.

E has a kink in D_j where an event of tube j lies on the orifice or on another tube's event: the two events part, and
a thin section with its own set of materials appears between them.  Its energy rate is that of the materials on the
side that opens, less the work of the torques that twist it, so each side has its own derivative.

All this is read off a shape and the quadrature nodes of the energy it minimises, at any model level.

Limits of the model: no friction, no clearance, quasi-static.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.energy import SectionNodes
from ctr_pvs.energy import bending_density
from ctr_pvs.energy import shared_curvature
from ctr_pvs.robot import Segment
from ctr_pvs.sections import ABSENT
from ctr_pvs.sections import Domain
from ctr_pvs.sections import Event
from ctr_pvs.shape import Shape

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Loads:
    """What the actuators must supply along +alpha and +D.

    torque : (N,) dE/dalpha [N m].
    force : (N,) dE/dD towards +D [N]; insertion force, as surgeons count it, is its negative.
    force_interval : (N, 2) dE/dD towards -D and towards +D [N]; they differ only at a kink.  Where a tube's tip is on
        the orifice nothing is left to move towards +D, and that side is 0.
    kink : (N,) true where D_j sits on a kink.
    """

    torque: Array
    force: Array
    force_interval: Array
    kink: NDArray[np.bool_]


def virtual_work_loads(shape: Shape, nodes: Sequence[SectionNodes]) -> Loads:
    """The loads of an equilibrium ``shape``, exact derivatives of the energy that is sampled at ``nodes``."""
    rates = _SectionRates(shape, nodes)
    minus, plus = (rates.slide.sum(axis=0) + boundary_forces(shape.domain, rates, side) for side in (-1, 1))
    kink = shape.domain.kinked_tubes()
    minus[~kink] = plus[~kink]
    return Loads(-rates.torque[0], plus, np.column_stack([minus, plus]), kink)


class _SectionRates:
    """Energy per motion of each section's ends, at strains fixed in x.

    right : (M,) [N] per motion of the far end, the near one held; left : (M,) [N] per motion of the near end.
    slide : (M, N) [N] per slide of each tube's material under fixed ends.
    torque : (M + 1, N) [N m] torque that passes each boundary: what bending beyond it pulls.
    """

    def __init__(self, shape: Shape, nodes: Sequence[SectionNodes]) -> None:
        sections, tubes = shape.domain.n_sections, len(shape.alpha)
        self.shape = shape
        self.right, self.left = np.zeros(sections), np.zeros(sections)
        self.slide = np.zeros((sections, tubes))
        self.torque = np.zeros((sections + 1, tubes))
        for node in sorted(nodes, key=lambda node: -node.section):
            self._section(node)

    def _section(self, node: SectionNodes) -> None:
        m, x = node.section, node.rule.x
        psi, k = self.shape.angle(m, x), self.shape.curvature(m, x)
        strain_work = self._strain_work(node, psi, k)
        pull = self._pull(node, psi, k)
        per_length = self._stretch(node, psi, k, pull)
        with_far_end = float((x @ strain_work).sum())
        self.slide[m] = strain_work.sum(axis=0)
        self.right[m] = per_length + with_far_end
        self.left[m] = float(self.slide[m].sum()) - with_far_end - per_length
        self.torque[m] = self.torque[m + 1] - pull.sum(axis=0)

    def _strain_work(self, node: SectionNodes, psi: Array, k: NDArray[np.complex128]) -> Array:
        """(g, N) weighted dw/dX_j: K_j Re[conj(kappa*_j - exp(-i psi_j) k) kappa*_j'] [N]."""
        strain = node.kappa - k[:, None] * np.exp(-1j * psi)
        steepness = self.shape.materials.pre_curvature_rate(node.section, node.s)
        return node.weight[:, None] * node.bending * (strain.conj() * steepness).real

    def _pull(self, node: SectionNodes, psi: Array, k: NDArray[np.complex128]) -> Array:
        """(g, N) weighted dw/dpsi_j [N m] with the curvature held in the outermost tube's frame.

        The outermost tube carries the others with it, so its own share is what makes the sum zero.
        """
        moments = node.bending * node.kappa * np.exp(1j * psi)
        pull = node.weight[:, None] * (moments * k[:, None].conj()).imag
        pull[:, np.flatnonzero(node.bending)[0]] -= pull.sum(axis=1)
        return pull

    def _stretch(self, node: SectionNodes, psi: Array, k: NDArray[np.complex128], pull: Array) -> float:
        """Energy per stretch of the section with all held at its x: density, twist, and what the twist turns."""
        m, x, shape = node.section, node.rule.x, self.shape
        twist = shape.twist_rate(m, x)
        rate = float(node.rule.weights @ bending_density(node.bending, node.kappa, psi, k))
        rate += 0.5 * float(node.rule.weights @ (twist**2 @ shape.materials.torsional[m]))
        turned = (psi - shape.angle_at_boundaries[m]) / shape.domain.lengths[m]
        turned_beyond = (shape.angle_at_boundaries[m + 1] - shape.angle_at_boundaries[m]) / shape.domain.lengths[m]
        return rate + float(np.sum(pull * turned)) - float(turned_beyond @ self.torque[m + 1])

    def thin(self, index: int, segments: NDArray[np.int64]) -> float:
        robot, domain = self.shape.materials.robot, self.shape.domain
        psi = self.shape.angle_at_boundaries[index]
        bending, kappa = np.zeros(len(psi)), np.zeros(len(psi), dtype=complex)
        twisting = 0.0
        for tube in np.flatnonzero(segments != ABSENT):
            segment = robot.tubes[tube].segments[segments[tube]]
            start = robot.tubes[tube].breaks[segments[tube]]
            bending[tube] = segment.bending_stiffness
            kappa[tube] = segment.pre_curvature(np.array(domain.boundaries[index] + domain.D[tube] - start))
            twisting += self._twisting(float(self.torque[index, tube]), segment)
        if not bending.any():
            return 0.0
        k = shared_curvature(bending, bending * kappa * np.exp(1j * psi))
        return float(bending_density(bending, kappa, psi, k)) - twisting

    def guide(self, tube: int, segment: int) -> float:
        material = self.shape.materials.robot.tubes[tube]
        guided = material.segments[segment]
        kappa = guided.pre_curvature(np.array(self.shape.domain.D[tube] - material.breaks[segment]))
        straightening = 0.5 * guided.bending_stiffness * float(np.abs(kappa)) ** 2
        return straightening - self._twisting(float(self.torque[0, tube]), guided)

    def _twisting(self, torque: float, segment: Segment) -> float:
        """Work per length [N] that a constant torque does in twisting a segment beyond its stored energy."""
        return 0.5 * torque**2 / segment.torsional_stiffness if self.shape.twists else 0.0


class Rates(Protocol):
    """Energy per motion of section ends [N], as numbers or as rows of coefficients (C,) that give numbers later.

    right, left : (M, ...) per motion of a section's far and near end.
    """

    right: Array
    left: Array

    def thin(self, index: int, segments: NDArray[np.int64]) -> Any:
        """Energy per length of a vanishing section at boundary ``index`` with one of ``segments`` (N,) per tube:
        bending density less the work T^2 / (2 GJ) that the passing torques do in twisting it."""

    def guide(self, tube: int, segment: int) -> Any:
        """Energy per dD_j of guiding more of a tube's ``segment``: straightening it, less the work of its torque in
        twisting it."""


def boundary_forces(domain: Domain, rates: Rates, side: int) -> Array:
    """(N, ...) part of dE/dD_j towards ``side`` (+1, -1) from the section ends that ride on tube j, and the guide."""
    force = np.zeros((len(domain.D), *rates.right.shape[1:]))
    for tube in range(len(domain.D)):
        segment = _guided_segment(domain, tube, side)
        if segment != ABSENT:  # its tip is on the orifice: nothing is left to go in
            force[tube] = rates.guide(tube, segment)
    for index, events in enumerate(domain.events):
        for event in events:
            if index == 0 and side < 0:
                force[event.tube] -= _opening(domain, rates, 0, event, side)
            elif index > 0 and len(events) > 1:
                force[event.tube] -= _opening(domain, rates, index, event, side)
            elif index > 0:
                force[event.tube] -= rates.right[index - 1] + _left_rate(rates, index)
    return force


def _guided_segment(domain: Domain, tube: int, side: int) -> int:
    """The segment that goes into the guide with dD_j towards ``side``; ``ABSENT`` where none is left."""
    on_orifice = [event.after for event in domain.events[0] if event.tube == tube]
    if side > 0 and on_orifice:
        return on_orifice[0]
    index = int(domain.guide_segment[tube])
    return 0 if index == ABSENT else index  # with its base on the orifice the first segment goes in


def _left_rate(rates: Rates, index: int) -> Any:
    """Energy per motion of boundary ``index`` as the near end of the section after it; past the last there is none."""
    return rates.left[index] if index < len(rates.left) else 0.0


def _opening(domain: Domain, rates: Rates, index: int, event: Event, side: int) -> Any:
    """Energy per motion of ``event`` along s when it parts from what else is on boundary ``index``.

    Towards +D the event moves back and shortens the section before; towards -D it moves on and shortens the one
    after.  The thin section between holds the materials of the other side, but for the event's own tube.
    """
    if side > 0:
        segments = domain.segment[index - 1].copy()
        segments[event.tube] = event.after
        return rates.right[index - 1] - rates.thin(index, segments)
    beyond = np.full(len(domain.D), ABSENT)
    segments = (domain.segment[index] if index < domain.n_sections else beyond).copy()
    segments[event.tube] = event.before
    return _left_rate(rates, index) + rates.thin(index, segments)
