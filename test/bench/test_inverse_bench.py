"""The bench of inverse kinematics judges ways by itself, and its dense search is one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bench.inverse.reach import closest_row
from bench.inverse.reach import keeps
from bench.inverse.reach import reached_row
from bench.inverse.reach import run
from bench.inverse.scenes import dense_tips
from bench.inverse.scenes import least_distances
from bench.inverse.scenes import reachable
from bench.inverse.scenes import scenes
from bench.inverse.scenes import unreachable
from ctr_pvs.tasks.walk import Step


@pytest.fixture(scope="module")
def scene():
    return scenes()[0]


def test_targets_are_reached_and_ways_judged(scene):
    done = run(scene, reachable(scene, 3, 1), None)
    row = reached_row(scene.name, done)
    assert row[1] == "3 of 3" and row[-1] == "0" and len(done.watch.seconds) == len(done.cpu) == 3
    whole = done.results[0]
    full = np.array([0.0935, 0.2085])  # between these two the robot snaps, see docs/stability.md
    snaps = [Step(np.array([0.0, turn]), full, 1.0) for turn in (0.0, 5.5)]
    assert keeps(scene.robot, whole, None)
    assert not keeps(scene.robot, replace(whole, way=tuple(snaps)), None)
    assert not keeps(scene.robot, replace(whole, way=(snaps[0],)), None)  # ends elsewhere


def test_closest_points_are_compared_with_a_search(scene):
    tips = dense_tips(scene, 2000, 1, None)
    targets = unreachable(scene, tips, 2, 1, True)
    dense = least_distances(targets, tips, True)
    assert (dense > 5e-3).all()
    assert least_distances(tips[:3], tips, True) == pytest.approx(np.zeros(3), abs=1e-12)
    row = closest_row(scene.name, run(scene, targets, None), dense)
    assert row[1] == "2 of 2" and row[-1] == "0"
