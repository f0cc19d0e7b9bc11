"""Random robots and commands for the tests: any number of tubes, any tip order, any pre-curvature."""

from __future__ import annotations

import numpy as np

from ctr_pvs import Robot
from ctr_pvs import Segment
from ctr_pvs import Tube


def random_robot(rng: np.random.Generator, tubes: int, strength: float = 1.0) -> Robot:
    """Tubes with one to three segments: straight, polynomial or helical pre-curvature up to 12 ``strength`` / m."""
    return Robot("random", tuple(_tube(rng, f"tube_{index}", index, strength) for index in range(tubes)))


def _tube(rng: np.random.Generator, name: str, index: int, strength: float) -> Tube:
    stiffness = 0.05 * rng.uniform(0.3, 1.0) / (index + 1)
    straight = Segment(rng.uniform(0.04, 0.08) + 0.03 * index, stiffness, stiffness / 1.3)
    curved = [_curved(rng, stiffness * rng.uniform(0.7, 1.4), strength) for _ in range(rng.integers(1, 3))]
    return Tube(name, (straight, *curved))


def _curved(rng: np.random.Generator, stiffness: float, strength: float) -> Segment:
    length = rng.uniform(0.03, 0.06)
    coefficients = strength * (rng.uniform(-8, 8, 3) + 1j * rng.uniform(-8, 8, 3)) / length ** np.arange(3) / 2
    turn = 0.0 if rng.random() < 0.6 else rng.uniform(-20, 20)
    return Segment(
        length, stiffness, stiffness / rng.uniform(1.0, 1.5), tuple(coefficients[: rng.integers(1, 4)]), turn
    )


def random_D(rng: np.random.Generator, robot: Robot) -> np.ndarray:
    """Base positions in order, some millimetres apart; about one tube in five is far retracted."""
    while True:
        shares = np.where(rng.random(robot.n_tubes) < 0.2, rng.uniform(0.8, 0.99), rng.uniform(0.1, 0.7, robot.n_tubes))
        lengths = np.array([tube.length for tube in robot.tubes])
        D = np.maximum.accumulate(shares * lengths + 0.002 * np.arange(robot.n_tubes))
        D += 0.001 * np.arange(robot.n_tubes)
        if np.all(lengths > D):
            return D


def two_tubes(lam: float, b: float, length: float = 0.1) -> tuple[Robot, list[float]]:
    """Two equal tubes with dimensionless coupling ``lam`` and guide length ``b``, and the D that gives it."""
    K, G = 0.02, 0.02 / 1.3
    curvature = np.sqrt(lam / (length**2 * (K / 2) * (2 / G)))
    guided = max(b * length, 1e-7)
    tubes = tuple(Tube(n, (Segment(guided, K, G), Segment(length, K, G, (curvature,)))) for n in "ab")
    return Robot("pair", tubes), [b * length, b * length]
