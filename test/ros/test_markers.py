"""The tubes as markers: where they are, how thick, and when they go."""

from collections import Counter
from itertools import pairwise

import numpy as np
import pytest
from geometry_msgs.msg import PoseStamped
from rclpy.serialization import deserialize_message
from visualization_msgs.msg import Marker
from visualization_msgs.msg import MarkerArray

from ctr_pvs import EquilibriumSolver
from ctr_pvs import load_robot
from ctr_pvs_ros.outputs.markers import TubeMarkers
from ctr_pvs_ros.outputs.markers import diameters
from ctr_pvs_ros.outputs.serialized import stamp_bytes
from ctr_pvs_ros.process import share_file

JOINTS = ["outer_rotation", "outer_translation", "inner_rotation", "inner_translation"]
GOOD = dict(zip(JOINTS, (0.0, 0.0935, 0.5, 0.2085), strict=True))
TIMEOUT = 5.0


@pytest.fixture(scope="module")
def robot(graph):
    return load_robot(share_file("config", "renda2021.yaml"))


def solved(robot, D):
    answer = EquilibriumSolver(robot).solve([0.3, 1.0], D)
    assert answer.success
    return answer


def markers_of(robot, equilibrium):
    message = TubeMarkers(robot, "base").of(equilibrium, stamp_bytes(3, 4))
    return deserialize_message(message, MarkerArray).markers


def points_of(marker):
    return np.array([(point.x, point.y, point.z) for point in marker.points])


def test_the_surface_lies_one_radius_around_each_tube(robot):
    equilibrium = solved(robot, [0.08, 0.15])
    markers = markers_of(robot, equilibrium)
    assert [(marker.ns, marker.id, marker.action) for marker in markers] == [("tubes", 0, 0), ("tubes", 1, 0)]
    for tube, (marker, diameter) in enumerate(zip(markers, diameters(robot), strict=True)):
        assert marker.type == Marker.TRIANGLE_LIST
        assert marker.header.frame_id == "base"
        assert (marker.header.stamp.sec, marker.header.stamp.nanosec) == (3, 4)
        assert marker.color.a == 1.0
        assert (marker.scale.x, marker.pose.orientation.w) == (1.0, 1.0)
        centres = equilibrium.tube_backbone(tube, 2000).position
        points = points_of(marker)
        assert len(points) % 3 == 0
        distance = np.linalg.norm(points[:, None, :] - centres, axis=2).min(axis=1)
        middles = distance < 1e-9
        assert {tuple(point) for point in points[middles]} == {tuple(centres[0]), tuple(centres[-1])}
        assert distance[~middles] == pytest.approx(np.full((~middles).sum(), diameter / 2), rel=1e-2)
        tip = centres[-1]
        assert np.linalg.norm(points[~middles] - tip, axis=1).min() == pytest.approx(diameter / 2, rel=1e-6)


def test_surfaces_are_closed_and_seen_from_outside(robot):
    """Every edge belongs to two triangles that go along it in opposite ways; the volume inside is that of a tube."""
    equilibrium = solved(robot, [0.08, 0.15])
    for marker, diameter, length in zip(
        markers_of(robot, equilibrium),
        diameters(robot),
        [tube.length for tube in robot.tubes] - equilibrium.D,
        strict=True,
    ):
        corners = points_of(marker).reshape(-1, 3, 3)
        edges = Counter(
            (tuple(start), tuple(end))
            for triangle in corners.tolist()
            for start, end in pairwise([*triangle, triangle[0]])
        )
        assert set(edges.values()) == {1}
        assert {(end, start) for start, end in edges} == set(edges)
        volume = np.linalg.det(corners).sum() / 6.0
        octagon = 2.0 * np.sqrt(2.0) * (diameter / 2.0) ** 2
        assert volume == pytest.approx(octagon * length, rel=1e-2)


def test_a_tube_that_does_not_come_out_is_deleted(robot):
    outer = robot.tubes[0].length
    shown = markers_of(robot, solved(robot, [outer, outer]))
    assert [marker.action for marker in shown] == [Marker.DELETE, Marker.ADD]
    assert shown[0].ns == "tubes" and len(shown[0].points) == 0


def test_tubes_of_unknown_diameter_are_drawn_thinner_inwards():
    from ctr_pvs import Robot
    from ctr_pvs import Segment
    from ctr_pvs import Tube

    tubes = tuple(Tube(name, (Segment(0.1, 0.05, 0.04),)) for name in ("outer", "inner"))
    outer, inner = diameters(Robot("two", tubes))
    assert outer > inner > 0.0


def test_markers_over_dds(start_node):
    peer = start_node("/shown")
    for angle in (0.3, 0.5):
        reply = peer.client.command({**GOOD, "inner_rotation": angle}, TIMEOUT)
    arrays = peer.subscribe(MarkerArray, "markers")
    peer.wait(lambda: bool(arrays), "the tubes for a late joiner")
    assert arrays[0].markers[0].header.stamp == reply.tip.header.stamp
    tips = peer.subscribe(PoseStamped, "setpoint_cp")
    peer.wait(lambda: bool(tips), "the tip for a late joiner")
    peer.client.command({**GOOD, "outer_translation": 0.1858, "inner_translation": 0.2085}, TIMEOUT)
    peer.wait(lambda: len(arrays) > 1 and len(tips) > 1, "the tubes after a command")
    assert [marker.action for marker in arrays[-1].markers] == [Marker.DELETE, Marker.ADD]
    assert peer.process.stop() == 0
    peer.wait(lambda: len(arrays) > 2, "the end of the tubes")
    assert [marker.action for marker in arrays[-1].markers] == [Marker.DELETEALL]
