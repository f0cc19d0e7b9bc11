"""From a command to an equilibrium: check, one proven step or the path, degrees raised until the tolerance is met."""

from __future__ import annotations

import time

import numpy as np
from numpy.typing import ArrayLike
from numpy.typing import NDArray

from ctr_pvs.answer.engine import Engine
from ctr_pvs.answer.equilibrium import Equilibrium
from ctr_pvs.answer.full import FullEquilibrium
from ctr_pvs.answer.shape import TorsionShape
from ctr_pvs.answer.state import Snap
from ctr_pvs.answer.state import State
from ctr_pvs.answer.status import NoEquilibriumError
from ctr_pvs.answer.status import Status
from ctr_pvs.errors import FieldError
from ctr_pvs.kernel.walk.cold import DELICATE
from ctr_pvs.kernel.walk.step import MORE
from ctr_pvs.kernel.walk.step import NOT_PROVEN
from ctr_pvs.kernel.walk.step import OK
from ctr_pvs.pvs.printed_loads import check_renda2021
from ctr_pvs.pvs.refine import refine_full
from ctr_pvs.robot.robot import Robot
from ctr_pvs.solve.batch import SEVERAL
from ctr_pvs.solve.batch import Batch
from ctr_pvs.solve.batch import Progress
from ctr_pvs.solve.batch import solve_rows
from ctr_pvs.solve.equilibria import equilibria
from ctr_pvs.solve.path import DEGREES
from ctr_pvs.solve.path import Followed
from ctr_pvs.solve.path import PathEnd
from ctr_pvs.solve.path import distance_to_snap
from ctr_pvs.solve.path import travel

Array = NDArray[np.float64]

#: Index of the degree at which a delicate journey is believed even if it does not agree with the one before.
MOST_REPEATS = 4

FIDELITIES = ("auto", "torsionless", "torsion", "full")
FORCE_MODELS = ("virtual_work", "renda2021")


