"""The backbone of answers: its tolerance, poses, rolls and signs of quaternions, and the tip Jacobian."""

from __future__ import annotations

import numpy as np
import pytest
from judges_of_shape import integrate_rod
from judges_of_shape import rolls
from random_robots import random_D
from random_robots import random_robot
from scipy.spatial.transform import Rotation

from ctr_pvs import EquilibriumSolver
from ctr_pvs import Robot
from ctr_pvs import Segment
from ctr_pvs import Tube
from ctr_pvs.answer.backbone import Backbone


def curvature_laws(shape):
    """Those of ``integrate_rod``, element by element: no step may cross a seam."""
    laws = []
    for m, length in enumerate(shape.domain.lengths):
        for panel in range(shape.panels(m)):
            share = length / shape.panels(m)

            def k(s, m=m, length=length, start=panel * share):
                return shape.curvature(m, np.array([(start + s) / length]))[0]

            laws.append((share, k))
    return laws


@pytest.mark.parametrize("tolerance", [1e-4, 1e-6, 1e-8, 1e-10])
def test_poses_of_a_shape_keep_the_tolerance(tolerance):
    """Over random robots, against an integrator on the shape's own curvature; a tube's rolls are its angles."""
    rng = np.random.default_rng(11)
    compared = 0
    for seed in range(8):
        robot = random_robot(rng, 2 + seed % 3, strength=1.5)
        answer = EquilibriumSolver(robot, tolerance).solve(rng.uniform(-2, 2, robot.n_tubes), random_D(rng, robot))
        if not answer.success:
            continue
        compared += 1
        shape = answer.shape
        domain = shape.domain
        s = np.union1d(np.linspace(0.0, domain.length, 20), domain.boundaries)
        rotation, position = integrate_rod(curvature_laws(shape), s)
        for tube in range(robot.n_tubes):
            found = Backbone(s, *answer._engine.poses(answer.state.vector, s, tube))
            assert np.linalg.norm(found.position - position, axis=1).max() < tolerance + 1e-11
            held = np.vstack([shape.angle_at_boundaries[0], shape.angles_held(s)[1:]])[:, tube]
            expected = Rotation.from_matrix(rotation) * rolls(held)
            apart = (expected.inv() * Rotation.from_quat(found.orientation)).magnitude()
            assert apart.max() < 1e3 * tolerance + 1e-7
    assert compared >= 6


def test_poses_along_the_backbone():
    """First pose at the orifice, last at the tip, equal spacing, x along the tangent, unit and sign-continuous
    quaternions."""
    rng = np.random.default_rng(4)
    robot = random_robot(rng, 3)
    answer = EquilibriumSolver(robot, tolerance=1e-8).solve([0.4, 2.0, -3.0], random_D(rng, robot))
    poses = answer.backbone(61)
    assert len(poses) == 61 and poses.s[0] == 0.0 and poses.s[-1] == answer.shape.domain.length
    assert np.array_equal(poses.position[0], np.zeros(3))
    assert poses.position[-1] == pytest.approx(answer.tip.position, abs=1e-9)
    assert poses.orientation[-1] == pytest.approx(answer.tip.orientation, abs=1e-8)
    assert np.linalg.norm(poses.orientation, axis=1) == pytest.approx(np.ones(61), abs=1e-14)
    assert np.sum(poses.orientation[1:] * poses.orientation[:-1], axis=1).min() > 0.5
    tangent = Rotation.from_quat(poses.orientation).as_matrix()[:, :, 0]
    chord = np.diff(poses.position, axis=0)
    spacing = poses.s[1]
    assert np.all(np.linalg.norm(chord, axis=1) <= spacing + 1e-12)
    middle = tangent[1:] + tangent[:-1]
    cosine = np.sum(chord * middle, axis=1) / np.linalg.norm(chord, axis=1) / np.linalg.norm(middle, axis=1)
    assert cosine.min() > 0.999
    with pytest.raises(ValueError, match="n: expected at least 2"):
        answer.backbone(1)


