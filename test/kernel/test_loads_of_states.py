"""Loads of states: what virtual work gives for the same fields, at kinks and off them, and what differences of the
energy give."""

from __future__ import annotations

import numpy as np
import pytest
from bvp_shape import elastic_energy
from dense_energies import energy_of_answer
from energy_differences import ANGLE_STEP
from energy_differences import KINKS
from energy_differences import LENGTH_STEP
from energy_differences import derivative
from energy_differences import kink_robot
from energy_differences import one_sided
from random_robots import random_D
from random_robots import random_robot

from ctr_pvs import Equilibrium
from ctr_pvs import EquilibriumSolver
from ctr_pvs import Robot
from ctr_pvs import Segment
from ctr_pvs import Status
from ctr_pvs import Tube
from ctr_pvs.answer.state import State
from ctr_pvs.kernel.walk.step import OK
from ctr_pvs.model.basis import gauss_legendre
from ctr_pvs.model.materials import section_nodes
from ctr_pvs.model.packing import MOST_NODES
from ctr_pvs.pvs.virtual_work import virtual_work_loads
from ctr_pvs.solve.path import NO_LOADS

#: Relative to the largest load of its kind; what is below the floor [N], [N m] is zero with rounding.
RELATIVE, FLOOR = 1e-11, 1e-15
FULL, PARTIAL = [0.0935, 0.2085], [0.0935, 0.1705]


