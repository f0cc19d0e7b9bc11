"""Motions along a path: the tip stays on it between commands, rates are kept, and what stops a motion is told."""

from __future__ import annotations

import numpy as np
import pytest

from ctr_pvs import EquilibriumSolver
from ctr_pvs import InverseStatus
from ctr_pvs import Limits
from ctr_pvs import Loads
from ctr_pvs import Rates
from ctr_pvs import Robot
from ctr_pvs import Segment
from ctr_pvs import Status
from ctr_pvs import Tube
from ctr_pvs import load_robot
from ctr_pvs.errors import FieldError
from ctr_pvs.tasks.bounds import Bounds
from ctr_pvs.tasks.motion import Polyline
from ctr_pvs.tasks.motion import distances

ALPHA, D, TOLERANCE = [0.3, 1.0], [0.06, 0.15], 1e-4


@pytest.fixture(scope="module")
def start():
    return EquilibriumSolver(load_robot("renda2021"), 1e-7).solve(ALPHA, D)


def corners(start):
    tip = start.tip.position
    return np.array([tip, tip + np.array([0.0, 0.01, 0.0]), tip + np.array([0.004, 0.01, 0.006])])


@pytest.mark.parametrize("loads", [None, Loads(tip_force=(0.0, 0.1, 0.05))])
def test_the_tip_stays_on_the_path(start, loads):
    """Looked at in ten places between any two commands, by a fresh solver that goes straight from one to the next."""
    robot, path = load_robot("renda2021"), corners(start)
    motion = EquilibriumSolver(robot, 1e-7).motion(path, start=start, loads=loads, tolerance=TOLERANCE)
    assert motion.success and motion.status is InverseStatus.REACHED, motion.message
    fresh, tips = EquilibriumSolver(robot, 1e-7), []
    for step in motion.approach:
        assert fresh.solve(step.alpha, step.D, loads=loads).status is Status.OK
    for index in range(1, len(motion.time)):
        for share in np.arange(11) / 10.0:
            alpha = motion.alpha[index - 1] + share * (motion.alpha[index] - motion.alpha[index - 1])
            depth = motion.D[index - 1] + share * (motion.D[index] - motion.D[index - 1])
            answer = fresh.solve(alpha, depth, loads=loads)
            assert answer.status is Status.OK and answer.stability_margin > 0.1
            tips.append(answer.tip.position)
    assert distances(np.array(tips), path).max() < 1.1 * TOLERANCE
    assert distances(path, np.array(tips)).max() < 1.1 * TOLERANCE  # it comes to all corners
    assert motion.deviation.max() <= TOLERANCE
    assert motion.progress[-1] == motion.length == pytest.approx(0.01 + np.hypot(0.004, 0.006))


def across_flush_tips(rng, robot, solver):
    """Two answers: with one tube's tip 4 mm out of that of the next one outside, and, moved a little, up to 3 mm in."""
    bounds, N = Bounds(robot, None), robot.n_tubes
    lengths = np.array([tube.length for tube in robot.tubes])
    while True:
        alpha = rng.uniform(-np.pi, np.pi, N)
        out = np.maximum.accumulate(rng.uniform(bounds.low[N:], bounds.high[N:]))
        outer = rng.integers(N - 1)
        out[outer + 1] = lengths[outer + 1] - lengths[outer] + out[outer] - 0.004
        within = out.copy()
        within[outer + 1] += 0.004 + 0.003 * rng.random()
        within[outer] = np.clip(within[outer] + 0.004 * rng.normal(), bounds.low[N + outer], bounds.high[N + outer])
        turned = alpha + 0.1 * rng.normal(size=N)
        if bounds.contains(alpha, out) and bounds.contains(turned, within):
            here = solver.solve(alpha, out, start="cold")
            if here.status is Status.OK and here.stability_margin > 0.5:
                there = solver.fork(here).solve(turned, within)
                if there.status is Status.OK and there.stability_margin > 0.5:
                    return here, there


