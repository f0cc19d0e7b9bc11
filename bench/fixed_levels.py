"""The package's model levels at one polynomial degree each, and converged references.

The public solver chooses its degree; these go below it.  All uses of the package's inner parts by the speed benches
are in this file.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from centreline import Centreline
from numpy.typing import NDArray

from ctr_pvs import EquilibriumSolver
from ctr_pvs import Robot
from ctr_pvs.materials import Materials
from ctr_pvs.models import Models
from ctr_pvs.pvs import frames
from ctr_pvs.pvs.energy import FullEnergy
from ctr_pvs.pvs.projection import projected_residual
from ctr_pvs.pvs.solution import FullShape
from ctr_pvs.pvs.solution import solve_full
from ctr_pvs.pvs.space import FullSpace
from ctr_pvs.pvs.space import StrainMaps
from ctr_pvs.pvs.space import StrainSection
from ctr_pvs.pvs.strain_basis import PolynomialBasis
from ctr_pvs.refine import tip_position
from ctr_pvs.sections import piecewise_domain
from ctr_pvs.shape import TorsionlessShape
from ctr_pvs.shape import TorsionShape
from ctr_pvs.solve import newton

Array = NDArray[np.float64]

#: Of the references: degree of the twist rates, solver tolerance [m], steps of the centreline in every section.
DEGREE, TOLERANCE, STEPS = 20, 1e-10, 24
#: Gauss points of the `full` level beyond the degree.
MORE_NODES = 6
#: Degree at which a cold start of the `full` level goes from the untwisted robot to the command, and in how many equal
#: steps of rotation any cold start does so, tried in turn.
COLD_DEGREE, EQUAL_STEPS = 5, (1, 2, 4, 8, 16, 64, 256)
#: Backbone integration [m] while a level's own error is not known yet.
FINE = 1e-12


class Level:
    """One level at one degree for one robot and D; ``integration`` [m] is the tolerance of the tip's integration."""

    integration = FINE
    unknowns = 0

    def warm(self, alpha: Array) -> Array | None:
        """Tip (3,) [m] at ``alpha`` (N,) from the last answer; None without convergence."""
        raise NotImplementedError

    def cold(self, alpha: Array) -> Array | None:
        """The same from the untwisted robot."""
        raise NotImplementedError


class Torsionless(Level):
    """Eq. (28)-(31): the closed form, nothing to solve."""

    def __init__(self, robot: Robot, D: Array) -> None:
        self.energy = Models(robot).energy(D, 1)
        self.none = np.zeros(self.energy.n)

    def warm(self, alpha: Array) -> Array | None:
        return tip_position(TorsionlessShape(self.energy.space, alpha, self.none), self.integration)

    cold = warm


class Torsion(Level):
    """Newton for the twist rates of one ``degree``."""

    def __init__(self, robot: Robot, D: Array, degree: int) -> None:
        self.energy = Models(robot).energy(D, degree)
        self.unknowns = self.energy.n
        self.q = np.zeros(self.energy.n)

    def warm(self, alpha: Array) -> Array | None:
        found = newton(self.energy, alpha, self.q)
        if not found.converged:
            return None
        self.q = found.q
        return tip_position(TorsionShape(self.energy.space, alpha, found.q), self.integration)

    def cold(self, alpha: Array) -> Array | None:
        return self.warm(alpha) if self.reach(alpha) else None

    def reach(self, alpha: Array) -> bool:
        """Go from the untwisted robot to ``alpha`` in ``EQUAL_STEPS``; false if none of them
        converges."""
        for count in EQUAL_STEPS:
            self.q = np.zeros(self.energy.n)
            if all(self._step(alpha * (i + 1) / count) for i in range(count)):
                return True
        return False

    def _step(self, alpha: Array) -> bool:
        found = newton(self.energy, alpha, self.q)
        self.q = found.q
        return found.converged


class Full(Level):
    """Newton for all strains in Legendre polynomials of one ``degree``."""

    def __init__(self, robot: Robot, D: Array, degree: int) -> None:
        self.materials, self.degree = Materials(robot, piecewise_domain(robot, D)), degree
        self.torsion = Torsion(robot, D, COLD_DEGREE)
        energy = self._energy(np.zeros(robot.n_tubes))
        self.unknowns, self.q = energy.n, np.zeros(energy.n)

    def _energy(self, alpha: Array) -> FullEnergy:
        return FullEnergy(self.materials, alpha, PolynomialBasis(self.degree), self.degree + MORE_NODES)

    def warm(self, alpha: Array) -> Array | None:
        return self._solve(self._energy(alpha))

    def _solve(self, energy: FullEnergy) -> Array | None:
        found = solve_full(energy, self.q)
        if not found.converged:
            return None
        self.q = found.q
        return frames.tip_position(FullShape(energy, found.q), self.integration)

    def cold(self, alpha: Array) -> Array | None:
        """As the package does it: the equilibrium of `torsion` first, then the strains nearest to it."""
        if not self.torsion.reach(alpha):
            return None
        energy = self._energy(alpha)
        self.q = energy.project(TorsionShape(self.torsion.energy.space, alpha, self.torsion.q))
        return self._solve(energy)


def reference_tips(robot: Robot, D: Array, alphas: list[Array]) -> list[Array]:
    """Converged tips (3,) [m] along a path of ``alphas``, each next to the one before."""
    solver, energy = EquilibriumSolver(robot, TOLERANCE), Models(robot).energy(D, DEGREE)
    centreline = Centreline(robot, D, STEPS)
    tips = []
    for alpha in alphas:
        answer = solver.solve(alpha, D)
        found = newton(energy, alpha, energy.space.coordinates(answer.shape.torques))
        if not (answer.success and found.converged and not answer.snaps):
            raise RuntimeError(f"no reference at {np.degrees(alpha)} deg: {answer.message}")
        tips.append(centreline.tip(TorsionShape(energy.space, alpha, found.q).angles_at(centreline.s)))
    return tips


def monomial_tables(
    robot: Robot, D: Array, degree: int, x: Array
) -> list[tuple[StrainSection, StrainMaps, Array, Array]]:
    """What the seed's equations need of every section, at its places ``x`` (g,) in [0, 1]: section, linear maps from
    the coordinates in monomials, bending stiffness (N,) and pre-curvature (g, N).

    Where nothing bends against anything (in the guide, and a tube alone) the stiffness is zero.
    """
    materials = Materials(robot, piecewise_domain(robot, D))
    space = FullSpace(materials, np.zeros(robot.n_tubes), PolynomialBasis(degree, orthogonal=False))
    rows = []
    for number, section in enumerate(space.sections):
        if not section.tubes:
            continue
        bending, kappa = np.zeros(robot.n_tubes), np.zeros((len(x), robot.n_tubes), dtype=complex)
        if section.bends:
            kappa = materials.pre_curvature(section.index, section.start + section.length * x)
            if len(section.tubes) > 1:
                bending = materials.bending[section.index]
        rows.append((section, space.maps(number, x), bending, kappa))
    return rows


def printed_residual(robot: Robot, D: Array, degree: int, alpha: Array) -> Callable[[Array], Array]:
    """The seed's equations in monomials at one command, with its wrenches and maps multiplied out at every call."""
    materials = Materials(robot, piecewise_domain(robot, D))
    energy = FullEnergy(materials, alpha, PolynomialBasis(degree, orthogonal=False), degree + MORE_NODES)
    return lambda q: projected_residual(energy, q)
