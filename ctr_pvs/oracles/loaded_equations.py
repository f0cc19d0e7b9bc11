"""The boundary-value model under dead loads, piece by piece: its unknowns, its rates, what jumps between the pieces.

A piece ends at a segment border, a tip or a point load.  With the Bishop frame R = (t, d2, d3), n and m the internal
force and moment (what the part beyond s exerts, in the base frame), m_perp = m.d2 + i m.d3 and c_j = exp(i psi_j)
kappa*_j,

    R' = R hat(0, k_y, k_z),    r' = t,    m' = -t x n,    n' = -sum f_j,    k = (m_perp + sum K_j c_j) / sum K_j,
    psi_j' = T_j / GJ_j,    T_j' = -K_j Im(conj(c_j) k).

A point load P, Q on tube p takes P from n, Q from m and Q.t from T_p; T_j = 0 at tube j's end, m = 0 beyond the tip.
Of one tube's axial force n_j.t, without friction or clearance, B_j = n_j.t + Re(conj(k) m_j) + psi_j' T_j - W_j (W_j
its energy per length, m_j = K_j (k - c_j)) obeys

    B_j' = -dW_j/dX - f_j.t,    dW_j/dX = -K_j Re(conj(k - c_j) exp(i psi_j) dkappa*_j/dX).

References: D. C. Rucker, B. A. Jones, R. J. Webster III, "A geometrically exact model for externally loaded
concentric-tube continuum robots", IEEE Transactions on Robotics 26(5) (2010); S. S. Antman, "Nonlinear problems of
elasticity" (2005), ch. 8, for the rod.  Without tubes around it, B_j is the integral of the rod's equations that goes
with sliding along itself.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike
from numpy.typing import NDArray

from ctr_pvs.errors import LoadError
from ctr_pvs.model.materials import Materials
from ctr_pvs.model.sections import ABSENT
from ctr_pvs.model.sections import SAME_PLACE
from ctr_pvs.model.sections import Domain
from ctr_pvs.model.sections import piecewise_domain
from ctr_pvs.robot.loads import ZERO
from ctr_pvs.robot.loads import Loads
from ctr_pvs.robot.loads import check_loads
from ctr_pvs.robot.robot import Robot

Array = NDArray[np.float64]
#: Real, or complex where a complex step carries a derivative along.
Field: TypeAlias = NDArray[Any]

#: Rows of a piece's state, before psi, T and B of its tubes: R row by row, r [m], m [N m].
FRAME, PLACE, MOMENT, TUBES = slice(0, 9), slice(9, 12), slice(12, 15), 15


@dataclass(frozen=True, eq=False)
class PlacedLoad:
    """A dead force P (3,) [N] and moment Q (3,) [N m] on ``tube`` at arc length s [m]."""

    tube: int
    s: float
    force: Array
    moment: Array


class Piece:
    """The equations between two cuts of the centreline, for the p tubes present there.

    Its state y (15 + 3p, ...) is R, r, m, then psi, T and B of its tubes.

    section : of the domain; start, length : m; tubes (p,); bending, torsional (p,) [N m^2]; line_force (p, 3) [N/m];
    loads : those at its end; ends (p,) : tubes whose last piece it is; force_after (3,) [N] : n just beyond its end.
    """

    def __init__(self, materials: Materials, m: int, start: float, end: float, line_force: Array) -> None:
        self.section, self.start, self.end, self.length = m, start, end, end - start
        self.tubes = np.flatnonzero(materials.torsional[m])
        self.p = len(self.tubes)
        self.bending, self.torsional = materials.bending[m, self.tubes], materials.torsional[m, self.tubes]
        self.line_force = line_force[self.tubes]
        self.loads: list[PlacedLoad] = []
        self.ends = np.zeros(self.p, dtype=bool)
        self.force_after = np.zeros(3)
        self._materials = materials
        psi = TUBES + self.p
        self.psi, self.torque, self.axial = (
            slice(TUBES, psi),
            slice(psi, psi + self.p),
            slice(psi + self.p, psi + 2 * self.p),
        )

    @property
    def size(self) -> int:
        return TUBES + 3 * self.p

    @property
    def force_at_end(self) -> Array:
        """n (3,) [N] just before the end."""
        return np.asarray(sum((load.force for load in self.loads), self.force_after))

    def force(self, s: ArrayLike) -> Array:
        """n (..., 3) [N] at arc lengths s (...) [m]."""
        rest = np.asarray(self.end - np.asarray(s))
        return np.asarray(self.force_at_end + rest[..., None] * self.line_force.sum(axis=0))

    def turned(self, kappa: NDArray[np.complex128], psi: Field) -> tuple[Field, Field]:
        """Real and imaginary part, (p, c) each, of exp(i psi_j) times ``kappa`` (p, 1) or (p, c); analytic in psi."""
        cos, sin = np.cos(psi), np.sin(psi)
        return kappa.real * cos - kappa.imag * sin, kappa.real * sin + kappa.imag * cos

    def pre_curvature(self, s: ArrayLike) -> NDArray[np.complex128]:
        """kappa*_j (p, 1) [1/m] in the tubes' own frames at one arc length s [m], (p, c) at s (c,)."""
        kappa = self._materials.pre_curvature(self.section, np.asarray(s))
        return np.asarray(kappa[..., self.tubes].T.reshape(self.p, -1))

    def pre_curvature_rate(self, s: ArrayLike) -> NDArray[np.complex128]:
        """Their derivatives along the tubes [1/m^2], likewise."""
        rate = self._materials.pre_curvature_rate(self.section, np.asarray(s))
        return np.asarray(rate[..., self.tubes].T.reshape(self.p, -1))

    def curvature(self, s: ArrayLike, y: Field) -> tuple[Field, Field, Field, Field]:
        """k_y, k_z (c,) of the centreline and c_y, c_z (p, c) of the tubes [1/m], in the Bishop frame, for states
        y (15 + 3p, c) at one arc length s or at s (c,)."""
        R, m = y[FRAME].reshape(3, 3, -1), y[MOMENT]
        c_y, c_z = self.turned(self.pre_curvature(s), y[self.psi])
        total = self.bending.sum()
        k_y = ((m * R[:, 1]).sum(axis=0) + self.bending @ c_y) / total
        k_z = ((m * R[:, 2]).sum(axis=0) + self.bending @ c_z) / total
        return k_y, k_z, c_y, c_z

    def rates(self, s: ArrayLike, y: Field) -> Field:
        """y' (15 + 3p, c) of states y at one arc length s or at s (c,)."""
        K = self.bending[:, None]
        R, n = y[FRAME].reshape(3, 3, -1), self.force(s).T
        t, d2, d3 = R[:, 0], R[:, 1], R[:, 2]
        k_y, k_z, c_y, c_z = self.curvature(s, y)
        slope_y, slope_z = self.turned(self.pre_curvature_rate(s), y[self.psi])
        out = np.empty_like(y)
        frame = out[FRAME].reshape(3, 3, -1)
        frame[:, 0], frame[:, 1], frame[:, 2] = k_z * d2 - k_y * d3, -k_z * t, k_y * t
        out[PLACE] = t
        for a, b, c in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
            out[MOMENT][a] = n[b] * t[c] - n[c] * t[b]
        out[self.psi] = y[self.torque] / self.torsional[:, None]
        out[self.torque] = -K * (c_y * k_z - c_z * k_y)
        out[self.axial] = K * ((k_y - c_y) * slope_y + (k_z - c_z) * slope_z) - self.line_force @ t
        return out


