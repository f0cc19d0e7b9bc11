"""Actuation loads by virtual work: tau_alpha = dE/dalpha and tau_D = dE/dD, straightening in the guide counted.

At an equilibrium dE/dq = 0, so only the explicit dependence on the command counts.  Torque coefficients are held while

* material slides: a node of section m carries material of tube j that moves with dX_j = ds + dD_j;
* section ends move: a boundary that belongs to tube j moves with -dD_j;
* the guide swallows tube: it grows more compliant, and new material is straightened.

E has a kink in D_j where an event of tube j lies on the orifice or on another tube's event: the two events part, and
a thin section with its own set of materials appears between them.  Its energy rate is that of the materials on the side
that opens, less the work of the torques that twist it, so each side has its own derivative.

Limits of the model: no friction, no clearance, quasi-static.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.basis import legendre
from ctr_pvs.energy import SectionNodes
from ctr_pvs.energy import TorsionEnergy
from ctr_pvs.energy import bending_density
from ctr_pvs.energy import shared_curvature
from ctr_pvs.sections import ABSENT
from ctr_pvs.sections import Event
from ctr_pvs.shape import Shape

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Loads:
    """What the actuators must supply along +alpha and +D.

    torque : (N,) dE/dalpha [N m].
    force : (N,) dE/dD towards +D [N]; insertion force, as surgeons count it, is its negative.
    force_interval : (N, 2) dE/dD towards -D and towards +D [N]; they differ only at a kink.
    kink : (N,) true where D_j sits on a kink.
    """

    torque: Array
    force: Array
    force_interval: Array
    kink: NDArray[np.bool_]


def virtual_work_loads(energy: TorsionEnergy, shape: Shape) -> Loads:
    """The loads of the equilibrium ``shape`` of ``energy``: exact derivatives of the energy that was minimised."""
    torques = energy.torque_density(energy.turned_moments(energy.angles(shape.q, shape.alpha)))
    rates = _SectionRates(energy, shape, torques)
    toward_minus, toward_plus = (
        rates.slide_forces() + _boundary_forces(energy, shape, rates, side) for side in (-1, 1)
    )
    kink = energy.materials.domain.kinked_tubes()
    toward_minus[~kink] = toward_plus[~kink]
    return Loads(torques.sum(axis=0), toward_plus, np.column_stack([toward_minus, toward_plus]), kink)


class _SectionRates:
    """Energy per motion of each section's ends, at fixed torque coefficients.

    right : (M,) [N] per motion of the far end, the near one held; left : (M,) [N] per motion of the near end.
    """

    def __init__(self, energy: TorsionEnergy, shape: Shape, torques: Array) -> None:
        self.energy, self.shape = energy, shape
        sections = energy.materials.domain.n_sections
        self.slide = np.zeros((sections, len(shape.alpha)))
        self.right, self.left = np.zeros(sections), np.zeros(sections)
        pull = {node.section: torques[part] for node, part in zip(energy.nodes, energy.slices, strict=True)}
        beyond = np.zeros(len(shape.alpha))  # torque density summed over the sections past this one
        for node in sorted([*energy.nodes, *energy.plain_nodes()], key=lambda node: -node.section):
            self._section(node, pull.get(node.section), beyond)
            if node.section in pull:
                beyond = beyond + pull[node.section].sum(axis=0)

    def _section(self, node: SectionNodes, pull: Array | None, beyond: Array) -> None:
        m, x = node.section, node.rule.x
        psi = self.shape.angle(m, x)
        strain_rate = self._strain_work(node, psi)
        per_length = self._stretch(node, psi, pull, beyond)
        self.slide[m] = strain_rate.sum(axis=0)
        with_far_end = float((x @ strain_rate).sum())
        self.right[m] = per_length + with_far_end
        self.left[m] = float(self.slide[m].sum()) - with_far_end - per_length

    def _strain_work(self, node: SectionNodes, psi: Array) -> Array:
        """(g, N) weighted dw/dX_j: K_j Re[conj(kappa*_j - exp(-i psi_j) k) kappa*_j'] [N]."""
        turn = np.exp(1j * psi)
        k = shared_curvature(node.bending, node.bending * node.kappa * turn)
        strain = node.kappa - k[:, None] / turn
        steepness = self.energy.materials.pre_curvature_rate(node.section, node.s)
        return node.weight[:, None] * node.bending * (strain.conj() * steepness).real

    def _stretch(self, node: SectionNodes, psi: Array, pull: Array | None, beyond: Array) -> float:
        """Energy per stretch of the section with its material held at each x: density, twist, and what twist turns."""
        m = node.section
        torque = self.shape.torques.sections[m]
        stiffness = self.energy.materials.torsional[m]
        compliance = np.divide(1.0, stiffness, out=np.zeros_like(stiffness), where=stiffness > 0.0)
        rate = float(node.rule.weights @ bending_density(node.bending, node.kappa, psi))
        rate += 0.5 * float(compliance @ np.sum(torque**2, axis=1))
        rate += float((compliance * torque[:, 0]) @ beyond)
        if pull is not None:
            angle_per_length = legendre(torque.shape[1] - 1, node.rule.x)[1] @ torque.T * compliance
            rate += float(np.sum(pull * angle_per_length))
        return rate

    def slide_forces(self) -> Array:
        """(N,) energy per slide of each tube's material under fixed section ends [N]."""
        return self.slide.sum(axis=0)


def _boundary_forces(energy: TorsionEnergy, shape: Shape, rates: _SectionRates, side: int) -> Array:
    """(N,) part of dE/dD_j towards ``side`` (+1, -1) from the section ends that ride on tube j, and from the guide."""
    domain = energy.materials.domain
    force = np.zeros(len(shape.alpha))
    for index, events in enumerate(domain.events):
        for event in events:
            if index == 0:
                force[event.tube] += 0.0 if side > 0 else _opening_at_orifice(energy, shape, rates, event)
            elif len(events) > 1:
                force[event.tube] -= _opening(energy, shape, rates, index, event, side)
            else:
                force[event.tube] -= rates.right[index - 1]
                if index < domain.n_sections:
                    force[event.tube] -= rates.left[index]
    for tube in range(len(force)):
        force[tube] += _guide_force(energy, shape, tube, side)
    return force


def _opening(energy: TorsionEnergy, shape: Shape, rates: _SectionRates, index: int, event: Event, side: int) -> float:
    """Energy per motion of ``event`` along s when it parts from the other events of boundary ``index``.

    Towards +D the event moves back and shortens the section before; towards -D it moves on and shortens the one after.
    The thin section between holds the materials of the other side, but for the event's own tube.
    """
    domain = energy.materials.domain
    if side > 0:
        segments = domain.segment[index - 1].copy()
        segments[event.tube] = event.after
        return rates.right[index - 1] - _thin_section(energy, shape, index, segments)
    beyond = np.full(len(shape.alpha), ABSENT)
    segments = (domain.segment[index] if index < domain.n_sections else beyond).copy()
    segments[event.tube] = event.before
    shortened = rates.left[index] if index < domain.n_sections else 0.0
    return shortened + _thin_section(energy, shape, index, segments)


def _opening_at_orifice(energy: TorsionEnergy, shape: Shape, rates: _SectionRates, event: Event) -> float:
    """Energy per dD (towards -D) when ``event`` comes out of the orifice with its own segment before it."""
    domain = energy.materials.domain
    out = domain.n_sections > 0
    segments = (domain.segment[0] if out else np.full(len(shape.alpha), ABSENT)).copy()
    segments[event.tube] = event.before
    shortened = rates.left[0] if out else 0.0
    return -(shortened + _thin_section(energy, shape, 0, segments))


def _thin_section(energy: TorsionEnergy, shape: Shape, index: int, segments: NDArray[np.int64]) -> float:
    """Energy per length [N] of a vanishing section at boundary ``index`` with one segment per tube: bending density
    less the work T^2 / (2 GJ) that the passing torques do in twisting it."""
    robot, domain = energy.materials.robot, energy.materials.domain
    s, psi = domain.boundaries[index], shape.angle_at_boundaries[index]
    torque = shape.torques.guide if index == 0 else _torque_before(shape, index)
    bending, kappa = np.zeros(len(psi)), np.zeros(len(psi), dtype=complex)
    twisting = 0.0
    for tube in np.flatnonzero(segments != ABSENT):
        segment = robot.tubes[tube].segments[segments[tube]]
        start = robot.tubes[tube].breaks[segments[tube]]
        bending[tube] = segment.bending_stiffness
        kappa[tube] = segment.pre_curvature(np.array(s + domain.D[tube] - start))
        twisting += 0.5 * float(torque[tube]) ** 2 / segment.torsional_stiffness
    if not bending.any():
        return 0.0
    return float(bending_density(bending, kappa, psi)) - twisting


def _torque_before(shape: Shape, index: int) -> Array:
    """(N,) torque at the far end of section ``index - 1``; torque passes a boundary unchanged."""
    coefficients = shape.torques.sections[index - 1]
    return legendre(coefficients.shape[1] - 1, np.ones(1))[0][0] @ coefficients.T


def _guide_force(energy: TorsionEnergy, shape: Shape, tube: int, side: int) -> float:
    """Energy per dD_j of guiding more of tube j: straightening it, less the work of its torque in twisting it."""
    robot, D = energy.materials.robot, energy.materials.domain.D
    index = energy.materials.domain.guide_segment[tube]
    at_orifice = [event.after for event in energy.materials.domain.events[0] if event.tube == tube]
    if side > 0 and at_orifice:
        index = at_orifice[0]
    if index == ABSENT:  # nothing of the tube there: its base, or its tip, is on the orifice
        index = 0 if D[tube] < robot.tubes[tube].breaks[1] and not at_orifice else ABSENT
    if index == ABSENT:
        return 0.0
    segment = robot.tubes[tube].segments[index]
    kappa = segment.pre_curvature(np.array(D[tube] - robot.tubes[tube].breaks[index]))
    straightening = 0.5 * segment.bending_stiffness * float(np.abs(kappa)) ** 2
    return straightening - 0.5 * float(shape.torques.guide[tube]) ** 2 / segment.torsional_stiffness
