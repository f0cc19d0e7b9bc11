"""What a picture of one equilibrium shows, as plain arrays: for figures, for the page, for the live view."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.cli.loads import loads_as_line
from ctr_pvs.cli.seeing.moments import Moments
from ctr_pvs.cli.seeing.moments import curvature_between
from ctr_pvs.cli.seeing.moments import moments_between
from ctr_pvs.cli.seeing.moments import places_along
from ctr_pvs.robot.robot import Robot

if TYPE_CHECKING:
    from ctr_pvs.answer.equilibrium import Equilibrium

Array = NDArray[np.float64]

#: Colours of the tubes from the outermost on, red, green, blue; they begin anew after the last.
COLOURS = ((78, 121, 167), (242, 142, 43), (89, 161, 79), (225, 87, 89), (118, 183, 178), (176, 122, 161))
#: Poses of a tube, and of the curves along s.
POSES, PLACES = 120, 401
#: Where no diameters are given: that of the innermost tube, as a share of the robot's longest tube, and how much wider
#: each tube around it is.
THIN, STEP = 0.005, 0.5


@dataclass(frozen=True)
class DrawnTube:
    """One tube beyond the orifice: position (n, 3) [m] of its centre line, its orientation (n, 4), outside diameter
    [m]; empty where all of it is behind the orifice."""

    name: str
    colour: tuple[int, int, int]
    diameter: float
    position: Array
    orientation: Array


@dataclass(frozen=True)
class Drawn:
    """One equilibrium as pictures show it.

    s (g,) [m]; twist (g, N) [rad], NaN past a tube's tip; curvature (g - 1,) [1/m] and moments between neighbouring s.
    tip (3,) [m]; tip_force (3,) [N]; title, told : lines of text.
    """

    title: str
    told: tuple[str, ...]
    tubes: tuple[DrawnTube, ...]
    s: Array
    twist: Array
    curvature: Array
    moments: Moments
    tip: Array
    tip_force: Array


def drawn(robot: Robot, equilibrium: Equilibrium) -> Drawn:
    """What is to be drawn of an answer that holds an equilibrium."""
    backbone = equilibrium.backbone_at(places_along(equilibrium.shape.domain, PLACES))
    curvature = curvature_between(backbone)
    loads = equilibrium.applied_loads
    return Drawn(
        f"{robot.name}: {equilibrium.status.value}: {equilibrium.message}",
        _told(robot, equilibrium),
        drawn_tubes(robot, equilibrium, POSES),
        backbone.s,
        equilibrium.twist(backbone.s),
        np.abs(curvature),
        moments_between(equilibrium, backbone.s, curvature),
        equilibrium.tip.position,
        np.array((0.0, 0.0, 0.0) if loads is None else loads.tip_force),
    )


def drawn_tubes(robot: Robot, equilibrium: Equilibrium, poses: int) -> tuple[DrawnTube, ...]:
    """The tubes from outermost to innermost, each with ``poses`` poses from the orifice to its own tip."""
    tubes = []
    for j, (tube, diameter) in enumerate(zip(robot.tubes, diameters(robot), strict=True)):
        backbone = equilibrium.tube_backbone(j, poses)
        out = slice(None) if backbone.s[-1] > 0.0 else slice(0)
        colour = COLOURS[j % len(COLOURS)]
        tubes.append(DrawnTube(tube.name, colour, diameter, backbone.position[out], backbone.orientation[out]))
    return tuple(tubes)


def diameters(robot: Robot) -> list[float]:
    """Outside diameters to draw [m]: the tubes' own, or made up where none are given."""
    thin = THIN * max(tube.length for tube in robot.tubes)
    made_up = [thin * (1.0 + STEP * (robot.n_tubes - 1 - j)) for j in range(robot.n_tubes)]
    return [tube.outer_diameter or width for tube, width in zip(robot.tubes, made_up, strict=True)]


def _told(robot: Robot, equilibrium: Equilibrium) -> tuple[str, ...]:
    loads = equilibrium.applied_loads
    alpha = ", ".join(f"{angle:.4g}" for angle in np.degrees(equilibrium.alpha))
    D = ", ".join(f"{depth:.4g}" for depth in 1e3 * equilibrium.D)
    tip = ", ".join(f"{place + 0.0:.2f}" for place in 1e3 * equilibrium.tip.position)
    guessed = [tube.name for tube in robot.tubes if tube.outer_diameter is None]
    lines = [
        f"α = {alpha}°;  D = {D} mm;  tip ({tip}) mm;  stability margin {equilibrium.stability_margin:.4f}",
        f"loads: {'none' if loads is None or loads.is_none else loads_as_line(robot, loads)}",
    ]
    return (*lines, f"diameter not known, made up: {', '.join(guessed)}") if guessed else tuple(lines)
