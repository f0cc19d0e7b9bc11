"""Axial forces of the single tubes under dead loads, and the insertion forces that follow from them.

B_j of ``loaded_equations`` is integrated along a solution; where tube j's own segment changes or the tube ends it jumps
by -[e(+) - e(-)], with m and the torques held and

    e = min over k, psi' of sum_j W_j - Re(conj(m) k) - sum_j T_j psi_j'

over the tubes on that side; a point load P, Q of its own takes P.t + Q.u from it, u = k_y d2 + k_z d3 + psi_j' t in the
mean of both sides.  B_j = 0 beyond its end.  In the guide n_j.t is constant and k = 0, so the actuator holds

    tau_D_j = n_j.t(0-) = B_j(0+) - T_j^2 / (2 GJ_j) + K_j |kappa*_j(D_j)|^2 / 2.

Where an event of tube j lies on the orifice or on another tube's event, tau_D_j is one-sided: a tube that moves has
its own event a little before (dD > 0) or beyond (dD < 0) everything else that is there.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.model.sections import ABSENT
from ctr_pvs.oracles.loaded_equations import FRAME
from ctr_pvs.oracles.loaded_equations import MOMENT
from ctr_pvs.oracles.loaded_equations import LoadedProblem
from ctr_pvs.oracles.loaded_equations import after_loads
from ctr_pvs.oracles.loaded_model import LoadedSolution
from ctr_pvs.oracles.loaded_model import Stretch

Array = NDArray[np.float64]
Segments = NDArray[np.int64]
#: Towards -D and towards +D.
TOWARDS = (-1, 1)


def force_interval(solution: LoadedSolution) -> Array:
    """tau_D (N, 2) [N], what the actuators supply along +D: [towards -D, towards +D]; equal where there is no kink."""
    problem, torque, psi = solution.problem, solution.base_torque, solution.alpha.copy()
    psi += problem.guide_compliance * torque
    moment = complex(*solution.base_moment[1:])
    distal = problem.domain.segment[0] if problem.pieces else np.full(len(psi), ABSENT)
    proximal = _just_behind(problem, distal)
    out = np.empty((len(psi), 2))
    out[:] = axial_constants(solution)
    for j in range(len(psi)):
        out[j, 0] -= _jump(problem, j, -1, proximal, distal, 0.0, moment, torque, psi)
        for side, segments in enumerate((proximal, distal)):
            if segments[j] != ABSENT:
                segment = problem.robot.tubes[j].segments[int(segments[j])]
                kappa = abs(complex(_pre_curvature(problem, j, int(segments[j]), 0.0)))
                straightening = 0.5 * segment.bending_stiffness * kappa**2
                out[j, side] += straightening - 0.5 * torque[j] ** 2 / segment.torsional_stiffness
    return out


def force(solution: LoadedSolution) -> Array:
    """tau_D (N,) [N]; at a kink the value towards +D."""
    return force_interval(solution)[:, 1].copy()


def axial_forces(solution: LoadedSolution) -> Array:
    """n_j.t (N,) [N] of every tube just beyond the orifice, towards +D at a kink; their sum is n(0+).e_x."""
    problem = solution.problem
    out = np.zeros(len(solution.alpha))
    if not problem.pieces:
        return out
    piece, y = problem.pieces[0], solution.stretches[0].begin
    k_y, k_z, _, _ = piece.curvature(0.0, y[:, None])
    kappa = np.abs(piece.pre_curvature(0.0)[:, 0])
    straightening = 0.5 * piece.bending * (k_y**2 + k_z**2 - kappa**2)
    twisting = 0.5 * y[piece.torque] ** 2 / piece.torsional
    out[piece.tubes] = axial_constants(solution)[piece.tubes, 1] - straightening - twisting
    return out


def axial_constants(solution: LoadedSolution) -> Array:
    """B_j(0+) (N, 2) [N], for both ways to move; 0 for tubes in the guide."""
    problem, stretches = solution.problem, solution.stretches
    B = np.zeros((len(solution.alpha), 2))
    for index, stretch in reversed(list(enumerate(stretches))):
        following = stretches[index + 1] if index + 1 < len(stretches) else None
        tubes = stretch.piece.tubes
        B[tubes] -= _jumps(problem, stretch, following)[tubes]
        B[tubes] -= (stretch.end - stretch.begin)[stretch.piece.axial, None]
    return B


def _jumps(problem: LoadedProblem, stretch: Stretch, following: Stretch | None) -> Array:
    """B_j(+) - B_j(-) (N, 2) at the end of a stretch: first its loads, then its borders."""
    piece = stretch.piece
    beyond = after_loads(piece, stretch.end[:, None])[:, 0]
    psi, torque = np.zeros(len(problem.D)), np.zeros(len(problem.D))
    psi[piece.tubes], torque[piece.tubes] = beyond[piece.psi], beyond[piece.torque]
    R = beyond[FRAME].reshape(3, 3)
    moment = complex(beyond[MOMENT] @ R[:, 1], beyond[MOMENT] @ R[:, 2])
    before = problem.domain.segment[piece.section]
    after = np.full_like(before, ABSENT) if following is None else problem.domain.segment[following.piece.section]
    out = np.array(
        [
            [_jump(problem, j, way, before, after, piece.end, moment, torque, psi) for way in TOWARDS]
            for j in range(len(psi))
        ]
    )
    for load in piece.loads:
        own = int(np.flatnonzero(piece.tubes == load.tube)[0])
        u = 0.5 * (_strain(stretch, stretch.end, own) + _strain(stretch, beyond, own))
        out[load.tube] -= load.force @ R[:, 0] + load.moment @ u
    return out


def _strain(stretch: Stretch, y: Array, own: int) -> Array:
    """u (3,) [1/m] of the tube with the index ``own`` in its piece, in the base frame, for the state y at its end."""
    piece, R = stretch.piece, y[FRAME].reshape(3, 3)
    k_y, k_z, _, _ = piece.curvature(piece.end, y[:, None])
    rate = y[piece.torque][own] / piece.torsional[own]
    return np.asarray(R @ [rate, k_y[0], k_z[0]])


def _jump(
    problem: LoadedProblem,
    j: int,
    way: int,
    before: Segments,
    after: Segments,
    s: float,
    moment: complex,
    torque: Array,
    psi: Array,
) -> float:
    """B_j(+) - B_j(-) [N] where the segments (N,) change at s, for tube j moving along ``way`` * D."""
    if before[j] == after[j]:
        return 0.0
    # All others' events lie beyond its own (way +1) or before it.
    others = before if way > 0 else after
    near, far = others.copy(), others.copy()
    near[j], far[j] = before[j], after[j]
    e_near, e_far = (_least_energy(problem, segments, s, moment, torque, psi) for segments in (near, far))
    return e_near - e_far


def _least_energy(
    problem: LoadedProblem, segments: Segments, s: float, moment: complex, torque: Array, psi: Array
) -> float:
    """e [N] of tubes with the ``segments`` (N,) at s, under the moment and torques given."""
    present = np.flatnonzero(segments != ABSENT)
    if not len(present):
        return 0.0
    parts = [problem.robot.tubes[j].segments[int(segments[j])] for j in present]
    K = np.array([part.bending_stiffness for part in parts])
    G = np.array([part.torsional_stiffness for part in parts])
    kappa = np.array([_pre_curvature(problem, j, int(segments[j]), s) for j in present.tolist()])
    c = kappa * np.exp(1j * psi[present])
    k = (moment + K @ c) / K.sum()
    bending = 0.5 * K @ np.abs(k - c) ** 2 - (np.conj(moment) * k).real
    return float(bending - np.sum(0.5 * torque[present] ** 2 / G))


def _pre_curvature(problem: LoadedProblem, j: int, segment: int, s: float) -> complex:
    X = problem.materials.abscissa(j, segment, np.array(s))
    return complex(problem.robot.tubes[j].segments[segment].pre_curvature(X))


def _just_behind(problem: LoadedProblem, distal: Segments) -> Segments:
    """Segments (N,) on the orifice's other side: what emerges there first if a tube moves out."""
    guide = problem.domain.guide_segment
    return np.where(guide == ABSENT, distal, guide)
