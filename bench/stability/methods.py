"""The methods that the failure chart compares, behind one interface.

``newton``, ``hybr``, ``lm`` and ``least_squares`` solve dE/dq = 0, the package's own elements at a fixed degree,
with the analytic Hessian; ``shooting`` and ``solve_bvp`` solve the boundary-value model of the field.  Each is what a
user would write: started from its last success (warm) or from no twist (cold), with scipy's defaults, and scipy's own
success flags believed.
"""

from __future__ import annotations

from abc import ABC
from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.optimize import root

from bench.common.dense import FixedDegree
from ctr_pvs import EquilibriumSolver
from ctr_pvs import Robot
from ctr_pvs import Status
from ctr_pvs.oracles.standard_model import AngleField
from ctr_pvs.oracles.standard_model import StandardSolution
from ctr_pvs.oracles.standard_model import solve_standard_bvp
from ctr_pvs.oracles.standard_model import solve_standard_shooting

Array = NDArray[np.float64]
Equations = Callable[[Array, Array], Array]

#: Of the twist rates, in every section: the error this leaves is far below what the judges can see.
DEGREE = 9
NEWTON_STEPS, LAST_STEP = 50, 1e-10
SHOOTING_RTOL = 1e-8
#: Of solve_bvp: tolerance and the most nodes (scipy's defaults are 1e-3 and 1000).
BVP_TOLERANCE, BVP_NODES = 1e-6, 1000


@dataclass(frozen=True, eq=False)
class Answer:
    """What a method says: success, whether it says that the robot snapped on the way, and the twist angles."""

    success: bool
    snapped: bool
    field: AngleField | None


def newton(equations: Equations, jacobian: Equations, x: Array, alpha: Array) -> tuple[Array, bool]:
    """Full Newton steps from x until one is short; whether that came."""
    for _ in range(NEWTON_STEPS):
        try:
            step = np.linalg.solve(jacobian(x, alpha), equations(x, alpha))
        except np.linalg.LinAlgError:
            return x, False
        x = x - step
        if np.abs(step).max(initial=0.0) < LAST_STEP:
            return x, True
    return x, False


def by_root(name: str, equations: Equations, jacobian: Equations, x: Array, alpha: Array) -> tuple[Array, bool]:
    """``scipy.optimize.root`` from x by the method of that name, and what it says of success."""
    found = root(equations, x, (alpha,), name, jacobian)
    return found.x, bool(found.success)


class Method(ABC):
    """One method on one robot at one D; ``solve`` is called with one alpha (N,) after the other."""

    def __init__(self, robot: Robot, D: Array, warm: bool) -> None:
        self.robot, self.D, self.warm = robot, D, warm

    @abstractmethod
    def solve(self, alpha: Array) -> Answer: ...


class ThisSolver(Method):
    """``EquilibriumSolver``: follows the path from its last good answer, or from the relaxed robot."""

    def __init__(self, robot: Robot, D: Array, warm: bool) -> None:
        super().__init__(robot, D, warm)
        self.solver = EquilibriumSolver(robot)

    def solve(self, alpha: Array) -> Answer:
        found = self.solver.solve(alpha, self.D, "warm" if self.warm else "cold")
        return Answer(found.success, found.status is Status.SNAP, found.shape if found.success else None)


class _Discretised(Method):
    """dE/dq = 0 in unknowns x that are of the order of a twist in radians."""

    def __init__(self, robot: Robot, D: Array, warm: bool) -> None:
        super().__init__(robot, D, warm)
        self.energy = FixedDegree(robot, D, DEGREE)
        self.unit = float(np.sqrt(robot.tubes[0].segments[0].torsional_stiffness / robot.length_beyond(D)))
        self.last = np.zeros(self.energy.n)

    def equations(self, x: Array, alpha: Array) -> Array:
        return self.energy.gradient(self.unit * x, alpha) / self.unit

    def jacobian(self, x: Array, alpha: Array) -> Array:
        return self.energy.hessian(self.unit * x, alpha)

    def solve(self, alpha: Array) -> Answer:
        x, success = self.run(self.last if self.warm else np.zeros(self.energy.n), alpha)
        if not success:
            return Answer(False, False, None)
        self.last = x
        return Answer(True, False, self.energy.shape(self.unit * x, alpha))

    @abstractmethod
    def run(self, x: Array, alpha: Array) -> tuple[Array, bool]: ...


class Newton(_Discretised):
    """Full Newton steps until one is short."""

    def run(self, x: Array, alpha: Array) -> tuple[Array, bool]:
        return newton(self.equations, self.jacobian, x, alpha)


class Hybr(_Discretised):
    """``scipy.optimize.root(method="hybr")``."""

    name = "hybr"

    def run(self, x: Array, alpha: Array) -> tuple[Array, bool]:
        return by_root(self.name, self.equations, self.jacobian, x, alpha)


class LM(Hybr):
    """``scipy.optimize.root(method="lm")``."""

    name = "lm"


class LeastSquares(_Discretised):
    """``scipy.optimize.least_squares``."""

    def run(self, x: Array, alpha: Array) -> tuple[Array, bool]:
        found = least_squares(self.equations, x, self.jacobian, args=(alpha,))
        return found.x, bool(found.success)


class _Standard(Method):
    """The boundary-value model; the last successful solution is the next guess."""

    last: StandardSolution | None = None

    def solve(self, alpha: Array) -> Answer:
        # A diverging trial overflows on its way to a reported failure: not this bench's business.
        with np.errstate(all="ignore"):
            found = self.run(alpha)
        if found.success and self.warm:
            self.last = found
        return Answer(found.success, False, found if found.success else None)

    @abstractmethod
    def run(self, alpha: Array) -> StandardSolution: ...


class ShootingMethod(_Standard):
    def run(self, alpha: Array) -> StandardSolution:
        guess = None if self.last is None else self.last.torque
        return solve_standard_shooting(self.robot, alpha, self.D, SHOOTING_RTOL, guess)


class BVP(_Standard):
    def run(self, alpha: Array) -> StandardSolution:
        return solve_standard_bvp(self.robot, alpha, self.D, BVP_TOLERANCE, self.last, BVP_NODES)


THIS_SOLVER = "this solver"
METHODS: dict[str, type[Method]] = {
    THIS_SOLVER: ThisSolver,
    "Newton": Newton,
    "root(hybr)": Hybr,
    "root(lm)": LM,
    "least_squares": LeastSquares,
    "shooting": ShootingMethod,
    "solve_bvp": BVP,
}
