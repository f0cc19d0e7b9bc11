"""From a command to an equilibrium: check, follow the path, refine until the tolerance is met."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from numpy.typing import NDArray

from ctr_pvs.backbone import bishop_frames
from ctr_pvs.continuation import Followed
from ctr_pvs.continuation import PathEnd
from ctr_pvs.continuation import State
from ctr_pvs.continuation import follow
from ctr_pvs.equilibrium import Equilibrium
from ctr_pvs.errors import FieldError
from ctr_pvs.models import Models
from ctr_pvs.relaxed import relaxed_state
from ctr_pvs.robot import Robot
from ctr_pvs.shape import Shape
from ctr_pvs.solution import TorsionSolution
from ctr_pvs.solve import newton
from ctr_pvs.status import Status

Array = NDArray[np.float64]

#: Polynomial degrees of the twist rates, tried in turn until two successive tips agree within the tolerance.
DEGREES = (5, 7, 9, 12, 16, 21, 28)
#: The ladder's first rung integrates with steps this much looser, so that the comparison sees the integration error
#: too.
LOOSER = 64.0


@dataclass(frozen=True, eq=False)
class _Refined:
    """A state refined at its command, its residual twist [rad], its error estimate [m] and the iterations spent."""

    solution: TorsionSolution
    residual: float
    estimate: float
    iterations: int


class EquilibriumSolver:
    """Solves commands of one robot one after the other and keeps the last good answer as the next warm start.

    tolerance : tip error [m] that an answer may have.
    fidelity : "auto" or "torsion".
    force_model : "virtual_work".
    """

    def __init__(
        self, robot: Robot, tolerance: float = 1e-5, fidelity: str = "auto", force_model: str = "virtual_work"
    ) -> None:
        _check_option("fidelity", fidelity, ("auto", "torsion"))
        _check_option("force_model", force_model, ("virtual_work",))
        if not 1e-10 <= tolerance <= 1.0:
            raise FieldError("tolerance", tolerance, "a length from 1e-10 to 1 m")
        self.robot = robot
        self.tolerance = float(tolerance)
        self._models = Models(robot)
        self._last: State | None = None

    def reset(self) -> None:
        """Forget the warm start: the next solve is cold."""
        self._last = None

    def solve(self, alpha: ArrayLike, D: ArrayLike, start: str = "warm", budget: float | None = None) -> Equilibrium:
        """The stable equilibrium at base rotations ``alpha`` (N,) [rad] and base positions ``D`` (N,) [m].

        start : "warm" follows the straight path from the last good answer; "cold", and the first solve, the path from
            the relaxed robot at this D.  Angles are not wrapped: 280 deg and -80 deg are different histories.
        budget : seconds that the solve may take; past it the status is TIMEOUT.

        The warm start stays the last good one when a solve fails.

        Raises ``CommandError`` for a command that the robot cannot take, ``FieldError`` for a wrong option; both are
        ``ValueError``.
        """
        _check_option("start", start, ("warm", "cold"))
        if budget is not None and not budget > 0.0:
            raise FieldError("budget", budget, "seconds above 0, or None")
        alpha, D = self.robot.check_command(alpha, D)
        deadline = np.inf if budget is None else time.monotonic() + budget
        origin, note = self._origin(alpha, D, start)
        if origin is None:
            return self._failure(alpha, D, Status.NOT_CONVERGED, note)
        return self._answer(origin, alpha, D, deadline, note)

    def _origin(self, alpha: Array, D: Array, start: str) -> tuple[State | None, str]:
        """The state to set out from, and what the user should know about it."""
        if start == "warm" and self._last is not None:
            return self._last, ""
        energy = self._models.energy(D, DEGREES[0])
        relaxed = relaxed_state(energy)
        if relaxed is None:
            return None, "the search for the relaxed robot, where a cold start sets out, found no energy minimum"
        # A common rotation of all tubes changes nothing: begin with tube 1 where the command wants it.
        begin = relaxed.alpha + (alpha[0] - relaxed.alpha[0])
        note = "; several relaxed states are equally near, the path set out from one of them" if relaxed.several else ""
        return State(begin, D, energy.space.field(relaxed.q)), note

    def _answer(self, origin: State, alpha: Array, D: Array, deadline: float, note: str) -> Equilibrium:
        """Follow the path at the lowest degree that keeps the branch up to the converged model, then refine."""
        iterations = 0
        for index, degree in enumerate(DEGREES[:-1]):
            followed = follow(self._models, origin, alpha, D, degree, deadline)
            iterations += followed.iterations
            if followed.end is PathEnd.TIMEOUT:
                return self._failure(
                    alpha, D, Status.TIMEOUT, f"out of time at {followed.t:.3g} of the path", iterations
                )
            if followed.end is PathEnd.FOLD:
                return self._failure(alpha, D, Status.NO_STABLE_EQUILIBRIUM, _fold_message(followed), iterations)
            refined = self._refine(followed.state, DEGREES[index:])
            if refined is not None:
                answer = self._success(alpha, D, refined, iterations + refined.iterations, note)
                if answer.success:
                    self._last = State(alpha, D, refined.solution.shape.torques)
                return answer
        message = "the refined model lost the branch that the coarse one followed: a fold is very near this command"
        return self._failure(alpha, D, Status.NOT_CONVERGED, message, iterations)

    def _refine(self, state: State, degrees: tuple[int, ...]) -> _Refined | None:
        """Raise the degree until successive tips agree; None if a higher degree has no equilibrium next to the lower
        one's."""
        torques, tip, iterations, refined = state.torques, None, 0, None
        looseness = LOOSER
        for degree in degrees:
            energy = self._models.energy(state.D, degree)
            result = newton(energy, state.alpha, energy.space.coordinates(torques))
            iterations += result.iterations
            if not result.converged:
                return None
            solution = TorsionSolution(energy, state.alpha, result.q)
            torques, before = solution.shape.torques, tip
            tip = _tip(solution.shape, looseness * 0.1 * self.tolerance)
            looseness = 1.0
            if before is not None:
                estimate = float(np.linalg.norm(tip - before))
                refined = _Refined(solution, result.residual, estimate, iterations)
                if estimate <= self.tolerance:
                    break
        return refined

    def _success(self, alpha: Array, D: Array, refined: _Refined, iterations: int, note: str) -> Equilibrium:
        status, message = Status.OK, "stable equilibrium" + note
        if refined.estimate > self.tolerance:
            status = Status.TOLERANCE_MISSED
            message = (
                f"tip error about {refined.estimate:.1e} m with the largest basis, tolerance {self.tolerance:.1e} m"
            )
        return Equilibrium(
            alpha,
            D,
            status,
            message,
            self.tolerance,
            "torsion",
            refined.estimate,
            refined.residual,
            iterations,
            refined.solution,
        )

    def _failure(self, alpha: Array, D: Array, status: Status, message: str, iterations: int = 0) -> Equilibrium:
        return Equilibrium(alpha, D, status, message, self.tolerance, "torsion", iterations=iterations)


def _tip(shape: Shape, tolerance: float) -> Array:
    """Tip position (3,) [m]."""
    return bishop_frames(shape, np.array([0.0, shape.domain.length]), tolerance)[-1][:3, 3]


def _fold_message(followed: Followed) -> str:
    alpha = ", ".join(f"{angle:.6g}" for angle in followed.state.alpha)
    D = ", ".join(f"{length:.6g}" for length in followed.state.D)
    return f"the stable branch ends on the way, at alpha = [{alpha}] rad, D = [{D}] m: approach from another side"


def _check_option(name: str, value: str, choices: tuple[str, ...]) -> None:
    if value not in choices:
        raise FieldError(name, value, f"one of {', '.join(choices)}")
