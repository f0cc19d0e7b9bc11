"""The reach of a robot: random commands that it can take, where their tips are, and how much room these fill."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.robot.robot import Robot

Array = NDArray[np.float64]

#: Rotations of a tube without limits: one turn.
TURN = (-math.pi, math.pi)
#: Beyond every limit of D [m]: to ask the robot for its limits.
FAR = 1e9
#: Draws of D at once, beside those still missing.
SPARE = 64


def random_commands(robot: Robot, count: int, seed: int) -> Array:
    """(count, 2 N) alpha [rad], then D [m]: uniform over all commands that the robot can take, D in order.

    A tube without limits of rotation turns once.  The same count and seed give the same commands.
    """
    rng = np.random.default_rng(seed)
    limits = robot.limits.alpha or (None,) * robot.n_tubes
    low, high = np.array([limit or TURN for limit in limits]).T
    alpha = rng.uniform(low, high, (count, robot.n_tubes))
    return np.hstack([alpha, _random_D(robot, count, rng)])


def _random_D(robot: Robot, count: int, rng: np.random.Generator) -> Array:
    """(count, N) [m], uniform where D is in order: drawn within what each tube can reach, kept if in order."""
    none = np.zeros(robot.n_tubes)
    low, high = (robot.clamp_command(none, np.full(robot.n_tubes, end))[1] for end in (-FAR, FAR))
    kept, missing = [np.empty((0, robot.n_tubes))], count
    while missing > 0:
        drawn = rng.uniform(low, high, (SPARE + missing, robot.n_tubes))
        kept.append(drawn[(np.diff(drawn, axis=1) >= 0.0).all(axis=1)][:missing])
        missing -= len(kept[-1])
    return np.concatenate(kept)


@dataclass(frozen=True)
class Volume:
    """Room that points fill, counted in cubes.

    edge : of a cube [m]; cubes : how many have a point in them; once : how many have exactly one; points : how many.
    half : the cubes of every second point: where they are nearly as many, more points would not find many more.
    """

    edge: float
    cubes: int
    once: int
    half: int
    points: int

    @property
    def volume(self) -> float:
        """m^3"""
        return self.cubes * self.edge**3


def volume(points: Array, edge: float) -> Volume:
    """The room that ``points`` (n, 3) [m] fill, in cubes with this edge [m] and a corner on the orifice."""
    counts = _cubes(points, edge)
    once = int(np.count_nonzero(counts == 1))
    return Volume(edge, len(counts), once, len(_cubes(points[::2], edge)), len(points))


def _cubes(points: Array, edge: float) -> NDArray[np.int64]:
    """How many points are in each cube that has any."""
    places = np.floor(points / edge).astype(np.int64)
    return np.asarray(np.unique(places, axis=0, return_counts=True)[1])


def fitting_edge(points: Array) -> float:
    """An edge [m] of 1, 2 or 5 times a power of ten, such that the longest side of the points' box has 20 to 50."""
    side = float(np.ptp(points, axis=0).max()) if len(points) else 0.0
    if side <= 0.0:
        return 1e-3
    power = 10.0 ** math.floor(math.log10(side / 20.0))
    return max(step * power for step in (1.0, 2.0, 5.0) if step * power <= side / 20.0 * (1.0 + 1e-9))
