"""Rates under loads: Jacobian, compliance, load Jacobian by differences of solves, and what forces alone must keep."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from energy_differences import KINKS
from energy_differences import kink_robot
from long_runs import some
from random_loads import random_loads
from random_robots import random_D
from random_robots import random_robot
from scipy.spatial.transform import Rotation

from ctr_pvs import Equilibrium
from ctr_pvs import EquilibriumSolver
from ctr_pvs import Robot
from ctr_pvs import Segment
from ctr_pvs import Tube
from ctr_pvs.robot.loads import Loads
from ctr_pvs.robot.loads import PointForce

TOLERANCE = 1e-9
#: Steps of differences: actuators [rad], [m], loads [N], [N m].
TURN, SLIDE, FORCE, MOMENT = 1e-3, 1e-4, 1e-3, 1e-4
WEIGHTS = {-2: 1.0 / 12.0, -1: -8.0 / 12.0, 1: 8.0 / 12.0, 2: -1.0 / 12.0}


class Scene:
    """A command under loads, away from kinks."""

    def __init__(self, seed: int, moments: bool, tubes: int = 2) -> None:
        rng = np.random.default_rng([seed, tubes, 178])
        self.robot = random_robot(rng, tubes)
        self.D, self.alpha = random_D(rng, self.robot), rng.uniform(-1.0, 1.0, tubes)
        self.loads = random_loads(rng, self.robot, self.D, moments)
        self.solver = EquilibriumSolver(self.robot, TOLERANCE)
        ends = [tube.breaks[1:] - base for tube, base in zip(self.robot.tubes, self.D, strict=True)]
        points = [point.X - self.D[point.tube] for point in self.loads.point_forces]
        self.roomy = bool(np.diff(np.sort(np.concatenate([[0.0], points, *ends]))).min() > 3 * SLIDE)
        self.here = self.solve()

    def solve(self, turn=0.0, slide=0.0, force=0.0, moment=0.0) -> Equilibrium:
        loads = replace(
            self.loads,
            tip_force=tuple(np.array(self.loads.tip_force) + force),
            tip_moment=tuple(np.array(self.loads.tip_moment) + moment),
        )
        answer = self.solver.solve(self.alpha + turn, self.D + slide, loads=loads)
        assert answer.success and not answer.snaps, answer.message
        return answer

    def slope(self, what, step: float, **direction) -> np.ndarray:
        """By differences of ``what`` (answer) between solves along a direction."""
        (name, way), total = next(iter(direction.items())), 0.0
        for i, weight in WEIGHTS.items():
            total = total + weight * what(self.solve(**{name: i * step * way}))
        return np.asarray(total) / step

    def tip_motion(self, answer: Equilibrium) -> np.ndarray:
        """(6,) from the tip here to that of ``answer``, base axes."""
        a, b = self.here.tip, answer.tip
        turn = Rotation.from_quat(b.orientation) * Rotation.from_quat(a.orientation).inv()
        return np.concatenate([b.position - a.position, turn.as_rotvec()])


def actuation(answer: Equilibrium) -> np.ndarray:
    return np.concatenate([answer.torque, answer.force])


def agree(value: np.ndarray, expected: np.ndarray, share: float = 1e-5) -> bool:
    return bool(np.abs(value - expected).max() <= share * max(np.abs(expected).max(), 1e-3))


SCENES = [(seed, moments, 2 + seed % 2) for seed in range(4) for moments in (False, True)]


@pytest.mark.parametrize(("seed", "moments", "tubes"), SCENES)
def test_jacobian_by_differences(seed: int, moments: bool, tubes: int):
    scene = Scene(seed, moments, tubes)
    for j, way in enumerate(np.eye(tubes)):
        turned = scene.slope(scene.tip_motion, TURN, turn=way)
        assert agree(scene.here.jacobian[:, j], turned)
        if scene.roomy and np.diff(scene.D).min() > 3 * SLIDE:
            slid = scene.slope(scene.tip_motion, SLIDE, slide=way)
            assert agree(scene.here.jacobian[:, tubes + j], slid)


@pytest.mark.parametrize(("seed", "moments", "tubes"), SCENES)
def test_compliance_and_load_jacobian_by_differences(seed: int, moments: bool, tubes: int):
    """With moments neither is what symmetry would make of the Jacobian."""
    scene = Scene(seed, moments, tubes)
    here = scene.here
    for i, way in enumerate(np.eye(3)):
        for column, step, kind in ((i, FORCE, "force"), (3 + i, MOMENT, "moment")):
            assert agree(here.compliance[:, column], scene.slope(scene.tip_motion, step, **{kind: way}))
            changed = scene.slope(actuation, step, **{kind: way})
            assert agree(here.load_jacobian[:tubes, column], changed[:tubes])
            assert agree(here.load_jacobian[tubes:, column], changed[tubes:])


MANY = [(seed, 1 + seed % 3) for seed in range(200)]


@pytest.mark.parametrize("of", some(MANY, range(9)))
def test_identities_of_forces(of: tuple[int, int]):
    """d tau / d wrench = -(d tip / dq)^T, the compliance is symmetric, and so are the rates of torques by rotations."""
    seed, tubes = of
    scene = Scene(seed, False, tubes)
    here = scene.here
    assert agree(here.load_jacobian, -here.jacobian.T, 1e-6)
    assert agree(here.compliance, here.compliance.T, 1e-6)
    assert np.linalg.eigvalsh(0.5 * (here.compliance + here.compliance.T))[0] > -1e-9
    stiffness = np.column_stack([scene.slope(lambda a: a.torque, TURN, turn=way) for way in np.eye(tubes)])
    assert agree(stiffness, stiffness.T)


@pytest.mark.parametrize("tubes", [1, 2, 3])
@pytest.mark.parametrize("seed", range(3))
def test_with_moments_they_do_not_hold(seed: int, tubes: int):
    here = Scene(seed, True, tubes).here
    apart = np.abs(here.compliance - here.compliance.T).max()
    assert apart > 1e-4 * np.abs(here.compliance).max()


@pytest.mark.parametrize("seed", range(3))
def test_without_loads_too(seed: int):
    """An unloaded robot has a compliance, and what a first load does to its actuators."""
    scene = Scene(seed, False, 2 + seed % 2)
    scene.loads = Loads()
    scene.here = here = scene.solve()
    assert here.applied_loads is None
    assert agree(here.load_jacobian, -here.jacobian.T, 1e-6) and agree(here.compliance, here.compliance.T, 1e-6)
    for way in np.eye(3):
        column = int(np.flatnonzero(way)[0])
        assert agree(here.compliance[:, column], scene.slope(scene.tip_motion, FORCE, force=way))
        assert agree(here.compliance[:, 3 + column], scene.slope(scene.tip_motion, MOMENT, moment=way))


@pytest.mark.parametrize("seed", range(4))
def test_torques_and_forces_are_slopes_of_the_potential(seed: int):
    scene = Scene(seed, False, 2 + seed % 2)
    for j, way in enumerate(np.eye(scene.robot.n_tubes)):
        turned = scene.slope(lambda answer: answer.potential, TURN, turn=way)
        assert scene.here.torque[j] == pytest.approx(turned, abs=1e-8)
        if scene.roomy and np.diff(scene.D).min() > 3 * SLIDE:
            slid = scene.slope(lambda answer: answer.potential, SLIDE, slide=way)
            assert scene.here.force[j] == pytest.approx(slid, abs=1e-6)


def loop_work(scene: Scene, size: float) -> tuple[float, float]:
    """What actuators do along a closed square of commands, by Simpson's rule on each side, and along one side alone."""
    n, parts = scene.robot.n_tubes, 8
    rng = np.random.default_rng(4)
    a = np.concatenate([rng.normal(0.0, size, n), rng.normal(0.0, 0.02 * size, n)])
    b = np.concatenate([rng.normal(0.0, size, n), rng.normal(0.0, 0.02 * size, n)])
    weights = np.array([1.0, *[4.0, 2.0] * (parts // 2 - 1), 4.0, 1.0]) / (3.0 * parts)
    total, sides = 0.0, []
    corners = [0.0 * a, a, a + b, b, 0.0 * a]
    for start, end in pairwise(corners):
        way, work = end - start, 0.0
        for t, weight in zip(np.linspace(0.0, 1.0, parts + 1), weights, strict=True):
            command = start + t * way
            work += weight * float(actuation(scene.solve(turn=command[:n], slide=command[n:])) @ way)
        sides.append(work)
        total += work
    return total, max(map(abs, sides))


def test_no_work_over_a_closed_loop_of_commands():
    """At constant forces; a dead moment does work over the same loop."""
    scene = Scene(11, False, 2)
    around, along = loop_work(scene, 0.1)
    assert along > 1e-4 and abs(around) < 1e-6 * along
    around, along = loop_work(Scene(11, True, 2), 0.1)
    assert abs(around) > 1e-5 * along


#: A load sits where another tube has the end of a segment, or the base of its load, or on its own segment's end.
POINTS = {
    "on another tube's end of a segment": (1, 0.05 - 0.03 + 0.06),
    "on another tube's tip": (2, 0.11 - 0.03 + 0.11),
    "on an end of a segment of its own": (1, 0.10),
}


@pytest.mark.parametrize("name", POINTS)
def test_point_loads_on_kinks(name: str):
    """Both one-sided forces are slopes of the potential to their sides."""
    robot, alpha, D = kink_robot(), np.array([0.1, 1.4, -0.9]), np.array([0.03, 0.06, 0.11])
    tube, X = POINTS[name]
    loads = Loads(point_forces=(PointForce(tube, X, (0.2, -0.3, 0.25)),), tip_force=(0.05, 0.1, -0.1))
    check_sides(robot, alpha, D, loads)


@pytest.mark.parametrize("name", ["boundary of a on the orifice", "boundaries of b and c coincide"])
def test_kinks_of_ends_under_loads(name: str):
    loads = Loads(tip_force=(0.2, 0.3, -0.2), line_forces={1: (0.0, 1.0, 0.5)})
    check_sides(kink_robot(), np.array([0.1, 1.4, -0.9]), np.array(KINKS[name][0]), loads)


def test_two_point_loads_in_one_place():
    robot, D = kink_robot(), np.array([0.03, 0.062, 0.11])
    points = PointForce(0, 0.08, (0.2, 0.1, 0.0)), PointForce(1, 0.112, (0.0, -0.2, 0.3))
    check_sides(robot, np.array([0.1, 1.4, -0.9]), D, Loads(point_forces=points))


def check_sides(robot: Robot, alpha: np.ndarray, D: np.ndarray, loads: Loads) -> None:
    solver = EquilibriumSolver(robot, TOLERANCE)
    here = solver.solve(alpha, D, loads=loads)
    assert here.success, here.message
    h = 1e-4
    for j in range(robot.n_tubes):
        for side, told in ((-1, here.force_interval[j, 0]), (1, here.force_interval[j, 1])):
            values = [
                solver.solve(alpha, D + side * i * h * np.eye(robot.n_tubes)[j], loads=loads).potential
                for i in range(5)
            ]
            slope = side * np.dot([-25.0, 48.0, -36.0, 16.0, -3.0], values) / (12.0 * h)
            assert told == pytest.approx(slope, abs=2e-6), (j, side)
    assert here.kink


def test_bases_and_ends_on_the_orifice():
    """No guide, or nothing but a load on the innermost tube: rates by differences to the side that can be commanded."""
    a, b = Segment(0.08, 0.05, 0.04, (9.0 + 2.0j,)), Segment(0.14, 0.02, 0.015, (11.0j,), 14.0)
    robot, alpha = Robot("bare", (Tube("a", (a,)), Tube("b", (b,)))), np.array([0.3, 1.4])
    loads = Loads(tip_force=(0.1, 0.2, -0.3), tip_moment=(0.01, 0.0, 0.01))
    for D in ([0.0, 0.0], [0.0, 0.03], [0.08, 0.09]):
        solver = EquilibriumSolver(robot, TOLERANCE)
        here = solver.solve(alpha, np.array(D), loads=loads)
        assert here.success, here.message
        turned = [
            solver.solve(alpha + i * TURN * np.array([0.0, 1.0]), np.array(D), loads=loads).tip.position
            for i in WEIGHTS
        ]
        expected = np.array(list(WEIGHTS.values())) @ np.array(turned) / TURN
        assert here.jacobian[:3, 1] == pytest.approx(expected, rel=1e-5, abs=1e-7)
        assert here.torque.sum() == pytest.approx(-here.base_wrench.moment[0], abs=1e-9)
