"""Frames and poses along the backbone: closed forms and collocation against an independent integrator."""

from __future__ import annotations

import cmath
import math

import numpy as np
import pytest
from judges_of_shape import integrate_rod
from judges_of_shape import rolls
from random_robots import random_D
from random_robots import random_robot
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from ctr_pvs import EquilibriumSolver
from ctr_pvs import Robot
from ctr_pvs import Segment
from ctr_pvs import Tube
from ctr_pvs.kernel.backbone.frames import arc
from ctr_pvs.kernel.sections import nodes_for_turn
from ctr_pvs.model.packing import MOST_NODES
from ctr_pvs.model.packing import PLACE
from ctr_pvs.model.packing import WEIGHT
from ctr_pvs.model.packing import quadrature_rules


def rotation_of(a, b):
    """The matrix of the unit quaternion a + b j, a = w + i x and b = y + i z."""
    return Rotation.from_quat([a.imag, b.real, b.imag, a.real]).as_matrix()


def random_tube(rng, name, pieces):
    """Straight, constant, polynomial and helical pieces in any order."""
    segments = []
    for _ in range(pieces):
        length, turn = rng.uniform(0.02, 0.08), rng.choice([0.0, rng.uniform(-30.0, 30.0)])
        c = rng.uniform(-15.0, 15.0, 3) + 1j * rng.uniform(-15.0, 15.0, 3)
        curvature = tuple((c / (0.5 * length) ** np.arange(3) / 2.0)[: rng.integers(0, 4)])
        segments.append(Segment(length, 0.02, 0.015, curvature, turn if curvature else 0.0))
    return Tube(name, tuple(segments))


def single_laws(tube, D, alpha):
    """Those of ``integrate_rod`` for one tube: it keeps its own shape, turned by its base angle."""
    laws = []
    for start, segment in zip(tube.breaks, tube.segments, strict=False):
        inside = max(0.0, D - start)
        if inside < segment.length:

            def k(s, segment=segment, inside=inside):
                return cmath.exp(1j * alpha) * complex(segment.pre_curvature(s + inside))

            laws.append((segment.length - inside, k))
    return laws


@pytest.mark.parametrize("seed", range(12))
def test_single_tubes_against_an_integrator(seed):
    """Any chain of arcs, helices and bends: the tip, and the poses between, to 1e-12."""
    rng = np.random.default_rng([seed, 61])
    tube = random_tube(rng, "one", 1 + seed % 4)
    D, alpha = rng.uniform(0.0, 0.9) * tube.length, rng.uniform(-9.0, 9.0)
    answer = EquilibriumSolver(Robot("one", (tube,)), 1e-10).solve([alpha], [D])
    laws = single_laws(tube, D, alpha)
    ends = np.minimum(np.concatenate([[0.0], np.cumsum([length for length, _ in laws])]), answer.length)
    s = np.unique(np.concatenate([ends, rng.uniform(0.0, ends[-1], 40)]))
    rotation, position = integrate_rod(laws, s)
    material = (Rotation.from_matrix(rotation) * rolls(np.full(len(s), alpha))).as_matrix()
    backbone = answer.backbone_at(s)
    assert backbone.position == pytest.approx(position, abs=1e-12)
    assert Rotation.from_quat(backbone.orientation).as_matrix() == pytest.approx(material, abs=1e-11)
    assert answer.tip.position == pytest.approx(position[-1], abs=1e-12)
    assert Rotation.from_quat(answer.tip.orientation).as_matrix() == pytest.approx(material[-1], abs=1e-11)


def laws_of_elements(shape):
    """Those of ``integrate_rod`` for an equilibrium's own curvature; no law crosses the seam of two elements."""
    laws = []
    for m, length in enumerate(shape.domain.lengths):
        share = length / shape.panels(m)
        for part in range(shape.panels(m)):

            def k(s, m=m, length=length, start=part * share):
                return complex(shape.curvature(m, np.array([(start + s) / length]))[0])

            laws.append((share, k))
    return laws


