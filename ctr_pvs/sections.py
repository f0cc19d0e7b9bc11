"""The piecewise domain with its topology, by which prepared tables are kept."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.lazy import lazy
from ctr_pvs.model import sections
from ctr_pvs.model.sections import ABSENT
from ctr_pvs.model.sections import SAME_PLACE
from ctr_pvs.model.sections import Event
from ctr_pvs.robot.robot import Robot

__all__ = ["ABSENT", "SAME_PLACE", "Domain", "Event", "Topology", "piecewise_domain"]

#: Which segments the sections and the guide hold: the shape and bytes of ``Domain.segment``, and ``guide_segment``'s.
Topology: TypeAlias = tuple[int, int, bytes, bytes]


@dataclass(frozen=True, eq=False)
class Domain(sections.Domain):
    """See the class it extends."""

    @lazy
    def topology(self) -> Topology:
        """Equal for two domains whose sections hold the same segments in the same order."""
        return (*self.segment.shape, self.segment.tobytes(), self.guide_segment.tobytes())


def piecewise_domain(robot: Robot, D: NDArray[np.float64]) -> Domain:
    """The sections of ``robot`` for base positions ``D`` (N,) [m], already checked by ``Robot.check_command``."""
    made = sections.piecewise_domain(robot, D)
    return Domain(made.D, made.boundaries, made.segment, made.events, made.guide_segment)
