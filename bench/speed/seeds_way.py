"""The seed's own way to an equilibrium: its equations in monomials, and a general root finder that differences them.

Eq. (26), (33), (35) in the bases of eq. (34), solved by ``scipy.optimize.root(method="hybr")`` with scipy's defaults.
Everything that does not change with the rotations is tabulated once, so one evaluation is two matrix products and a
few array operations: what is timed is the method and not a careless way to write it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import root

from bench.speed.centreline import GAUSS
from bench.speed.centreline import Centreline
from bench.speed.fixed_levels import Level
from bench.speed.fixed_levels import monomial_tables
from bench.speed.fixed_levels import printed_residual
from ctr_pvs import Robot

Array = NDArray[np.float64]

#: Gauss points in a section beyond the degree of the basis.
MORE_NODES = 4
#: Steps of the centreline in every section.
STEPS = 5


class SeedsWay(Level):
    """Equilibria of one robot at one D (N,) [m] with monomials of one ``degree`` for every strain."""

    def __init__(self, robot: Robot, D: Array, degree: int = 2) -> None:
        y, weights = np.polynomial.legendre.leggauss(degree + MORE_NODES)
        rows = monomial_tables(robot, D, degree, 0.5 * (y + 1.0))
        points, tubes = len(y), robot.n_tubes
        self.unknowns = self.n = rows[0][1].rate.shape[2]
        self.points, self.tubes = points * len(rows), tubes
        # One row of the big map for each number that the energy depends on: twist rates, relative twists, bending.
        rate = np.concatenate([maps.rate for _, maps, _, _ in rows])
        turn = np.concatenate([maps.angle - maps.angle[:, [s.lead]] for s, maps, _, _ in rows])
        bend = np.concatenate([maps.curvature for _, maps, _, _ in rows])
        self.map = np.concatenate([rate.reshape(-1, self.n), turn.reshape(-1, self.n), bend.reshape(-1, self.n)])
        self.weight = np.concatenate([0.5 * s.length * weights for s, _, _, _ in rows])
        self.lead = np.repeat([s.lead for s, _, _, _ in rows], points)
        self.torsional = np.concatenate([np.tile(s.torsional, (points, 1)) for s, _, _, _ in rows])
        self.bending = np.concatenate([np.tile(bending, (points, 1)) for _, _, bending, _ in rows])
        self.moment = self.bending * np.concatenate([kappa for _, _, _, kappa in rows])
        self.total = self.bending.sum(axis=1)
        self.q = np.zeros(self.n)
        self.line = _Line(robot, D, degree)

    def residual(self, q: Array, alpha: Array) -> Array:
        """Left minus right sides (n,) of eq. (26), (33), (35) at coordinates ``q`` (n,)."""
        fields = self.map @ q
        many = self.points * self.tubes
        rate, turn = fields[:many].reshape(-1, self.tubes), fields[many : 2 * many].reshape(-1, self.tubes)
        u = fields[2 * many :].view(complex)
        moments = self.moment * np.exp(1j * (alpha - alpha[self.lead, None] + turn))
        bent = self.weight * (self.total * u - moments.sum(axis=1))
        torsion = self.weight[:, None] * self.torsional * rate
        turning = -self.weight[:, None] * (moments.conj() * u[:, None]).imag
        return np.concatenate([torsion.ravel(), turning.ravel(), bent.view(float)]) @ self.map

    def warm(self, alpha: Array) -> Array | None:
        found = root(self.residual, self.q, (alpha,), method="hybr")
        if not found.success:
            return None
        self.q = found.x
        return self.line.tip(self.q, alpha)

    def cold(self, alpha: Array) -> Array | None:
        """One solve from straight, untwisted tubes: scipy's success is believed, whatever branch it is on."""
        self.q = np.zeros(self.n)
        return self.warm(alpha)


class AsPrinted(SeedsWay):
    """The same equations evaluated as they are printed, with wrenches, Ad* and ad* at every Gauss point: as the package
    has them to check its energy, with no care for speed."""

    def __init__(self, robot: Robot, D: Array, degree: int = 2) -> None:
        super().__init__(robot, D, degree)
        self.case = robot, D, degree

    def printed(self, alpha: Array) -> Array | None:
        """The tip, from the last answer of ``warm``."""
        found = root(printed_residual(*self.case, alpha), self.q, method="hybr")
        return self.line.tip(found.x, alpha) if found.success else None


class _Line:
    """The tip for coordinates q: curvature of the leading tube, turned by its angle, along the centreline's steps."""

    def __init__(self, robot: Robot, D: Array, degree: int) -> None:
        self.centreline = Centreline(robot, D, STEPS)
        x = ((np.arange(STEPS)[:, None] + GAUSS) / STEPS).ravel()
        rows = [row for row in monomial_tables(robot, D, degree, x) if row[0].bends]
        self.angle = np.concatenate([maps.angle[:, s.lead] for s, maps, _, _ in rows])
        self.curvature = np.concatenate([maps.curvature for _, maps, _, _ in rows])
        self.lead = np.repeat([s.lead for s, _, _, _ in rows], len(x))
        alone = [kappa[:, s.lead] if len(s.tubes) == 1 else np.zeros(len(x)) for s, _, _, kappa in rows]
        self.alone = np.concatenate(alone)

    def tip(self, q: Array, alpha: Array) -> Array:
        """Position (3,) [m]."""
        bent = self.curvature @ q
        turn = np.exp(1j * (alpha[self.lead] + self.angle @ q))
        return self.centreline.tip_of_curvature((bent[:, 0] + 1j * bent[:, 1] + self.alone) * turn)
