"""Fig. 2, Fig. 4 and eq. (31) of the seed paper, computed with its own bases and converged."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.answer.equilibrium import Equilibrium
from ctr_pvs.answer.status import NoEquilibriumError
from ctr_pvs.model.materials import Materials
from ctr_pvs.model.sections import piecewise_domain
from ctr_pvs.model.shape import Shape
from ctr_pvs.pvs.energy import FullEnergy
from ctr_pvs.pvs.frames import bishop_frames
from ctr_pvs.pvs.solution import FullSolution
from ctr_pvs.pvs.solution import solve_full
from ctr_pvs.pvs.strain_basis import PolynomialBasis
from ctr_pvs.pvs.strain_basis import ReferenceStrainBasis
from ctr_pvs.pvs.strain_basis import StrainBasis
from ctr_pvs.renda2021.numbers import Part
from ctr_pvs.renda2021.numbers import Row
from ctr_pvs.renda2021.numbers import row
from ctr_pvs.renda2021.robots import INNER
from ctr_pvs.renda2021.robots import OUTER
from ctr_pvs.renda2021.robots import curved_robot
from ctr_pvs.renda2021.robots import fig2_robot
from ctr_pvs.renda2021.robots import fig4_robot
from ctr_pvs.robot.robot import Robot
from ctr_pvs.solve.solver import EquilibriumSolver

Array = NDArray[np.float64]

#: Tip error [m] that the converged answers and the integration of all backbones may have.
TOLERANCE = 1e-9
#: Legendre degree of the converged strains in Fig. 2; theta_2(L_1) then agrees with the torsion level to 1e-10 deg.
CONVERGED_DEGREE = 12
#: Gauss points beyond the degree of a basis.
MORE_NODES = 12
#: Points along a drawn backbone.
DRAWN = 101

FIG2_BASES = {1: "linear", 2: "quadratic", 3: "cubic"}
#: The three equilibria of Fig. 2: two mirror images of each other, and one in the mirror plane between them.
BRANCHES = ("first", "mirrored", "planar")

FIG4_D1 = 93.5e-3  # m, section III-C
#: Section III-C: D_2 [m] and the last alpha_2 [deg] of each sweep; steps of 20 deg from 0.
FIG4_SWEEPS = {"full": (208.5e-3, 280), "partial": (170.5e-3, 200)}

#: Fully overlapping tubes [m] with variable pre-curvature [1/m, 1/m^2, ..] out of plane; this project's choice, as
#: eq. (31) holds for any.
EQ31_LENGTH = 0.2
EQ31_CURVATURES = ((9.9 + 3.0j, -40.0 + 25.0j), (13.8 - 5.0j, 60.0, -200.0 + 300.0j))


@dataclass(frozen=True, eq=False)
class Branch:
    """One equilibrium of Fig. 2: theta_2(L_1) [deg], the margin, and backbones (n, 3) [m] of the same arc lengths.

    joint : index of the point where the outer tube ends.
    """

    theta: float
    margin: float
    converged: Array
    linear: Array
    joint: int

    @property
    def stable(self) -> bool:
        return self.margin > 0.0


@dataclass(frozen=True, eq=False)
class Sweep:
    """A sweep of Fig. 4: alpha_2 (rows,) [deg], backbones (rows, n, 3) [m] in the quadratic basis, converged tips
    (rows, 3) [m]."""

    angles: Sequence[int]
    backbones: Array
    converged_tips: Array

    @property
    def distances(self) -> Array:
        """(rows,) [m] from the tips of the quadratic basis to the converged ones."""
        return np.asarray(np.linalg.norm(self.backbones[:, -1] - self.converged_tips, axis=1))


def fig2() -> tuple[Part, dict[str, Branch]]:
    """The rows of Fig. 2, and its three equilibria by name."""
    converged = fig2_equilibria(PolynomialBasis(CONVERGED_DEGREE))
    tips = {name: _points(converged[name].shape)[-1] for name in BRANCHES}
    rows: list[Row] = []
    linear: dict[str, FullSolution] = {}
    for degree, word in FIG2_BASES.items():
        found = fig2_equilibria(PolynomialBasis(degree, orthogonal=False))
        linear = linear or found
        distances = [1e3 * float(np.linalg.norm(_points(found[name].shape)[-1] - tips[name])) for name in BRANCHES]
        basis = f"{word} basis" + (" (34)" if degree == 1 else "")
        rows.append(row(f"fig2_theta_{word}_deg", f"theta_2(L_1), {basis} [deg]", theta_2(found["first"].shape)))
        rows.append(row(f"fig2_tip_{word}_mm", f"tip from converged, {basis}, largest of three [mm]", max(distances)))
        if degree == 1:
            what = f"tip from converged, {basis}, mean of three [mm]"
            rows.append(row("fig2_tip_linear_mean_mm", what, float(np.mean(distances))))
    branches = {name: _branch(converged[name], linear[name]) for name in BRANCHES}
    part = Part(
        "Fig. 2: wholly curved tubes of 140 and 200 mm, D = 0, alpha_2 = 180 deg (section III-B)",
        (*rows, *_equilibrium_rows(branches)),
        (
            "The margin is the smallest eigenvalue of the energy Hessian against torsional stiffness: above 0 stable, "
            "below 0 unstable.",
        ),
    )
    return part, branches


def _equilibrium_rows(branches: dict[str, Branch]) -> list[Row]:
    rows = []
    names = {"first": "converged", "mirrored": "mirrored", "planar": "planar"}
    for branch, name in names.items():
        rows.append(row(f"fig2_theta_{name}_deg", f"theta_2(L_1), {name} [deg]", branches[branch].theta))
    for branch, name in names.items():
        verdict = "stable" if branches[branch].stable else "UNSTABLE"
        what = f"stability margin at {branches[branch].theta:.2f} deg: {verdict}"
        rows.append(row(f"fig2_margin_{name}", what, branches[branch].margin))
    return rows


def fig2_equilibria(basis: PolynomialBasis) -> dict[str, FullSolution]:
    """The equilibria of Fig. 2 by name, in one basis of the `full` level.

    Newton goes to the one its guess is near to: the stable equilibria at base rotations of +180 and -180 deg (two
    histories, one base rotation), and no strain at all, from where the mirror symmetry keeps it in the plane.
    """
    robot, D = fig2_robot(), np.zeros(2)
    energy = full_energy(robot, np.array([0.0, np.pi]), D, basis, basis.degree)
    solver = EquilibriumSolver(robot, TOLERANCE, "torsion")
    guesses = [energy.project(solved(solver.solve([0.0, angle], D, "cold")).shape) for angle in (np.pi, -np.pi)]
    guesses.append(np.zeros(energy.n))
    return {name: full_solution(energy, guess) for name, guess in zip(BRANCHES, guesses, strict=True)}


def fig4() -> tuple[Part, dict[str, Sweep]]:
    """The rows of Fig. 4, and its sweeps by name."""
    sweeps = {name: fig4_sweep(name) for name in FIG4_SWEEPS}
    rows = []
    for name, sweep in sweeps.items():
        distances = 1e3 * sweep.distances
        for word, value in (("max", distances.max()), ("mean", distances.mean())):
            rows.append(row(f"fig4_{name}_{word}_mm", f"tip, {name} overlap, {word} distance [mm]", value))
    part = Part(
        "Fig. 4: the robot of Fig. 3, quadratic basis, D_1 = 93.5 mm, D_2 = 208.5 | 170.5 mm (section III-C)",
        tuple(rows),
        (
            "Ours is the error of the quadratic basis: its distance from our converged tips. The seed's is a distance "
            "from the simulations of its reference [21], another yardstick.",
        ),
    )
    return part, sweeps


def fig4_sweep(name: str) -> Sweep:
    """The sweep ``name`` of ``FIG4_SWEEPS``; each step sets out from the one before."""
    robot = fig4_robot()
    D2, last = FIG4_SWEEPS[name]
    D, angles = np.array([FIG4_D1, D2]), range(0, last + 1, 20)
    solver = EquilibriumSolver(robot, TOLERANCE, "torsion")
    backbones, tips = [], []
    for angle in angles:
        alpha = np.array([0.0, np.radians(angle)])
        converged = solved(solver.solve(alpha, D))
        energy = full_energy(robot, alpha, D, PolynomialBasis(2, orthogonal=False), 2)
        quadratic = full_solution(energy, energy.project(converged.shape))
        backbones.append(_points(quadratic.shape))
        tips.append(converged.tip.position)
    return Sweep(angles, np.array(backbones), np.array(tips))


def eq31() -> Part:
    """Eq. (28)-(31): coordinates in the basis of reference strains, twist left out."""
    robot = curved_robot("eq31", (EQ31_LENGTH, EQ31_LENGTH), *EQ31_CURVATURES)
    energy = full_energy(robot, np.zeros(2), np.zeros(2), ReferenceStrainBasis(), 8)
    q = full_solution(energy, np.zeros(energy.n)).q
    EI = np.array([OUTER.stiffness[0], INNER.stiffness[0]])
    expected = np.tile(EI / EI.sum(), 2)
    rows = []
    for i in range(4):
        tube = i % 2 + 1
        what = f"q_{i + 1} = EI_{tube} / (EI_1 + EI_2)"
        rows.append(Row(f"eq31_q{i + 1}", what, float(q[i]), float(expected[i]), f"{expected[i]:.4f}", "eq. (31)"))
    largest = float(np.abs(q - expected).max())
    return Part(
        "Eq. (31): two torsionless, fully overlapping tubes, pre-curvatures that vary in both planes (section III-A)",
        tuple(rows),
        (f"Largest difference {largest:.1e}.",),
    )


def theta_2(shape: Shape) -> float:
    """theta_2 [deg] where the outer tube of Fig. 2 ends, inner against outer tube."""
    outer, inner = shape.angle_at_boundaries[1]
    return float(np.degrees(inner - outer))


def full_energy(robot: Robot, alpha: Array, D: Array, basis: StrainBasis, degree: int) -> FullEnergy:
    """The `full` level's energy at one command, with Gauss points for strains of polynomial ``degree``."""
    materials = Materials(robot, piecewise_domain(robot, D))
    return FullEnergy(materials, alpha, basis, degree + MORE_NODES)


