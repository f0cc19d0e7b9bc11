"""What a tube's wall and its neighbours say of it: curvature, strain, clearance."""

from __future__ import annotations

import numpy as np

from ctr_pvs.robot.robot import Segment
from ctr_pvs.robot.robot import Tube

_SAMPLES = 101


def largest_curvature(segment: Segment) -> float:
    """The largest pre-curvature |kappa| [1/m] along a segment."""
    return float(np.abs(segment.pre_curvature(np.linspace(0.0, segment.length, _SAMPLES))).max())


def tube_curvature(tube: Tube) -> float:
    """The largest pre-curvature |kappa| [1/m] along a tube."""
    return max(map(largest_curvature, tube.segments))


def largest_strain(tube: Tube) -> float | None:
    """Of the wall's outside where the tube is straightened, half the outer diameter times the largest pre-curvature;
    None without diameters."""
    return None if tube.outer_diameter is None else 0.5 * tube.outer_diameter * tube_curvature(tube)


def clearance(outer: Tube, inner: Tube) -> float | None:
    """Of one tube in another, in diameter [m]; None where diameters are not known."""
    bore, outside = outer.inner_diameter, inner.outer_diameter
    return None if bore is None or outside is None else bore - outside