class EquilibriumSolver:
    """Solves commands of one robot one after the other and keeps the last good answer as the next warm start.

    tolerance : tip error [m] that an answer may have.
    fidelity : "torsionless" (eq. (28)-(31), closed form), "torsion", "full" (the seed's PVS, all strains free), or
        "auto": the first of "torsionless" and "torsion" that meets the tolerance.  "full" is never needed: without
        external loads "torsion" is its limit.  Degrees of the bases follow from the tolerance at every level.
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
        self._level = fidelity
        self._untwisted = fidelity == "auto"
        self._engine = Engine(robot, self.tolerance)
        self._last: State | None = None

    def follow(self, alpha: ArrayLike, D: ArrayLike, budget: float | None = None) -> Equilibrium:
        """Go from the last good answer to (alpha, D) along the straight path, through folds: ``solve`` with a warm
        start.

        Rotation and sliding may come together.  Where the branch ends the robot snaps: the status is SNAP, and
        ``answer.snaps`` tells for each one the fraction of the path, alpha and D there, the states before and after,
        and the energy released.
        """
        return self.solve(alpha, D, "warm", budget)

    def distance_to_snap(self, budget: float | None = None, turn: float = 4.0 * np.pi) -> Array:
        """(2 N, 2) how far each actuator, alpha_1 .. alpha_N [rad] and D_1 .. D_N [m], can go from the last good answer
        towards - and + before the stable branch ends.

        turn : how far to look in rotation [rad]; D is looked at between its neighbours and its tube's length.
        Infinite where no snap lies in reach; NaN where the ``budget`` [s] ran out first.

        Raises ``NoEquilibriumError`` without a last good answer, and where no tubes are coupled.
        """
        if self._last is None:
            raise NoEquilibriumError("no coupled equilibrium to start from: solve a command first")
        state = self._last
        alpha, D = state.alpha, state.D
        lengths = np.array([tube.length for tube in self.robot.tubes])
        lowest, highest = np.append(0.0, D[:-1]), np.minimum(np.append(D[1:], np.inf), lengths)
        bounds = np.concatenate([alpha - turn, lowest]), np.concatenate([alpha + turn, highest])
        return distance_to_snap(self._engine, state, bounds, _deadline(budget))

    def reset(self) -> None:
        """Forget the warm start: the next solve is cold."""
        self._last = None

    def solve(self, alpha: ArrayLike, D: ArrayLike, start: str = "warm", budget: float | None = None) -> Equilibrium:
        """The stable equilibrium at base rotations ``alpha`` (N,) [rad] and base positions ``D`` (N,) [m].

        start : "warm" follows the straight path from the last good answer; "cold", and the first solve, the path from
            the relaxed robot at this D.  Angles are not wrapped: 280 deg and -80 deg are different histories.
            "lowest-energy" has no history: of all stable equilibria that ``equilibria`` finds, the one of least energy.
        budget : seconds that following the path may take; past it the status is TIMEOUT.  A command near enough for
            one proven step is answered at once.

        The warm start stays the last good one when a solve fails.

        Raises ``CommandError`` for a command that the robot cannot take, ``FieldError`` for a wrong option; both are
        ``ValueError``.
        """
        _check_option("start", start, ("warm", "cold", "lowest-energy"))
        deadline = _deadline(budget)
        alpha, D = self.robot.check_command(alpha, D)
        if self._level == "torsionless":
            return self._torsionless(alpha, D)
        if start == "lowest-energy":
            return self._lowest(alpha, D)
        if start == "cold" or self._last is None:
            return self._cold(alpha, D, deadline)
        code, vector = self._engine.advance(self._last.vector, alpha, D, self._untwisted)
        if code == OK:
            return self._keep(alpha, D, State(vector, len(alpha)), (), 0, "")
        return self._travelled(self._last, alpha, D, deadline, "")

    def solve_batch(
        self, alpha: ArrayLike, D: ArrayLike, start: str = "cold", progress: Progress | None = None
    ) -> Batch:
        """Many commands at once: the answers of cold starts to the rows of ``alpha`` [rad] and ``D`` [m] (M, N).

        progress : called as progress(done, total) from time to time.  The warm start of ``solve`` stays as it is.

        A row that the robot cannot take is told in the batch.  Raises ``CommandError`` for arrays that are no tables of
        real numbers with a column per tube, ``FieldError`` for a wrong option.
        """
        _check_option("start", start, ("cold",))
        return solve_rows(self, self._engine, alpha, D, self._level, progress)

    def solve_alone(self, alpha: Array, D: Array) -> Equilibrium:
        """A cold start that leaves the warm start as it is; for threads of a batch."""
        other = EquilibriumSolver.__new__(EquilibriumSolver)
        other.__dict__.update(self.__dict__)
        other._last = None
        return other.solve(alpha, D, start="cold")

    def _cold(self, alpha: Array, D: Array, deadline: float) -> Equilibrium:
        """The path from the relaxed robot at this D, where one has to be walked."""
        code, vector = self._engine.cold_start(alpha, D, self._untwisted)
        if code in (OK, MORE):
            return self._keep(alpha, D, State(vector, len(alpha)), (), 0, SEVERAL if code == MORE else "")
        code, vector = self._engine.relaxed(D, DEGREES[1])
        if code == NOT_PROVEN:
            message = "the search for the relaxed robot, where a cold start sets out, found no energy minimum"
            return self._failure(alpha, D, Status.NOT_CONVERGED, message)
        # A common rotation of all tubes changes nothing: begin with tube 1 where the command wants it.
        relaxed = State(vector, len(alpha)).turned_to(alpha[0])
        return self._travelled(relaxed, alpha, D, deadline, SEVERAL if code == MORE else "")

    def _travelled(self, origin: State, alpha: Array, D: Array, deadline: float, note: str) -> Equilibrium:
        """Travel at the lowest degree that keeps the branch up to the converged model, then settle on the degrees that
        the tolerance asks for.

        Folds lie a little elsewhere at a low degree.  A journey through one, or to the edge of one, is therefore made
        again at the next degree, until two agree.
        """
        iterations, before, walked = 0, None, 0.0
        for index, degree in enumerate(DEGREES[:-1]):
            if index < MOST_REPEATS and degree <= walked:
                continue  # the tolerance has asked for more already: the same journey would agree with itself
            journey = travel(self._engine, origin, alpha, D, degree, deadline)
            walked = self._engine.elements(journey.state.vector)[:, 3].max(initial=0.0)
            iterations += journey.iterations
            if journey.end is PathEnd.NO_LANDING and index < len(DEGREES) - 2:
                continue  # a state at the edge of a fold may lie beyond the fold of a lower degree
            if journey.end is not PathEnd.REACHED:
                return self._failure(alpha, D, _STATUS[journey.end], _stopped(journey), iterations)
            code, vector = self._engine.settle(journey.state.vector, self._untwisted)
            if code != OK:
                continue
            delicate = bool(journey.snaps) or self._engine.margin(vector) < DELICATE
            if not delicate or index == MOST_REPEATS or (before is not None and journey.agrees_with(before)):
                return self._keep(alpha, D, State(vector, len(alpha)), journey.snaps, iterations, note)
            before = journey
        message = "the refined model lost the branch that the coarse one followed: a fold is very near this command"
        return self._failure(alpha, D, Status.NOT_CONVERGED, message, iterations)

    def _lowest(self, alpha: Array, D: Array) -> Equilibrium:
        """The stable equilibrium of least energy, whatever path may lead there."""
        every = equilibria(self.robot, alpha, D, self.tolerance)
        if every.stable:
            code, vector = self._engine.settle(every.stable[0].state.vector, self._untwisted)
            if code == OK:
                note = f", of least energy among {len(every.stable)}; {every.method}"
                return self._keep(alpha, D, State(vector, len(alpha)), (), 0, note)
        return self._failure(alpha, D, Status.NO_STABLE_EQUILIBRIUM, f"none found: {every.method}")

    def _torsionless(self, alpha: Array, D: Array) -> Equilibrium:
        """The closed form, with what it neglects told by its error estimate."""
        code, vector = self._engine.untwisted(alpha, D)
        if code != OK:
            message = "the untwisted state is unstable: twist cannot be neglected here"
            return self._failure(alpha, D, Status.NO_STABLE_EQUILIBRIUM, message)
        return self._told(alpha, D, State(vector, len(alpha)), (), 0, "; twist is neglected")

    def _keep(
        self, alpha: Array, D: Array, state: State, snaps: tuple[Snap, ...], iterations: int, note: str
    ) -> Equilibrium:
        """The answer of the level that was asked for; a good one is kept as the next warm start."""
        if self._level == "full":
            answer = self._full(alpha, D, state, snaps, iterations, note)
        else:
            answer = self._told(alpha, D, state, snaps, iterations, note)
        if answer.status.success:
            # Tubes that are not coupled remember nothing: what follows sets out from the relaxed robot.
            self._last = state if state.coupled else None
        return answer

    def _full(
        self, alpha: Array, D: Array, state: State, snaps: tuple[Snap, ...], iterations: int, note: str
    ) -> Equilibrium:
        refined = refine_full(TorsionShape(self._engine, state), self.tolerance)
        if refined is None:
            message = "Newton at the full level does not converge from the torsion equilibrium"
            return self._failure(alpha, D, Status.NOT_CONVERGED, message, iterations)
        status, message = self._outcome(refined.estimate, snaps, note)
        answer = FullEquilibrium(
            self._engine, alpha, D, status, message, "full", self.force_model, state,
            iterations + state.steps + refined.iterations, snaps,
        )  # fmt: skip
        answer.refined = refined
        return answer

    def _told(
        self, alpha: Array, D: Array, state: State, snaps: tuple[Snap, ...], iterations: int, note: str
    ) -> Equilibrium:
        """The answer, with its status and message."""
        status, message = Status.OK, "stable equilibrium"
        if snaps or note or state.estimate > self.tolerance:
            status, message = self._outcome(state.estimate, snaps, note)
        level = "torsion" if state.twists else "torsionless"
        return Equilibrium(
            self._engine, alpha, D, status, message, level, self.force_model, state, iterations + state.steps, snaps
        )

    def _outcome(self, estimate: float, snaps: tuple[Snap, ...], note: str) -> tuple[Status, str]:
        if estimate > self.tolerance:
            needed = f"{self.tolerance:.1e} m were asked for"
            return Status.TOLERANCE_MISSED, f"tip error about {estimate:.1e} m at the {self._level} level, {needed}"
        return (Status.SNAP, _snapped(snaps) + note) if snaps else (Status.OK, "stable equilibrium" + note)

    def _failure(self, alpha: Array, D: Array, status: Status, message: str, iterations: int = 0) -> Equilibrium:
        return Equilibrium(
            self._engine, alpha, D, status, message, self._level, self.force_model, iterations=iterations
        )


_STATUS = {
    PathEnd.TIMEOUT: Status.TIMEOUT,
    PathEnd.NO_LANDING: Status.NO_STABLE_EQUILIBRIUM,
    PathEnd.TOO_MANY_SNAPS: Status.NOT_CONVERGED,
}


def _stopped(journey: Followed) -> str:
    place = _place(journey.state.alpha, journey.state.D)
    return f"{journey.end.value}: stopped at {journey.t:.6g} of the path, {place}"


def _snapped(snaps: tuple[Snap, ...]) -> str:
    """What happened on the way, for people; ``Equilibrium.snaps`` has the states."""
    last = snaps[-1]
    many = "snapped" if len(snaps) == 1 else f"snapped {len(snaps)} times, the last time"
    released = sum(snap.energy_released for snap in snaps)
    return (
        f"{many} at {last.t:.6g} of the path, {_place(last.alpha, last.D)}, releasing {released:.3g} J in all; "
        "the landing is a prediction, real snaps are dynamic"
    )


def _place(alpha: Array, D: Array) -> str:
    angles = ", ".join(f"{angle:.6g}" for angle in alpha)
    lengths = ", ".join(f"{length:.6g}" for length in D)
    return f"alpha = [{angles}] rad, D = [{lengths}] m"


def _check_option(name: str, value: str, choices: tuple[str, ...]) -> None:
    if value not in choices:
        raise FieldError(name, value, f"one of {', '.join(choices)}")


def _deadline(budget: float | None) -> float:
    """``time.monotonic()`` value after which to give up."""
    if budget is not None and not budget > 0.0:
        raise FieldError("budget", budget, "seconds above 0, or None")
    return np.inf if budget is None else time.monotonic() + budget
