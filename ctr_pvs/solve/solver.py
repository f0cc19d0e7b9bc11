"""From a command to an equilibrium: check, one proven step or the path, degrees raised until the tolerance is met."""

from __future__ import annotations

from dataclasses import replace
from typing import Self

import numpy as np
from numpy.typing import ArrayLike
from numpy.typing import NDArray

from ctr_pvs.answer.degrees import raised
from ctr_pvs.answer.degrees import settled
from ctr_pvs.answer.engine import Engine
from ctr_pvs.answer.equilibrium import Equilibrium
from ctr_pvs.answer.full import FullEquilibrium
from ctr_pvs.answer.shape import TorsionShape
from ctr_pvs.answer.state import Snap
from ctr_pvs.answer.state import State
from ctr_pvs.answer.status import NoEquilibriumError
from ctr_pvs.answer.status import Status
from ctr_pvs.errors import FieldError
from ctr_pvs.errors import check_choice
from ctr_pvs.kernel.walk.step import MORE
from ctr_pvs.kernel.walk.step import NOT_PROVEN
from ctr_pvs.kernel.walk.step import OK
from ctr_pvs.pvs.printed_loads import check_renda2021
from ctr_pvs.pvs.refine import refine_full
from ctr_pvs.robot.loads import Loads
from ctr_pvs.robot.play import Play
from ctr_pvs.robot.robot import Robot
from ctr_pvs.solve.batch import SEVERAL
from ctr_pvs.solve.batch import Batch
from ctr_pvs.solve.batch import Progress
from ctr_pvs.solve.batch import solve_rows
from ctr_pvs.solve.equilibria import equilibria
from ctr_pvs.solve.journey import Command
from ctr_pvs.solve.journey import arrive
from ctr_pvs.solve.journey import snapped
from ctr_pvs.solve.legs import cold_legs
from ctr_pvs.solve.legs import load_leg
from ctr_pvs.solve.legs import warm_legs
from ctr_pvs.solve.packer import LoadPacker
from ctr_pvs.solve.path import DEGREES
from ctr_pvs.solve.path import NO_LOADS
from ctr_pvs.solve.path import Leg
from ctr_pvs.solve.path import deadline_of
from ctr_pvs.solve.path import distance_to_snap
from ctr_pvs.solve.path import load_to_snap
from ctr_pvs.solve.sensing import SensedForce
from ctr_pvs.solve.sensing import measured
from ctr_pvs.solve.sensing import sense