@pytest.mark.parametrize("seed", range(6))
def test_equilibria_against_an_integrator(seed):
    """Coupled tubes at the tightest tolerance: tip and backbone, of the kernel's own curvature, to 1e-12."""
    rng = np.random.default_rng([seed, 63])
    robot = random_robot(rng, 2 + seed % 3)
    solver = EquilibriumSolver(robot, 1e-10, fidelity="torsion")
    answer = solver.solve(rng.uniform(-2.0, 2.0, robot.n_tubes), random_D(rng, robot))
    assert answer.success, answer.message
    ends = [b for m, b in enumerate(answer.shape.domain.boundaries[1:]) for _ in range(answer.shape.panels(m))]
    laws = laws_of_elements(answer.shape)
    seams = np.minimum(np.cumsum([length for length, _ in laws]), ends)
    s = np.union1d(np.linspace(0.0, answer.length, 23), seams)
    rotation, position = integrate_rod(laws, s)
    backbone = answer.backbone_at(s)
    assert answer.tip.position == pytest.approx(position[-1], abs=2e-12)
    assert backbone.position == pytest.approx(position, abs=2e-12)
    tangent = Rotation.from_quat(backbone.orientation).as_matrix()[:, :, 0]
    assert tangent == pytest.approx(rotation[:, :, 0], abs=1e-10)


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("tolerance", [1e-3, 1e-6])
def test_the_last_pose_is_the_tip(seed, tolerance):
    """With few Gauss points too: what lies between is less exact than the end, but runs into the same end."""
    rng = np.random.default_rng([seed, 62])
    robot = random_robot(rng, 1 + seed % 4)
    answer = EquilibriumSolver(robot, tolerance).solve(rng.uniform(-2.0, 2.0, robot.n_tubes), random_D(rng, robot))
    backbone, tip = answer.backbone(7), answer.tip
    assert backbone.position[-1] == pytest.approx(tip.position, abs=1e-15)
    assert backbone.orientation[-1] == pytest.approx(tip.orientation, abs=1e-14)


@pytest.mark.parametrize("turn", [0.0, 1e-200, 1e-9, 1e-4, 3.0])
@pytest.mark.parametrize("curvature", [0.0, 1e-200, 1e-9, 1e-4, 7.0])
def test_arcs_in_the_limits(curvature, turn):
    """Circles, helices and their limits, by the textbook's formula for the position on a planar circle and, with
    turn, by the rotation vector of the turning frame."""
    length = 0.2
    places = np.linspace(0.0, length, 5)
    arcs = [arc(curvature * 1j, turn, float(s)) for s in places]
    points = np.array([[along, across.real, across.imag] for _, _, along, across in arcs])
    x = places[:, None] * np.linspace(0.0, 1.0, 2001)
    axis = np.array([turn, 0.0, curvature])
    frames = Rotation.from_rotvec((x[..., None] * axis).reshape(-1, 3)).as_matrix()[:, :, 0].reshape(5, 2001, 3)
    weights = np.full(2001, 2.0)  # Simpson
    weights[1::2], weights[[0, -1]] = 4.0, 1.0
    expected = np.einsum("g,ngi->ni", weights / 6000.0, frames) * x[:, -1:]
    assert points == pytest.approx(expected, abs=1e-15)
    if not turn and curvature == 7.0:
        angle = curvature * length
        assert points[-1] == pytest.approx([math.sin(angle) / 7.0, (1.0 - math.cos(angle)) / 7.0, 0.0], abs=1e-15)


@pytest.mark.parametrize("seed", range(12))
def test_arcs_against_an_integrator(seed):
    rng = np.random.default_rng([seed, 64])
    k, turn, length = complex(*rng.uniform(-25.0, 25.0, 2)), rng.uniform(-40.0, 40.0), rng.uniform(0.02, 0.2)
    rotation, position = integrate_rod([(length, lambda s: k * cmath.exp(1j * turn * s))], np.array([length]))
    a, b, along, across = arc(k, turn, length)
    assert [along, across.real, across.imag] == pytest.approx(position[0].tolist(), abs=1e-12)
    assert rotation_of(a, b) == pytest.approx(rotation[0], abs=1e-11)


