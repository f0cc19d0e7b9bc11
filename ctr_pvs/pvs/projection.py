"""The seed's equilibrium equations as it writes them: eq. (13) projected by d'Alembert's principle, (26), (33), (35).

    int B_1^T (F_1 + Ad*_g_theta2 (F_2 + ..)) dX = 0,        F_j = (Sigma_j (k_j - k*_j), N_j)
    int B_theta_j^T (F_j + ..) dX = sum over sections int J_theta_j^T ad*_xi1 Ad*_(g_theta2 .. g_theta_j) (F_j + ..) dX

The unknown internal forces N_j drop out, because no basis strains shear or stretch, and J_theta turns about the
tangent.  This is the independent form of ``FullEnergy.gradient``: their agreement shows that the energy is the
seed's model.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.pvs.energy import FullEnergy
from ctr_pvs.pvs.se3 import adjoint
from ctr_pvs.pvs.se3 import coadjoint
from ctr_pvs.pvs.se3 import inverse
from ctr_pvs.pvs.se3 import roll
from ctr_pvs.pvs.se3 import small_coadjoint
from ctr_pvs.pvs.space import StrainSection

Array = NDArray[np.float64]


def projected_residual(energy: FullEnergy, q: Array) -> Array:
    """Left minus right sides (n,) of (26)/(33)/(35) at coordinates ``q`` (n,), in the order of q."""
    residual = np.zeros(energy.n)
    wrenches = [section_wrenches(energy, number, q) for number in range(len(energy.space.sections))]
    for number, section in enumerate(energy.space.sections):
        if section.columns.stop == section.columns.start:
            continue
        table = energy.space.table(section, energy.rule.x)
        weight = section.length * energy.rule.weights
        together = _carried(wrenches[number], section, 0)
        width = table.lead.shape[2]
        own = np.einsum("g,grn,gr->n", weight, table.lead, together[:, :3])
        own += _turned_beyond(energy, wrenches, number, 0, table.lead[:, 0])
        start = section.columns.start
        residual[start : start + width] = own
        start += width
        for order, basis in enumerate(table.relative, start=1):
            carried = _carried(wrenches[number], section, order)
            left = np.einsum("g,gn,g->n", weight, basis, carried[:, 0])
            right = _turned_beyond(energy, wrenches, number, order, basis)
            residual[start : start + basis.shape[1]] = left + right
            start += basis.shape[1]
    return residual


def section_strains(energy: FullEnergy, number: int, q: Array) -> tuple[Array, Array]:
    """xi_j (g, N, 6) of every tube in section ``number`` (eq. 12) and psi (g, N) [rad], at the energy's Gauss
    points."""
    section = energy.space.sections[number]
    maps = energy.space.maps(number, energy.rule.x)
    psi, rate = energy.alpha + maps.angle @ q, maps.rate @ q
    bent = maps.curvature @ q
    if section.bends and len(section.tubes) == 1:
        rest = energy.materials.pre_curvature(section.index, section.start + section.length * energy.rule.x)
        bent = np.column_stack([rest[:, section.lead].real, rest[:, section.lead].imag])
    xi = np.zeros((*psi.shape, 6))
    lead = np.column_stack([rate[:, section.lead], bent, np.ones(len(bent)), np.zeros((len(bent), 2))])
    for tube in section.tubes:
        back = adjoint(inverse(roll(psi[:, tube] - psi[:, section.lead])))
        xi[:, tube] = (back @ lead[:, :, None])[:, :, 0]
        xi[:, tube, 0] += rate[:, tube] - rate[:, section.lead]
    return xi, psi


def section_wrenches(energy: FullEnergy, number: int, q: Array) -> tuple[Array, Array, Array]:
    """F_j (g, N, 6) of eq. (14), with no internal force, the strains xi_j (g, N, 6) and psi (g, N)."""
    section = energy.space.sections[number]
    xi, psi = section_strains(energy, number, q)
    wrench = np.zeros_like(xi)
    wrench[:, :, 0] = section.torsional * xi[:, :, 0]
    if section.bends:
        stiffness = energy.materials.bending[section.index]
        rest = energy.materials.pre_curvature(section.index, section.start + section.length * energy.rule.x)
        wrench[:, :, 1] = stiffness * (xi[:, :, 1] - rest.real)
        wrench[:, :, 2] = stiffness * (xi[:, :, 2] - rest.imag)
    return wrench, xi, psi


def _carried(state: tuple[Array, Array, Array], section: StrainSection, order: int) -> Array:
    """(g, 6) F_j + Ad*_g_theta F_(j+1) + .. of the tubes from ``order`` inwards, in the frame of the first of them."""
    wrench, _, psi = state
    first = section.tubes[order]
    total = np.zeros(wrench[:, 0].shape)
    for tube in section.tubes[order:]:
        total += (coadjoint(roll(psi[:, tube] - psi[:, first])) @ wrench[:, tube, :, None])[:, :, 0]
    return total


def _turned_beyond(
    energy: FullEnergy,
    states: list[tuple[Array, Array, Array]],
    number: int,
    order: int,
    basis: Array,
) -> Array:
    """(n,) minus the right side for the columns ``basis`` (g, n) that turn the tubes from ``order`` inwards.

    Only where a tube outside them leads do they turn against anything; in the guide nothing is bent.
    """
    turned = energy.space.sections[number].tubes[order:]
    work = np.zeros(basis.shape[1])
    for beyond in range(number, len(energy.space.sections)):
        section = energy.space.sections[beyond]
        if not section.bends or not section.tubes or section.lead in turned:
            continue
        reach = _integral(energy, number, order, beyond)
        moved = [tube for tube in section.tubes if tube in turned]
        wrench, xi, psi = states[beyond]
        carried = np.zeros(xi[:, 0].shape)
        for tube in moved:
            carried += (coadjoint(roll(psi[:, tube] - psi[:, section.lead])) @ wrench[:, tube, :, None])[:, :, 0]
        turning = (small_coadjoint(xi[:, section.lead]) @ carried[:, :, None])[:, 0, 0]
        work -= (section.length * energy.rule.weights * turning) @ reach
    return work


def _integral(energy: FullEnergy, number: int, order: int, beyond: int) -> Array:
    """J_theta (g, n) of eq. (22) for one basis of section ``number``, seen at the Gauss points of section
    ``beyond``."""
    section = energy.space.sections[number]
    table = energy.space.table(section, np.array([0.5]))
    widths = [table.lead.shape[2], *(relative.shape[1] for relative in table.relative)]
    start = section.columns.start + sum(widths[:order])
    angle = energy.space.maps(beyond, energy.rule.x).angle
    return angle[:, section.tubes[order], start : start + widths[order]]
