"""Random loads for the tests: of any kind, on any tube, of a size that bends the robot by some tenths of a radian."""

from __future__ import annotations

import numpy as np

from ctr_pvs import Robot
from ctr_pvs.robot.loads import Loads
from ctr_pvs.robot.loads import PointForce


def random_loads(
    rng: np.random.Generator, robot: Robot, D: np.ndarray, moments: bool = False, size: float = 0.5
) -> Loads:
    """A tip force, forces on points of the outermost and the innermost tube, a force along one; with ``moments`` also
    moments on the tip and the points.  A tube that ends at the orifice carries no point."""
    length = robot.length_beyond(D)
    stiffness = robot.tubes[-1].segments[-1].bending_stiffness
    force = size * stiffness / length**2  # N: over the length, a turn by about half of ``size`` [rad]

    def vector(scale: float) -> tuple[float, float, float]:
        x, y, z = (scale * rng.normal(0.0, 1.0, 3)).tolist()
        return x, y, z

    def moment() -> tuple[float, float, float]:
        return vector(0.3 * force * length) if moments else (0.0, 0.0, 0.0)

    points = []
    for j in sorted({0, robot.n_tubes - 1}):
        out = robot.tubes[j].length - D[j]
        if out > 1e-3:
            points.append(PointForce(j, float(D[j] + rng.uniform(0.2, 0.8) * out), vector(0.6 * force), moment()))
    return Loads(vector(force), moment(), tuple(points), {0: vector(force / length)})
