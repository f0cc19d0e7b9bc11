"""Actuation loads by virtual work: tau_alpha = dE/dalpha and tau_D = dE/dD, straightening in the guide counted.

At an equilibrium dE/dq = 0, so only the explicit dependence on the command counts.  Strains are held at each place
x = (s - s_m) / h of their section while

* material slides: a node of section m carries material of tube j that moves with dX_j = ds + dD_j;
* section ends move: a boundary that belongs to tube j moves with -dD_j;
* the guide swallows tube: it grows more compliant, and new material is straightened.

E has a kink in D_j where an event of tube j lies on the orifice or on another tube's event: the two events part, and
a thin section with its own set of materials appears between them.  Its energy rate is that of the materials on the
side that opens, less the work of the torques that twist it, so each side has its own derivative.

All this is read off a shape and the quadrature nodes of the energy it minimises, at any model level and without
external loads.

Limits of the model: no friction, no clearance, quasi-static.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.model.basis import gauss_legendre
from ctr_pvs.model.materials import Materials
from ctr_pvs.model.materials import SectionNodes
from ctr_pvs.model.materials import bending_density
from ctr_pvs.model.materials import section_nodes
from ctr_pvs.model.materials import shared_curvature
from ctr_pvs.model.sections import ABSENT
from ctr_pvs.model.sections import Domain
from ctr_pvs.model.sections import Event
from ctr_pvs.model.shape import Shape
from ctr_pvs.robot.robot import Segment

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
    rates, kink = _SectionRates(shape, nodes), shape.domain.kinked_tubes()
    plus = [rates.force(Motion(shape.domain, tube, 1)) for tube in range(len(kink))]
    minus = [rates.force(Motion(shape.domain, tube, -1)) if kink[tube] else plus[tube] for tube in range(len(kink))]
    return Loads(-rates.torque[0], np.array(plus), np.column_stack([minus, plus]), kink)


def quadrature(shape: Shape, nodes: int) -> list[SectionNodes]:
    """Gauss points for the loads of a ``shape`` whose energy has none of its own: ``nodes`` on every panel."""
    sections = range(shape.domain.n_sections)
    return [section_nodes(shape.materials, m, gauss_legendre(nodes, shape.panels(m))) for m in sections]


class Motion:
    """What dD of one tube moves towards one side (+1, -1), besides the tube's material; M sections of N tubes.

    far, near : (M) per dD, how every section's far and near end move: -1 where it rides on the tube, else 0.
    opens : boundary and segments (N) of the thin sections that grow by ``side`` dD.  They hold the materials of the
        section that is shortened, but for the tube's own.
    guided : the tube's segment that goes into the guide; ``ABSENT`` where its tip is on the orifice.
    """

    def __init__(self, domain: Domain, tube: int, side: int) -> None:
        self.tube, self.side = tube, side
        self.far, self.near = [0.0] * domain.n_sections, [0.0] * domain.n_sections
        self.opens: list[tuple[int, list[int]]] = []
        guided = int(domain.guide_segment[tube])
        self.guided = 0 if guided == ABSENT else guided  # with its base on the orifice the first segment goes in
        for index, events in enumerate(domain.events):
            for event in events:
                if event.tube == tube:
                    self._ride(domain, index, event, index == 0 or len(events) > 1)

    def _ride(self, domain: Domain, index: int, event: Event, kink: bool) -> None:
        """Towards +D an event moves back and shortens the section before; towards -D it moves on and shortens the one
        after.  Without a kink it does both to both; on the orifice it goes into the guide."""
        if index == 0 and self.side > 0:
            self.guided = event.after
            return
        if self.side > 0 or not kink:
            self.far[index - 1] = -1.0
        if (self.side < 0 or not kink) and index < domain.n_sections:
            self.near[index] = -1.0
        if kink:
            self.opens.append((index, self._between(domain, index, event)))

    def _between(self, domain: Domain, index: int, event: Event) -> list[int]:
        """Segments (N) between ``event`` and what else is on boundary ``index``."""
        shortened = index if self.side < 0 else index - 1
        segments = domain.segment[shortened].tolist() if shortened < domain.n_sections else [ABSENT] * len(domain.D)
        segments[event.tube] = event.before if self.side < 0 else event.after
        return segments


def pre_curvature_at(materials: Materials, tube: int, segment: int, boundary: int) -> complex:
    """kappa* [1/m] of a tube's segment where it lies on ``boundary``."""
    material, domain = materials.robot.tubes[tube], materials.domain
    if material.segments[segment].is_straight:
        return 0j
    place = domain.boundaries[boundary] + domain.D[tube] - material.breaks[segment]
    return complex(material.segments[segment].pre_curvature(place))


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

    def force(self, motion: Motion) -> float:
        """dE/dD_j [N] along ``motion``."""
        out = float(self.slide[:, motion.tube].sum() + self.right @ motion.far + self.left @ motion.near)
        if motion.guided != ABSENT:
            out += self._guide(motion.tube, motion.guided)
        return out + motion.side * sum(self._thin(boundary, segments) for boundary, segments in motion.opens)

    def _thin(self, boundary: int, segments: list[int]) -> float:
        """Energy per length [N] of a vanishing section at ``boundary`` with one of ``segments`` (N) per tube: bending
        density less the work T^2 / (2 GJ) that the passing torques do in twisting it."""
        materials, psi = self.shape.materials, self.shape.angle_at_boundaries[boundary]
        bending, kappa = np.zeros(len(psi)), np.zeros(len(psi), dtype=complex)
        twisting = 0.0
        for tube, index in enumerate(segments):
            if index != ABSENT:
                segment = materials.segment(tube, index)
                bending[tube] = segment.bending_stiffness
                kappa[tube] = pre_curvature_at(materials, tube, index, boundary)
                twisting += self._twisting(float(self.torque[boundary, tube]), segment)
        if not bending.any():
            return 0.0
        k = shared_curvature(bending, bending * kappa * np.exp(1j * psi))
        return float(bending_density(bending, kappa, psi, k)) - twisting

    def _guide(self, tube: int, index: int) -> float:
        """Energy [N] per dD_j of guiding more of a tube's segment: straightening it, less the work of its torque."""
        guided = self.shape.materials.segment(tube, index)
        kappa = pre_curvature_at(self.shape.materials, tube, index, 0)
        straightening = 0.5 * guided.bending_stiffness * abs(kappa) ** 2
        return straightening - self._twisting(float(self.torque[0, tube]), guided)

    def _twisting(self, torque: float, segment: Segment) -> float:
        """Work per length [N] that a constant torque does in twisting a segment beyond its stored energy."""
        return 0.5 * torque**2 / segment.torsional_stiffness if self.shape.twists else 0.0
