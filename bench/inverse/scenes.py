"""Robots, where their searches start, and targets: tips of random commands, and points out of reach."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.common.places import CONFIG
from ctr_pvs import EquilibriumSolver
from ctr_pvs import Loads
from ctr_pvs import Robot
from ctr_pvs import Segment
from ctr_pvs import Status
from ctr_pvs import Tube
from ctr_pvs import load_robot
from ctr_pvs.solve.batch import Batch
from ctr_pvs.tasks.bounds import Bounds

Array = NDArray[np.float64]

TOLERANCE = 1e-7
#: Targets are tips of commands with more margin than this.
FLOOR = 0.1


@dataclass(frozen=True)
class Scene:
    """A robot, and alpha [rad] and D [m] of the start of all searches."""

    name: str
    robot: Robot
    alpha: tuple[float, ...]
    D: tuple[float, ...]

    @property
    def start(self) -> tuple[Array, Array]:
        return np.array(self.alpha), np.array(self.D)


def _plain_tube(name: str, inner: float, outer: float, straight: float, curved: float, curvature: float) -> Tube:
    """One material, E 65 GPa and G 24.621 GPa; a straight stretch, then an arc."""
    polar = math.pi * (outer**4 - inner**4) / 32.0
    stiffness = 65e9 * polar / 2.0, 24.621e9 * polar
    return Tube(name, (Segment(straight, *stiffness), Segment(curved, *stiffness, (curvature,))))


def scenes() -> list[Scene]:
    """The two shipped robots, half out, and the example of fcpedrosa/Concentric-Tube-Robot at its home."""
    found = []
    for name in ("renda2021", "three_tubes"):
        robot = load_robot(CONFIG / f"{name}.yaml")
        alpha, D = Bounds(robot, None).centre()
        found.append(Scene(name, robot, tuple(alpha.tolist()), tuple(D.tolist())))
    tubes = (
        _plain_tube("outer", 1.2e-3, 1.4e-3, 0.09, 0.04, 50.0 / 7.0),
        _plain_tube("middle", 0.97e-3, 1.1e-3, 0.12, 0.08, 10.0),
        _plain_tube("inner", 0.8e-3, 0.92e-3, 0.19, 0.06, 25.0),
    )
    example = Robot("example of fcpedrosa", tubes)
    return [*found, Scene(example.name, example, (0.0, 0.0, 0.0), (0.08, 0.1, 0.12))]


def random_commands(rng: np.random.Generator, robot: Robot, count: int) -> tuple[Array, Array]:
    """alpha (M, N) [rad], any rotation within limits, and D (M, N) [m] in order."""
    bounds, N = Bounds(robot, None), robot.n_tubes
    alpha = rng.uniform(-np.pi, np.pi, (count, N))
    D = bounds.low[N:] + rng.random((count, N)) * (bounds.high[N:] - bounds.low[N:])
    good = (D[:, 1:] >= D[:, :-1]).all(axis=1)  # all orders are equally likely: drawn again, not sorted
    if good.all():
        return alpha, D
    more = random_commands(rng, robot, int((~good).sum()))
    return np.concatenate([alpha[good], more[0]]), np.concatenate([D[good], more[1]])


def reachable(scene: Scene, count: int, seed: int, loads: Loads | None = None) -> Array:
    """(count, 3) tips [m] of cold starts at random commands that do not snap and have margin."""
    rng, solver, tips = np.random.default_rng(seed), EquilibriumSolver(scene.robot, TOLERANCE), list[Array]()
    while len(tips) < count:
        alpha, D = random_commands(rng, scene.robot, 1)
        answer = solver.solve(alpha[0], D[0], start="cold", loads=loads)
        if answer.status is Status.OK and answer.stability_margin > FLOOR:
            tips.append(answer.tip.position)
    return np.array(tips)


def dense_tips(scene: Scene, count: int, seed: int, force: Array | None) -> Array:
    """(M, 3) tips of ``count`` random commands, those far out more often, and many with tubes at their ends."""
    rng, bounds, N = np.random.default_rng(seed), Bounds(scene.robot, None), scene.robot.n_tubes
    alpha = rng.uniform(-np.pi, np.pi, (count, N))
    share = np.where(rng.random((count, N)) < 0.3, 0.0, rng.random((count, N)) ** 1.5)
    D = np.maximum.accumulate(bounds.low[N:] + share * (bounds.high[N:] - bounds.low[N:]), axis=1)
    solver = EquilibriumSolver(scene.robot, 1e-5)
    batch: Batch = solver.solve_batch(alpha, D, tip_force=None if force is None else np.tile(force, (count, 1)))
    return batch.tip_position[batch.status == Status.OK]


def least_distances(targets: Array, tips: Array, turned: bool) -> Array:
    """(T,) [m] from targets (T, 3) to the nearest of the tips (M, 3), each turned about +x as suits if ``turned``."""
    if turned:
        targets, tips = (np.column_stack([at[:, 0], np.hypot(at[:, 1], at[:, 2])]) for at in (targets, tips))
    return np.array([np.linalg.norm(tips - target, axis=1).min() for target in targets])


def unreachable(scene: Scene, tips: Array, count: int, seed: int, turned: bool) -> Array:
    """(count, 3) points around the workspace, farther than 5 mm from every one of many tips (M, 3)."""
    rng, found = np.random.default_rng(seed), list[Array]()
    low, high = tips.min(axis=0) - 0.05, tips.max(axis=0) + 0.05
    while len(found) < count:
        point = rng.uniform(low, high)
        if least_distances(point[None], tips, turned)[0] > 5e-3:
            found.append(point)
    return np.array(found)
