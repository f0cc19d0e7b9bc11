"""The energy of elements: its value, gradient and Hessian in any state, equilibrium or not, by differences and by an
energy in plain numpy."""

from __future__ import annotations

import math

import numpy as np
import pytest
from bvp_shape import elastic_energy
from dense_energies import random_scene
from random_robots import random_D
from random_robots import random_robot

from ctr_pvs import EquilibriumSolver
from ctr_pvs import Robot
from ctr_pvs import Segment
from ctr_pvs import Tube
from ctr_pvs.answer.engine import Engine
from ctr_pvs.answer.shape import TorsionShape
from ctr_pvs.kernel.twist.element import ALONG
from ctr_pvs.kernel.twist.element import EXACT
from ctr_pvs.kernel.twist.element import LOWERED
from ctr_pvs.kernel.twist.element import WIDER
from ctr_pvs.kernel.twist.element import WORST
from ctr_pvs.kernel.twist.element import spring
from ctr_pvs.model.packing import HIGHEST_DEGREE
from ctr_pvs.model.packing import INTEGRAL
from ctr_pvs.model.packing import INTERPOLANT
from ctr_pvs.model.packing import MOST_NODES
from ctr_pvs.model.packing import PLACE
from ctr_pvs.model.packing import POLYNOMIAL
from ctr_pvs.model.packing import WEIGHT
from ctr_pvs.model.packing import quadrature_rules
from ctr_pvs.solve.dense import DenseEnergy

ENERGY = 4  # the row of the kernel's loads that begins with the elastic energy


def bare_scene(D, alpha):
    """Three tubes curved from their bases on, one of them by a helix and one by a polynomial."""
    tubes = (
        Tube("a", (Segment(0.08, 0.05, 0.04, (9.0 + 2.0j,)),)),
        Tube("b", (Segment(0.11, 0.03, 0.025, (4.0, 90.0 - 30.0j)),)),
        Tube("c", (Segment(0.14, 0.02, 0.015, (11.0j,), 14.0),)),
    )
    energy = DenseEnergy(Engine(Robot("bare", tubes), 1e-5), np.array(D), 4)
    y = 0.02 * np.cos(np.arange(energy.n))
    y[:3][energy.D == 0.0] = 0.0  # no guide, no unknown of it
    return energy, np.array(alpha), y


#: Bases on the orifice, any tip order, tubes that end inside the guide.
BARE = {
    "all bases on the orifice": [0.0, 0.0, 0.0],
    "one base on the orifice": [0.0, 0.02, 0.05],
    "tips in reverse order": [0.0, 0.045, 0.1],
    "the outer tube is inside": [0.08, 0.09, 0.09],
    "the inner tube alone": [0.08, 0.11, 0.12],
    "nothing out": [0.08, 0.11, 0.14],
}
SCENES = [(seed, tubes) for tubes in (1, 2, 3, 4) for seed in range(4)] + list(BARE)


def scene_of(key):
    return bare_scene(BARE[key], [0.3, -1.1, 2.0]) if key in BARE else random_scene(*key, strength=1.5)


@pytest.mark.parametrize("scene", SCENES)
def test_gradient_and_hessian_match_differences(scene):
    energy, alpha, y = scene_of(scene)
    gradient, hessian = energy.gradient(y, alpha), energy.hessian(y, alpha)
    assert np.allclose(hessian, hessian.T, atol=1e-12)
    h, rng = 1e-5, np.random.default_rng(3)
    for _ in range(5):
        d = rng.standard_normal(energy.n)
        slope = (energy.value(y + h * d, alpha) - energy.value(y - h * d, alpha)) / (2 * h)
        assert slope == pytest.approx(gradient @ d, rel=1e-6, abs=1e-8)
        bend = (energy.gradient(y + h * d, alpha) - energy.gradient(y - h * d, alpha)) / (2 * h)
        assert bend == pytest.approx(hessian @ d, rel=1e-6, abs=1e-8)