@pytest.mark.parametrize("name", ["renda2021", "three_tubes"])
def test_paths_are_followed_where_the_tip_goes_from_one_tube_to_another(name):
    """Rates jump there: some of these motions come to rest on the kink where descents do not slide along it."""
    rng, robot = np.random.default_rng(7), load_robot(name)
    solver = EquilibriumSolver(robot, 1e-7)
    for _ in range(60):
        here, there = across_flush_tips(rng, robot, solver)
        motion = solver.motion([here.tip.position, there.tip.position], start=here)
        assert motion.success, motion.message
        assert motion.tip[-1] == pytest.approx(there.tip.position, abs=1e-5)


def test_rates_are_kept_and_one_of_them_is_used_up(start):
    rates = Rates(turn=0.2, slide=0.003, tip=0.002)
    motion = EquilibriumSolver(load_robot("renda2021"), 1e-7).motion(corners(start), start=start, rates=rates)
    lasts = np.diff(motion.time)
    turn = np.abs(np.diff(motion.alpha, axis=0)).max(axis=1) / lasts / rates.turn
    slide = np.abs(np.diff(motion.D, axis=0)).max(axis=1) / lasts / rates.slide
    way = np.linalg.norm(np.diff(motion.tip, axis=0), axis=1) / lasts / rates.tip
    assert np.maximum(np.maximum(turn, slide), way) == pytest.approx(np.ones(len(lasts)), abs=1e-6)


def test_where_a_path_cannot_be_followed_on_is_told(start):
    robot = load_robot("renda2021")
    solver, tip = EquilibriumSolver(robot, 1e-7), start.tip.position
    out = solver.motion([tip, tip + np.array([0.0, 0.3, 0.0])], start=start)
    assert not out.success and 0.0 < out.progress[-1] < out.length
    assert "stopped at" in out.message
    limits = Limits(D=((0.05, 0.07), (0.14, 0.16)))
    held = solver.motion([tip, tip + np.array([0.1, 0.0, 0.0])], start=start, limits=limits)
    assert held.status is InverseStatus.LIMITS and held.deviation.max() <= TOLERANCE
    assert held.D.min() >= 0.05 and held.D[:, 1].max() <= 0.16
    far = solver.motion([[0.0, 0.5, 0.0], tip], start=start)
    assert not far.success and "first waypoint" in far.message and len(far.time) == 1


def test_a_motion_ends_in_time(start):
    motion = EquilibriumSolver(load_robot("renda2021"), 1e-7).motion(corners(start), start=start, budget=1e-4)
    assert motion.status is InverseStatus.TIMEOUT and not motion.success


@pytest.mark.parametrize("points", [[], [[0.0, 1.0]], [[0.0, 0.0, np.inf]], "abc", [["a", "b", "c"]]])
def test_what_is_no_path_is_refused(points):
    with pytest.raises(FieldError, match="waypoints"):
        Polyline(points)


def test_wrong_rates_are_refused():
    with pytest.raises(FieldError, match="slide"):
        Rates(slide=0.0)


def test_a_single_arc_that_comes_out_follows_its_tip():
    """A circle slides along itself; only its straight guide does not curve."""
    robot = Robot("arc", (Tube("only", (Segment(0.1, 0.01, 0.008), Segment(0.08, 0.01, 0.008, (12.0,)))),))
    D = np.linspace(0.179, 0.1, 30)[:, None]
    deployed = EquilibriumSolver(robot, 1e-7).follow_the_leader(np.zeros((30, 1)), D)
    assert deployed.worst < 2e-5  # what straight lines between 30 tips leave of the arc: kappa h^2 / 8
    assert deployed.tip.shape == (30, 3) and deployed.stray[0] == 0.0
    turned = EquilibriumSolver(robot, 1e-7).follow_the_leader(np.linspace(0.0, 1.0, 30)[:, None], D)
    assert turned.worst > 5e-3


def test_distances_to_a_line_are_those_to_its_nearest_point():
    line = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]])
    points = np.array([[0.5, 0.0, 2.0], [-3.0, 4.0, 0.0], [1.5, 0.5, 0.0], [1.0, 1.0, 0.0]])
    assert distances(points, line) == pytest.approx([2.0, 5.0, 0.5, 0.0])
    assert distances(points, line[:1]) == pytest.approx(np.linalg.norm(points, axis=1))
