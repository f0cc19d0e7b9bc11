"""The robots of F. Renda, C. Messer, D. C. Rucker, F. Boyer, "A Sliding-rod Variable-strain Model for Concentric Tube
Robots", 2021: Table I and the lengths told with each test.

They are written here and not read from the robot files in ``config``, so that they are at hand wherever the package
is installed; a test shows that both are equal.
"""

from __future__ import annotations

from dataclasses import dataclass

from ctr_pvs.robot.cross_section import annulus_stiffness
from ctr_pvs.robot.robot import Robot
from ctr_pvs.robot.robot import Segment
from ctr_pvs.robot.robot import Tube

YOUNGS_MODULUS = 58.0e9  # Pa, Table I
SHEAR_MODULUS = 21.5e9  # Pa, Table I


@dataclass(frozen=True)
class CrossSection:
    """A column of Table I: diameters [m] and reference curvature [1/m]."""

    name: str
    inner_diameter: float
    outer_diameter: float
    curvature: float

    @property
    def stiffness(self) -> tuple[float, float]:
        """(E I, G J) [N m^2]."""
        return annulus_stiffness(YOUNGS_MODULUS, SHEAR_MODULUS, self.inner_diameter, self.outer_diameter)

    def tube(self, *segments: tuple[float, tuple[complex, ...]]) -> Tube:
        """A tube of segments (length [m], pre-curvature coefficients [1/m, 1/m^2, ..])."""
        return Tube(
            self.name,
            tuple(Segment(length, *self.stiffness, curvature) for length, curvature in segments),
            self.inner_diameter,
            self.outer_diameter,
        )


OUTER = CrossSection("outer", 2.01e-3, 2.39e-3, 9.9)
INNER = CrossSection("inner", 0.0, 1.6e-3, 13.8)


def fig2_robot() -> Robot:
    """Section III-B and Fig. 2: wholly curved tubes of 140 and 200 mm."""
    outer = OUTER.tube((140.0e-3, (OUTER.curvature,)))
    return Robot("renda2021_fig2", (outer, INNER.tube((200.0e-3, (INNER.curvature,)))))


def fig4_robot() -> Robot:
    """Fig. 3, the robot of the sweeps of Fig. 4: each tube straight, then curved."""
    outer = OUTER.tube((93.5e-3, ()), (92.3e-3, (OUTER.curvature,)))
    return Robot("renda2021", (outer, INNER.tube((218.5e-3, ()), (85.0e-3, (INNER.curvature,)))))


def curved_robot(
    name: str, lengths: tuple[float, float], outer: tuple[complex, ...], inner: tuple[complex, ...]
) -> Robot:
    """Cross sections of Table I, wholly curved: lengths [m], and coefficients [1/m, 1/m^2, ..] from each tube's
    base."""
    return Robot(name, (OUTER.tube((lengths[0], outer)), INNER.tube((lengths[1], inner))))
