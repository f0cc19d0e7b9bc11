"""The tubes as RViz and Foxglove show them: one mesh for each, of its own diameter, from the orifice to its tip.

A mesh and not a line: nested tubes of different diameters lie in one another, where lines would lie in one plane and
flicker, and its facets show how a tube is rolled.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point
from numpy.typing import NDArray
from std_msgs.msg import ColorRGBA
from std_msgs.msg import Header
from visualization_msgs.msg import Marker
from visualization_msgs.msg import MarkerArray

from ctr_pvs import Backbone
from ctr_pvs import Robot
from ctr_pvs_ros.outputs.serialized import STAMP
from ctr_pvs_ros.outputs.serialized import Form
from ctr_pvs_ros.outputs.serialized import placeholders

if TYPE_CHECKING:
    from ctr_pvs import Equilibrium

NAMESPACE = "tubes"
RINGS, SIDES = 32, 8
SHORTEST = 1e-6  # m; less of a tube than this is not drawn
#: Of a tube whose file gives no diameter [m]; each tube further in is this much thinner.
DEFAULT_DIAMETER, THINNER = 3e-3, 0.7
#: Red, green, blue; outermost first, then round again.
COLOURS = ((0.80, 0.80, 0.84), (0.95, 0.65, 0.20), (0.30, 0.60, 0.90), (0.45, 0.75, 0.40), (0.80, 0.45, 0.70))


def _faces() -> NDArray[np.intp]:
    """Corners of all triangles, as indices into the corners of the rings, one ring after the other, and after these the
    middles of the first and the last ring."""
    ring, side = np.divmod(np.arange((RINGS - 1) * SIDES), SIDES)
    here, beside = ring * SIDES + side, ring * SIDES + (side + 1) % SIDES
    wall = np.stack((here, beside, here + SIDES, beside, beside + SIDES, here + SIDES), axis=1).ravel()
    side = np.arange(SIDES)
    first, next_to_it, middle = side, (side + 1) % SIDES, np.full(SIDES, RINGS * SIDES)
    start = np.stack((middle, next_to_it, first), axis=1).ravel()
    to_the_end = (RINGS - 1) * SIDES
    end = np.stack((middle + 1, first + to_the_end, next_to_it + to_the_end), axis=1).ravel()
    return np.concatenate((wall, start, end))


FACES = _faces()
ANGLES = 2.0 * np.pi * np.arange(SIDES) / SIDES
CIRCLE = np.stack((np.cos(ANGLES), np.sin(ANGLES)))


def tube_surface(backbone: Backbone, diameter: float) -> NDArray[np.float64]:
    """Corners (len(FACES), 3) [m] of the triangles of a tube with closed ends, three to each, counter-clockwise as seen
    from outside."""
    x, y, z, w = backbone.orientation.T
    across = np.stack((2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x)), axis=1)
    up = np.stack((2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)), axis=1)
    spokes = np.stack((across, up), axis=2) @ CIRCLE
    corners = backbone.position[:, None, :] + 0.5 * diameter * spokes.transpose(0, 2, 1)
    return np.concatenate((corners.reshape(-1, 3), backbone.position[[0, -1]]))[FACES]


def diameters(robot: Robot) -> list[float]:
    """Outer diameter of each tube [m], outermost first; made up where the robot file gives none."""
    return [tube.outer_diameter or DEFAULT_DIAMETER * THINNER**index for index, tube in enumerate(robot.tubes)]


class TubeMarkers:
    """Serializes visualization_msgs/MarkerArray messages: marker j of namespace "tubes" is tube j."""

    def __init__(self, robot: Robot, frame_id: str) -> None:
        self._frame_id = frame_id
        self._diameters = diameters(robot)
        self._lengths = [tube.length for tube in robot.tubes]
        self._form = lru_cache(maxsize=8)(self._new_form)

    def of(self, equilibrium: Equilibrium, stamp: bytes) -> bytes:
        """All tubes; those that do not come out of the orifice are deleted."""
        shown = tuple((self._lengths > equilibrium.D + SHORTEST).tolist())
        contents = []
        for tube, seen in enumerate(shown):
            contents.append(stamp)
            if seen:
                surface = tube_surface(equilibrium.tube_backbone(tube, RINGS), self._diameters[tube])
                contents.append(surface.tobytes())
        return self._form(shown).fill(*contents)

    def none(self) -> MarkerArray:
        """Takes all tubes away."""
        return MarkerArray(markers=[Marker(header=Header(frame_id=self._frame_id), action=Marker.DELETEALL)])

    def _new_form(self, shown: tuple[bool, ...]) -> Form:
        gaps: list[Time | list[float]] = []
        markers = []
        for tube, seen in enumerate(shown):
            markers.append(self._marker(tube, seen))
            gaps.append(STAMP)
            if seen:
                numbers = placeholders(3 * len(FACES), run=tube)
                markers[-1].points = [Point(x=x, y=y, z=z) for x, y, z in zip(*[iter(numbers)] * 3, strict=True)]
                gaps.append(numbers)
        return Form(MarkerArray(markers=markers), gaps)

    def _marker(self, tube: int, seen: bool) -> Marker:
        red, green, blue = COLOURS[tube % len(COLOURS)]
        marker = Marker(
            header=Header(stamp=STAMP, frame_id=self._frame_id),
            ns=NAMESPACE,
            id=tube,
            type=Marker.TRIANGLE_LIST,
            action=Marker.ADD if seen else Marker.DELETE,
            color=ColorRGBA(r=red, g=green, b=blue, a=1.0),
        )
        marker.scale.x = marker.scale.y = marker.scale.z = 1.0
        marker.pose.orientation.w = 1.0
        return marker