Array = NDArray[np.float64]

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
        check_choice("fidelity", fidelity, FIDELITIES)
        check_choice("force_model", force_model, FORCE_MODELS)
        if force_model == "renda2021":
            check_renda2021(robot)
        if not 1e-10 <= tolerance <= 1.0:
            raise FieldError("tolerance", tolerance, "a length from 1e-10 to 1 m")
        self.robot, self.tolerance, self.force_model = robot, float(tolerance), force_model
        self._level, self._untwisted, self._halts = fidelity, fidelity == "auto", False
        self._engine = Engine(robot, self.tolerance)
        self._last: State | None = None
        self._acting: Loads | None = None
        self._packer = LoadPacker(robot, fidelity, force_model)
        self._play = Play(robot.play.of(robot.n_tubes)) if robot.play else None

    def follow(
        self, alpha: ArrayLike, D: ArrayLike, budget: float | None = None, *, loads: Loads | None = None
    ) -> Equilibrium:
        """``solve`` with a warm start: the straight path from the last good answer, in all at once, through folds.
        Where the branch ends the robot snaps: the status is SNAP, and ``answer.snaps`` tells for each one the fraction
        of the path, alpha and D there, the states before and after, and the energy released.
        """
        return self.solve(alpha, D, "warm", budget, loads=loads)

    def distance_to_snap(self, budget: float | None = None, turn: float = 4.0 * np.pi) -> Array:
        """(2 N, 2) how far each actuator, alpha_1 .. alpha_N [rad] and D_1 .. D_N [m], can go from the last good answer
        towards - and + before the stable branch ends.

        turn : how far to look in rotation [rad]; D is looked at between its neighbours and its tube's length.
        Infinite where no snap lies in reach; NaN where the ``budget`` [s] ran out first.

        Raises ``NoEquilibriumError`` without a last good answer, and where no tubes are coupled.
        """
        if self._last is None:
            raise NoEquilibriumError("no coupled equilibrium to start from: solve a command first")
        state, alpha, D = self._last, self._last.alpha, self._last.D
        lengths = np.array([tube.length for tube in self.robot.tubes])
        lowest, highest = np.append(0.0, D[:-1]), np.minimum(np.append(D[1:], np.inf), lengths)
        bounds = np.concatenate([alpha - turn, lowest]), np.concatenate([alpha + turn, highest])
        return distance_to_snap(self._engine, state, bounds, deadline_of(budget))

    def load_to_snap(self, loads: Loads, budget: float | None = None, most: float = 10.0) -> float:
        """How many times ``loads`` can act on the last good answer, beside what acts on it already, before the stable
        branch ends; infinite if it does not up to ``most`` times, NaN where the ``budget`` [s] ran out first.

        Raises ``NoEquilibriumError`` without a last good answer, ``LoadError`` for loads that the robot cannot take.
        """
        if self._last is None:
            raise NoEquilibriumError("no equilibrium to start from: solve a command first")
        packed = self._packer.pack(self._last.D, loads)
        return load_to_snap(self._engine, self._last, packed, most, deadline_of(budget))

    def sense_tip_force(
        self,
        alpha: ArrayLike,
        D: ArrayLike,
        *,
        torque: ArrayLike | None = None,
        force: ArrayLike | None = None,
        tip_position: ArrayLike | None = None,
        torque_std: ArrayLike = 1e-3,
        force_std: ArrayLike = 0.05,
        position_std: ArrayLike = 5e-4,
        loads: Loads | None = None,
        guess: ArrayLike = (0.0, 0.0, 0.0),
        largest_std: float = 10.0,
    ) -> SensedForce:
        """The force on the tip [N] at (alpha, D), (N,) each, from measured actuator torques (N,) [N m] and forces (N,)
        [N], or a measured tip position (3,) [m], with their standard deviations: see ``solve.sensing``.

        loads : what else is known to act.  guess : where to start, (3,) [N].  largest_std : a direction whose standard
        deviation would be larger [N] counts as not seen.  The warm start of ``solve`` stays as it is.

        Raises ``FieldError`` for measurements that are none, and as ``solve`` does.
        """
        told = measured(self.robot.n_tubes, torque, force, tip_position, torque_std, force_std, position_std)
        other = self.fork()
        known = loads or Loads()

        def solve(tip: Array) -> Equilibrium:
            x, y, z = (tip + known.tip_force).tolist()
            return other.solve(alpha, D, loads=replace(known, tip_force=(x, y, z)))

        return sense(solve, told, np.array(guess, dtype=np.float64), largest_std)

    def fork(self, answer: Equilibrium | None = None, halts: bool | None = None) -> Self:
        """A solver that does not share the warm start: its own is ``answer``, one of this robot's, or none.

        halts : whether it looks for no landing where a stable branch ends: NO_STABLE_EQUILIBRIUM.  None is as this one.
        """
        other = type(self).__new__(type(self))
        other.__dict__.update(self.__dict__)
        other._last, other._acting, other._play = None, None, None  # commands are those of the tubes
        other._halts = self._halts if halts is None else halts
        if answer is not None and answer.state.coupled:
            other._last, other._acting = answer.state, answer.applied_loads
        return other

    def reset(self) -> None:
        """Forget the warm start, and where play has left the tubes: the next solve is cold."""
        self._last = None
        if self._play is not None:
            self._play = self._play.moved(None)

    def solve(
        self, alpha: ArrayLike, D: ArrayLike, start: str = "warm", budget: float | None = None, *,
        loads: Loads | None = None,
    ) -> Equilibrium:  # fmt: skip
        """The stable equilibrium at base rotations ``alpha`` (N,) [rad] and base positions ``D`` (N,) [m] under
        ``loads``; None is no load, whatever acted before.

        start : "warm" follows the straight path from the last good answer, in alpha, D and loads together; "cold", and
            the first solve, the path from the relaxed robot at this D: the rotation, then the loads in proportion.
            What of the command reaches the tubes depends on the path, too, if the robot has play; other starts find
            each play in its middle.
            Angles are not wrapped: 280 deg and -80 deg are different histories. "lowest-energy" has no history: of all
            stable equilibria that ``equilibria`` finds, the one of least energy; not under load.
        budget : seconds that following the path may take; past it the status is TIMEOUT.  A command near enough for
            one proven step is answered at once.

        The warm start stays the last good one when a solve fails.

        Raises ``CommandError`` for a command that the robot cannot take, ``LoadError`` for loads that cannot act on it,
        ``FieldError`` for a wrong option; all are ``ValueError``.
        """
        check_choice("start", start, ("warm", "cold", "lowest-energy"))
        deadline = deadline_of(budget)
        alpha, D = self.robot.check_command(alpha, D)
        tubes, packed = (alpha, D), NO_LOADS
        if self._play is not None:
            tubes = self.robot.clamp_command(*self._play.between(alpha, D, start == "warm"))[:2]
        if loads is not None:
            packed = self._packer.pack(tubes[1], loads)
            loads = loads if len(packed) else None
        answer = self._solve(Command(*tubes, loads), start, packed, deadline)
        if self._play is not None:
            if answer.success:
                self._play = self._play.moved(np.concatenate(tubes))
            answer.alpha, answer.D = alpha, D
        return answer

    def _solve(self, at: Command, start: str, packed: Array, deadline: float) -> Equilibrium:
        alpha, D, loads = at
        if self._level == "torsionless":
            return self._torsionless(at)
        if start == "lowest-energy":
            return self._lowest(at)
        if start == "cold" or self._last is None:
            return self._cold(at, packed, deadline)
        code, vector = self._engine.step(self._last.vector, alpha, D, packed, untwisted=self._untwisted)
        state = raised(self._engine, State(vector, len(alpha)), alpha, D, packed) if code == OK else None
        if state is not None:
            return self._keep(at, state, (), 0, "")
        legs = warm_legs(self.robot, self._last, self._acting, alpha, D, loads)
        return self._travelled(self._last, legs, at, packed, deadline, "")

    def solve_batch(
        self, alpha: ArrayLike, D: ArrayLike, start: str = "cold", progress: Progress | None = None, *,
        tip_force: ArrayLike | None = None, tip_moment: ArrayLike | None = None, complete: bool = False,
        threads: int | None = None,
    ) -> Batch:  # fmt: skip
        """Many commands at once: the answers of cold starts to the rows of ``alpha`` [rad] and ``D`` [m] (M, N), under
        ``tip_force`` [N] and ``tip_moment`` [N m], (M, 3) each or None.

        progress : called as progress(done, total) from time to time.  The warm start of ``solve`` stays as it is.
        complete : margins and forces are worked out on the way; else whoever asks for them has every row solved again.
        threads : None for one per processor.

        A row that the robot cannot take is told in the batch.  Raises ``CommandError`` for arrays that are no tables of
        real numbers with a column per tube, ``FieldError`` for a wrong option.
        """
        check_choice("start", start, ("cold",))
        return solve_rows(
            self, self._engine, alpha, D, tip_force, tip_moment, self._level, progress, complete, threads
        )  # fmt: skip

    def solve_alone(self, alpha: Array, D: Array, loads: Loads | None) -> Equilibrium:
        """A cold start that leaves the warm start as it is; for threads of a batch."""
        return self.fork().solve(alpha, D, start="cold", loads=loads)

    def _cold(self, at: Command, packed: Array, deadline: float) -> Equilibrium:
        """The path from the relaxed robot at this D, where one has to be walked, then the loads."""
        alpha, D, loads = at
        code, vector = self._engine.cold_start(alpha, D, self._untwisted and loads is None)
        if code in (OK, MORE):
            state, note = State(vector, len(alpha)), SEVERAL if code == MORE else ""
            if loads is None:
                return self._keep(at, state, (), 0, note)
            return self._travelled(state, [load_leg(self.robot, alpha, D, packed)], at, packed, deadline, note)
        code, vector = self._engine.relaxed(D, DEGREES[1])
        if code == NOT_PROVEN:
            message = "the search for the relaxed robot, where a cold start sets out, found no energy minimum"
            return self._failure(at, Status.NOT_CONVERGED, message)
        # A common rotation of all tubes changes nothing: begin with tube 1 where the command wants it.
        relaxed = State(vector, len(alpha)).turned_to(alpha[0])
        legs = cold_legs(self.robot, relaxed, alpha, D, packed)
        return self._travelled(relaxed, legs, at, packed, deadline, SEVERAL if code == MORE else "")

    def _travelled(
        self, origin: State, legs: list[Leg], at: Command, packed: Array, deadline: float, note: str
    ) -> Equilibrium:
        """The answer at the end of a journey."""
        arrival = arrive(self._engine, origin, legs, packed, self._untwisted, deadline, self._halts)
        if arrival.state is None:
            return self._failure(at, arrival.status, arrival.message, arrival.iterations)
        return self._keep(at, arrival.state, arrival.snaps, arrival.iterations, note)

    def _lowest(self, at: Command) -> Equilibrium:
        """The stable equilibrium of least energy, whatever path may lead there."""
        alpha, D, loads = at
        if loads is not None:
            raise FieldError("start", "lowest-energy", "cold or warm where loads act", "the search knows no loads")
        every = equilibria(self.robot, alpha, D, self.tolerance)
        if every.stable:
            code, vector = settled(self._engine, every.stable[0].state.vector, NO_LOADS, self._untwisted)
            if code == OK:
                note = f", of least energy among {len(every.stable)}; {every.method}"
                return self._keep(at, State(vector, len(alpha)), (), 0, note)
        return self._failure(at, Status.NO_STABLE_EQUILIBRIUM, f"none found: {every.method}")

    def _torsionless(self, at: Command) -> Equilibrium:
        """The closed form, with what it neglects told by its error estimate."""
        code, vector = self._engine.untwisted(at.alpha, at.D)
        if code != OK:
            message = "the untwisted state is unstable: twist cannot be neglected here"
            return self._failure(at, Status.NO_STABLE_EQUILIBRIUM, message)
        return self._told(at, State(vector, self.robot.n_tubes), (), 0, "; twist is neglected")

    def _keep(self, at: Command, state: State, snaps: tuple[Snap, ...], iterations: int, note: str) -> Equilibrium:
        """The answer of the level that was asked for; a good one is kept as the next warm start."""
        if self._level == "full" and at.loads is None:
            answer = self._full(at, state, snaps, iterations, note)
        else:
            answer = self._told(at, state, snaps, iterations, note)
        if answer.status.success:
            # Tubes that are not coupled remember nothing: what follows sets out from the relaxed robot.
            self._last, self._acting = state if state.coupled else None, at.loads
        return answer

    def _full(self, at: Command, state: State, snaps: tuple[Snap, ...], iterations: int, note: str) -> Equilibrium:
        refined = refine_full(TorsionShape(self._engine, state), self.tolerance)
        if refined is None:
            message = "Newton at the full level does not converge from the torsion equilibrium"
            return self._failure(at, Status.NOT_CONVERGED, message, iterations)
        status, message = self._outcome(refined.estimate, snaps, note)
        answer = FullEquilibrium(
            self._engine, at.alpha, at.D, status, message, "full", self.force_model, state,
            iterations + state.steps + refined.iterations, snaps,
        )  # fmt: skip
        answer.refined = refined
        return answer

    def _told(
        self, at: Command, state: State, snaps: tuple[Snap, ...], iterations: int, note: str
    ) -> Equilibrium:  # fmt: skip
        """The answer, with its status and message."""
        status, message = Status.OK, "stable equilibrium"
        if snaps or note or state.estimate > self.tolerance:
            status, message = self._outcome(state.estimate, snaps, note)
        level = "full" if at.loads is not None else "torsion" if state.twists else "torsionless"
        return Equilibrium(
            self._engine, at.alpha, at.D, status, message, level, self.force_model, state, iterations + state.steps,
            snaps, at.loads,
        )  # fmt: skip

    def _outcome(self, estimate: float, snaps: tuple[Snap, ...], note: str) -> tuple[Status, str]:
        if estimate > self.tolerance:
            needed = f"{self.tolerance:.1e} m were asked for"
            return Status.TOLERANCE_MISSED, f"tip error about {estimate:.1e} m at the {self._level} level, {needed}"
        return (Status.SNAP, snapped(snaps) + note) if snaps else (Status.OK, "stable equilibrium" + note)

    def _failure(self, at: Command, status: Status, message: str, iterations: int = 0) -> Equilibrium:
        return Equilibrium(
            self._engine, at.alpha, at.D, status, message, self._level, self.force_model, iterations=iterations,
            loads=at.loads,
        )  # fmt: skip