@pytest.mark.parametrize("scene", SCENES)
def test_the_energy_is_the_same_in_both(scene):
    """What the kernel calls elastic energy changes with the unknowns as the plain one does, and is that of the fields:
    int T^2 / (2 GJ) over guide and sections is y.y / 2, and bending and straightening come to it."""
    energy, alpha, y = scene_of(scene)
    engine = energy.engine
    told = [float(engine.loads(energy.state(v, alpha).vector)[ENERGY, 0]) for v in (y, np.zeros(energy.n))]
    change = energy.value(y, alpha) - energy.value(np.zeros(energy.n), alpha)
    assert told[0] - told[1] == pytest.approx(change, rel=1e-12, abs=1e-14)
    shape = TorsionShape(engine, energy.state(y, alpha))
    # But for what the integral over Gauss points that were chosen for 1e-5 m leaves.
    assert told[0] == pytest.approx(elastic_energy(shape, 30), rel=1e-8, abs=1e-13)


@pytest.mark.parametrize("scene", SCENES)
def test_torques_are_energy_per_turn_of_a_base(scene):
    """In any state, with the twist held: by differences; and bending pulls no two tubes but against each other."""
    energy, alpha, y = scene_of(scene)
    torque = energy.state(y, alpha).torque
    h = 1e-5
    for j in range(len(alpha)):
        turned = h * np.eye(len(alpha))[j]
        slope = (energy.value(y, alpha + turned) - energy.value(y, alpha - turned)) / (2 * h)
        assert torque[j] == pytest.approx(slope, rel=1e-6, abs=1e-9)
    assert abs(torque.sum()) < 1e-14 * max(1.0, np.abs(torque).max())


@pytest.mark.parametrize("scene", SCENES)
def test_angles_and_torques_between_are_those_of_the_unknowns(scene):
    """The angles at any place are those at the Gauss points too; the torque is GJ psi', also in the guide."""
    energy, alpha, y = scene_of(scene)
    engine, state = energy.engine, energy.state(y, alpha)
    psi, _ = engine.angles(state.vector, energy.place)
    present = np.abs(energy.moment) > 0.0
    assert psi[present] == pytest.approx(energy.angles(y, alpha)[present], abs=1e-12)
    shape, h = TorsionShape(engine, state), 1e-6
    for m in range(shape.domain.n_sections):
        x = np.array([0.137, 0.381, 0.862])
        rate = (shape.angle(m, x + h) - shape.angle(m, x - h)) / (2 * h * shape.domain.lengths[m])
        there = shape.materials.torsional[m] > 0.0
        assert shape.twist_rate(m, x)[:, there] == pytest.approx(rate[:, there], rel=1e-6, abs=1e-6)
    guided = engine.angles(state.vector, np.array([-1.0]))[1][0]
    turned = shape.angle_at_boundaries[0] - alpha
    assert shape.materials.guide_compliance * guided == pytest.approx(turned, abs=1e-14)


@pytest.mark.parametrize("seed", range(6))
def test_at_an_equilibrium_torques_cancel_all_along(seed):
    rng = np.random.default_rng([seed, 61])
    robot = random_robot(rng, 2 + seed % 3)
    answer = EquilibriumSolver(robot, 1e-8).solve(rng.uniform(-2.0, 2.0, robot.n_tubes), random_D(rng, robot))
    assert answer.success
    s = np.linspace(-0.01, answer.length, 50)
    _, torque = answer._engine.angles(answer.state.vector, s)
    assert np.abs(torque.sum(axis=1)).max() < 1e-9 * max(1.0, np.abs(torque).max())