def after_loads(piece: Piece, y: Field) -> Field:
    """The state just beyond the loads at a piece's end."""
    y = y.copy()
    t = y[FRAME].reshape(3, 3, -1)[:, 0]
    for load in piece.loads:
        y[MOMENT] -= load.moment[:, None]
        row = piece.torque.start + int(np.flatnonzero(piece.tubes == load.tube)[0])
        y[row] -= load.moment @ t
    return y


def carried_over(piece: Piece, following: Piece, y: Field) -> Field:
    """The state as the piece after it has it: without the tubes that ended."""
    kept = np.isin(piece.tubes, following.tubes)
    parts = [y[rows][kept] for rows in (piece.psi, piece.torque, piece.axial)]
    return np.concatenate([y[:TUBES], *parts])


class LoadedProblem:
    """One command's boundary-value problem under loads.

    pieces : from the orifice to the farthest tip; leader : the tube that carries the tip's wrench.

    Raises:
        CommandError: for a command the robot cannot take.
        LoadError: for loads that cannot act there, a point load on the orifice itself among them.
    """

    def __init__(self, robot: Robot, alpha: ArrayLike, D: ArrayLike, loads: Loads) -> None:
        self.robot, self.loads = robot, loads
        self.alpha, self.D = robot.check_command(alpha, D)
        check_loads(robot, self.D, loads)
        self.domain = piecewise_domain(robot, self.D)
        self.materials = Materials(robot, self.domain)
        self.guide_compliance = self.materials.guide_compliance
        self.leader = self.domain.leader
        stiffest = max(segment.bending_stiffness for tube in robot.tubes for segment in tube.segments)
        #: Of moments [N m]: about what bends the robot by one radian.
        self.unit = stiffest / max(tube.length for tube in robot.tubes)
        self.pieces = self._pieces(placed_loads(robot, self.D, loads, self.leader, self.domain.length))

    def _pieces(self, loads: list[PlacedLoad]) -> list[Piece]:
        line_force = line_forces(self.robot, self.domain, self.loads)
        pieces: list[Piece] = []
        for m, (start, end) in enumerate(itertools.pairwise(self.domain.boundaries)):
            inside = sorted({load.s for load in loads if start + SAME_PLACE < load.s < end - SAME_PLACE})
            cuts = [float(start), *inside, float(end)]
            pieces += [Piece(self.materials, m, a, b, line_force[m]) for a, b in itertools.pairwise(cuts) if b > a]
        force = np.zeros(3)
        following = np.zeros(0, dtype=np.intp)
        for piece in reversed(pieces):
            piece.loads = [load for load in loads if abs(load.s - piece.end) <= SAME_PLACE]
            piece.ends = ~np.isin(piece.tubes, following)
            piece.force_after = force
            force, following = piece.force(piece.start), piece.tubes
        return pieces

    @property
    def present(self) -> NDArray[np.intp]:
        """Tubes that come out of the orifice."""
        return self.pieces[0].tubes if self.pieces else np.zeros(0, dtype=np.intp)


