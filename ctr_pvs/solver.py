"""From a command to an equilibrium: check, follow the path, refine until the tolerance is met."""

from __future__ import annotations

import time

import numpy as np
from numpy.typing import ArrayLike
from numpy.typing import NDArray

from ctr_pvs.continuation import Followed
from ctr_pvs.continuation import PathEnd
from ctr_pvs.continuation import State
from ctr_pvs.continuation import follow
from ctr_pvs.equilibrium import Equilibrium
from ctr_pvs.errors import FieldError
from ctr_pvs.models import Models
from ctr_pvs.refine import DEGREES
from ctr_pvs.refine import Refined
from ctr_pvs.refine import refine_full
from ctr_pvs.refine import refine_torsion
from ctr_pvs.refine import torsionless
from ctr_pvs.relaxed import relaxed_state
from ctr_pvs.renda2021 import check_renda2021
from ctr_pvs.robot import Robot
from ctr_pvs.solution import TorsionSolution
from ctr_pvs.status import Status

Array = NDArray[np.float64]

FIDELITIES = ("auto", "torsionless", "torsion", "full")
FORCE_MODELS = ("virtual_work", "renda2021")


class EquilibriumSolver:
    """Solves commands of one robot one after the other and keeps the last good answer as the next warm start.

    tolerance : tip error [m] that an answer may have.
    fidelity : "torsionless" (eq. (28)-(31), closed form), "torsion", "full" (the seed's PVS, all strains free), or
        "auto": torsion, which without external loads is the limit of "full".
    force_model : "virtual_work" (dE/dD), or "renda2021": eq. (41) on the +D axis, for two tubes.
    """

    def __init__(
        self, robot: Robot, tolerance: float = 1e-5, fidelity: str = "auto", force_model: str = "virtual_work"
    ) -> None:
        _check_option("fidelity", fidelity, FIDELITIES)
        _check_option("force_model", force_model, FORCE_MODELS)
        if force_model == "renda2021":
            check_renda2021(robot)
        if not 1e-10 <= tolerance <= 1.0:
            raise FieldError("tolerance", tolerance, "a length from 1e-10 to 1 m")
        self.robot = robot
        self.tolerance = float(tolerance)
        self.force_model = force_model
        self._level = "torsion" if fidelity == "auto" else fidelity
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
        if self._level == "torsionless":
            return self._torsionless(alpha, D)
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
            refined = refine_torsion(self._models, followed.state, DEGREES[index:], self.tolerance)
            if refined is not None:
                return self._keep(refined, iterations, note)
        message = "the refined model lost the branch that the coarse one followed: a fold is very near this command"
        return self._failure(alpha, D, Status.NOT_CONVERGED, message, iterations)

    def _keep(self, refined: Refined, iterations: int, note: str) -> Equilibrium:
        """The answer of the level that was asked for; a good one is kept as the next warm start."""
        torsion = refined.solution
        assert isinstance(torsion, TorsionSolution)
        iterations += refined.iterations
        alpha, D = torsion.alpha, torsion.energy.materials.domain.D
        if self._level == "full":
            full = refine_full(self._models, torsion, self.tolerance)
            if full is None:
                message = "Newton at the full level does not converge from the torsion equilibrium"
                return self._failure(alpha, D, Status.NOT_CONVERGED, message, iterations)
            refined, iterations = full, iterations + full.iterations
        answer = self._success(alpha, D, refined, iterations, note)
        if answer.success:
            # Tubes that are not coupled remember nothing: what follows sets out from the relaxed robot.
            self._last = State(alpha, D, torsion.shape.torques) if torsion.degrees_of_freedom else None
        return answer

    def _torsionless(self, alpha: Array, D: Array) -> Equilibrium:
        """The closed form, with what it neglects told by its error estimate."""
        return self._success(alpha, D, torsionless(self._models, alpha, D, self.tolerance), 0, "; twist is neglected")

    def _success(self, alpha: Array, D: Array, refined: Refined, iterations: int, note: str) -> Equilibrium:
        status, message = Status.OK, "stable equilibrium" + note
        if refined.estimate > self.tolerance:
            status = Status.TOLERANCE_MISSED
            needed = f"{self.tolerance:.1e} m were asked for"
            message = f"tip error about {refined.estimate:.1e} m at the {self._level} level, {needed}"
        return Equilibrium(
            alpha,
            D,
            status,
            message,
            self.tolerance,
            self._level,
            self.force_model,
            refined.estimate,
            refined.residual,
            iterations,
            refined.solution,
        )

    def _failure(self, alpha: Array, D: Array, status: Status, message: str, iterations: int = 0) -> Equilibrium:
        return Equilibrium(
            alpha, D, status, message, self.tolerance, self._level, self.force_model, iterations=iterations
        )


def _fold_message(followed: Followed) -> str:
    alpha = ", ".join(f"{angle:.6g}" for angle in followed.state.alpha)
    D = ", ".join(f"{length:.6g}" for length in followed.state.D)
    return f"the stable branch ends on the way, at alpha = [{alpha}] rad, D = [{D}] m: approach from another side"


def _check_option(name: str, value: str, choices: tuple[str, ...]) -> None:
    if value not in choices:
        raise FieldError(name, value, f"one of {', '.join(choices)}")
