"""Jobs, as the node has them done in another process: what is asked, and what came of it."""

from __future__ import annotations

import time
import warnings
from abc import ABC
from abc import abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING
from typing import Any

from numpy.typing import NDArray

import ctr_pvs
from ctr_pvs import Backbone
from ctr_pvs import Loads
from ctr_pvs import Pose
from ctr_pvs import Robot
from ctr_pvs import RobotWarning
from ctr_pvs import Status
from ctr_pvs.errors import FieldError

if TYPE_CHECKING:
    from ctr_pvs import Equilibrium
    from ctr_pvs import EquilibriumSolver

BAD_INPUT = "bad_input"


def robot_of(file: str) -> Robot:
    """The robot of a file. What looks wrong in it is told by the node, once, and not by each of its processes.

    Raises RobotFileError.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RobotWarning)
        return ctr_pvs.load_robot(file)


@dataclass(frozen=True)
class SolverOptions:
    """What a solver is made of."""

    robot_file: str
    tolerance: float
    fidelity: str
    force_model: str

    def new_solver(self) -> EquilibriumSolver:
        """Raises RobotFileError, where that has not been found right before."""
        return ctr_pvs.EquilibriumSolver(
            robot_of(self.robot_file),
            tolerance=self.tolerance,
            fidelity=self.fidelity,
            force_model=self.force_model,
        )


@dataclass(frozen=True, eq=False, kw_only=True)
class Job(ABC):
    """Something to be done.

    Attributes:
        number: which tells its answer from others; set when it is handed over.
        deadline: on the system's monotonic clock [s].
    """

    deadline: float
    number: int = 0

    @abstractmethod
    def done_by(self, solver: EquilibriumSolver, budget: float) -> Solved:
        """What comes of it within `budget` [s]."""


@dataclass(frozen=True, eq=False, kw_only=True)
class SolveJob(Job):
    """One command to solve for.

    Attributes:
        alpha, D: (N,) [rad], [m].
        start: cold or warm.
        poses: on the backbone.
    """

    alpha: NDArray[Any]
    D: NDArray[Any]
    loads: Loads
    start: str
    poses: int

    def done_by(self, solver: EquilibriumSolver, budget: float) -> Solved:
        began = time.monotonic()
        equilibrium = solver.solve(self.alpha, self.D, start=self.start, budget=budget, loads=self.loads)
        took = time.monotonic() - began
        numbers = numbers_of(equilibrium, self.poses) if equilibrium.success else None
        return Solved(self.number, equilibrium.status.value, equilibrium.message, took, numbers)


@dataclass(frozen=True, eq=False)
class Numbers:
    """All of an equilibrium that a solve tells."""

    tip: Pose
    backbone: Backbone
    arrays: dict[str, NDArray[Any]]
    scalars: dict[str, float | int | str]


@dataclass(frozen=True, eq=False)
class Solved:
    """What came of a job, and the wall-clock time it took [s]; without numbers it failed."""

    number: int
    status: str
    message: str
    time: float = 0.0
    numbers: Any = None


@dataclass(frozen=True)
class LookForKernels:
    """Not a job: compiled kernels may be there by now."""


@dataclass(frozen=True)
class Ready:
    """Not an answer: jobs are done from now on."""


def do(solver: EquilibriumSolver, job: Job) -> Solved:
    """Do a job; never raises."""
    left = job.deadline - time.monotonic()
    if left <= 0.0:
        return Solved(job.number, Status.TIMEOUT.value, "the budget was over before other requests were done")
    try:
        return job.done_by(solver, left)
    except FieldError as error:  # a load, at a model level or with a force model that knows none
        return Solved(job.number, BAD_INPUT, str(error))
    except Exception as error:  # whatever went wrong, the client gets an answer
        text = f"internal error: {type(error).__name__}: {error}"
        return Solved(job.number, Status.NOT_CONVERGED.value, text)


def numbers_of(equilibrium: Equilibrium, poses: int) -> Numbers:
    """What a response tells of a successful solve."""
    lower, upper = equilibrium.force_interval.T
    return Numbers(
        equilibrium.tip,
        equilibrium.backbone(poses),
        {
            "torque": equilibrium.torque,
            "force": equilibrium.force,
            "force_lower": lower,
            "force_upper": upper,
            "force_interval_reversed": equilibrium.force_interval_reversed,
        },
        {
            "stability_margin": float(equilibrium.stability_margin),
            "fidelity": equilibrium.fidelity,
            "degrees_of_freedom": int(equilibrium.degrees_of_freedom),
            "error_estimate": float(equilibrium.error_estimate),
            "residual": float(equilibrium.residual),
            "iterations": int(equilibrium.iterations),
            "energy": float(equilibrium.energy),
        },
    )