def placed_loads(robot: Robot, D: Array, loads: Loads, leader: int, length: float) -> list[PlacedLoad]:
    """Point loads and the tip's wrench, where they are; none that is zero."""
    placed = [PlacedLoad(leader, length, np.array(loads.tip_force), np.array(loads.tip_moment))]
    for index, load in enumerate(loads.point_forces):
        s, tube = load.X - float(D[load.tube]), robot.tubes[load.tube]
        if s <= SAME_PLACE:
            limit = f"X > {D[load.tube]:.9g} m, a place of tube {tube.name!r} beyond the orifice"
            raise LoadError(f"point_forces[{index}].X", load.X, limit, "what acts on the orifice moves nothing")
        placed.append(PlacedLoad(load.tube, s, np.array(load.force), np.array(load.moment)))
    return [load for load in placed if load.force.any() or load.moment.any()]


def line_forces(robot: Robot, domain: Domain, loads: Loads) -> Array:
    """f_j (M, N, 3) [N/m] of every tube in every section, weight included, 0 where it is absent."""
    out = np.zeros((*domain.segment.shape, 3))
    for m, j in np.argwhere(domain.segment != ABSENT).tolist():
        tube = robot.tubes[j]
        out[m, j] = loads.line_forces.get(j, ZERO)
        area = tube.areas[int(domain.segment[m, j])]
        if any(loads.gravity) and tube.density is not None and area is not None:  # known: check_loads has seen to it
            out[m, j] += tube.density * area * np.array(loads.gravity)
    return out
