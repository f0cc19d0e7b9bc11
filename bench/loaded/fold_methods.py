"""The methods that are sent through a fold under load, behind the interface of ``bench.stability.judges``.

``newton``, ``hybr`` and ``lm`` solve the dense virtual work of ``bench.loaded.loaded_galerkin`` with its exact
tangent; ``shooting`` and ``solve_bvp`` the boundary-value model of the field.  Each is what a user would write: started
from its last success (warm) or from a straight robot (cold), with scipy's defaults, and its own success believed.
"""

from __future__ import annotations

from abc import ABC
from abc import abstractmethod
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.loaded.loaded_judge import LoadedJudge
from bench.loaded.loaded_judge import LoadedPath
from bench.loaded.loaded_judge import Place
from bench.loaded.random_loaded_sweeps import place_of
from bench.stability.judges import Judge
from bench.stability.judges import Kind
from bench.stability.methods import Answer
from bench.stability.methods import by_root
from bench.stability.methods import newton
from ctr_pvs import EquilibriumSolver
from ctr_pvs import Loads
from ctr_pvs import Robot
from ctr_pvs import Status
from ctr_pvs.oracles.loaded_collocation import solve_loaded_bvp
from ctr_pvs.oracles.loaded_equations import LoadedProblem
from ctr_pvs.oracles.loaded_model import LoadedShooting
from ctr_pvs.oracles.loaded_model import LoadedSolution
from ctr_pvs.oracles.loaded_model import solve_loaded

Array = NDArray[np.float64]

#: Degree of the judge and of what the root finders solve; states nearer than this [rad] are one.
DEGREE, SAME = 9, 1e-3
SHOOTING_RTOL, BVP_TOLERANCE, BVP_NODES = 1e-8, 1e-6, 1000


@dataclass(frozen=True, eq=False)
class Found:
    """The state next to an answer; None where there is none."""

    place: Place | None


class FoldJudge(Judge):
    """Branches of stable states of one robot under constant loads, numbered as they turn up: each is followed in small
    steps from where it was met, branch 0 from the first of ``commands`` (M, 2)."""

    def __init__(self, robot: Robot, D: Array, loads: Loads, commands: Array) -> None:
        super().__init__(robot, D, commands)
        self.loads, self.judge = loads, LoadedJudge(robot, DEGREE)
        bare = self.judge.solve(commands[0], D)
        if bare is None:
            raise RuntimeError("the judge finds no unloaded robot")
        ramp = LoadedPath(commands[0], D, Loads(), commands[0], D, loads)
        start, t = self.judge.go(ramp, bare)
        if t < 1.0:
            raise RuntimeError("the judge's branch ends while the robot is being loaded")
        self.branches: list[tuple[int, list[Place | None]]] = [(0, [start])]

    def locate(self, field: Found, k: int) -> int | Kind:  # type: ignore[override]
        place = field.place
        if place is None:
            return Kind.NOTHING
        if not place.stable:
            return Kind.UNSTABLE
        for index in range(len(self.branches)):
            state = self.state(index, k)
            if state is not None and state.apart(place) < SAME:
                return index
        self.branches.append((k, [place]))
        return len(self.branches) - 1

    def alive(self, branch: int, k: int) -> bool:
        return self.state(branch, k) is not None

    def state(self, branch: int, k: int) -> Place | None:
        """The state of a branch at a command; None where it has ended or was not met yet."""
        first, states = self.branches[branch]
        while states[-1] is not None and first + len(states) <= k:
            a, b = self.commands[first + len(states) - 1], self.commands[first + len(states)]
            reached, t = self.judge.go(LoadedPath(a, self.D, self.loads, b, self.D, self.loads), states[-1])
            states.append(reached if t == 1.0 else None)
        return states[k - first] if 0 <= k - first < len(states) else None


class FoldMethod(ABC):
    """One method; ``solve`` is called with one alpha (N,) after the other."""

    def __init__(self, judge: FoldJudge, warm: bool) -> None:
        self.robot, self.D, self.loads, self.warm = judge.robot, judge.D, judge.loads, warm
        self.judge = LoadedJudge(judge.robot, DEGREE)
        self.model = self.judge.model(judge.D, judge.loads)

    @abstractmethod
    def solve(self, alpha: Array) -> Answer: ...

    def told(self, place: Place | None) -> Answer:
        """A success, with what is next to it; it says nothing more."""
        return Answer(True, False, Found(place))  # type: ignore[arg-type]


