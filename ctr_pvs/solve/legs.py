"""The straight parts of a journey: a wrench on the tip changes its carrier where another tube comes to reach
farthest."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.answer.state import State
from ctr_pvs.model.packing import on_common_points
from ctr_pvs.model.packing import packed_loads
from ctr_pvs.model.packing import tip_carrier
from ctr_pvs.robot.loads import Loads
from ctr_pvs.robot.robot import Robot
from ctr_pvs.solve.path import CommandPath
from ctr_pvs.solve.path import Leg

Array = NDArray[np.float64]


def warm_legs(
    robot: Robot, start: State, acting: Loads | None, alpha: Array, D: Array, loads: Loads | None
) -> list[Leg]:
    """From the state ``start``, on which ``acting`` acts, straight to (alpha, D), (N,) each, and ``loads``."""
    whole = CommandPath(start.alpha, start.D, alpha, D)
    ts = [0.0, *(carrier_changes(robot, start.D, D) if _on_tip(acting) or _on_tip(loads) else []), 1.0]
    legs, packed = [], start.loads
    for t0, t1 in pairwise(ts):
        middle = whole.at(0.5 * (t0 + t1))[1]
        if t0 > 0.0:  # the tip is another tube's end from here on
            here = packed_loads(robot, middle, between(acting, loads, t0))
            legs.append(Leg(CommandPath(*whole.at(t0), *whole.at(t0), *on_common_points(robot, packed, here)), t0, t0))
            packed = here
        # At the end of the way the tip is that of the command: at a tie it may be another tube's.
        there = packed_loads(robot, D if t1 == 1.0 else middle, between(acting, loads, t1))
        legs.append(Leg(CommandPath(*whole.at(t0), *whole.at(t1), *on_common_points(robot, packed, there)), t0, t1))
        packed = there
    return legs


def cold_legs(robot: Robot, relaxed: State, alpha: Array, D: Array, packed: Array) -> list[Leg]:
    """From the relaxed robot to (alpha, D), (N,) each: the rotation, then ``packed`` loads in proportion."""
    turn = CommandPath(relaxed.alpha, D, alpha, D)
    return [Leg(turn, 0.0, 0.5), load_leg(robot, alpha, D, packed)] if len(packed) else [Leg(turn)]


def load_leg(robot: Robot, alpha: Array, D: Array, packed: Array) -> Leg:
    """The second half of a journey, from no loads to ``packed`` ones in proportion."""
    return Leg(CommandPath(alpha, D, alpha, D, *on_common_points(robot, packed[:0], packed)), 0.5, 1.0)


def between(before: Loads | None, after: Loads | None, t: float) -> Loads | None:
    """What acts at the fraction ``t`` of the straight way from one to the other."""
    if t == 0.0 or t == 1.0:
        return before if t == 0.0 else after
    first, last = (before or Loads()).scaled(1.0 - t), (after or Loads()).scaled(t)

    def added(a: tuple[float, ...], b: tuple[float, ...]) -> tuple[float, float, float]:
        return (a[0] + b[0], a[1] + b[1], a[2] + b[2])

    none = (0.0, 0.0, 0.0)
    tubes = {*first.line_forces, *last.line_forces}
    return Loads(
        added(first.tip_force, last.tip_force),
        added(first.tip_moment, last.tip_moment),
        (*first.point_forces, *last.point_forces),
        {tube: added(first.line_forces.get(tube, none), last.line_forces.get(tube, none)) for tube in tubes},
        added(first.gravity, last.gravity),
    )


def carrier_changes(robot: Robot, D: Array, D_end: Array) -> list[float]:
    """Fractions of the straight way from D to D_end, (N,) each, at which another tube comes to reach farthest."""
    lengths = np.array([tube.length for tube in robot.tubes])
    reach, rate = lengths - D, D - D_end
    crossings = {0.0, 1.0}
    for i in range(len(D)):
        for j in range(i):
            if rate[i] != rate[j]:
                t = float((reach[j] - reach[i]) / (rate[i] - rate[j]))
                if 0.0 < t < 1.0:
                    crossings.add(t)
    ts = sorted(crossings)
    carriers = [tip_carrier(robot, D + 0.5 * (a + b) * (D_end - D)) for a, b in pairwise(ts)]
    return [t for t, before, after in zip(ts[1:-1], carriers, carriers[1:], strict=False) if before != after]


def _on_tip(loads: Loads | None) -> bool:
    return loads is not None and (any(loads.tip_force) or any(loads.tip_moment))
