"""The arrays that the kernel reads: loads."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from random_robots import random_D
from random_robots import random_robot

from ctr_pvs import Loads
from ctr_pvs import PointForce
from ctr_pvs import Robot
from ctr_pvs import Segment
from ctr_pvs import Tube
from ctr_pvs.model.packing import POINT_WIDTH
from ctr_pvs.model.packing import packed_loads
from ctr_pvs.model.packing import packed_robot
from ctr_pvs.model.packing import tip_carrier
from ctr_pvs.model.sections import piecewise_domain

PIECE = Segment(0.1, 0.05, 0.04)
ROBOT = Robot(
    "two",
    (
        Tube("outer", (PIECE,), 2.01e-3, 2.39e-3, 8000.0),
        Tube("inner", (PIECE, replace(PIECE, area=1e-6), replace(PIECE, area=3e-6)), density=6000.0),
    ),
)
D = np.array([0.05, 0.15])
FORCE, MOMENT = (1.0, 2.0, 3.0), (0.1, 0.2, 0.3)


def unpacked(robot: Robot, packed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(N, S, 3) forces per length and (P, 8) point loads."""
    N, S = packed_robot(robot)[0].shape[:2]
    return packed[: 3 * N * S].reshape(N, S, 3), packed[3 * N * S :].reshape(-1, POINT_WIDTH)


@pytest.mark.parametrize(
    "loads",
    [
        None,
        Loads(),
        Loads(point_forces=[PointForce(0, 0.1)], line_forces={1: (0, 0, 0)}),
        Loads(point_forces=[PointForce(1, 0.2, FORCE), PointForce(1, 0.2, tuple(-f for f in FORCE))]),
    ],
)
def test_no_load_is_an_empty_array(loads):
    packed = packed_loads(ROBOT, D, loads)
    assert packed.shape == (0,) and packed.dtype == np.float64


def test_line_forces_stand_on_every_segment_of_their_tube():
    lines, points = unpacked(ROBOT, packed_loads(ROBOT, D, Loads(line_forces={0: FORCE, 1: (0, 0, -1)})))
    assert lines[0].tolist() == [list(FORCE), [0, 0, 0], [0, 0, 0]]
    assert lines[1].tolist() == [[0, 0, -1]] * 3
    assert len(points) == 0


def test_weight_is_density_times_area_times_gravity_and_adds_to_line_forces():
    gravity = np.array([0.0, 6.0, -8.0])
    lines, _ = unpacked(ROBOT, packed_loads(ROBOT, D, Loads(gravity=gravity, line_forces={1: FORCE})))
    np.testing.assert_allclose(lines[0, 0], 8000.0 * np.pi * (1.195e-3**2 - 1.005e-3**2) * gravity, rtol=1e-14)
    assert not lines[0, 1:].any()
    # The first segment of the inner tube, behind the orifice, has no known weight.
    np.testing.assert_allclose(lines[1], [FORCE, FORCE + 6e-3 * gravity, FORCE + 18e-3 * gravity], rtol=1e-14)


def test_the_weight_of_a_tube_whose_diameters_vary_is_that_of_its_material():
    """Summed over lengths it is density times volume, whatever way the areas were given."""
    tube = Tube("t", (PIECE, Segment(0.03, 1.0, 1.0, area=2e-6)), 0.0, 1e-3, 7000.0)
    same = Tube("t", (PIECE, Segment(0.03, 1.0, 1.0)), 0.0, 1e-3, 7000.0)
    for which, volume in ((tube, 0.03 * 2e-6), (same, 0.13 * np.pi / 4 * 1e-6)):
        lines, _ = unpacked(Robot("r", (which,)), packed_loads(Robot("r", (which,)), np.zeros(1), Loads(gravity=FORCE)))
        lengths = np.array([segment.length for segment in which.segments])
        np.testing.assert_allclose(lengths @ lines[0], 7000.0 * volume * np.array(FORCE), rtol=1e-14)


def test_the_tip_wrench_sits_on_the_end_of_the_tube_that_reaches_farthest():
    _, points = unpacked(ROBOT, packed_loads(ROBOT, D, Loads(FORCE, MOMENT)))
    assert points.tolist() == [[1.0, ROBOT.tubes[1].length, *FORCE, *MOMENT]]
    _, points = unpacked(ROBOT, packed_loads(ROBOT, np.array([0.0, 0.25]), Loads(FORCE)))
    assert points.tolist() == [[0.0, ROBOT.tubes[0].length, *FORCE, 0.0, 0.0, 0.0]]


def test_points_are_sorted_added_and_left_out_where_nothing_acts():
    end = ROBOT.tubes[1].length
    loads = Loads(
        tip_force=FORCE,
        point_forces=[
            PointForce(1, end, (1, 0, 0), MOMENT),
            PointForce(1, 0.2, FORCE),
            PointForce(0, 0.09, moment=MOMENT),
            PointForce(1, 0.2, (1, 1, 1), (0, 0, 1)),
            PointForce(0, 0.06),
        ],
    )
    lines, points = unpacked(ROBOT, packed_loads(ROBOT, D, loads))
    assert not lines.any()
    assert points.tolist() == [
        [0.0, 0.09, 0.0, 0.0, 0.0, *MOMENT],
        [1.0, 0.2, 2.0, 3.0, 4.0, 0.0, 0.0, 1.0],
        [1.0, end, 2.0, 2.0, 3.0, *MOMENT],
    ]


def test_packing_is_linear_in_the_loads():
    loads = Loads(FORCE, MOMENT, [PointForce(1, 0.2, FORCE)], {0: FORCE}, (0, 0, -9.81))
    whole, half = (unpacked(ROBOT, packed_loads(ROBOT, D, one)) for one in (loads, loads.scaled(0.5)))
    np.testing.assert_allclose(2.0 * half[0], whole[0], rtol=1e-15)
    assert np.array_equal(half[1][:, :2], whole[1][:, :2])
    np.testing.assert_allclose(2.0 * half[1][:, 2:], whole[1][:, 2:], rtol=1e-15)


# --- who carries the tip ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(20))
def test_the_tip_is_on_the_tube_that_leads_the_sections(seed):
    rng = np.random.default_rng(seed)
    robot = random_robot(rng, 1 + seed % 4)
    for _ in range(10):
        at = random_D(rng, robot)
        assert tip_carrier(robot, at) == piecewise_domain(robot, at).leader


EQUAL = Robot("equal", tuple(Tube(name, (PIECE,)) for name in "abc"))


@pytest.mark.parametrize(
    ("at", "carrier"),
    [
        ([0.02, 0.02, 0.02], 2),  # equals: the innermost
        ([0.02, 0.02, 0.02 + 9e-13], 2),
        ([0.02, 0.02, 0.02 + 3e-12], 1),
        ([0.02, 0.03, 0.04], 0),
        ([0.1, 0.1, 0.1], 2),  # nothing out
        ([0.1 - 5e-13, 0.1, 0.1], 2),  # nothing to speak of
        ([0.1 - 3e-12, 0.1, 0.1], 0),
        ([0.0, 0.0, 0.0], 2),
    ],
)
def test_equals_and_tubes_that_are_in(at, carrier):
    assert tip_carrier(EQUAL, np.array(at)) == carrier
    assert piecewise_domain(EQUAL, np.array(at)).leader == carrier
