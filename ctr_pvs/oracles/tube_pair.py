"""Robots in which only two tubes pull at each other: one relative angle then tells everything.

The other tubes, if there are any, stay straight or alone; where they are present their bending stiffness counts.  With
theta = psi_b - psi_a and the torque T that tube b carries (tube a carries -T, eq. (26) of the seed summed over tubes),

    theta' = (1/GJ_a + 1/GJ_b) T,      T' = Im[c exp(i theta)],      c = K_a K_b conj(kappa*_a) kappa*_b / sum K,

T = 0 where the tubes cease to overlap, and theta = alpha_b - alpha_a + lead T where they start to.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from numpy.typing import NDArray

from ctr_pvs.model.materials import Materials
from ctr_pvs.model.sections import piecewise_domain
from ctr_pvs.robot.robot import Robot

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

#: Relative differences below this are those of rounding.
ROUNDING = 1e-13


@dataclass(frozen=True)
class PairSection:
    """A section between the first and the last coupled one, both included.

    index : section of the domain; start, length : m; compliance : 1/GJ_a + 1/GJ_b [1/(N m^2)]; coupled : whether the
    pair pulls at each other here.
    """

    index: int
    start: float
    length: float
    compliance: float
    coupled: bool


class TubePair:
    """The tubes ``a`` < ``b`` (counted from 0) that couple, and what lies between their bases and the last place
    where they do.

    lead : relative twist per torque [rad/(N m)] from the bases to the first coupled section, guide included.
    """

    def __init__(self, materials: Materials, a: int, b: int) -> None:
        self.materials = materials
        self.a, self.b = a, b
        coupled = np.flatnonzero(materials.coupled)
        first, last = int(coupled[0]), int(coupled[-1])
        self.lead = float(materials.guide_compliance[[a, b]].sum())
        self.lead += sum(self._section(m).compliance * self._section(m).length for m in range(first))
        self.sections = tuple(self._section(m) for m in range(first, last + 1))

    def _section(self, m: int) -> PairSection:
        domain = self.materials.domain
        compliance = float(np.sum(1.0 / self.materials.torsional[m, [self.a, self.b]]))
        start, length = float(domain.boundaries[m]), float(domain.lengths[m])
        return PairSection(m, start, length, compliance, bool(self.materials.coupled[m]))

    def pull(self, m: int, s: Array) -> ComplexArray:
        """c (g,) [N] of the coupled section m at arc lengths ``s`` (g,) [m]."""
        bending, kappa = self.materials.bending[m], self.materials.pre_curvature(m, s)
        stiffness = bending[self.a] * bending[self.b] / bending.sum()
        return np.asarray(stiffness * kappa[..., self.a].conj() * kappa[..., self.b])

    def constant_pull(self, section: PairSection) -> complex | None:
        """c [N] if it is the same all along the section, up to rounding; else None."""
        s = section.start + section.length * np.linspace(0.0, 1.0, 12)
        pulls = self.pull(section.index, s)
        return complex(pulls[0]) if np.abs(pulls - pulls[0]).max() <= ROUNDING * abs(pulls[0]) else None


def materials_at(robot: Robot, D: ArrayLike) -> Materials:
    """What lies where at base positions ``D`` (N,) [m]; raises ``CommandError`` for a D that the robot cannot take."""
    within_limits = [0.0 if limit is None else 0.5 * (limit[0] + limit[1]) for limit in robot.limits.alpha]
    _, D = robot.check_command(within_limits, D)
    return Materials(robot, piecewise_domain(robot, D))


def tube_pair(materials: Materials) -> TubePair | None:
    """The pair, or None unless exactly two tubes couple along the whole robot."""
    pulled = np.flatnonzero((materials.curved & materials.coupled[:, None]).any(axis=0))
    return TubePair(materials, int(pulled[0]), int(pulled[1])) if len(pulled) == 2 else None