def test_lowered_cosines_bound_the_springs():
    """On the box around the old and the new angle no spring is weaker than what the check puts in its place."""
    rng = np.random.default_rng(5)
    for _ in range(3000):
        b, c = rng.uniform(0.0, 2.0, 2) * np.exp(1j * rng.uniform(-3.2, 3.2, 2))
        moved = rng.choice([1e-9, 1e-3, 9e-3, 0.1, 1.0, 3.0]) * rng.uniform(-1.0, 1.0)
        slack = rng.choice([1e-9, 1e-6, 1e-3, 0.05, 0.5])
        exact = (np.conj(b) * c).real
        assert spring(np.conj(b) * c, moved, slack, EXACT) == pytest.approx(exact, abs=1e-15)
        bound = spring(np.conj(b) * c, moved, slack, LOWERED)
        # ``b`` and ``c`` are the present ones; the angle between them was less by ``moved``.
        low, high = min(-moved, 0.0), max(-moved, 0.0)
        room = WIDER * abs(moved) + slack
        within = np.linspace(low - room, high + room, 41)
        least = (np.conj(b) * c * np.exp(1j * within)).real.min()
        assert bound <= least + 1e-12
        assert spring(np.conj(b) * c, moved, slack, WORST) <= bound <= exact + 1e-15
        if room + high - low < 0.05:  # and the bound is no cruder than it must be
            assert bound >= exact - 2.0 * abs(b) * abs(c) * (abs(moved) + slack)


def test_what_stands_for_springs_at_two_ends_bounds_them_along_the_way():
    """On the straight way between two angles, and ``strayed`` to either side of it, no spring is weaker than the mean
    of what stands for it at both ends."""
    rng = np.random.default_rng(6)
    for _ in range(3000):
        b, c = rng.uniform(0.0, 2.0, 2) * np.exp(1j * rng.uniform(-3.2, 3.2, 2))
        moved = rng.choice([1e-9, 1e-3, 0.1, 1.0, 3.0]) * rng.uniform(-1.0, 1.0)
        strayed = rng.choice([1e-9, 1e-3, 0.05, 0.5])
        begin, end = np.conj(b) * c, np.conj(b) * c * np.exp(1j * moved)
        bounds = [spring(product, moved, strayed, ALONG) for product in (begin, end)]
        t = np.linspace(0.0, 1.0, 21)[:, None]
        off = strayed * np.linspace(-1.0, 1.0, 21)
        springs = (begin * np.exp(1j * (moved * t + off))).real
        assert ((1.0 - t) * bounds[0] + t * bounds[1] <= springs + 1e-12).all()
        if abs(moved) + strayed < 0.01:  # what is left out is small of second order, but for the straying
            assert bounds[0] >= begin.real - abs(begin) * (strayed + moved**2 + strayed**2)


@pytest.mark.parametrize("nodes", [1, 2, 9, 17, MOST_NODES])
def test_the_rules_integrate(nodes):
    """Weights, orthonormal polynomials and their integrals from 0; interpolation exact to degree G - 1, and no integral
    at 0."""
    rule = quadrature_rules()[nodes, :nodes]
    x, w = rule[:, PLACE], rule[:, WEIGHT]
    for power in range(2 * nodes):
        assert w @ x**power == pytest.approx(1.0 / (power + 1), abs=1e-14)
    degrees = min(nodes - 1, HIGHEST_DEGREE) + 1
    values = rule[:, POLYNOMIAL : POLYNOMIAL + degrees]
    assert values.T @ (w[:, None] * values) == pytest.approx(np.eye(degrees), abs=1e-12)
    rng = np.random.default_rng(nodes)
    law = np.polynomial.Chebyshev(rng.uniform(-1.0, 1.0, nodes), domain=[0.0, 1.0])
    interpolant = rule[:, INTERPOLANT : INTERPOLANT + nodes]
    assert interpolant @ law(x) == pytest.approx(law.integ(lbnd=0.0)(x), abs=1e-13)
    for k in range(degrees):
        c = np.zeros(k + 1)
        c[k] = math.sqrt(2 * k + 1)
        legendre = np.polynomial.Legendre(c, domain=[0.0, 1.0])
        assert values[:, k] == pytest.approx(legendre(x), abs=1e-12)
        assert rule[:, INTEGRAL + k] == pytest.approx(legendre.integ(lbnd=0.0)(x), abs=1e-13)
