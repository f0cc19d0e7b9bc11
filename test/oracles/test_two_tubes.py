"""Closed forms for two tubes, against values computed apart from the package, and the package's energy against them.

The numbers in the tables come from high-precision integration of theta'' = lambda sin(theta) from the tip, done once
with other programs; the numbers for more tubes from the eigenvalues of the linearised torsion equations.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import ellipeinc
from scipy.special import ellipj

from ctr_pvs import CommandError
from ctr_pvs import EquilibriumSolver
from ctr_pvs import Robot
from ctr_pvs import Segment
from ctr_pvs import Tube
from ctr_pvs.answer.engine import Engine
from ctr_pvs.errors import FieldError
from ctr_pvs.oracles.two_tubes import TwoTubes
from ctr_pvs.oracles.two_tubes import _jacobi
from ctr_pvs.oracles.two_tubes import critical_lambda
from ctr_pvs.oracles.two_tubes import stability_function
from ctr_pvs.oracles.two_tubes import two_tube_parameters
from ctr_pvs.renda2021.robots import fig2_robot
from ctr_pvs.solve.dense import DenseEnergy

CRITICAL = {
    0.0: 2.4674011003,
    0.1: 2.0416695089,
    0.25: 1.5991918422,
    0.5: 1.1596575824,
    1.0: 0.7401738844,
    2.0: 0.4267632439,
    4.0: 0.2304906684,
    10.0: 0.0967538744,
}
# lambda, b, theta_tip at the fold, alpha there
SNAPS = [
    (3.0, 0.0, 2.42936616, 3.21810737),
    (4.0, 0.0, 2.03716590, 3.45201018),
    (5.0, 0.0, 1.81206546, 3.70267574),
    (8.0, 0.0, 1.40332038, 4.34832861),
    (1.0, 1.0, 2.31385169, 3.30816829),
    (2.0, 0.5, 2.00359180, 3.55878859),
    (4.0, 0.5, 1.41949375, 4.76973218),
]
# lambda, b, alpha, theta(1), theta(0), theta'(0)
STABLE = [
    (2.0, 0.0, 0.5, 0.2314678728, 0.5, -0.6188639343),
    (2.0, 0.0, 2.5, 1.5257036025, 2.5, -1.8398054895),
    (2.0, 0.0, 3.0, 2.4372644086, 3.0, -0.9548733879),
    (1.0, 0.5, 1.5, 0.7559488414, 1.1187043729, -0.7625912541),
    (4.0, 0.0, 3.0, 1.1460724703, 3.0, -3.3491033848),
    (2.0, 0.5, 3.0, 1.1121149034, 2.0495197556, -1.9009604888),
]
AT_HALF_TURN = {2.5: 2.81799520, 2.6: 2.49801462, 3.0: 1.91706905, 4.0: 1.27895891, 5.0: 0.95093023}
#: lambda_c that twist rates of each polynomial degree see at b = 0.
RITZ = {0: (3.0, 1e-12), 1: (2.48596, 5e-6), 2: (2.467738, 5e-7), 3: (2.4674045, 5e-8), 6: (0.25 * np.pi**2, 1e-10)}
#: Three tubes K = (1, 2, 5), GJ = K / 1.3, kappa = (1.2, .9, .5): untwisted angles over pi, and the length at which
#: that state loses its stability.
CRITICAL_LENGTHS = {(0, 1, 0): 1.8204868390, (0, 0, 1): 1.9376784517, (0, 1, 1): 1.5983781605}
#: lambda, b, plane offset
PARAMETERS = [(3.0, 0.0, 0.0), (2.0, 0.5, 1.1), (0.7, 2.0, -2.5), (3.5, 0.2, np.pi)]
#: Fig. 4 of the seed paper: D [m] and the rotation at the fold [deg].
FIG4_FOLDS = [((0.0935, 0.2085), 281.88998), ((0.0935, 0.1705), 205.92164)]


def pair(lam: float, b: float, offset: float = 0.0) -> tuple[Robot, np.ndarray]:
    """A robot with these parameters: unit overlap of two unlike tubes behind a straight lead, part of it guided."""
    bending, torsional = np.array([2.0, 0.7]), np.array([1.5, 0.6])
    compliance = float(np.sum(1.0 / torsional))
    kappa = np.sqrt(lam / (compliance * bending.prod() / bending.sum()))
    planes = (1.0, np.exp(1j * offset))
    tubes = []
    for name, K, G, factor, plane in zip("uv", bending, torsional, (1.6, 1 / 1.6), planes, strict=True):
        lead = (Segment(b, K, G),) if b else ()  # as long in both: together they twist as one of length b would
        tubes.append(Tube(name, (*lead, Segment(1.0, K, G, (kappa * factor * plane,)))))
    return Robot("pair", tuple(tubes)), np.full(2, 0.3 * b)


def margin_of_untwisted(robot: Robot, alpha: np.ndarray, degree: int) -> float:
    """Smallest eigenvalue of the package's Hessian where no tube twists, not clipped, for twist rates of ``degree``."""
    n = robot.n_tubes
    energy = DenseEnergy(Engine(robot, 1.0), np.zeros(n), degree)
    assert len(energy.engine.elements(energy.state(np.zeros(energy.n), alpha).vector)) == 1
    each = (energy.n - n) // n  # those of the guide, then tube by tube, rising in degree
    kept = [*range(n), *(n + each * j + k for j in range(n) for k in range(degree + 1))]
    return float(np.linalg.eigvalsh(energy.hessian(np.zeros(energy.n), alpha)[np.ix_(kept, kept)])[0])