@pytest.mark.parametrize("seed", range(6))
def test_moving_the_bases_keeps_the_poses_right(seed):
    """Sections are kept while D stays and cut anew when it moves, to others and back again: against an integrator on
    the shape's own curvature."""
    rng = np.random.default_rng(seed)
    robot = random_robot(rng, 2 + seed % 2)
    solver, D, other = EquilibriumSolver(robot, tolerance=1e-8), random_D(rng, robot), random_D(rng, robot)
    for place in (D, D + 1e-4, other, D + 2e-4, other - 1e-4, D):
        answer = solver.solve(rng.uniform(-1, 1, robot.n_tubes), place)
        assert answer.success
        found = answer.backbone(40)
        laws = curvature_laws(answer.shape)
        ends = np.minimum(np.cumsum([length for length, _ in laws]), answer.length)
        s = np.union1d(found.s, ends)
        rotation, position = (rows[np.isin(s, found.s)] for rows in integrate_rod(laws, s))
        roll = answer.shape.angles_held(found.s)[:, answer.shape.leader]
        roll[0] = answer.shape.angle_at_boundaries[0, answer.shape.leader]
        expected = (Rotation.from_matrix(rotation) * rolls(roll)).as_matrix()
        assert found.position == pytest.approx(position, abs=2e-8)
        assert Rotation.from_quat(found.orientation).as_matrix() == pytest.approx(expected, abs=1e-6)
        assert answer.tip.position == pytest.approx(position[-1], abs=1e-8)


def test_each_tube_has_its_own_roll():
    """Tube poses share the backbone's points and tangents; they differ by the tubes' twist, and end at their own
    tips."""
    rng = np.random.default_rng(6)
    robot = random_robot(rng, 3)
    D = random_D(rng, robot)
    answer = EquilibriumSolver(robot, tolerance=1e-8).solve([0.0, 1.0, 2.0], D)
    for j, tube in enumerate(robot.tubes):
        own = answer.tube_backbone(j, 7)
        assert own.s[-1] == pytest.approx(tube.length - D[j], abs=1e-12)
        shared = answer.backbone_at(own.s)
        assert own.position == pytest.approx(shared.position, abs=1e-9)
        between = Rotation.from_quat(shared.orientation).inv() * Rotation.from_quat(own.orientation)
        psi = answer.twist(own.s)
        expected = psi[:, j] - psi[:, answer.shape.leader]
        turn = np.column_stack([expected, np.zeros(7), np.zeros(7)])
        assert (between * Rotation.from_rotvec(turn).inv()).magnitude() == pytest.approx(np.zeros(7), abs=5e-8)


def test_the_sign_of_quaternions_follows_the_unwrapped_angle():
    """Turning a lone tube by a full turn carries the quaternion to its negative without a jump on the way."""
    robot = Robot("one", (Tube("a", (Segment(0.1, 0.05, 0.04, (10.0,)),)),))
    solver = EquilibriumSolver(robot)
    first = last = solver.solve([0.0], [0.02]).tip.orientation
    for angle in np.linspace(0.0, 2 * np.pi, 41):
        tip = solver.solve([angle], [0.02]).tip.orientation
        assert tip @ last > 0.9
        last = tip
    assert last == pytest.approx(-first, abs=1e-9)


@pytest.mark.parametrize("seed", range(8))
def test_tip_jacobian_matches_differences(seed):
    rng = np.random.default_rng([seed, 21])
    robot = random_robot(rng, 2 + seed % 3)
    n, h = robot.n_tubes, 1e-5
    alpha, D = rng.uniform(-1.5, 1.5, n), random_D(rng, robot)
    solver = EquilibriumSolver(robot, tolerance=1e-9)
    here = solver.solve(alpha, D)
    assert here.success, here.message
    assert here.jacobian.shape == (6, 2 * n)
    for index in range(2 * n):
        shift = np.zeros(2 * n)
        shift[index] = h
        ahead, behind = (solver.solve(alpha + s * shift[:n], D + s * shift[n:]) for s in (1, -1))
        if not all(np.array_equal(here.shape.domain.segment, a.shape.domain.segment) for a in (ahead, behind)):
            continue  # the difference would cross a kink
        move = (ahead.tip.position - behind.tip.position) / (2 * h)
        turn = Rotation.from_quat(ahead.tip.orientation) * Rotation.from_quat(behind.tip.orientation).inv()
        expected = np.concatenate([move, turn.as_rotvec() / (2 * h)])
        assert here.jacobian[:, index] == pytest.approx(expected, rel=2e-5, abs=2e-5)
