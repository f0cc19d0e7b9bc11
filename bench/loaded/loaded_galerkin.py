"""Concentric tubes under dead loads by virtual work, dense, in plain numpy: for judges of what the package answers.

Unknowns are Legendre coefficients of psi_j' and of the curvature k = k_y + i k_z itself, piece by piece between segment
borders, tips, point loads and the seams of long sections.  Equilibrium is

    d sum int W_j = sum P.dr + sum Q.w_p + sum int f_j.dr ds  (tip and point loads, line loads),
    w_p = phi + t dpsi_p,    phi' = R (0, dk_y, dk_z),    (dr)' = phi x t,

where n, all forces beyond s, is known whatever the shape.  With m the moment of all loads beyond, the tangent is that
of the tubes, of -int (t x n).phi and of the moments:

    int dphi^T [(n.t) 1 - t n^T] phi - int R dk.(m x phi) - dpsi_p (t x Q).phi(s_p);

the last term, of dead moments alone, has no mirror image: they have no potential.  Frames are the Gauss collocation of
R' = R hat(0, k_y, k_z), whose stages are the quadrature's points.

Of the package it shares the robot, its sections and materials; no energy, element, step, frame or backbone.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bench.loaded.gauss_points import hat
from bench.loaded.gauss_points import rule_of
from ctr_pvs import Robot
from ctr_pvs.model.materials import Materials
from ctr_pvs.model.sections import piecewise_domain
from ctr_pvs.robot.loads import Loads
from ctr_pvs.robot.loads import check_loads

Array = NDArray[np.float64]

#: Sections longer than this [m] get seams; cuts closer than this [m] are one.
LONGEST, SAME = 0.06, 1e-12


@dataclass(frozen=True, eq=False)
class Fields:
    """What a vector of unknowns means at the Gauss points: psi (P, G, N), k (P, G, 2), R (P, G, 3, 3), at the pieces'
    ends R_end (P, 3, 3), and m (P, G, 3), the moment of all loads beyond."""

    psi: Array
    k: Array
    R: Array
    R_end: Array
    m: Array

    @property
    def t(self) -> Array:
        return self.R[..., 0]


class Galerkin:
    """One D under one set of loads, with polynomials of ``degree`` in P pieces for N tubes.

    The unknowns x (n,) are scaled so that the stiffness each has by itself is 1: psi_j(0) = alpha_j + sqrt(C_j) x_j
    with the guide's compliance C_j, then psi' tube by tube and piece by piece, then k piece by piece, k_y before k_z.
    """

    def __init__(self, robot: Robot, D: Array, loads: Loads, degree: int) -> None:
        self.robot, self.D, self.loads, self.degree = robot, np.array(D, dtype=float), loads, degree
        check_loads(robot, self.D, loads)
        self.rule = rule_of(degree)
        self.domain = piecewise_domain(robot, self.D)
        self.materials = Materials(robot, self.domain)
        self.leader = self.domain.leader
        self._lay_out()
        self._put_loads()

    def _lay_out(self) -> None:
        domain, N = self.domain, self.robot.n_tubes
        points = [load.X - float(self.D[load.tube]) for load in self.loads.point_forces]
        rows, ends = [], [0.0]
        for m, (start, end) in enumerate(itertools.pairwise(domain.boundaries)):
            cuts = [float(start)]
            for cut in sorted([p for p in points if start < p < end] + [float(end)]):
                if cut - cuts[-1] > SAME:
                    cuts.append(cut)
            cuts[-1] = float(end)
            for a, b in itertools.pairwise(cuts):
                panels = int(np.ceil((b - a) / LONGEST))
                rows += [m] * panels
                ends += [a + (b - a) * (i + 1) / panels for i in range(panels)]
        self.section, self.edges = np.array(rows, dtype=int), np.array(ends)
        self.loaded_ends = np.isin(self.edges[1:], points).astype(int)
        self.start, self.h = self.edges[:-1], np.diff(self.edges)
        self.P, self.Q, self.G = len(rows), self.degree + 1, len(self.rule.x)
        self.s = self.start[:, None] + self.h[:, None] * self.rule.x
        self.w = self.h[:, None] * self.rule.weight
        self.K, self.GJ = self.materials.bending[self.section], self.materials.torsional[self.section]
        self.kappa = np.zeros((self.P, self.G, N), dtype=complex)
        for p, m in enumerate(rows):
            self.kappa[p] = self.materials.pre_curvature(m, self.s[p])
        self.total = self.K.sum(axis=1)
        self.pieces_of = (self.GJ > 0.0).sum(axis=0)  # a tube is there from the orifice on
        counts = N + self.Q * np.concatenate([[0], np.cumsum(self.pieces_of)])
        self.rows = [slice(int(a), int(b)) for a, b in itertools.pairwise(counts)]
        self.first_k = int(counts[-1])
        self.n = self.first_k + 2 * self.Q * self.P
        self.softness = np.sqrt(self.materials.guide_compliance)
        self.angle_maps = [self._angle_map(j) for j in range(N)]
        self.k_scale = 1.0 / np.sqrt(self.total * self.h)

    def _angle_map(self, j: int) -> tuple[Array, Array]:
        """psi_j - alpha_j as a linear function of the guide's unknown and the tube's own: at the Gauss points
        (P_j, G, 1 + Q P_j), at the pieces' ends (P_j, 1 + Q P_j)."""
        P, Q = int(self.pieces_of[j]), self.Q
        at, end = np.zeros((P, self.G, 1 + Q * P)), np.zeros((P, 1 + Q * P))
        at[..., 0] = end[:, 0] = self.softness[j]
        for p in range(P):
            scale = np.sqrt(self.h[p] / self.GJ[p, j])
            at[p, :, 1 + Q * p : 1 + Q * (p + 1)] = scale * self.rule.integral
            at[p + 1 :, :, 1 + Q * p] = end[p:, 1 + Q * p] = scale
        return at, end

    def _put_loads(self) -> None:
        """n (P, G, 3) [N], and the point moments with the pieces at whose ends they are."""
        loads, tip = self.loads, np.zeros((self.P, 3))
        self.moments: list[tuple[int, int, Array]] = []  # tube, piece, Q
        everything = [(self.leader, self.P - 1, loads.tip_force, loads.tip_moment)] if self.P else []
        for load in loads.point_forces:
            s = load.X - float(self.D[load.tube])
            p = int(np.argmin(np.abs(self.edges[1:] - s)))
            if s > SAME and abs(self.edges[p + 1] - s) < 1e-9:
                everything.append((load.tube, p, load.force, load.moment))
            elif any(load.moment):
                raise ValueError(f"a moment on the orifice (X = {load.X:g} m) is not modelled")
        for tube, p, force, moment in everything:
            tip[p] += force
            if any(moment):
                self.moments.append((tube, p, np.array(moment)))
        line = np.zeros((self.P, 3))
        for p, j in np.argwhere(self.GJ > 0.0).tolist():
            line[p] += loads.line_forces.get(j, (0.0, 0.0, 0.0))
            if any(loads.gravity):
                tube = self.robot.tubes[j]
                area = tube.areas[int(self.domain.segment[self.section[p], j])]
                line[p] += (tube.density or 0.0) * (area or 0.0) * np.array(loads.gravity)
        beyond = tip + self.h[:, None] * line  # of each piece's end and the piece itself
        after = np.cumsum((beyond)[::-1], axis=0)[::-1] - self.h[:, None] * line
        rest = self.h[:, None] * (1.0 - self.rule.x)
        self.force = after[:, None, :] + rest[..., None] * line[:, None, :]

    @cached_property
    def signature(self) -> tuple[int, bytes]:
        """Equal where coefficients of one D can be taken for those of another: pieces of the same segments, with a
        point load at the end of the same ones."""
        kinds = [self.domain.segment[self.section], self.section[:, None], self.loaded_ends[:, None]]
        return self.degree, np.hstack(kinds).tobytes()

    # --- fields -------------------------------------------------------------------------------------------------------

    def own(self, j: int, x: Array) -> Array:
        """The unknowns that ``angle_maps[j]`` maps."""
        return np.concatenate([x[j : j + 1], x[self.rows[j]]])

    def curvature(self, x: Array) -> Array:
        """k (P, G, 2) [1/m]."""
        b = x[self.first_k :].reshape(self.P, 2, self.Q)
        return np.asarray(self.k_scale[:, None, None] * (self.rule.value @ b.transpose(0, 2, 1)))

    def angles(self, x: Array, alpha: Array) -> Array:
        """psi (P, G, N) [rad], where past its tip a tube keeps its last angle."""
        psi = np.empty((self.P, self.G, len(alpha)))
        for j, (at, end) in enumerate(self.angle_maps):
            own, P = self.own(j, x), int(self.pieces_of[j])
            psi[:P, :, j] = at @ own
            psi[P:, :, j] = end[-1] @ own if P else self.softness[j] * own[0]
        return psi + alpha

    def frames(self, k: Array) -> tuple[Array, Array]:
        """R (P, G, 3, 3) at the Gauss points, (P, 3, 3) at the pieces' ends."""
        P, G = self.P, self.G
        strain = hat(np.concatenate([np.zeros((P, G, 1)), k], axis=2))  # E' = E strain, row by row
        stages = np.einsum("p,gf,pfji->pgifj", self.h, self.rule.partial, strain)
        system = np.eye(3 * G) - stages.reshape(P, 3 * G, 3 * G)
        rows = np.broadcast_to(np.tile(np.eye(3), (G, 1)), (P, 3 * G, 3))
        E = np.linalg.solve(system, rows).reshape(P, G, 3, 3).swapaxes(2, 3)  # the last axis of rows: which row
        E_end = np.eye(3) + np.einsum("pg,pgij,pgjk->pik", self.w, E, strain)
        R_end, R = np.empty((P, 3, 3)), np.eye(3)
        for p in range(P):
            R = R_end[p] = R @ E_end[p]
        before = np.concatenate([np.eye(3)[None], R_end[:-1]])
        return before[:, None] @ E, R_end

    def fields(self, x: Array, alpha: Array) -> Fields:
        k = self.curvature(x)
        R, R_end = self.frames(k)
        pull = np.cross(R[..., 0], self.force)
        whole = np.einsum("pg,pgi->pi", self.w, pull)
        beyond = np.cumsum(whole[::-1], axis=0)[::-1]
        m = beyond[:, None] - self.h[:, None, None] * (self.rule.partial @ pull)
        for _, p, moment in self.moments:
            m[: p + 1] += moment
        return Fields(self.angles(x, alpha), k, R, R_end, m)

    def turned(self, psi: Array) -> tuple[Array, Array]:
        """Real and imaginary part (P, G, N) of K_j c_j."""
        c = self.K[:, None] * self.kappa * np.exp(1j * psi)
        return c.real, c.imag

    @cached_property
    def basis(self) -> Array:
        """w times the polynomials, scaled for k (P, G, Q)."""
        return self.w[..., None] * self.k_scale[:, None, None] * self.rule.value

    # --- virtual work -------------------------------------------------------------------------------------------------

    def potential(self, x: Array, alpha: Array) -> float:
        """Pi [J] up to what depends on neither x nor alpha; of the forces only."""
        f = self.fields(x, alpha)
        c_y, c_z = self.turned(f.psi)
        shared = f.k[..., 0] * c_y.sum(axis=2) + f.k[..., 1] * c_z.sum(axis=2)
        pull = np.einsum("pgi,pgi->pg", self.force, f.t)
        return float(0.5 * x @ x - np.sum(self.w * (shared + pull)))

    def residual(self, x: Array, f: Fields) -> Array:
        """(n,) the virtual work that is not balanced."""
        out = x.copy()
        c_y, c_z = self.turned(f.psi)
        twist = self.w[..., None] * (f.k[..., :1] * c_z - f.k[..., 1:] * c_y)
        for j, (at, _) in enumerate(self.angle_maps):
            P = int(self.pieces_of[j])
            if not P:
                continue
            g = np.einsum("pg,pgn->n", twist[:P, :, j], at)
            out[j] += g[0]
            out[self.rows[j]] += g[1:]
        for j, p, moment in self.moments:
            a = -(moment @ f.R_end[p][:, 0]) * self.angle_maps[j][1][p]
            out[j] += a[0]
            out[self.rows[j]] += a[1:]
        moment = np.stack([c.sum(axis=2) for c in (c_y, c_z)], axis=2)
        moment += np.einsum("pgi,pgic->pgc", f.m, f.R[..., 1:])
        out[self.first_k :] -= (moment.swapaxes(1, 2) @ self.basis).ravel()
        return out

    def tangent(self, f: Fields) -> Array:
        """(n, n) derivative of ``residual``, unsymmetric where moments act."""
        J = np.eye(self.n)
        c_y, c_z = self.turned(f.psi)
        stiff = self.w[..., None] * (f.k[..., :1] * c_y + f.k[..., 1:] * c_z)
        for j, (at, _) in enumerate(self.angle_maps):
            P = int(self.pieces_of[j])
            if not P:
                continue
            index = np.append(j, np.arange(self.rows[j].start, self.rows[j].stop))
            flat = at.reshape(P * self.G, at.shape[2])
            J[np.ix_(index, index)] += (flat.T * stiff[:P, :, j].ravel()) @ flat
            sides = np.stack([c_z[:P, :, j], -c_y[:P, :, j]], axis=2)
            block = at.swapaxes(1, 2) @ (sides[..., None] * self.basis[:P, :, None, :]).reshape(P, self.G, -1)
            columns = self.first_k + np.arange(2 * self.Q * P)
            block = block.swapaxes(0, 1).reshape(len(index), -1)
            J[np.ix_(index, columns)] += block
            J[np.ix_(columns, index)] += block.T
        self._of_loads(f, J)
        return J

    def _of_loads(self, f: Fields, J: Array) -> None:
        """Adds the loads' part: low rank between pieces, because phi beyond a piece depends on its whole turn alone."""
        P, G, Q, first = self.P, self.G, 2 * self.Q, self.first_k
        t, n = f.t, self.force
        pull = np.einsum("pgi,pgi->pg", t, n)[..., None, None] * np.eye(3) - t[..., :, None] * n[..., None, :]
        S = self.w[..., None, None] * pull
        whole = S.sum(axis=1)
        beyond = np.cumsum(whole[::-1], axis=0)[::-1] - whole
        scaled = self.k_scale[:, None, None] * self.rule.value
        turn = (f.R[..., 1:, None] * scaled[:, :, None, None, :]).reshape(P, G, 3, Q)  # R (0, dk)
        local = self.h[:, None, None] * (self.rule.partial @ turn.reshape(P, G, 3 * Q))
        local = local.reshape(P, G, 3, Q)
        full = np.einsum("pg,pgiq->piq", self.w, turn)
        S_local = S @ local
        levers = -self.w[..., None, None] * (turn.swapaxes(2, 3) @ hat(f.m))  # (P, G, Q, 3)
        lower = np.einsum("pgiq,pgij->pqj", local, S) + full.swapaxes(1, 2) @ beyond + levers.sum(axis=1)
        upper = S_local.sum(axis=1) + beyond @ full
        flat = local.reshape(P, G * 3, Q).swapaxes(1, 2)
        own = flat @ S_local.reshape(P, G * 3, Q) + full.swapaxes(1, 2) @ (beyond @ full)
        own += levers.swapaxes(1, 2).reshape(P, Q, G * 3) @ local.reshape(P, G * 3, Q)
        k = J[first:, first:].reshape(P, Q, P, Q)
        for p in range(P):
            k[p, :, p] += own[p]
            before = full[:p].transpose(1, 0, 2).reshape(3, -1)
            k[p, :, :p] += (lower[p] @ before).reshape(Q, p, Q)
            k[:p, :, p] += (before.T @ upper[p]).reshape(p, Q, Q)
        for j, p, moment in self.moments:
            a = self.angle_maps[j][1][p]
            lever = np.cross(f.R_end[p][:, 0], moment)
            columns = np.einsum("i,piq->pq", lever, full[: p + 1]).ravel()
            rows = np.append(j, np.arange(self.rows[j].start, self.rows[j].stop))[: len(a)]
            J[np.ix_(rows, first + np.arange(len(columns)))] -= np.outer(a, columns)

    def changes(self, dx: Array, f: Fields) -> float:
        """By how much [rad] a change of the unknowns twists a tube or turns the centreline, at most, to first order."""
        psi = self.angles(dx, np.zeros(len(self.D)))
        turn = f.R[..., 1:] @ self.curvature(dx)[..., None]
        phi = np.cumsum(np.einsum("pg,pgi->pi", self.w, turn[..., 0]), axis=0)
        return float(max(np.abs(psi).max(initial=0.0), np.linalg.norm(phi, axis=1).max(initial=0.0)))

    # --- what a state tells -------------------------------------------------------------------------------------------

    def tip(self, f: Fields) -> Array:
        """Position (3,) [m] of the farthest tip."""
        return np.asarray(np.einsum("pg,pgi->i", self.w, f.t))

    def psi_ends(self, x: Array, alpha: Array) -> Array:
        """psi (N,) [rad] at each tube's own end; of a tube in the guide, at the orifice."""
        psi = alpha + self.softness * x[: len(alpha)]
        for j, (_, end) in enumerate(self.angle_maps):
            if self.pieces_of[j]:
                psi[j] = alpha[j] + end[-1] @ self.own(j, x)
        return psi


def is_stable(J: Array) -> bool:
    """Whether the symmetric part is positive definite."""
    try:
        np.linalg.cholesky(0.5 * (J + J.T))
    except np.linalg.LinAlgError:
        return False
    return True