FAILED = Answer(False, False, None)


class ThisSolver(FoldMethod):
    """``EquilibriumSolver``."""

    def __init__(self, judge: FoldJudge, warm: bool) -> None:
        super().__init__(judge, warm)
        self.solver = EquilibriumSolver(self.robot)

    def solve(self, alpha: Array) -> Answer:
        answer = self.solver.solve(alpha, self.D, "warm" if self.warm else "cold", loads=self.loads)
        if not answer.success:
            return FAILED
        place = place_of(self.judge, answer, alpha, self.D, self.loads)
        return Answer(True, answer.status is Status.SNAP, Found(place))  # type: ignore[arg-type]


class _Discretised(FoldMethod):
    """The virtual work in unknowns of the order of one."""

    def __init__(self, judge: FoldJudge, warm: bool) -> None:
        super().__init__(judge, warm)
        self.last = np.zeros(self.model.n)

    def left(self, x: Array, alpha: Array) -> Array:
        return self.model.residual(x, self.model.fields(x, alpha))

    def slope(self, x: Array, alpha: Array) -> Array:
        return self.model.tangent(self.model.fields(x, alpha))

    def solve(self, alpha: Array) -> Answer:
        x, success = self.run(self.last if self.warm else np.zeros(self.model.n), alpha)
        if not success:
            return FAILED
        self.last = x
        return self.told(self.judge.newton(self.model, alpha, x, SAME))

    @abstractmethod
    def run(self, x: Array, alpha: Array) -> tuple[Array, bool]: ...


class Newton(_Discretised):
    """Full Newton steps until one is short."""

    def run(self, x: Array, alpha: Array) -> tuple[Array, bool]:
        return newton(self.left, self.slope, x, alpha)


class Hybr(_Discretised):
    """``scipy.optimize.root(method="hybr")``."""

    name = "hybr"

    def run(self, x: Array, alpha: Array) -> tuple[Array, bool]:
        return by_root(self.name, self.left, self.slope, x, alpha)


class LM(Hybr):
    """``scipy.optimize.root(method="lm")``."""

    name = "lm"


class Shooting(FoldMethod):
    """Newton on the moments at the orifice."""

    last: LoadedSolution | None = None

    def solve(self, alpha: Array) -> Answer:
        found = self.run(alpha)
        if found is None or not found.success:
            return FAILED
        self.last = found if self.warm else None
        s = self.model.s.ravel()
        return self.told(
            self.judge.placed(alpha, self.D, self.loads, lambda _: found.angles_at(s), lambda _: found.frames(s))
        )

    def run(self, alpha: Array) -> LoadedSolution | None:
        return solve_loaded(self.robot, alpha, self.D, self.loads, self.last, SHOOTING_RTOL)


class BVP(Shooting):
    """Collocation; the last solution's fields, integrated from its moments at the orifice, are the next guess."""

    def run(self, alpha: Array) -> LoadedSolution | None:
        found = solve_loaded_bvp(self.robot, alpha, self.D, self.loads, self.last, BVP_TOLERANCE, BVP_NODES)
        return integrated(self.robot, alpha, self.D, self.loads, found.base_moment, found.torque, found.success)


def integrated(
    robot: Robot, alpha: Array, D: Array, loads: Loads, moment: Array, torque: Array, success: bool
) -> LoadedSolution | None:
    """The fields that begin with these moments [N m] at the orifice, as a solution; None for a failure."""
    if not success:
        return None
    problem = LoadedProblem(robot, alpha, D, loads)
    z = np.concatenate([moment[1:], -torque[problem.present]]) / problem.unit
    left, stretches = LoadedShooting(problem, SHOOTING_RTOL).shoot(z[:, None], dense=True)
    residual = problem.unit * float(np.abs(left).max())
    return LoadedSolution(
        problem.alpha, problem.D, problem, True, 0, "collocated", residual, 0, -torque, moment, tuple(stretches)
    )


THIS_SOLVER = "this solver"
METHODS: dict[str, type[FoldMethod]] = {
    THIS_SOLVER: ThisSolver,
    "Newton": Newton,
    "root(hybr)": Hybr,
    "root(lm)": LM,
    "shooting": Shooting,
    "solve_bvp": BVP,
}
