"""The scenes of speed against accuracy: a robot, its D, and the commands along a sweep."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.common.nested_robots import nested
from bench.common.nested_robots import turned
from bench.common.places import CONFIG
from ctr_pvs import Robot
from ctr_pvs import load_robot

Array = NDArray[np.float64]

SEED, FIG2 = load_robot(CONFIG / "renda2021.yaml"), load_robot(CONFIG / "renda2021_fig2.yaml")
FULL_OVERLAP, PARTIAL_OVERLAP = np.array([0.0935, 0.2085]), np.array([0.0935, 0.1705])
#: Where the branch ends [deg]: test/data/reference_values.json.
PARTIAL_FOLD = 205.921639


@dataclass(frozen=True, eq=False)
class Scene:
    """A sweep alpha = ``direction`` * angle at one ``D`` (N,) [m].

    runs : where on the sweep [deg] warm steps of 1 deg begin; steps : how many follow each beginning.
    """

    name: str
    robot: Robot
    D: Array
    direction: Array
    runs: tuple[float, ...]
    steps: int

    def alpha(self, degrees: float) -> Array:
        """Base angles (N,) [rad]."""
        return np.radians(degrees) * self.direction

    @property
    def commands(self) -> list[list[Array]]:
        """For every run the command it begins at, and those 1 deg farther each."""
        return [[self.alpha(begin + step) for step in range(self.steps + 1)] for begin in self.runs]


def scenes(runs: int = 4, steps: int = 5) -> list[Scene]:
    """All scenes, with so many ``runs`` of so many ``steps``; the last command before the fold is always there."""
    second = np.array([0.0, 1.0])
    last = PARTIAL_FOLD - 0.02
    three, D = nested(3)
    return [
        Scene("Fig. 4, full overlap", SEED, FULL_OVERLAP, second, _spread(20.0, 265.0, runs), steps),
        Scene("Fig. 4, partial overlap", SEED, PARTIAL_OVERLAP, second, _spread(15.0, 190.0, runs), steps),
        Scene("just before a fold", SEED, PARTIAL_OVERLAP, second, (last - 2.0 * steps,), 2 * steps),
        Scene("three tubes", three, D, turned(3), _spread(15.0, 160.0, runs), steps),
    ]


def _spread(first: float, last: float, runs: int) -> tuple[float, ...]:
    return tuple(float(begin) for begin in np.linspace(first, last, runs)) if runs > 1 else (0.5 * (first + last),)