@pytest.mark.parametrize(("b", "expected"), CRITICAL.items())
def test_critical_lambda(b, expected):
    found = critical_lambda(b)
    assert found == pytest.approx(expected, abs=1e-10)
    assert abs(stability_function(found, b)) < 1e-14
    assert TwoTubes(0.999999 * found, b).snap_free and TwoTubes(0.999999 * found, b).snap is None
    just_above = TwoTubes(1.000001 * found, b)
    assert not just_above.snap_free and just_above.snap.alpha == pytest.approx(np.pi, abs=1e-4)


@pytest.mark.parametrize(("lam", "b", "theta_tip", "alpha"), SNAPS)
def test_snaps(lam, b, theta_tip, alpha):
    tubes = TwoTubes(lam, b)
    assert tubes.snap.theta_tip == pytest.approx(theta_tip, abs=5e-8)
    assert tubes.snap.alpha == pytest.approx(alpha, abs=1e-8)
    assert not tubes.snap_free
    assert tubes.stable_tip(alpha - 1e-6) == pytest.approx(theta_tip, abs=3e-3)
    assert tubes.stable_tip(alpha + 1e-6) is None
    assert tubes.stable_tip(1e-6 - alpha) == pytest.approx(-theta_tip, abs=3e-3)


@pytest.mark.parametrize(("lam", "b"), [(2.0, 0.0), (0.5, 1.0)])
def test_pairs_without_a_snap(lam, b):
    tubes = TwoTubes(lam, b)
    assert tubes.snap_free and tubes.folds == ()
    assert len(tubes.equilibria(np.pi)) == 1
    assert tubes.stable_tip(40.0) == pytest.approx(tubes.equilibria(40.0)[0], abs=1e-12)


@pytest.mark.parametrize(("lam", "b", "alpha", "tip", "base", "rate"), STABLE)
def test_the_stable_branch(lam, b, alpha, tip, base, rate):
    tubes = TwoTubes(lam, b)
    theta = tubes.stable_tip(alpha)
    assert theta == pytest.approx(tip, abs=1e-10)
    assert np.array(tubes.base(theta)) == pytest.approx([base, rate], abs=2e-10)


