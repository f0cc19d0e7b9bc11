"""Model levels at one polynomial degree each, and converged references.

The public solver chooses its degree; these go below it.  `torsion` is Newton on the whole Hessian in plain numpy, with
the kernel's elements: what a degree costs without the kernel.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from bench.common.dense import FixedDegree
from bench.common.dense import nearest
from bench.speed.centreline import Centreline
from ctr_pvs import EquilibriumSolver
from ctr_pvs import Robot
from ctr_pvs.model.materials import Materials
from ctr_pvs.model.sections import piecewise_domain
from ctr_pvs.pvs import frames
from ctr_pvs.pvs.energy import FullEnergy
from ctr_pvs.pvs.projection import projected_residual
from ctr_pvs.pvs.solution import FullShape
from ctr_pvs.pvs.solution import solve_full
from ctr_pvs.pvs.space import FullSpace
from ctr_pvs.pvs.space import StrainMaps
from ctr_pvs.pvs.space import StrainSection
from ctr_pvs.pvs.strain_basis import PolynomialBasis
from ctr_pvs.solve.equilibria import stationary

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
#: Steps of the centreline in every section and the error [m] that they stay below.
FEW_STEPS, MANY_STEPS, FEW_STEPS_ERROR = 5, 10, 1e-10
#: How far [rad] the references may lie from the answers they are polished from.
ROOM = 0.05


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
        self.lines = {steps: Centreline(robot, D, steps) for steps in (FEW_STEPS, MANY_STEPS)}

    def warm(self, alpha: Array) -> Array | None:
        line = self.lines[_steps(self.integration)]
        return line.tip(np.broadcast_to(alpha, line.moment.shape))

    cold = warm


class Torsion(Level):
    """Newton for the twist rates of one ``degree``."""

    def __init__(self, robot: Robot, D: Array, degree: int) -> None:
        self.energy = FixedDegree(robot, D, degree)
        self.unknowns = self.energy.n
        self.q = np.zeros(self.energy.n)
        lines = {steps: Centreline(robot, D, steps) for steps in (FEW_STEPS, MANY_STEPS)}
        self.lines = {steps: (line, self.energy.map_at(line.s)) for steps, line in lines.items()}

    def warm(self, alpha: Array) -> Array | None:
        found = self._solve(alpha)
        if found is None:
            return None
        self.q = found
        line, turn = self.lines[_steps(self.integration)]
        return line.tip(alpha + turn @ found)

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
        found = self._solve(alpha)
        if found is not None:
            self.q = found
        return found is not None

    def _solve(self, alpha: Array) -> Array | None:
        return stationary(self.energy, alpha, self.q, np.inf)[0]


def _steps(integration: float) -> int:
    return FEW_STEPS if integration > FEW_STEPS_ERROR else MANY_STEPS


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
        self.q = energy.project(self.torsion.energy.shape(self.torsion.q, alpha))
        return self._solve(energy)


def reference_tips(robot: Robot, D: Array, alphas: list[Array]) -> list[Array]:
    """Converged tips (3,) [m] along a path of ``alphas``, each next to the one before."""
    solver, energy = EquilibriumSolver(robot, TOLERANCE), FixedDegree(robot, D, DEGREE, fine=True)
    centreline = Centreline(robot, D, STEPS)
    turn = energy.map_at(centreline.s)
    tips = []
    for alpha in alphas:
        answer = solver.solve(alpha, D)
        found, _ = stationary(energy, alpha, nearest(energy, answer.shape, alpha), ROOM)
        if found is None or not answer.success or answer.snaps:
            raise RuntimeError(f"no reference at {np.degrees(alpha)} deg: {answer.message}")
        tips.append(centreline.tip(alpha + turn @ found))
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
