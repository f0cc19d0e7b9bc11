"""Tip Jacobian: how the tip moves with the command, by the implicit function theorem.

With g' = g xi on sections whose ends move, the tip's spatial twist is the integral of Ad_g d(h xi) over x = (s -
s_m) / h: changes of curvature turn everything distal, changes of length push it along the tangent (eq. (36)-(37),
integrated at fixed x).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.backbone import bishop_frames
from ctr_pvs.energy import SectionNodes
from ctr_pvs.energy import TorsionEnergy
from ctr_pvs.energy import shared_curvature
from ctr_pvs.sensitivity import Sensitivity
from ctr_pvs.shape import TorsionShape

Array = NDArray[np.float64]


def tip_jacobian(energy: TorsionEnergy, shape: TorsionShape, tolerance: float) -> Array:
    """(6, 2 N) rates of the tip: rows position [m] and rotation [rad] in base axes, columns alpha [1/rad] then D [1/m].

    Rotation is that of the leading tube's material frame.  At a kink of the energy in D it is the mean of both sides.
    """
    tubes = len(shape.alpha)
    none = np.zeros((tubes, tubes))
    directions = np.hstack([np.eye(tubes), none]), np.hstack([none, np.eye(tubes)])
    rates = Sensitivity(energy, shape.alpha, shape.q, *directions, twists=shape.twists)
    nodes = energy.all_nodes
    places = np.concatenate([np.zeros(1), *(node.s for node in nodes), [shape.domain.length]])
    rotation, position = bishop_frames(shape.pieces(tolerance), places)
    turn, push = np.zeros((3, 2 * tubes)), np.zeros((3, 2 * tubes))
    start = 1
    for node in nodes:
        here = slice(start, start + len(node.s))
        start += len(node.s)
        bend, stretch = _strain_rates(node, shape, rates)
        turning = rotation[here] @ bend  # (g, 3, 2N)
        arm = position[-1] - position[here]
        turn += turning.sum(axis=0)
        push += np.cross(turning, arm[:, :, None], axis=1).sum(axis=0)
        push += np.einsum("g,gi,p->ip", node.rule.weights, rotation[here, :, 0], stretch)
    return np.vstack([push, turn + rotation[-1, :, :1] * _leader_turn(shape, rates)])


def _strain_rates(node: SectionNodes, shape: TorsionShape, rates: Sensitivity) -> tuple[Array, Array]:
    """Weighted d(h k) (g, 3, P) in the Bishop frame and dh (P,) of one section."""
    m, x = node.section, node.rule.x
    materials = shape.materials
    turned = np.exp(1j * shape.angle(m, x))
    moments = node.bending * node.kappa * turned
    steepness = node.bending * materials.pre_curvature_rate(m, node.s) * turned
    change = steepness[:, :, None] * rates.material_motion(m, x) + 1j * moments[:, :, None] * rates.angle_rate(m, x)
    k = shared_curvature(node.bending, moments)
    k_rate = change.sum(axis=1) / node.bending.sum()
    stretch = rates.domain.lengths[m]
    swing = node.weight[:, None] * k_rate + node.rule.weights[:, None] * k[:, None] * stretch
    bend = np.zeros((len(x), 3, swing.shape[1]))
    bend[:, 1] = swing.real
    bend[:, 2] = swing.imag
    return bend, stretch


def _leader_turn(shape: TorsionShape, rates: Sensitivity) -> Array:
    """(P,) rate of the leading tube's angle at the tip."""
    last = shape.domain.n_sections - 1
    if last < 0:  # nothing is out: no torque, no twist
        return rates.alpha_rate[shape.leader]
    return rates.angle_rate(last, np.ones(1))[0, shape.leader]
