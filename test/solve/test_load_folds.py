"""Where stable branches end under loads, what comes after, and the way of a load whose carrier changes."""

from __future__ import annotations

import numpy as np
import pytest
from loaded_cases import REFERENCE

from bench.loaded.loaded_judge import LoadedJudge
from bench.loaded.loaded_judge import LoadedPath
from bench.loaded.random_loaded_sweeps import place_of
from ctr_pvs import EquilibriumSolver
from ctr_pvs import Robot
from ctr_pvs import Segment
from ctr_pvs import Status
from ctr_pvs import Tube
from ctr_pvs.robot.loads import Loads

FULL, PARTIAL = np.array([0.0935, 0.2085]), np.array([0.0935, 0.1705])
FOLDS = REFERENCE["folds"]


def force(direction, size: float = 1.0) -> Loads:
    return Loads(tip_force=tuple(size * np.array(direction, dtype=float)))


@pytest.mark.parametrize(("D", "name"), [(FULL, "full"), (PARTIAL, "partial")])
def test_sideways_of_the_planar_branch(seed_robot, D, name):
    """Pulled up, the planar robot at 0 deg loses its stability sideways: a bifurcation, where the margin falls in
    proportion to what is left, and the branch counts as ended when it is 1e-5: up to 8e-5 N before it."""
    solver = EquilibriumSolver(seed_robot, 1e-6)
    solver.solve([0.0, 0.0], D, loads=force([0, 0, 1]))
    factor = solver.load_to_snap(force([0, 0, 1]))
    assert 1.0 + factor == pytest.approx(FOLDS["sideways_at_0_deg_up_N"][name], abs=1e-5)


@pytest.mark.parametrize("fold", FOLDS["snap_at_load_N"], ids=lambda fold: f"{fold['alpha2_deg']} {fold['direction']}")
def test_folds_along_a_growing_load(seed_robot, fold):
    solver, D = EquilibriumSolver(seed_robot, 1e-6), np.array(fold["D"])
    alpha = [0.0, np.radians(fold["alpha2_deg"])]
    free = solver.solve(alpha, D)
    assert free.status is Status.OK
    assert solver.load_to_snap(force(fold["direction"])) == pytest.approx(fold["load"], abs=1e-6)
    beyond = solver.solve(alpha, D, loads=force(fold["direction"], fold["load"] + 0.01))
    assert beyond.status is Status.SNAP and len(beyond.snaps) == 1 and beyond.stability_margin > 0.0
    snap = beyond.snaps[0]
    assert snap.t == pytest.approx(fold["load"] / (fold["load"] + 0.01), abs=1e-5)
    assert snap.energy_released > 0.0
    at = snap.command[4:].reshape(-1)[-6:-3]  # the tip's force
    assert np.linalg.norm(at) == pytest.approx(fold["load"], abs=1e-5)


@pytest.mark.parametrize("fold", FOLDS["snap_at_angle_deg"], ids=lambda fold: f"{fold['force']}")
def test_folds_along_a_rotation(seed_robot, fold):
    solver, D, loads = EquilibriumSolver(seed_robot, 1e-6), np.array(fold["D"]), force(fold["force"])
    begin = np.radians(fold["alpha2_deg"] - 20.0)
    assert solver.solve([0.0, begin], D, "cold", loads=loads).status is Status.OK
    distance = solver.distance_to_snap(turn=0.6)
    assert np.degrees(begin + distance[1, 1]) == pytest.approx(fold["alpha2_deg_judged"], abs=1e-4)
    beyond = solver.follow([0.0, np.radians(fold["alpha2_deg"] + 1.0)], D, loads=loads)
    assert beyond.status is Status.SNAP
    assert np.degrees(beyond.snaps[0].alpha[1]) == pytest.approx(fold["alpha2_deg_judged"], abs=1e-4)


def test_a_snap_under_a_moment_releases_no_known_energy(seed_robot):
    """Dead moments have no potential: the landing is where the overdamped flow of the residual ends."""
    solver, alpha = EquilibriumSolver(seed_robot, 1e-5), [0.0, np.radians(200.0)]
    assert solver.solve(alpha, PARTIAL).status is Status.OK
    moment = Loads(tip_force=(0.0, -0.3, 0.0), tip_moment=(0.0, 1e-3, 0.0))
    answer = solver.solve(alpha, PARTIAL, loads=moment)
    assert answer.status is Status.SNAP and np.isnan(answer.snaps[0].energy_released)
    assert answer.stability_margin > 0.0 and answer.residual < 1e-10


def test_compression_only_bends_the_seed_robot_away(seed_robot):
    """No Euler load: its curvature leads it, and the margin falls smoothly."""
    solver, margins = EquilibriumSolver(seed_robot, 1e-5), []
    for push in (0.0, 2.0, 10.0, 60.0):
        answer = solver.solve([0.0, 1.0], FULL, loads=force([-1, 0, 0], push))
        assert answer.status is Status.OK, answer.message
        margins.append(answer.stability_margin)
    assert min(margins) > 0.05


def leaders() -> Robot:
    """Two tubes of nearly one length: sliding makes the one or the other reach farther."""
    a = Segment(0.05, 0.05, 0.04), Segment(0.06, 0.05, 0.04, (6.0,))
    b = Segment(0.05, 0.02, 0.015), Segment(0.08, 0.02, 0.015, (3.0 + 9.0j,))
    return Robot("leaders", (Tube("a", a), Tube("b", b)))


@pytest.mark.parametrize(
    "loads",
    [
        Loads(tip_force=(0.1, -0.3, 0.4)),
        Loads(tip_moment=(0.02, 0.01, -0.02)),
        Loads(tip_force=(0.1, -0.3, 0.4), tip_moment=(0.02, 0.01, -0.02)),
    ],
    ids=["force", "moment", "both"],
)
def test_another_tube_comes_to_reach_farthest(loads: Loads):
    """On a sliding path the tip's load goes over to it; judged by small steps of Newton on the dense virtual work."""
    robot, alpha = leaders(), np.array([0.2, 1.1])
    D, D_end = np.array([0.02, 0.03]), np.array([0.02, 0.06])  # b's end, then a's
    solver, judge = EquilibriumSolver(robot, 1e-7), LoadedJudge(robot)
    first = solver.solve(alpha, D, loads=loads)
    assert first.success and not first.snaps
    place = place_of(judge, first, alpha, D, loads)
    assert place is not None
    path = LoadedPath(alpha, D, loads, alpha, D_end, loads)
    reached, t = judge.go(path, place, 0.0)
    assert t == 1.0
    answer = solver.solve(alpha, D_end, loads=loads)
    assert answer.status is Status.OK, answer.message
    end = place_of(judge, answer, alpha, D_end, loads)
    assert end is not None and end.apart(reached) < 1e-6
    assert np.linalg.norm(answer.tip.position - reached.tip) < 1e-5
    cold = EquilibriumSolver(robot, 1e-7).solve(alpha, D_end, loads=loads)
    assert cold.tip.position == pytest.approx(answer.tip.position, abs=2e-7)
    assert cold.torque == pytest.approx(answer.torque, abs=1e-6)
