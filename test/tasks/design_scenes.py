"""A known robot, mild in curvature, whose tips are targets of designs."""

from __future__ import annotations

from ctr_pvs import Robot
from ctr_pvs import Segment
from ctr_pvs import Tube

KNOWN = Robot(
    "pair",
    (
        Tube("outer", (Segment(0.06, 0.05, 0.05 / 1.3), Segment(0.05, 0.05, 0.05 / 1.3, (7.0,))), 1.8e-3, 2.2e-3),
        Tube("inner", (Segment(0.15, 0.02, 0.02 / 1.3), Segment(0.06, 0.02, 0.02 / 1.3, (14.0,))), 1.0e-3, 1.5e-3),
    ),
)