def same_nodes(answer):
    """The Gauss points of the answer's own energy where tubes are coupled, and enough of them elsewhere."""
    shape, place = answer.shape, energy_of_answer(answer).place
    nodes = []
    for m in range(shape.domain.n_sections):
        start, end = shape.domain.boundaries[m : m + 2]
        own, elements = int(np.count_nonzero((place > start) & (place < end))), shape.panels(m)
        rule = gauss_legendre(own // elements if own else MOST_NODES, elements)
        nodes.append(section_nodes(shape.materials, m, rule))
    return nodes


def finer(answer):
    """The same equilibrium at degrees that leave nothing: the balance along a tube, which the kernel's forces follow
    from, and the derivative of the energy are one only for fields that balance everywhere."""
    assert answer.success, answer.message
    code, vector = answer._engine.step(answer.state.vector, answer.alpha, answer.D, NO_LOADS, raised=6)
    assert code == OK
    state = State(vector, len(answer.alpha))
    return Equilibrium(answer._engine, answer.alpha, answer.D, answer.status, "finer", "torsion", state=state)


def assert_same(answer):
    """The kernel against the general way, field by field."""
    assert answer.success or answer.status is Status.TOLERANCE_MISSED, answer.message
    loads, expected = answer.loads, virtual_work_loads(answer.shape, same_nodes(answer))
    assert np.array_equal(loads.kink, expected.kink)
    assert np.array_equal(loads.force, loads.force_interval[:, 1])
    assert np.array_equal(loads.force_interval[~loads.kink, 0], loads.force[~loads.kink])
    for name in ("torque", "force", "force_interval"):
        value, reference = getattr(loads, name), getattr(expected, name)
        assert value.shape == reference.shape
        assert value == pytest.approx(reference, rel=0.0, abs=FLOOR + RELATIVE * np.abs(reference).max())
    assert answer.torque == pytest.approx(loads.torque, rel=0.0, abs=FLOOR + RELATIVE * np.abs(loads.torque).max())
    assert answer.energy == pytest.approx(elastic_energy(answer.shape, same_nodes(answer)), rel=RELATIVE, abs=FLOOR)


def coincident_D(rng, robot):
    """A random D with one tube moved so that one of its events lies on another's, or on the orifice."""
    while True:
        D = random_D(rng, robot)
        tube, other = rng.integers(robot.n_tubes, size=2)
        target = 0.0 if other == tube else rng.choice(robot.tubes[other].breaks[1:]) - D[other]
        D[tube] = rng.choice(robot.tubes[tube].breaks[1:]) - target
        lengths = np.array([material.length for material in robot.tubes])
        if target >= 0.0 and np.all(np.diff(D) >= 0.0) and np.all(D >= 0.0) and np.all(lengths >= D):
            return D


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("tubes", [1, 2, 3, 4])
def test_random_robots(tubes, seed):
    rng = np.random.default_rng([seed, tubes, 5])
    robot = random_robot(rng, tubes)
    solver, D = EquilibriumSolver(robot, tolerance=1e-9), random_D(rng, robot)
    assert_same(finer(solver.solve(rng.uniform(-2.0, 2.0, tubes), D)))


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("tubes", [1, 2, 3, 4])
def test_random_kinks(tubes, seed):
    rng = np.random.default_rng([seed, tubes, 6])
    robot = random_robot(rng, tubes)
    solver, D = EquilibriumSolver(robot, tolerance=1e-9), coincident_D(rng, robot)
    answer = solver.solve(rng.uniform(-2.0, 2.0, tubes), D)
    assert answer.kink
    assert_same(finer(answer))


def soft_robot(rng: np.random.Generator, tubes: int, coupling: float) -> Robot:
    """Tubes of about the dimensionless ``coupling``, strong enough for several elements, its pre-curvature turning."""
    parts = []
    for index in range(tubes):
        K = 0.02 * rng.uniform(0.7, 1.3)
        curvature = np.sqrt(coupling / 1.3) / 0.1 * np.exp(1j * rng.uniform(-0.3, 0.3)), rng.uniform(-20.0, 20.0)
        bent = Segment(0.1 * rng.uniform(0.8, 1.2), K, K / 1.3, curvature, rng.uniform(-3.0, 3.0))
        parts.append(Tube(f"t{index}", (Segment(0.02 + 0.01 * index, K, K / 1.3), bent)))
    return Robot("soft", tuple(parts))


@pytest.mark.parametrize("coupling", [40.0, 90.0])
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("tubes", [2, 3])
def test_strong_coupling_on_several_elements(tubes, seed, coupling):
    rng = np.random.default_rng([seed, tubes, 7])
    robot = soft_robot(rng, tubes, coupling)
    D = [material.breaks[1] - 0.01 for material in robot.tubes] if seed % 2 else [0.02] * tubes
    answer = EquilibriumSolver(robot, tolerance=1e-9).solve(rng.uniform(-0.5, 0.5, tubes), D)
    assert any(answer.shape.panels(m) > 1 for m in range(answer.shape.domain.n_sections))
    assert_same(answer)


@pytest.mark.parametrize("degrees", [0.0, 100.0, 200.0])
@pytest.mark.parametrize("D", [FULL, PARTIAL])
def test_the_seeds_robot(seed_robot, D, degrees):
    """Its outer tube's straight length is what is in the guide: a kink at the orifice."""
    assert_same(EquilibriumSolver(seed_robot, tolerance=1e-9).solve([0.0, np.radians(degrees)], D))


@pytest.mark.parametrize("name", KINKS)
def test_kinks_of_a_robot_with_round_lengths(name):
    assert_same(EquilibriumSolver(kink_robot(), tolerance=1e-9).solve([0.1, 1.4, -0.9], KINKS[name][0]))


def ends_robot() -> Robot:
    """Two tubes curved from their bases on; bases together, the inner one is straight at a node in mid-section."""
    bent = 200.0 + 80.0j
    a = Segment(0.125, 0.05, 0.04, (6.0, 30.0), 12.0)
    b = Segment(0.125, 0.02, 0.016, (-0.0625 * bent, bent)), Segment(0.04, 0.015, 0.012, (5.0,))
    return Robot("ends", (Tube("a", (a,)), Tube("b", b)))


ENDS = {
    "bases on the orifice": [0.0, 0.0],
    "one base on the orifice": [0.0, 0.03],
    "base and tip on the orifice": [0.0, 0.165],
    "tips on the orifice, nothing out": [0.125, 0.165],
    "the inner tube alone": [0.125, 0.13],
    "tips coincide": [0.0, 0.04],
}


@pytest.mark.parametrize("twists", [True, False])
@pytest.mark.parametrize("name", ENDS)
def test_bases_and_tips_on_the_orifice(name, twists):
    solver = EquilibriumSolver(ends_robot(), tolerance=1e-9, fidelity="torsion" if twists else "torsionless")
    assert_same(solver.solve([0.2, 1.1], ENDS[name]))


def test_energy_that_no_force_depends_on():
    """A bend of the inner tube that slides inside the outer one's: only torque and energy see the angle between."""
    a = Segment(0.02, 0.05, 0.04), Segment(0.1, 0.05, 0.04, (9.0,))
    b = Segment(0.06, 0.02, 0.016), Segment(0.03, 0.02, 0.016, (15.0j,)), Segment(0.06, 0.02, 0.016)
    solver = EquilibriumSolver(Robot("inside", (Tube("a", a), Tube("b", b))), tolerance=1e-9)
    assert_same(solver.solve([0.2, 1.1], [0.01, 0.03]))


@pytest.mark.parametrize("seed", range(8))
def test_tubes_rigid_in_torsion(seed):
    """No equilibrium of the twist, and no work of the torques."""
    rng = np.random.default_rng([seed, 8])
    robot = random_robot(rng, 2 + seed % 3)
    D = random_D(rng, robot) if seed % 2 else coincident_D(rng, robot)
    solver = EquilibriumSolver(robot, tolerance=1e-6, fidelity="torsionless")
    answer = solver.solve(rng.uniform(-0.5, 0.5, robot.n_tubes), D)
    assert not answer.state.twists
    assert_same(answer)


@pytest.mark.parametrize("seed", range(4))
def test_differences_of_the_energy(seed):
    rng = np.random.default_rng([seed, 9])
    robot = random_robot(rng, 3)
    solver, D, alpha = EquilibriumSolver(robot, tolerance=1e-8), random_D(rng, robot), rng.uniform(-2.0, 2.0, 3)
    loads = solver.solve(alpha, D).loads
    for tube in range(3):
        torque = derivative(solver, alpha, D, tube, ANGLE_STEP)
        assert torque == pytest.approx(loads.torque[tube], rel=1e-6, abs=1e-9)
        force = derivative(solver, alpha, D, 3 + tube, LENGTH_STEP)
        assert force == pytest.approx(loads.force[tube], rel=1e-6, abs=1e-7)


def test_one_sided_differences_of_the_energy(seed_robot):
    solver, alpha = EquilibriumSolver(seed_robot, tolerance=1e-9), np.radians([0.0, 100.0])
    loads = solver.solve(alpha, PARTIAL).loads
    assert loads.kink.tolist() == [True, False]
    for tube in (0, 1):
        for side, expected in zip((-1, 1), loads.force_interval[tube], strict=True):
            assert one_sided(solver, alpha, PARTIAL, tube, side) == pytest.approx(expected, rel=1e-6)