@pytest.mark.parametrize(("lam", "tip"), AT_HALF_TURN.items())
def test_half_a_turn_is_a_pitchfork(lam, tip):
    tubes = TwoTubes(lam, 0.0)
    assert tubes.stable_tip(np.pi) == pytest.approx(tip, abs=1e-8)
    assert tubes.equilibria(np.pi) == pytest.approx([tip, np.pi, 2 * np.pi - tip], abs=1e-8)


@pytest.mark.parametrize("lam", [0.5, 2.0, 8.0, 20.0])
def test_the_elliptic_functions_are_those_of_scipy(lam):
    u, tips = np.sqrt(lam), np.linspace(1e-3, np.pi - 0.1, 40)
    k, k_ = np.cos(tips / 2), np.sin(tips / 2)
    *mine, area = _jacobi(u, k, k_)
    *theirs, amplitude = ellipj(u, k**2)
    assert np.array(mine) == pytest.approx(np.array(theirs), abs=1e-12)
    assert area == pytest.approx((ellipeinc(amplitude, k**2) - k_**2 * u) / k**2, abs=1e-10)


@pytest.mark.parametrize(("lam", "b"), [(0.3, 2.0), (3.0, 0.4), (20.0, 0.0), (60.0, 3.0)])
def test_alpha_and_its_slope_are_those_of_the_integrated_equation(lam, b):
    tubes = TwoTubes(lam, b)
    for tip in (1e-4, 0.02, 0.7, 2.0, 3.0, np.pi, 4.0, -1.2, 9.0):

        def equation(_, y):  # from the tip on: theta, its rate, and the derivatives of both by the tip angle
            return [y[1], lam * np.sin(y[0]), y[3], lam * np.cos(y[0]) * y[2]]

        end = solve_ivp(equation, (0, 1), [tip, 0, 1, 0], rtol=1e-12, atol=1e-13, method="DOP853").y[:, -1]
        assert float(tubes.alpha(tip)) == pytest.approx(end[0] + b * end[1], abs=1e-8 * (1 + abs(end[1])))
        assert float(tubes.slope(tip)) == pytest.approx(end[2] + b * end[3], rel=1e-8, abs=1e-8)
    assert float(tubes.slope(np.pi)) == pytest.approx(stability_function(lam, b), abs=1e-10)


@pytest.mark.parametrize("seed", range(8))
def test_no_equilibrium_is_missed(seed):
    """As many as there are sign changes along a dense sampling of the curve, each one exact."""
    rng = np.random.default_rng([seed, 5])
    tubes = TwoTubes(rng.uniform(0.5, 12.0), rng.choice([0.0, rng.uniform(0.0, 3.0)]))
    alpha = rng.uniform(-6.0, 6.0)
    found = tubes.equilibria(alpha)
    assert tubes.alpha(found) == pytest.approx(np.full(len(found), alpha), abs=1e-10)
    dense = np.linspace(found[0] - 1.0, found[-1] + 1.0, 400_001)
    assert np.count_nonzero(np.diff(tubes.alpha(dense) > alpha)) == len(found)  # a sample may hit a root


@pytest.mark.parametrize(("D", "expected"), FIG4_FOLDS)
def test_the_folds_of_fig_4(seed_robot, D, expected):
    assert np.degrees(two_tube_parameters(seed_robot, D).snap.alpha) == pytest.approx(expected, abs=1e-5)


def test_the_equilibria_of_fig_2():
    tubes = two_tube_parameters(fig2_robot(), [0.0, 0.0])
    assert np.degrees(tubes.equilibria(np.pi)) == pytest.approx([84.0719, 180.0, 275.928], abs=2e-4)


@pytest.mark.parametrize(
    ("lam", "b", "offset"), [(3.0, 0.0, 0.0), (2.0, 0.5, 1.1), (0.7, 2.0, -2.5), (3.5, 0.2, np.pi)]
)
def test_parameters_of_a_robot(lam, b, offset):
    robot, D = pair(lam, b, offset)
    tubes = two_tube_parameters(robot, D)
    assert (tubes.lam, tubes.b) == pytest.approx((lam, b), abs=1e-12)
    assert np.exp(1j * tubes.plane_offset) == pytest.approx(np.exp(1j * offset), abs=1e-12)


