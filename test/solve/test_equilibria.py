"""Every equilibrium of a command: pairs against closed forms and sign rules, all by integration from the tip."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from judges_of_shape import base_angles
from random_robots import random_D
from random_robots import random_robot

from ctr_pvs import CommandError
from ctr_pvs import EquilibriumSolver
from ctr_pvs import Robot
from ctr_pvs import Segment
from ctr_pvs import Tube
from ctr_pvs.errors import FieldError
from ctr_pvs.oracles.tip_curve import TURN
from ctr_pvs.oracles.two_tubes import two_tube_parameters
from ctr_pvs.renda2021.robots import fig2_robot
from ctr_pvs.solve.equilibria import Equilibria
from ctr_pvs.solve.equilibria import equilibria
from ctr_pvs.solve.equilibria import folds
from ctr_pvs.solve.equilibria import tip_curve

STRAIGHT = Segment(0.03, 0.03, 0.02)
FULL, PARTIAL = (0.0935, 0.2085), (0.0935, 0.1705)


def strong_robot(rng: np.random.Generator, tubes: int, spread: float = 0.5) -> tuple[Robot, np.ndarray]:
    """Strongly and almost equally curved tubes whose ends lie apart: many equilibria."""
    made = []
    for index in range(tubes):
        K = 0.05 * rng.uniform(0.3, 1.0) / (index + 1)
        curvature = rng.uniform(12.0, 40.0) * np.exp(1j * rng.uniform(-spread, spread))
        bent = Segment(float(rng.uniform(0.05, 0.1)), K, K / 1.3, (curvature,))
        made.append(Tube(f"t{index}", (Segment(0.03, K, K / 1.3), bent)))
    return Robot("strong", tuple(made)), np.full(tubes, 0.02)


def helical_pair() -> tuple[Robot, np.ndarray]:
    """Everything that closed forms cannot take: varying, helical and patterned, with a gap in the coupling."""
    outer = (
        STRAIGHT,
        Segment(0.03, 0.03, 0.02, (30.0, 200.0)),
        Segment(0.01, 0.01, 0.006),
        Segment(0.02, 0.03, 0.02, (35j,)),
    )
    inner = (Segment(0.05, 0.015, 0.01), Segment(0.06, 0.015, 0.012, (45.0,), 12.0))
    return Robot("helical", (Tube("u", outer), Tube("v", inner))), np.array([0.02, 0.04])


def end_of_overlap(robot: Robot, D: np.ndarray) -> float:
    return min(tube.length - base for tube, base in zip(robot.tubes, D, strict=True))


def tips(found: Equilibria) -> np.ndarray:
    """Relative angle [rad] of two tubes where their overlap ends."""
    angles = []
    for one in found.found:
        psi = one.twist(np.array([end_of_overlap(one.shape.materials.robot, one.D)]))[0]
        angles.append(psi[1] - psi[0])
    return np.sort(angles)


def check(found: Equilibria, robot: Robot, alpha: np.ndarray, D: np.ndarray) -> None:
    """What every answer must be: exact, told as what it is, no two the same, in order."""
    lengths = np.array([tube.length for tube in robot.tubes])
    shapes = []
    for one in found.found:
        assert one.residual < 1e-9 and one.error_estimate <= one.tolerance
        assert one.success == (one.stability_margin > 0.0)
        assert ("unstable" in one.message) != one.success
        at_tips = np.array([one.twist(np.array([length]))[0, j] for j, length in enumerate(lengths - D)])
        bases, torque = base_angles(robot, D, at_tips)
        assert bases == pytest.approx(alpha, abs=1e-5)
        # By the chain rule the work of all bases is what their torques do; dE/dalpha is minus the torque in the tube.
        assert one.torque == pytest.approx(-torque, abs=1e-5 * (1.0 + np.abs(torque).max()))
        shapes.append(at_tips)
    for index, one in enumerate(shapes):
        assert all(np.abs(one - other).max() > 1e-4 for other in shapes[:index])
    energies = [one.energy for one in found.found]
    assert energies == sorted(energies) and len(found.stable) >= 1
    assert found.consistent
    assert found.stable == tuple(one for one in found.found if one.stability_margin > 0.0)


def test_fig_2_has_three():
    found = equilibria(fig2_robot(), [0.0, np.pi], [0.0, 0.0], tolerance=1e-8)
    assert found.complete and "tip" in found.method
    assert np.degrees(tips(found)) == pytest.approx([84.0719, 180.0, 275.928], abs=2e-4)
    margins = [one.stability_margin for one in found.found]
    assert margins[0] > 0.0 and margins[1] > 0.0 and margins[2] < 0.0  # mirror images first, the planar one last
    assert np.degrees(tips(found))[1] == pytest.approx(180.0, abs=1e-9)
    check(found, fig2_robot(), np.array([0.0, np.pi]), np.zeros(2))


@pytest.mark.parametrize(("D", "fold"), [(FULL, 281.88998), (PARTIAL, 205.92164)])
def test_folds_of_fig_4_and_the_counts_beside_them(seed_robot, D, fold):
    named = {one.maximum: one for one in folds(seed_robot, D)}
    assert len(named) == 2 and all(one.ends_stable for one in named.values())
    assert np.degrees(named[True].alpha) == pytest.approx(fold, abs=1e-5)
    assert named[False].alpha == pytest.approx(-named[True].alpha, abs=1e-9)
    for away, count in ((-1.0, 3), (-1e-4, 3), (-1e-9, 3), (1e-9, 1), (1e-4, 1), (1.0, 1)):
        found = equilibria(seed_robot, [0.0, named[True].alpha + np.radians(away)], D)
        assert found.complete and len(found.found) == count
        assert len(found.stable) == (count + 1) // 2


def test_what_is_found_past_the_fold_of_fig_4(seed_robot):
    """Only the other history is left: that of a base turned by 360 deg less."""
    alpha = np.radians(290.0)
    found = equilibria(seed_robot, [0.0, alpha], FULL, tolerance=1e-8)
    other = EquilibriumSolver(seed_robot, tolerance=1e-8).solve([0.0, alpha - TURN], FULL)
    assert found.found[0].tip.position == pytest.approx(other.tip.position, abs=1e-8)
    assert found.found[0].energy == pytest.approx(other.energy, rel=1e-9)
    assert found.found[0].force == pytest.approx(other.force, abs=1e-6)


@pytest.mark.parametrize("seed", range(12))
def test_pairs_agree_with_the_closed_forms(seed):
    rng = np.random.default_rng([seed, 41])
    robot, D = strong_robot(rng, 2)
    alpha = rng.uniform(-8.0, 8.0, 2)
    closed = two_tube_parameters(robot, D)
    found = equilibria(robot, alpha, D)
    expected = closed.equilibria(alpha[1] - alpha[0] + closed.plane_offset)
    assert found.complete
    assert tips(found) + closed.plane_offset == pytest.approx(expected, abs=1e-7)
    named = folds(robot, D)
    assert len(named) == 2 * len(closed.folds)
    if closed.snap is not None:
        rising = [one for one in named if one.maximum and one.ends_stable]
        assert len(rising) == 1
        turned = rising[0].alpha + closed.plane_offset - closed.snap.alpha
        assert turned == pytest.approx(TURN * np.round(turned / TURN), abs=1e-9)
    check(found, robot, alpha, D)


@pytest.mark.parametrize("alpha", [-2.0, 0.4, 2.9, 7.0])
def test_pairs_of_any_kind(alpha):
    robot, D = helical_pair()
    found = equilibria(robot, [0.0, alpha], D, tolerance=1e-7)
    assert found.complete
    check(found, robot, np.array([0.0, alpha]), D)
    curve = tip_curve(robot, D)
    assert curve.resolved
    # Stability alternates along the curve, with the sign of d alpha / d theta_tip.
    places = tips(found)
    slopes = curve.integral.base(places)[1]
    by_tip = sorted(found.found, key=lambda one: float(np.diff(one.twist(np.array([end_of_overlap(robot, D)]))[0])[0]))
    directions = curve.integral.unstable_directions(places)
    assert [one.stability_margin > 0.0 for one in by_tip] == [count == 0 for count in directions]
    assert np.all((slopes > 0.0) == (directions % 2 == 0))
    assert all((a > 0.0) != (b > 0.0) for a, b in pairwise(slopes))


@pytest.mark.parametrize("scene", ["helical", "strong", "seed"])
def test_the_branches_of_the_curve(seed_robot, scene):
    """Monotone, joined at folds, one period long; between folds the count of unstable directions is constant."""
    robot, D = {
        "helical": helical_pair(),
        "strong": strong_robot(np.random.default_rng(3), 2),
        "seed": (seed_robot, np.array(FULL)),
    }[scene]
    curve = tip_curve(robot, D)
    assert len(curve.branches) == max(1, len(curve.folds)) and len(curve.folds) >= 2
    assert curve.theta_tip[-1] - curve.theta_tip[0] == pytest.approx(TURN, abs=1e-12)
    assert curve.alpha[-1] - curve.alpha[0] == pytest.approx(TURN, abs=1e-8)
    for fold, branch, after in zip(curve.folds, curve.branches, [*curve.branches[1:], curve.branches[0]], strict=True):
        assert branch.theta_tip[0] == fold.theta_tip and branch.alpha[0] == fold.alpha
        rising = branch.alpha[-1] > branch.alpha[0]
        assert np.all(np.diff(branch.alpha) > 0.0) if rising else np.all(np.diff(branch.alpha) < 0.0)
        assert rising != fold.maximum and rising == (branch.unstable_directions % 2 == 0)
        assert abs(after.unstable_directions - branch.unstable_directions) == 1
        inside = curve.integral.unstable_directions(branch.theta_tip[1:-1])
        assert np.all(inside == branch.unstable_directions)
    assert [branch.stable for branch in curve.branches].count(True) == 1


def test_whole_turns_of_a_base_change_nothing_but_the_angle_told(seed_robot):
    first = equilibria(seed_robot, [0.0, 4.0], FULL)
    turned = equilibria(seed_robot, [TURN, 4.0 - TURN], FULL)
    assert len(first.found) == len(turned.found) == 3
    for a, b in zip(first.found, turned.found, strict=True):
        assert a.energy == pytest.approx(b.energy, rel=1e-9)
        assert a.tip.position == pytest.approx(b.tip.position, abs=1e-8)
    assert tips(turned) + 2 * TURN == pytest.approx(tips(first), abs=1e-8)


def test_without_an_overlap_there_is_one(seed_robot):
    D = [0.18, 0.21]  # the outer tube ends before the inner one bends
    found = equilibria(seed_robot, [0.3, 2.0], D)
    assert found.complete and len(found.found) == 1 and found.found[0].stability_margin == 1.0
    assert found.found[0].twist(np.array([0.0]))[0] == pytest.approx([0.3, 2.0])
    with pytest.raises(FieldError, match="exactly two pre-curved tubes"):
        folds(seed_robot, D)


def test_a_pair_that_no_number_can_resolve_is_not_called_complete():
    """lambda = 900: tip angles that differ in the 15th digit lie turns apart at the base."""
    # lambda = kappa^2 L^2 (K / 2) (2 / GJ), with K = GJ and L = 1 m
    robot = Robot("mighty", tuple(Tube(n, (Segment(1.0, 0.01, 0.01, (30.0,)),)) for n in "uv"))
    found = equilibria(robot, [0.1, 0.4], [0.0, 0.0], tolerance=1e-3)
    assert not found.complete and "not complete" in found.method


@pytest.mark.parametrize("seed", range(6))
def test_three_tubes(seed):
    rng = np.random.default_rng([seed, 43])
    robot, D = strong_robot(rng, 3)
    alpha = rng.uniform(-4.0, 4.0, 3)
    found = equilibria(robot, alpha, D)
    assert not found.complete and "not guaranteed complete" in found.method and "801 starts" in found.method
    check(found, robot, alpha, D)
    answer = EquilibriumSolver(robot).solve(alpha, D)
    assert answer.success
    assert any(one.energy == pytest.approx(answer.energy, rel=1e-6) for one in found.stable)


def test_aligned_and_opposed_planar_tubes_are_all_found():
    """Three planar tubes with a half turn between two of them: the untwisted state is an equilibrium, if not a stable
    one."""
    robot, D = strong_robot(np.random.default_rng(8), 3, spread=0.0)
    for turned in ((0, 1, 0), (0, 0, 1), (0, 1, 1)):
        alpha = np.pi * np.array(turned)
        found = equilibria(robot, alpha, D)
        check(found, robot, alpha, D)
        untwisted = [one for one in found.found if np.abs(one.twist(np.zeros(1))[0] - alpha).max() < 1e-9]
        assert len(untwisted) == 1 and untwisted[0].stability_margin < 0.0
        # The others come in mirror images of equal energy.
        assert len(found.found) % 2 == 1 and len(found.found) >= 3


@pytest.mark.parametrize("seed", range(8))
def test_random_robots(seed):
    rng = np.random.default_rng([seed, 47])
    robot = random_robot(rng, 2 + seed % 2, strength=3.0)
    D, alpha = random_D(rng, robot), rng.uniform(-4.0, 4.0, robot.n_tubes)
    check(equilibria(robot, alpha, D), robot, alpha, D)


def test_bad_input_is_refused(seed_robot):
    with pytest.raises(CommandError):
        equilibria(seed_robot, [0.0], FULL)
    with pytest.raises(FieldError):
        equilibria(seed_robot, [0.0, 0.0], FULL, tolerance=0.0)
    with pytest.raises(CommandError):
        tip_curve(seed_robot, [0.2085, 0.0935])
