"""The solver as users meet it: one command after the other, and the tasks that take many."""

from __future__ import annotations

from numpy.typing import ArrayLike

from ctr_pvs.errors import FieldError
from ctr_pvs.robot.loads import Loads
from ctr_pvs.robot.robot import Limits
from ctr_pvs.robot.robot import Robot
from ctr_pvs.solve import solver as solve
from ctr_pvs.solve.path import deadline_of
from ctr_pvs.tasks.aim import Aim
from ctr_pvs.tasks.inverse import InverseResult
from ctr_pvs.tasks.inverse import InverseSearch
from ctr_pvs.tasks.inverse import Start
from ctr_pvs.tasks.motion import Deployment
from ctr_pvs.tasks.motion import Motion
from ctr_pvs.tasks.motion import Rates
from ctr_pvs.tasks.motion import follow_the_leader
from ctr_pvs.tasks.motion import motion


class EquilibriumSolver(solve.EquilibriumSolver):
    __doc__ = solve.EquilibriumSolver.__doc__

    def __init__(
        self, robot: Robot, tolerance: float = 1e-5, fidelity: str = "auto", force_model: str = "virtual_work"
    ) -> None:
        super().__init__(robot, tolerance, fidelity, force_model)
        self._search: tuple[Limits | None, InverseSearch] | None = None

    def inverse(
        self,
        position: ArrayLike,
        tangent: ArrayLike | None = None,
        orientation: ArrayLike | None = None,
        *,
        start: Start | None = None,
        loads: Loads | None = None,
        limits: Limits | None = None,
        margin_floor: float = 0.1,
        budget: float | None = None,
        all: bool = False,
        within: float = 1e-6,
        within_angle: float = 1e-4,
    ) -> InverseResult:
        """The command (alpha, D) that brings the tip to ``position`` (3,) [m], and with a ``tangent`` (3,) or an
        ``orientation`` (4,), quaternion x, y, z, w, turns it so; with the way there, on which nothing snaps.

        start : an answer, or alpha and D of a cold start, to set out from; None is the last good answer, or without
            one no rotation and tubes half out.  loads : what acts, on all of the way.
        limits : on alpha and D, beside those of the robot.  margin_floor : no command of the way has less margin, or
            less than the start if that has less.
        budget : seconds; past it the status is TIMEOUT, with the nearest that was found.
        all : look for all solutions; the one of largest margin has the ``others``.
        within [m], within_angle [rad] : how near is there.

        The closest point where the target is out of reach.  The warm start of ``solve`` stays as it is: to go on,
        ``follow`` the way, or start the next search from ``result.equilibrium``.

        Raises ``FieldError`` and as ``solve`` does for wrong input, ``NoEquilibriumError`` without an equilibrium at
        the start.
        """
        deadline = deadline_of(budget)
        search = self._searching(limits)
        aim = Aim(position, tangent, orientation, within, within_angle)
        walker = search.walker(self._here(start), loads, _checked_floor(margin_floor), deadline)
        return search.search(aim, walker, all)

    def motion(
        self,
        waypoints: ArrayLike,
        *,
        tolerance: float = 1e-4,
        rates: Rates | None = None,
        start: Start | None = None,
        loads: Loads | None = None,
        limits: Limits | None = None,
        margin_floor: float = 0.1,
        budget: float | None = None,
    ) -> Motion:
        """Joint values that lead the tip along the polyline through ``waypoints`` (M, 3) [m], never farther from it
        than ``tolerance`` [m] where it is looked at: at each command and half-way between two.

        rates : what the actuators can.  The rest as for ``inverse``, which finds the way to the first waypoint.  Where
        the path cannot be followed to its end the motion ends there, and ``status`` and ``message`` say why.
        """
        deadline = deadline_of(budget)
        if not 0.0 < tolerance < 1.0:
            raise FieldError("tolerance", tolerance, "a length above 0 m, below 1 m")
        search = self._searching(limits)
        start = self._here(start)
        walker = search.walker(start, loads, _checked_floor(margin_floor), deadline)
        return motion(search, walker, waypoints, tolerance, rates or Rates())

    def follow_the_leader(
        self, alpha: ArrayLike, D: ArrayLike, *, loads: Loads | None = None, places: int = 60
    ) -> Deployment:
        """How far the body strays from its tip's track while the commands alpha [rad], D [m] (K, N) are followed, the
        first from a cold start; looked at in ``places`` of the body."""
        return follow_the_leader(self, alpha, D, loads, places)

    def _searching(self, limits: Limits | None) -> InverseSearch:
        """The last search, with its table of starts, if it fits."""
        if self._search is None or self._search[0] != limits:
            self._search = limits, InverseSearch(self.fork(), limits)
        return self._search[1]

    def _here(self, start: Start | None) -> Start | None:
        """``start``, or the last good answer, solved again from itself."""
        if start is not None or self._last is None:
            return start
        other = self.fork()
        other._last, other._acting = self._last, self._acting
        return other.solve(self._last.alpha, self._last.D, loads=self._acting)


def _checked_floor(margin: float) -> float:
    if not 0.0 <= margin < 1.0:
        raise FieldError("margin_floor", margin, "a number from 0 to below 1")
    return float(margin)
