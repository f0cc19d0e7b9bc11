"""Pieces of a rod, arcs and bends: closed forms and collocation against an independent integrator, and the rule for
the number of nodes."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from judges_of_shape import integrate_rod
from judges_of_shape import rolls
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from ctr_pvs.backbone import bishop_frames
from ctr_pvs.backbone import chain
from ctr_pvs.backbone import poses
from ctr_pvs.backbone import position_of
from ctr_pvs.backbone import tip_pose
from ctr_pvs.basis import gauss_legendre
from ctr_pvs.collocation import FEWEST_NODES
from ctr_pvs.collocation import MOST_NODES
from ctr_pvs.collocation import interpolation
from ctr_pvs.collocation import nodes_needed
from ctr_pvs.pieces import Arc
from ctr_pvs.pieces import Bend


def bend(length, k, roll, nodes):
    s = length * gauss_legendre(nodes).x
    return Bend(length, 0.5 * length * k(s), roll(s))


def random_rod(rng, count):
    """Pieces, and for each its length, its law k(s) and its roll(s)."""
    pieces, laws = [], []
    for _ in range(count):
        length = rng.uniform(0.02, 0.08)
        c = complex(*rng.uniform(-20, 20, 2))
        turn, roll, rate = rng.uniform(-30, 30), rng.uniform(-9, 9), rng.uniform(-20, 20)
        if rng.random() < 0.5:

            def k(s, c=c, turn=turn):
                return c * np.exp(1j * turn * s)

            def psi(s, roll=roll, rate=rate):
                return roll + rate * s

            pieces.append(Arc(length, c, turn, roll, rate))
        else:
            d, bow = complex(*rng.uniform(-15, 15, 2)), rng.uniform(-200, 200)

            def k(s, c=c, d=d, turn=turn, bow=bow):
                return c * np.exp(1j * (turn * s + bow * s**2)) + d

            def psi(s, roll=roll, rate=rate, bow=bow):
                return roll + rate * s - bow * s**2

            pieces.append(bend(length, k, psi, 16))
        laws.append((length, k, psi))
    return pieces, laws


@pytest.mark.parametrize("seed", range(12))
def test_pieces_against_an_integrator(seed):
    """Any chain of arcs and bends: the tip, the poses between, and the Bishop frame."""
    rng = np.random.default_rng([seed, 61])
    pieces, laws = random_rod(rng, 1 + seed % 4)
    ends = np.concatenate([[0.0], np.cumsum([length for length, _, _ in laws])])
    s = np.unique(np.concatenate([ends, rng.uniform(0.0, ends[-1], 40)]))
    rotation, position = integrate_rod([law[:2] for law in laws], s)
    found, places = bishop_frames(pieces, s)
    assert found == pytest.approx(rotation, abs=2e-10)
    assert places == pytest.approx(position, abs=2e-11)
    section = np.clip(np.searchsorted(ends, s, side="left") - 1, 0, len(laws) - 1)
    psi = np.array([laws[m][2](x - ends[m]) for m, x in zip(section, s, strict=True)])
    material = (Rotation.from_matrix(rotation) * rolls(psi)).as_matrix()
    backbone = poses(pieces, s)
    assert backbone.position == pytest.approx(position, abs=2e-11)
    assert Rotation.from_quat(backbone.orientation).as_matrix() == pytest.approx(material, abs=2e-10)
    tip = tip_pose(pieces, chain(pieces)[-1])
    assert tip.position == pytest.approx(position[-1], abs=1e-12)
    assert Rotation.from_quat(tip.orientation).as_matrix() == pytest.approx(material[-1], abs=2e-11)


@pytest.mark.parametrize("seed", range(6))
def test_the_last_pose_is_the_tip(seed):
    """With few nodes too: what lies between is less exact than the end, but runs into the same end."""
    rng = np.random.default_rng([seed, 62])
    pieces = [Bend(0.05, 0.5 * np.exp(1j * rng.uniform(-3, 3, n)), rng.uniform(-9, 9, n)) for n in (3, 5, 4)]
    pieces.insert(seed % 4, Arc(0.03, 12.0 - 5.0j, 9.0, 2.0, -3.0))
    backbone, tip = poses(pieces, np.linspace(0.0, 0.18, 7)), tip_pose(pieces, chain(pieces)[-1])
    assert backbone.position[-1] == pytest.approx(tip.position, abs=1e-15)
    assert backbone.orientation[-1] == pytest.approx(tip.orientation, abs=1e-14)


def test_an_arc_is_a_bend_of_the_same_law():
    c, turn, roll, rate, length = 14.0 - 6.0j, 25.0, 4.0, -12.0, 0.06
    arc = [Arc(length, c, turn, roll, rate)]
    same = [bend(length, lambda s: c * np.exp(1j * turn * s), lambda s: roll + rate * s, 18)]
    s = np.linspace(0.0, length, 31)
    a, b = poses(arc, s), poses(same, s)
    assert a.position == pytest.approx(b.position, abs=1e-15)
    assert a.orientation == pytest.approx(b.orientation, abs=1e-12)


@pytest.mark.parametrize("turn", [0.0, 1e-200, 1e-9, 1e-4, 3.0])
@pytest.mark.parametrize("curvature", [0.0, 1e-200, 1e-9, 1e-4, 7.0])
def test_arcs_in_the_limits(curvature, turn):
    """Circles, helices and their limits, by the textbook's formula for the position on a planar circle and, with
    turn, by the rotation vector of the turning frame."""
    length = 0.2
    piece = Arc(length, curvature * 1j, turn)
    points = poses([piece], np.linspace(0.0, length, 5)).position
    x = np.linspace(0.0, length, 5)[:, None] * np.linspace(0.0, 1.0, 2001)
    axis = np.array([turn, 0.0, curvature])
    frames = Rotation.from_rotvec((x[..., None] * axis).reshape(-1, 3)).as_matrix()[:, :, 0].reshape(5, 2001, 3)
    weights = np.full(2001, 2.0)  # Simpson
    weights[1::2], weights[[0, -1]] = 4.0, 1.0
    expected = np.einsum("g,ngi->ni", weights / 6000.0, frames) * x[:, -1:]
    assert points == pytest.approx(expected, abs=1e-15)
    assert position_of(chain([piece])[-1]) == pytest.approx(expected[-1], abs=1e-15)
    if not turn and curvature == 7.0:
        angle = curvature * length
        assert points[-1] == pytest.approx([math.sin(angle) / 7.0, (1.0 - math.cos(angle)) / 7.0, 0.0], abs=1e-15)


def test_a_piece_of_no_length_is_the_rolled_orifice():
    pieces = [Arc(0.0, 0.0, roll=8.0)]
    expected = [math.sin(4.0), 0.0, 0.0, math.cos(4.0)]
    backbone = poses(pieces, np.zeros(3))
    assert np.array_equal(backbone.position, np.zeros((3, 3)))
    assert backbone.orientation == pytest.approx(np.tile(expected, (3, 1)), abs=1e-15)
    assert tip_pose(pieces, chain(pieces)[-1]).orientation == pytest.approx(expected, abs=1e-15)


def pendulum(rng):
    """Two angles psi(x) on [0, 1] that a coupling pulls together or apart, their largest rate, and sqrt(coupling)."""
    coupling, share = rng.uniform(0.0, 12.0), rng.uniform(0.0, 1.0)
    start = rng.uniform(-3.0, 3.0, 2)
    run = solve_ivp(
        lambda x, y: [y[1], coupling * np.sin(y[0])], (0, 1), start, rtol=1e-12, atol=1e-13, method="DOP853",
        dense_output=True,
    )  # fmt: skip
    rate = np.abs(run.sol(np.linspace(0.0, 1.0, 101))[1]).max() * max(share, 1.0 - share)
    return (lambda x: share * run.sol(x)[0], lambda x: (share - 1.0) * run.sol(x)[0]), rate, math.sqrt(coupling)


def steady(rng):
    """Two angles that turn at constant rates; no coupling."""
    rates = rng.uniform(-4.0, 4.0, 2)
    return (lambda x: rates[0] * x, lambda x: rates[1] * x), np.abs(rates).max(), 0.0


@pytest.mark.parametrize("twist", [pendulum, steady])
def test_the_rule_for_the_number_of_nodes(twist):
    """Over random laws k = kappa_1 exp(i psi_1) + kappa_2 exp(i psi_2) errors stay within the tolerance, at the tip and
    between; and on average no more than a few nodes are too many."""
    rng = np.random.default_rng(63)
    x = np.linspace(0.0, 1.0, 41)
    wasted = []
    for _ in range(40):
        h = rng.uniform(0.01, 0.12)
        kappa, phase = rng.uniform(0.0, 25.0, 2), rng.uniform(-3.0, 3.0)
        psi, rate, wave = twist(rng)

        def k(y, kappa=kappa, psi=psi, phase=phase):
            return kappa[0] * np.exp(1j * psi[0](y)) + kappa[1] * np.exp(1j * (phase + psi[1](y)))

        def points(nodes, parts, h=h, k=k):
            y = [(gauss_legendre(nodes).x + part) / parts for part in range(parts)]
            return poses([Bend(h / parts, 0.5 * h / parts * k(part), np.zeros(nodes)) for part in y], x * h).position

        exact = points(20, 4)
        largest = np.abs(k(x)).max()
        for relative in (1e-4, 1e-6, 1e-8):
            parts, nodes = nodes_needed(h, largest, rate / h, wave / h, relative)
            assert FEWEST_NODES <= nodes <= MOST_NODES
            found = [points(fewer, parts) for fewer in range(FEWEST_NODES, nodes + 1)]
            errors = [np.linalg.norm(there - exact, axis=1).max() / h for there in found]
            assert errors[-1] <= relative
            wasted.append(sum(error <= relative for error in errors) - 1)
    assert np.mean(wasted) < 4.0


def test_more_is_asked_of_stronger_bends():
    """Longer, more curved, faster turning or more strictly judged pieces take no fewer nodes in all; at the limits the
    piece is divided."""
    usual = (0.05, 10.0, 20.0, 30.0, 1e-6)
    for index, values in enumerate([(0.01, 0.05, 0.2, 3.0), (0.1, 10, 40, 1e4), (0.0, 9.0, 80.0, 1e4), (0.0, 30, 300)]):
        totals = []
        for value in values:
            parts, nodes = nodes_needed(*usual[:index], value, *usual[index + 1 :])
            totals.append(parts * nodes)
        assert all(a <= b for a, b in pairwise(totals)) and totals[0] < totals[-1]
    assert nodes_needed(0.05, 0.0, 0.0, 0.0, 1e-14) == (1, FEWEST_NODES)
    assert nodes_needed(*usual[:-1], 0.0) == nodes_needed(*usual[:-1], 1e-14)
    parts, nodes = nodes_needed(1.0, 1e4, 0.0, 0.0, 1e-6)
    assert parts > 100 and nodes <= MOST_NODES


def test_quaternions_are_continuous_and_of_norm_one():
    """Along s, however fast the material rolls, and in time: a full turn of the base leads to the negative."""
    rng = np.random.default_rng(64)
    s = np.linspace(0.0, 0.11, 800)
    k = 25 * np.exp(1j * rng.uniform(-3, 3, 6))

    def rod(angle):
        nodes = gauss_legendre(6).x
        return [
            Arc(0.04, 20.0, 30.0, angle, 90.0),
            Bend(0.03, 0.015 * k, angle + 3.6 + 2.0 * nodes**2),
            Arc(0.04, -18.0j, 0.0, angle + 5.6, -70.0),
        ]

    before = None
    for angle in np.linspace(0.0, 2 * np.pi, 41):
        orientation = poses(rod(angle), s).orientation
        assert np.linalg.norm(orientation, axis=1) == pytest.approx(np.ones(800), abs=2e-15)
        assert np.sum(orientation[1:] * orientation[:-1], axis=1).min() > 0.99
        assert orientation[0] == pytest.approx([math.sin(angle / 2), 0.0, 0.0, math.cos(angle / 2)], abs=1e-15)
        if before is not None:
            assert np.sum(orientation * before, axis=1).min() > 0.99
        before = orientation
    assert before == pytest.approx(-poses(rod(0.0), s).orientation, abs=1e-13)


@pytest.mark.parametrize("nodes", [1, FEWEST_NODES, 9, MOST_NODES])
def test_interpolation_from_gauss_points(nodes):
    """Exact for polynomials of degree G - 1 and their integrals, and no integral at 0 to the last bit."""
    rng = np.random.default_rng(nodes)
    x = np.concatenate([[0.0, 1.0], rng.uniform(0.0, 1.0, 50)])
    law = np.polynomial.Chebyshev(rng.uniform(-1.0, 1.0, nodes), domain=[0.0, 1.0])
    values, integrals = interpolation(nodes, x)
    assert values @ law(gauss_legendre(nodes).x) == pytest.approx(law(x), abs=1e-12)
    assert integrals @ law(gauss_legendre(nodes).x) == pytest.approx(law.integ(lbnd=0.0)(x), abs=1e-14)
    assert not integrals[0].any()