@pytest.mark.parametrize(("lam", "b", "offset"), [(2.0, 0.5, 0.0), (4.0, 0.0, 0.4), (1.2, 1.0, -0.8)])
def test_the_solver_agrees(lam, b, offset):
    robot, D = pair(lam, b, offset)
    tubes = two_tube_parameters(robot, D)
    solver = EquilibriumSolver(robot, tolerance=1e-9)
    for alpha in (0.3, 1.5, 0.98 * tubes.snap.alpha):
        answer = solver.solve([0.2, 0.2 + alpha - offset], D, start="cold")
        assert answer.success
        psi = answer.twist(np.array([robot.tubes[0].length - D[0]]))[0]
        assert psi[1] - psi[0] + offset == pytest.approx(tubes.stable_tip(alpha), abs=1e-7)


def test_a_stiffer_stretch_in_the_lead_counts_by_its_own_stiffness():
    robot = Robot(
        "patterned",
        (
            Tube("u", (Segment(0.5, 1.0, 2.0), Segment(0.25, 1.0, 1.0), Segment(1.0, 1.0, 1.0, (1.0,)))),
            Tube("v", (Segment(0.75, 1.0, 1.0), Segment(1.0, 1.0, 1.0, (1.0,)))),
        ),
    )
    # Compliances 0.5 / 2 + 0.25 / 1 and 0.75 / 1 add up to 1.25, over the 2 of the pair.
    assert two_tube_parameters(robot, [0.4, 0.4]).b == pytest.approx(0.625, abs=1e-12)


def test_scenes_of_another_kind_are_refused(seed_robot):
    with pytest.raises(FieldError, match="two pre-curved tubes that overlap"):
        two_tube_parameters(seed_robot, [0.18, 0.21])  # the outer tube ends before the inner one bends
    bent = Tube("w", (Segment(0.1, 0.01, 0.01, (5.0, 40.0)),))
    with pytest.raises(FieldError, match="constant along the overlap"):
        two_tube_parameters(Robot("bent", (Tube("u", (Segment(0.1, 0.02, 0.02, (5.0,)),)), bent)), [0.0, 0.0])
    with pytest.raises(CommandError):
        two_tube_parameters(seed_robot, [0.2085, 0.0935])
    for lam, b in ((0.0, 1.0), (101.0, 1.0), (np.nan, 0.0), (1.0, -0.1), (1.0, np.inf)):
        with pytest.raises(FieldError):
            TwoTubes(lam, b)
    with pytest.raises(FieldError):
        critical_lambda(-1.0)


@pytest.mark.parametrize(("degree", "expected"), RITZ.items())
def test_a_basis_of_low_degree_sees_too_high_a_critical_lambda(degree, expected):
    robot, _ = pair(1.0, 0.0)
    critical = 1.0 / (1.0 - margin_of_untwisted(robot, np.array([0.0, np.pi]), degree))
    value, digits = expected
    assert critical == pytest.approx(value, abs=digits)


@pytest.mark.parametrize("turned", [(0, 1, 0), (0, 0, 1), (0, 1, 1), (0, 0, 0)])
def test_critical_lengths_of_three_tubes(turned):
    K, kappa = (1.0, 2.0, 5.0), (1.2, 0.9, 0.5)
    tubes = [Tube(n, (Segment(1.0, k, k / 1.3, (c,)),)) for n, k, c in zip("uvw", K, kappa, strict=True)]
    margin = margin_of_untwisted(Robot("three", tuple(tubes)), np.pi * np.array(turned), 8)
    if any(turned):
        assert 1.0 / np.sqrt(1.0 - margin) == pytest.approx(CRITICAL_LENGTHS[turned], abs=1e-9)
    else:
        assert margin == pytest.approx(1.0, abs=1e-14)  # a common turn costs torsion alone
