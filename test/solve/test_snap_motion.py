"""The way of a snap: it goes down the energy without a break, from the fold to the landing."""

from __future__ import annotations

import numpy as np
import pytest
from random_robots import two_tubes

from ctr_pvs import EquilibriumSolver
from ctr_pvs import Loads
from ctr_pvs.solve.snap import snap_motion

D = [0.0935, 0.2085]
COUNT = 13


def snapped(solver, loads=None):
    solver.solve([0.0, 4.5], D, loads=loads)
    answer = solver.solve([0.0, 5.5], D, loads=loads)
    assert answer.status.value == "snap"
    return answer


@pytest.mark.parametrize("loads", [None, Loads(tip_force=(0.0, 0.1, 0.05))], ids=["unloaded", "loaded"])
def test_it_goes_from_the_fold_down_to_the_landing(seed_robot, loads):
    answer = snapped(EquilibriumSolver(seed_robot), loads)
    (snap,) = answer.snaps
    shapes = snap_motion(answer, snap, COUNT, 60.0)
    assert len(shapes) == COUNT
    assert shapes[0].tip.position == pytest.approx(snap.before.tip[:3], abs=5e-5)  # left by the flow's first nudge
    assert shapes[-1].tip.position == pytest.approx(snap.after.tip[:3], abs=1e-6)
    assert all(shape.alpha.tolist() == pytest.approx(snap.alpha, abs=1e-6) for shape in shapes)
    assert not any(shape.success for shape in shapes)
    if loads is None:
        energy = np.array([shape.energy for shape in shapes])
        assert (np.diff(energy) < 0.0).all()
        assert energy[0] - energy[-1] == pytest.approx(snap.energy_released, rel=1e-3)
    steps = np.linalg.norm(np.diff([shape.tip.position for shape in shapes], axis=0), axis=1)
    assert steps.max() < 3.0 * np.median(steps)  # nowhere a jump
    straight = np.linalg.norm(shapes[-1].tip.position - shapes[0].tip.position)
    assert steps.sum() > 1.1 * straight  # the way down is not the straight one


def test_shapes_hang_together(seed_robot):
    """Between the ends they are no mixtures of positions: each is as long as the robot and joined to the orifice."""
    answer = snapped(EquilibriumSolver(seed_robot))
    for shape in snap_motion(answer, answer.snaps[0], 5, 60.0):
        backbone = shape.tube_backbone(1, 400)
        along = np.linalg.norm(np.diff(backbone.position, axis=0), axis=1).sum()
        assert along == pytest.approx(answer.length, rel=1e-4)
        assert backbone.position[0] == pytest.approx(np.zeros(3), abs=1e-12)
        assert backbone.position[-1] == pytest.approx(shape.tip.position, abs=1e-6)


def test_without_time_there_is_none(seed_robot):
    answer = snapped(EquilibriumSolver(seed_robot))
    assert snap_motion(answer, answer.snaps[0], COUNT, 0.0) == ()


@pytest.mark.parametrize(("lam", "b"), [(3.0, 0.0), (4.0, 1.0), (8.0, 0.5), (15.0, 0.0)])
def test_strong_pairs_whose_twist_drifts_before_it_leaves(lam, b):
    robot, where = two_tubes(lam, b)
    solver = EquilibriumSolver(robot)
    solver.solve([0.0, 0.0], where)
    answer = solver.solve([0.0, 4.0 * np.pi], where)
    assert answer.snaps
    for snap in answer.snaps[-2:]:
        shapes = snap_motion(answer, snap, COUNT, 60.0)
        assert len(shapes) == COUNT
        energy = np.array([shape.energy for shape in shapes])
        assert (np.diff(energy) < 1e-9 * energy.max()).all()
        assert energy[0] - energy[-1] == pytest.approx(snap.energy_released, rel=1e-2)
