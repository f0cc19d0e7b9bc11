"""The other equilibria of a command, to be shown as ghosts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.cli.live.state import POSES
from ctr_pvs.cli.seeing.drawn import DrawnTube
from ctr_pvs.cli.seeing.drawn import drawn_tubes
from ctr_pvs.robot.loads import Loads
from ctr_pvs.robot.robot import Robot
from ctr_pvs.solve.equilibria import equilibria

Array = NDArray[np.float64]

#: Tubes that are nowhere farther apart than this [m], and some tolerances, are in the same place.
SAME_PLACE, TOLERANCES = 1e-4, 4.0


@dataclass(frozen=True, eq=False)
class Question:
    """A command: alpha (N,) [rad], D (N,) [m], tip_force (3,) [N]."""

    alpha: Array
    D: Array
    tip_force: Array


@dataclass(frozen=True, eq=False)
class Ghost:
    """One equilibrium, stable or not."""

    tubes: tuple[DrawnTube, ...]
    stable: bool


@dataclass(frozen=True, eq=False)
class Others:
    """What was found, in the order of energy; told : how, and what that guarantees."""

    ghosts: tuple[Ghost, ...]
    told: str

    def beside(self, tubes: tuple[DrawnTube, ...], tolerance: float) -> tuple[Ghost, ...]:
        """Those that are not where the ``tubes`` are that are shown; tolerance : of their tips [m]."""
        near = SAME_PLACE + TOLERANCES * tolerance
        return tuple(ghost for ghost in self.ghosts if _apart(ghost.tubes, tubes) > near)


def _apart(some: tuple[DrawnTube, ...], others: tuple[DrawnTube, ...]) -> float:
    """Largest distance [m] between the same poses of the same tubes."""
    apart = [np.linalg.norm(a.position - b.position, axis=1) for a, b in zip(some, others, strict=True)]
    return max((float(distance.max(initial=0.0)) for distance in apart), default=0.0)


def find_others(robot: Robot, tolerance: float, question: Question) -> Others:
    """All equilibria that ``equilibria`` finds, that which is shown among them."""
    x, y, z = question.tip_force.tolist()
    loads = Loads(tip_force=(x, y, z)) if any((x, y, z)) else None
    every = equilibria(robot, question.alpha, question.D, tolerance, loads=loads)
    ghosts = (Ghost(drawn_tubes(robot, one, POSES), one.stability_margin > 0.0) for one in every.found)
    return Others(tuple(ghosts), every.method)