def test_nothing_out_is_the_rolled_orifice():
    segment = Segment(0.1, 0.05, 0.04, (10.0,))
    robot = Robot("pair", (Tube("a", (segment,)), Tube("b", (segment,))))
    answer = EquilibriumSolver(robot).solve([0.0, 8.0], [0.1, 0.1])
    expected = [math.sin(4.0), 0.0, 0.0, math.cos(4.0)]
    backbone = answer.backbone(3)
    assert np.array_equal(backbone.position, np.zeros((3, 3)))
    assert backbone.orientation == pytest.approx(np.tile(expected, (3, 1)), abs=1e-15)
    assert answer.tip.orientation == pytest.approx(expected, abs=1e-15)


def pendulum(rng):
    """An angle psi(x) on [0, 1] that a coupling pulls back or away, and its largest turn."""
    coupling = rng.uniform(0.0, 12.0)
    start = rng.uniform(-3.0, 3.0, 2)
    run = solve_ivp(
        lambda x, y: [y[1], coupling * np.sin(y[0])], (0, 1), start, rtol=1e-12, atol=1e-13, method="DOP853",
        dense_output=True,
    )  # fmt: skip
    fastest = np.abs(run.sol(np.linspace(0.0, 1.0, 101))[1]).max()
    return (lambda x: run.sol(x)[0]), float(fastest + math.sqrt(coupling))


def steady(rng):
    rate = rng.uniform(-4.0, 4.0)
    return (lambda x: rate * x), abs(rate)


@pytest.mark.parametrize("twist", [pendulum, steady])
def test_the_rule_for_the_number_of_gauss_points(twist):
    """What it says of a factor exp(i psi) that turns that far holds for its mean; and it is not far too many."""
    rng = np.random.default_rng(63)
    rules = quadrature_rules()
    wasted = []
    for _ in range(40):
        psi, turn = twist(rng)
        x, w = np.polynomial.legendre.leggauss(60)
        exact = 0.5 * w @ np.exp(1j * psi(0.5 * (x + 1.0)))
        for relative in (1e-4, 1e-6, 1e-8):
            nodes = nodes_for_turn(turn, relative)
            assert 1 <= nodes <= MOST_NODES
            errors = [
                abs(rules[G, :G, WEIGHT] @ np.exp(1j * psi(rules[G, :G, PLACE])) - exact) for G in range(1, nodes + 1)
            ]
            assert errors[-1] <= relative
            wasted.append(sum(error <= relative for error in errors) - 1)
    assert np.mean(wasted) < 6.0


def test_more_is_asked_of_faster_turns():
    turns = [nodes_for_turn(turn, 1e-6) for turn in (0.0, 0.1, 1.0, 4.0, 20.0)]
    assert turns == sorted(turns) and turns[0] < turns[-1] <= MOST_NODES
    digits = [nodes_for_turn(2.0, relative) for relative in (1e-2, 1e-6, 1e-12)]
    assert digits == sorted(digits) and digits[0] < digits[-1]


def test_quaternions_are_continuous_and_of_norm_one():
    """Along s, however fast the material rolls, and in time: a full turn of the base leads to the negative."""
    tube = Tube(
        "one",
        (
            Segment(0.01, 0.02, 0.015),
            Segment(0.04, 0.02, 0.015, (20.0,), 30.0),
            Segment(0.03, 0.02, 0.015, (25.0, -900.0 + 400.0j, 2e4j), -70.0),
            Segment(0.04, 0.02, 0.015, (-18.0j,), 90.0),
        ),
    )
    solver = EquilibriumSolver(Robot("one", (tube,)))
    first = before = None
    for angle in np.linspace(0.0, 2 * np.pi, 41):
        orientation = solver.solve([angle], [0.01]).backbone(800).orientation
        assert np.linalg.norm(orientation, axis=1) == pytest.approx(np.ones(800), abs=2e-15)
        assert np.sum(orientation[1:] * orientation[:-1], axis=1).min() > 0.99
        assert orientation[0] == pytest.approx([math.sin(angle / 2), 0.0, 0.0, math.cos(angle / 2)], abs=1e-15)
        if before is not None:
            assert np.sum(orientation * before, axis=1).min() > 0.99
        first, before = orientation if first is None else first, orientation
    assert before == pytest.approx(-first, abs=1e-13)