def full_solution(energy: FullEnergy, guess: Array) -> FullSolution:
    """The stationary point that Newton reaches from ``guess`` (n,); raises ``NoEquilibriumError`` if it does not."""
    result = solve_full(energy, guess)
    if not result.converged:
        raise NoEquilibriumError("Newton at the full level did not converge from this guess")
    return FullSolution(energy, result.q)


def solved(equilibrium: Equilibrium) -> Equilibrium:
    """``equilibrium`` itself; raises ``NoEquilibriumError`` if it is no good answer."""
    if not equilibrium.success:
        raise NoEquilibriumError(f"{equilibrium.status.value}: {equilibrium.message}")
    return equilibrium


def _branch(converged: FullSolution, linear: FullSolution) -> Branch:
    shape = converged.shape
    joint = int(np.argmin(np.abs(_places(shape) - shape.domain.boundaries[1])))
    margin = converged.stability_margin()
    return Branch(theta_2(shape), margin, _points(shape), _points(linear.shape), joint)


def _places(shape: Shape) -> Array:
    """(DRAWN,) arc lengths [m] from the orifice to the tip."""
    return np.linspace(0.0, shape.domain.length, DRAWN)


def _points(shape: Shape) -> Array:
    """(DRAWN, 3) positions [m] of the backbone, the tip last."""
    return bishop_frames(shape, _places(shape), TOLERANCE)[1]
