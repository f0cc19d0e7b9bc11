"""The methods of speed against accuracy, behind one interface: from a command to a tip, warm or cold.

Cold starts of the boundary-value model and of the seed's way are one solve from no twist, and scipy's own success is
believed; where that leads to another branch the bench counts it.
"""

from __future__ import annotations

from abc import ABC
from abc import abstractmethod
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from bench.common.scenes import Scene
from bench.speed.centreline import Centreline
from bench.speed.fixed_levels import Full
from bench.speed.fixed_levels import Level
from bench.speed.fixed_levels import Torsion
from bench.speed.fixed_levels import Torsionless
from bench.speed.seeds_way import SeedsWay
from ctr_pvs import EquilibriumSolver
from ctr_pvs.oracles.standard_model import StandardSolution
from ctr_pvs.oracles.standard_model import solve_standard_bvp
from ctr_pvs.oracles.standard_model import solve_standard_shooting

Array = NDArray[np.float64]

#: Longest step [rad] on the way to where timed warm steps begin.
APPROACH = np.radians(10.0)
#: solve_bvp refines its mesh up to here; scipy's default of 1000 is too few for the tightest tolerances.
BVP_NODES = 20_000
#: Steps of the centreline in every section: below 1e-10 m and below 1e-12 m.
FEW, MANY = 5, 10


class Method(ABC):
    """One method with one setting on one scene; tips are (3,) [m], None where the method reports failure.

    last : (N,) the command [rad] of the last warm answer, no rotation at first.
    """

    unknowns = 0

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.last = np.zeros(scene.robot.n_tubes)

    def approach(self, alpha: Array) -> None:
        """Bring the warm start from the last command to ``alpha`` (N,), in steps that are not timed."""
        steps = int(np.ceil(np.abs(alpha - self.last).max() / APPROACH))
        for here in np.linspace(self.last, alpha, steps + 1)[1:]:
            self.warm(here)

    @abstractmethod
    def warm(self, alpha: Array) -> Array | None: ...

    @abstractmethod
    def cold(self, alpha: Array) -> Array | None: ...


class Auto(Method):
    """The package as it is served: a tolerance [m] goes in."""

    def __init__(self, scene: Scene, tolerance: float) -> None:
        super().__init__(scene)
        self.solver = EquilibriumSolver(scene.robot, tolerance)

    def warm(self, alpha: Array) -> Array | None:
        return self._solve(alpha, "warm")

    def cold(self, alpha: Array) -> Array | None:
        return self._solve(alpha, "cold")

    def _solve(self, alpha: Array, start: str) -> Array | None:
        answer = self.solver.solve(alpha, self.scene.D, start)
        self.last = alpha
        if not answer.success:
            return None
        self.unknowns = answer.degrees_of_freedom
        return answer.tip.position


class AtLevel(Method):
    """A model level at a fixed degree, or the seed's way."""

    def __init__(self, scene: Scene, level: Level) -> None:
        super().__init__(scene)
        self.level, self.unknowns = level, level.unknowns
        level.cold(self.last)

    def warm(self, alpha: Array) -> Array | None:
        self.last = alpha
        return self.level.warm(alpha)

    def cold(self, alpha: Array) -> Array | None:
        return self.level.cold(alpha)


class Standard(Method):
    """The boundary-value model with one tolerance."""

    guess: StandardSolution | None = None

    def __init__(self, scene: Scene, tolerance: float) -> None:
        super().__init__(scene)
        self.tolerance = tolerance
        self.centreline = Centreline(scene.robot, scene.D, FEW if tolerance > 1e-6 else MANY)

    def warm(self, alpha: Array) -> Array | None:
        found = self.run(alpha)
        self.last = alpha
        if found.success:
            self.guess = found
        return self._tip(found)

    def cold(self, alpha: Array) -> Array | None:
        self.guess = None
        return self._tip(self.run(alpha))

    def _tip(self, found: StandardSolution) -> Array | None:
        return self.centreline.tip(found.angles_at(self.centreline.s)) if found.success else None

    @abstractmethod
    def run(self, alpha: Array) -> StandardSolution: ...


class BVP(Standard):
    def run(self, alpha: Array) -> StandardSolution:
        return solve_standard_bvp(self.scene.robot, alpha, self.scene.D, self.tolerance, self.guess, BVP_NODES)


class Shooting(Standard):
    def run(self, alpha: Array) -> StandardSolution:
        guess = None if self.guess is None else self.guess.torque
        return solve_standard_shooting(self.scene.robot, alpha, self.scene.D, self.tolerance, guess)


Make = Callable[[Scene], Method]

AUTO, TORSIONLESS, TORSION, FULL = "auto", "torsionless", "torsion", "full"
SEED, BVP_NAME, SHOOTING = "seed's way", "solve_bvp", "shooting"


def _auto(tolerance: float) -> Make:
    return lambda scene: Auto(scene, tolerance)


def _bvp(tolerance: float) -> Make:
    return lambda scene: BVP(scene, tolerance)


def _shooting(tolerance: float) -> Make:
    return lambda scene: Shooting(scene, tolerance)


def _level(level: Callable[..., Level], *degree: int) -> Make:
    return lambda scene: AtLevel(scene, level(scene.robot, scene.D, *degree))


def _decades(first: int, last: int) -> list[float]:
    return [float(f"1e-{k}") for k in range(first, last + 1)]


#: Family, and setting as it is told: degree, tolerance [m] or scipy's tolerance.
METHODS: dict[str, dict[str, Make]] = {
    AUTO: {f"{t:.0e}": _auto(t) for t in _decades(2, 9)},
    TORSIONLESS: {"": _level(Torsionless)},
    TORSION: {str(degree): _level(Torsion, degree) for degree in range(1, 9)},
    FULL: {str(degree): _level(Full, degree) for degree in range(1, 7)},
    SEED: {str(degree): _level(SeedsWay, degree) for degree in (1, 2, 3, 4)},
    BVP_NAME: {f"{t:.0e}": _bvp(t) for t in _decades(2, 10)},
    SHOOTING: {f"{t:.0e}": _shooting(t) for t in _decades(3, 12)},
}
#: Whose twist is not solved for, so that no answer is on a wrong branch.
BRANCHLESS = (TORSIONLESS,)
