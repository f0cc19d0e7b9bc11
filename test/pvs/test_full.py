"""The `full` level is the seed's model: its equations, its bases, its limit, and its agreement with the other
levels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from conftest import ROOT
from random_robots import random_D
from random_robots import random_robot

from ctr_pvs import EquilibriumSolver
from ctr_pvs import Robot
from ctr_pvs import Segment
from ctr_pvs import Status
from ctr_pvs import Tube
from ctr_pvs import load_robot
from ctr_pvs.errors import FieldError
from ctr_pvs.model.materials import Materials
from ctr_pvs.model.sections import piecewise_domain
from ctr_pvs.oracles.standard_model import solve_standard_bvp
from ctr_pvs.pvs.energy import FullEnergy
from ctr_pvs.pvs.frames import tip_position
from ctr_pvs.pvs.projection import projected_residual
from ctr_pvs.pvs.solution import FullSolution
from ctr_pvs.pvs.solution import solve_full
from ctr_pvs.pvs.strain_basis import CustomBasis
from ctr_pvs.pvs.strain_basis import PolynomialBasis
from ctr_pvs.pvs.strain_basis import ReferenceStrainBasis
from ctr_pvs.pvs.strain_basis import SectionBasis


@dataclass(frozen=True)
class CurvedGuide:
    """Polynomials of one degree everywhere, in the guide too: does twist there stay constant by itself?"""

    degree: int

    def __call__(self, view, bends):
        table = PolynomialBasis(self.degree)(view, True)
        if bends:
            return table
        return SectionBasis(table.lead[:, :, : self.degree + 1], table.relative)


def energy_of(robot, alpha, D, basis, nodes=12):
    alpha, D = np.asarray(alpha, dtype=float), np.asarray(D, dtype=float)
    return FullEnergy(Materials(robot, piecewise_domain(robot, D)), alpha, basis, nodes)


def scene(seed, tubes):
    rng = np.random.default_rng([seed, tubes, 51])
    robot = random_robot(rng, tubes)
    return robot, rng.uniform(-1.5, 1.5, tubes), random_D(rng, robot), rng


def solved(robot, alpha, D, basis, nodes=12):
    energy = energy_of(robot, alpha, D, basis, nodes)
    torsion = EquilibriumSolver(robot, tolerance=1e-9).solve(alpha, D)
    assert torsion.success, torsion.message
    result = solve_full(energy, energy.project(torsion.shape))
    assert result.converged
    return FullSolution(energy, result.q), torsion


BASES = [PolynomialBasis(2), PolynomialBasis(3, orthogonal=False), ReferenceStrainBasis(), CurvedGuide(2)]


@pytest.mark.parametrize("basis", BASES, ids=str)
@pytest.mark.parametrize("tubes", [1, 2, 3, 4])
def test_the_energy_is_the_seeds_model(tubes, basis):
    """dE/dq equals eq. (26)/(33)/(35), projected as the seed writes them, to rounding, at states that are no
    equilibria."""
    robot, alpha, D, rng = scene(1, tubes)
    energy = energy_of(robot, alpha, D, basis)
    for _ in range(3):
        q = 2.0 * rng.standard_normal(energy.n)
        gradient = energy.gradient(q)
        scale = max(np.abs(gradient).max(initial=0.0), 1e-12)
        assert np.abs(projected_residual(energy, q) - gradient).max(initial=0.0) < 1e-13 * scale


@pytest.mark.parametrize("tubes", [2, 3, 4])
def test_derivatives_match_differences(tubes):
    robot, alpha, D, rng = scene(2, tubes)
    energy = energy_of(robot, alpha, D, PolynomialBasis(3))
    q, h = rng.standard_normal(energy.n), 1e-5
    for _ in range(4):
        d = rng.standard_normal(energy.n)
        slope = (energy.value(q + h * d) - energy.value(q - h * d)) / (2 * h)
        assert slope == pytest.approx(energy.gradient(q) @ d, rel=1e-6, abs=1e-9)
        bend = (energy.gradient(q + h * d) - energy.gradient(q - h * d)) / (2 * h)
        assert bend == pytest.approx(energy.hessian(q) @ d, rel=1e-6, abs=1e-9)


@pytest.mark.parametrize(("degree", "angle", "millimetres"), [(1, 85.434, 1.200), (2, 84.39, 0.334), (3, 84.10, 0.030)])
@pytest.mark.parametrize("orthogonal", [True, False])
def test_fig2_with_the_seeds_bases(reference, degree, angle, millimetres, orthogonal):
    """The seed's linear basis (34), and its successors: theta_2 at the outer tip and tip distance to the converged
    model."""
    robot = load_robot(ROOT / "config" / "renda2021_fig2.yaml")
    solution, _ = solved(robot, [0.0, np.pi], [0.0, 0.0], PolynomialBasis(degree, orthogonal))
    theta = np.degrees(np.diff(solution.shape.angles_at(np.array([0.14])))[0, 0])
    assert theta == pytest.approx(angle, abs=0.006)
    away = tip_position(solution.shape, 1e-9) - reference["fig2"]["tip_m"]
    assert 1e3 * np.linalg.norm(away) == pytest.approx(millimetres, abs=6e-4)


@pytest.mark.parametrize("sweep", ["fig4_full", "fig4_partial"])
def test_fig4_with_the_seeds_quadratic_basis(seed_robot, reference, sweep):
    for row in reference[sweep]["rows"][::2]:
        alpha = [0.0, np.radians(row["alpha2_deg"])]
        solution, _ = solved(seed_robot, alpha, reference[sweep]["D"], PolynomialBasis(2, orthogonal=False))
        assert 1e3 * np.linalg.norm(tip_position(solution.shape, 1e-9) - row["tip_m"]) < 1e-3


@pytest.mark.parametrize("tubes", [2, 3, 4])
def test_full_converges_to_torsion_and_to_the_standard_model(tubes):
    """As the basis grows the tip goes to that of `torsion`, below 1e-9 m; the boundary-value model agrees to 1e-8 m."""
    robot, alpha, D, _ = scene(4, tubes)
    distances = []
    for degree in (2, 5, 8, 12):
        solution, torsion = solved(robot, alpha, D, PolynomialBasis(degree), nodes=degree + 8)
        distances.append(np.linalg.norm(tip_position(solution.shape, 1e-10) - tip_position(torsion.shape, 1e-10)))
    assert distances[-1] < 1e-9
    above_rounding = np.maximum(distances, 1e-12)
    assert above_rounding[0] > above_rounding[-1] and np.all(np.diff(above_rounding) <= 0.0)
    loads = solution.loads()
    assert loads.torque == pytest.approx(torsion.torque, rel=1e-6, abs=1e-9)
    assert loads.force == pytest.approx(torsion.force, rel=1e-6, abs=1e-7)
    assert solution.elastic_energy() == pytest.approx(torsion.energy, rel=1e-9)
    assert solution.stability_margin() == pytest.approx(torsion.stability_margin, abs=1e-5)
    standard = solve_standard_bvp(robot, alpha, D, tolerance=1e-9, guess=torsion.shape)
    assert standard.success
    assert np.linalg.norm(standard.tip - tip_position(solution.shape, 1e-10)) < 1e-8


def test_all_three_equilibria_of_fig2():
    """Two mirror images and the unstable one between them, at theta_2 = 180 deg; only that one has a negative
    margin."""
    robot = load_robot(ROOT / "config" / "renda2021_fig2.yaml")
    alpha, D = np.array([0.0, np.pi]), np.zeros(2)
    solution, _ = solved(robot, alpha, D, PolynomialBasis(8))
    energy = solution.energy
    untwisted = solve_full(energy, np.zeros(energy.n))
    other_way = EquilibriumSolver(robot, tolerance=1e-9).solve([0.0, -np.pi], D)
    mirror = solve_full(energy, energy.project(other_way.shape))
    found = [solution, *(FullSolution(energy, r.q) for r in (untwisted, mirror))]
    assert untwisted.converged and mirror.converged
    theta = [np.degrees(np.diff(f.shape.angles_at(np.array([0.14])))[0, 0]) for f in found]
    assert theta == pytest.approx([84.0719, 180.0, 275.928], abs=1e-3)
    margins = [f.stability_margin() for f in found]
    assert margins[0] > 0.7 and margins[1] < -0.1 and margins[2] == pytest.approx(margins[0], abs=1e-9)


def test_twist_in_the_guide_is_constant_by_itself(seed_robot):
    """Section III-C: with a cubic torsional basis in the guide too, its twist rates come out constant."""
    alpha, D = [0.0, 2.0], [0.0935, 0.1705]
    solution, torsion = solved(seed_robot, alpha, D, CurvedGuide(3))
    space = solution.energy.space
    for number, section in enumerate(space.sections):
        if not section.bends:
            rate = space.maps(number, np.linspace(0, 1, 9)).rate @ solution.q
            assert np.ptp(rate, axis=0) == pytest.approx(np.zeros(2), abs=1e-9)
    assert np.linalg.norm(tip_position(solution.shape, 1e-9) - torsion.tip.position) < 1e-6


def test_fully_curved_tubes_are_straightened_by_the_guide():
    """Tubes without a straight part have straight guided parts: same shape as tubes that are straight there, more
    energy."""
    curved = Segment(0.15, 0.05, 0.04, (10.0,)), Segment(0.2, 0.01, 0.008, (14.0,))
    cut = [
        (Segment(base, g.bending_stiffness, g.torsional_stiffness), g)
        for base, g in zip((0.05, 0.08), curved, strict=True)
    ]
    half = [
        (straight, Segment(g.length - straight.length, g.bending_stiffness, g.torsional_stiffness, g.curvature))
        for straight, g in cut
    ]
    whole = Robot("whole", (Tube("a", curved[:1]), Tube("b", curved[1:])))
    parts = Robot("parts", (Tube("a", half[0]), Tube("b", half[1])))
    a, b = (EquilibriumSolver(r, 1e-8, fidelity="full").solve([0.0, 1.0], [0.05, 0.08]) for r in (whole, parts))
    assert a.tip.position == pytest.approx(b.tip.position, abs=1e-9)
    straightening = 0.5 * (0.05 * 10.0**2 * 0.05 + 0.01 * 14.0**2 * 0.08)
    assert a.energy - b.energy == pytest.approx(straightening, rel=1e-9)


def test_eq_31_and_the_torsionless_level():
    """With the tubes' own variable pre-curvatures as basis, the coordinates are the shares of stiffness, eq. (31)."""
    K1, K2 = 0.05, 0.02
    first = Segment(0.12, K1, 0.04, (6.0 + 2.0j, 90.0 - 30.0j))
    second = Segment(0.12, K2, 0.015, (-4.0 + 9.0j, 60.0 + 80.0j, 500.0))
    robot = Robot("pair", (Tube("a", (first,)), Tube("b", (second,))))
    energy = energy_of(robot, [0.0, 0.0], [0.0, 0.0], ReferenceStrainBasis())
    result = solve_full(energy, np.zeros(energy.n))
    assert result.converged
    assert result.q == pytest.approx(np.array([K1, K2, K1, K2]) / (K1 + K2), rel=1e-12)
    shape, x = FullSolution(energy, result.q).shape, np.linspace(0.0, 1.0, 7)
    closed = (K1 * first.pre_curvature(0.12 * x) + K2 * second.pre_curvature(0.12 * x)) / (K1 + K2)
    assert shape.curvature(0, x) == pytest.approx(closed, rel=1e-12)
    level = EquilibriumSolver(robot, 1e-3, fidelity="torsionless").solve([0.0, 0.0], [0.0, 0.0])
    assert level.shape.curvature(0, x) == pytest.approx(closed, rel=1e-12)
    assert level.degrees_of_freedom == 0


