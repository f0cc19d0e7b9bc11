"""Insertion forces by eq. (41) of the seed, as printed, for two tubes.

With c = exp(i psi_2) kappa*_2 in the Bishop frame, the terms of eq. (41) are Re(conj(k) c) and the like, and

    (xi_k1' + ad_xi1 xi_k1)^T Ad_gtheta2 xi*_k2  =  Re(conj(k') c).

The integral over the overlap is taken by parts, so that it needs the derivative of c and not of k.

Eq. (41) is not the derivative of the elastic energy: it leaves out the concentrated axial forces at the orifice and at
the outer tube's tip, where curvature jumps (docs/insertion_forces.md).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.errors import FieldError
from ctr_pvs.model.basis import gauss_legendre
from ctr_pvs.model.sections import ABSENT
from ctr_pvs.model.shape import Shape
from ctr_pvs.robot.robot import Robot

Array = NDArray[np.float64]

#: Gauss points on each panel of the overlap.
NODES = 32


def check_renda2021(robot: Robot) -> None:
    """Raise ``FieldError`` unless eq. (41) was derived for robots like this one: two tubes."""
    if robot.n_tubes != 2:
        rule = "virtual_work for this robot: eq. (41) of the seed is for two tubes"
        raise FieldError("force_model", "renda2021", rule, f"it has {robot.n_tubes}")


def printed_forces(shape: Shape) -> Array:
    """tau_D1, tau_D2 (2,) [N] of eq. (41), along +x as eq. (42) has it: on the +D axis they are the negatives.

    Raises ``FieldError`` unless tube 1 ends inside tube 2 and pre-curvatures are smooth over the overlap, as the
    equation takes for granted.
    """
    check_renda2021(shape.materials.robot)
    overlap = _overlap(shape)
    stiffness, inner = shape.materials.bending[overlap], 1
    rule = gauss_legendre(NODES, shape.panels(overlap))
    x = rule.x
    k, (k_orifice, k_end) = shape.curvature(overlap, x), shape.curvature(overlap, np.array([0.0, 1.0]))
    s = shape.domain.boundaries[overlap] + x * shape.domain.lengths[overlap]
    turn = np.exp(1j * shape.angle(overlap, x)[:, inner])
    rest = shape.materials.pre_curvature(overlap, s)[:, inner]
    rest_rate = shape.materials.pre_curvature_rate(overlap, s)[:, inner]
    rate = turn * (rest_rate + 1j * shape.twist_rate(overlap, x)[:, inner] * rest)
    work = shape.domain.lengths[overlap] * float(rule.weights @ (k.conj() * rate).real)
    second = stiffness[inner] * (0.5 * abs(k_orifice) ** 2 - 0.5 * abs(k_end) ** 2 + work)
    # tau_D1 + tau_D2 is xi_k1^T of the whole internal moment past the orifice, eq. (43): zero where bending balances.
    balance = float((k_orifice.conj() * _moment_past_orifice(shape, overlap, k_orifice)).real)
    return np.array([balance - second, second])


def _moment_past_orifice(shape: Shape, overlap: int, k: complex) -> complex:
    """Internal bending moment [N m] of both tubes just past the orifice, in Bishop axes."""
    here = np.zeros(1)
    rest = shape.materials.pre_curvature(overlap, shape.domain.boundaries[overlap] + here)[0]
    turned = rest * np.exp(1j * shape.angle(overlap, here)[0])
    return complex(shape.materials.bending[overlap] @ (k - turned))


def _overlap(shape: Shape) -> int:
    """The section where both tubes overlap beyond the orifice, with nothing but smooth material in it."""
    segment = shape.domain.segment
    both = np.flatnonzero(np.all(segment != ABSENT, axis=1))
    alone = np.flatnonzero(segment[:, 0] == ABSENT)
    if len(both) != 1 or not len(alone):
        rule = "virtual_work for this command: eq. (41) is for a tube 1 of smooth pre-curvature that ends inside tube 2"
        raise FieldError("force_model", "renda2021", rule)
    return int(both[0])