def test_a_basis_of_ones_own(seed_robot):
    """A custom basis that spans the same strains gives the same equilibrium, dependent columns included."""
    alpha, D = [0.0, 1.5], [0.0935, 0.1705]
    legendre, _ = solved(seed_robot, alpha, D, PolynomialBasis(2))

    def powers(view):
        return np.column_stack([(view.x - 0.3) ** k for k in range(3)] + [0.5 + view.x])

    def lead(view):
        table = powers(view)
        out = np.zeros((len(view.x), 3, 3 * table.shape[1]))
        for row in range(3):
            out[:, row, row * table.shape[1] : (row + 1) * table.shape[1]] = table
        return out

    custom, _ = solved(seed_robot, alpha, D, CustomBasis(lead, lambda view, inner: powers(view)))
    assert tip_position(custom.shape, 1e-9) == pytest.approx(tip_position(legendre.shape, 1e-9), abs=1e-9)
    with pytest.raises(FieldError, match="lead"):
        energy_of(seed_robot, alpha, D, CustomBasis(lambda view: view.x, lambda view, inner: powers(view)))


def test_the_solver_serves_all_levels(seed_robot, reference):
    row = next(row for row in reference["fig4_full"]["rows"] if row["alpha2_deg"] == 200)
    alpha, D = [0.0, np.radians(200)], reference["fig4_full"]["D"]
    for fidelity in ("auto", "torsion", "full"):
        answer = EquilibriumSolver(seed_robot, tolerance=1e-8, fidelity=fidelity).solve(alpha, D)
        assert answer.status is Status.OK and answer.error_estimate <= 1e-8
        assert np.linalg.norm(answer.tip.position - row["tip_m"]) < 2e-8
        assert answer.torque[1] == pytest.approx(row["torque2_Nm"], rel=1e-6)
    untwisted = EquilibriumSolver(seed_robot, tolerance=1e-3, fidelity="torsionless")
    rough = untwisted.solve([0.0, np.radians(60)], D)
    assert rough.status is Status.TOLERANCE_MISSED and not rough.success
    assert rough.error_estimate > 1e-3
    assert untwisted.solve(alpha, D).status is Status.NO_STABLE_EQUILIBRIUM
    aligned = EquilibriumSolver(seed_robot, tolerance=1e-6, fidelity="torsionless").solve([0.0, 0.0], D)
    assert aligned.success and aligned.torque == pytest.approx([0.0, 0.0], abs=1e-12)


def test_torsionless_loads_are_derivatives_of_the_untwisted_energy():
    robot, alpha, D, _ = scene(6, 3)
    solver = EquilibriumSolver(robot, tolerance=1e-2, fidelity="torsionless")
    answer = solver.solve(alpha, D)
    for index in range(6):
        step = 2e-3 if index < 3 else 2e-5
        values = []
        for shift in (-2, -1, 1, 2):
            command = np.concatenate([alpha, D])
            command[index] += shift * step
            values.append(solver.solve(*np.split(command, 2)).energy)
        slope = (values[0] - 8 * values[1] + 8 * values[2] - values[3]) / (12 * step)
        assert slope == pytest.approx(np.concatenate([answer.torque, answer.force])[index], rel=1e-6, abs=1e-7)
