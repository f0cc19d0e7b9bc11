"""Along a path with the tip: commands near enough to each other that the tip stays on it in between, timed by what the
actuators can; and how well a deployment follows the leader, the body where the tip has been."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from numpy.typing import NDArray

from ctr_pvs.errors import FieldError
from ctr_pvs.robot.loads import Loads
from ctr_pvs.solve.solver import EquilibriumSolver
from ctr_pvs.tasks.aim import Aim
from ctr_pvs.tasks.descent import End
from ctr_pvs.tasks.descent import descend
from ctr_pvs.tasks.inverse import InverseSearch
from ctr_pvs.tasks.inverse import InverseStatus
from ctr_pvs.tasks.inverse import outcome
from ctr_pvs.tasks.walk import Refusal
from ctr_pvs.tasks.walk import Step
from ctr_pvs.tasks.walk import Walker

Array = NDArray[np.float64]

#: The first stretch of the path that is tried in one [m], and the shortest, as a share of the tolerance.
STRETCH, SHORTEST = 2e-3, 0.05
#: Steps of a descent from one place of the path to the next; the tip meets a place to this share of the tolerance.
STEPS, SHARE = 40, 0.05


@dataclass(frozen=True, eq=False)
class Rates:
    """What the actuators can: turn [rad/s], slide [m/s]; and how fast the tip may go, tip [m/s]."""

    turn: float = 1.0
    slide: float = 0.01
    tip: float = np.inf

    def __post_init__(self) -> None:
        for name in ("turn", "slide", "tip"):
            if not getattr(self, name) > 0.0:
                raise FieldError(name, getattr(self, name), "a rate above 0")

    def time(self, turn: Array, slide: Array, way: float) -> float:
        """Seconds that turns (N,) [rad] and slides (N,) [m] take while the tip goes ``way`` [m]."""
        return float(max(np.abs(turn).max() / self.turn, np.abs(slide).max() / self.slide, way / self.tip))


@dataclass(frozen=True, eq=False)
class Motion:
    """Joint values along a path of the tip.

    status, message : "reached" at its end, else why it cannot go on, and where.
    time (K,) [s], alpha (K, N) [rad], D (K, N) [m], tip (K, 3) [m], margin (K,) : straight lines lie between them.
    deviation (K,) : how far the tip is from the path [m], at each command and half-way from the one before.
    progress (K,) : along the path [m], of ``length``.
    approach : the way from the start to the first command, as in ``InverseResult``.
    """

    status: InverseStatus
    message: str
    time: Array
    alpha: Array
    D: Array
    tip: Array
    margin: Array
    deviation: Array
    progress: Array
    length: float
    approach: tuple[Step, ...]

    @property
    def success(self) -> bool:
        return self.status is InverseStatus.REACHED


class Polyline:
    """Corners (M, 3) [m] and what lies between."""

    def __init__(self, corners: ArrayLike) -> None:
        array = np.asarray(corners)
        fits = array.ndim == 2 and array.shape[1:] == (3,) and len(array) > 0 and array.dtype.kind in "iuf"
        if not fits or not np.isfinite(array).all():
            raise FieldError("waypoints", corners, "a table of finite numbers with 3 columns, at least a row")
        array = array.astype(np.float64)
        self.corners = array[np.append(True, np.linalg.norm(np.diff(array, axis=0), axis=1) > 0.0)]
        self.at_corner = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(self.corners, axis=0), axis=1)))

    @property
    def length(self) -> float:
        return float(self.at_corner[-1])

    def at(self, s: float) -> Array:
        """(3,) at the arc length s [m]."""
        return np.array([np.interp(s, self.at_corner, column) for column in self.corners.T])

    def stretch(self, s: float, step: float) -> float:
        """Where a step from s ends: not past the next corner."""
        corner = self.at_corner[np.searchsorted(self.at_corner, s + 1e-12 * max(self.length, 1.0), side="right") :]
        return float(min(s + step, corner[0])) if len(corner) else self.length


def distances(points: Array, line: Array) -> Array:
    """(P,) [m] from points (P, 3) to the nearest point of a polyline (M, 3)."""
    if len(line) == 1:
        return np.asarray(np.linalg.norm(points - line[0], axis=1))
    begin, along = line[:-1], np.diff(line, axis=0)
    square = np.maximum((along**2).sum(axis=1), 1e-300)
    share = np.clip(((points[:, None] - begin) * along).sum(axis=2) / square, 0.0, 1.0)
    return np.asarray(np.linalg.norm(points[:, None] - begin - share[..., None] * along, axis=2).min(axis=1))


class _Track:
    """Goes along a path and takes down where it has been."""

    def __init__(self, walker: Walker, search: InverseSearch, path: Polyline, tolerance: float, rates: Rates) -> None:
        self.walker, self._search, self._path = walker, search, path
        self._tolerance, self._rates = tolerance, rates
        self.rows: list[tuple[float, Step, Array, float, float]] = []
        self._take_down(0.0, 0.0, float(np.linalg.norm(walker.answer.tip.position - path.at(0.0))))

    @property
    def s(self) -> float:
        return self.rows[-1][4]

    def _take_down(self, time: float, s: float, deviation: float) -> None:
        self.rows.append((time, self.walker.way[-1], self.walker.answer.tip.position, deviation, s))

    def advance(self) -> tuple[InverseStatus, str]:
        """As far as it goes."""
        step = STRETCH
        while self.s < self._path.length:
            end = self._path.stretch(self.s, step)
            blocked = self._stretch(end)
            if blocked is None:
                step = min(2.0 * step, STRETCH)
                continue
            step = 0.5 * (end - self.s)
            late = blocked[0] is InverseStatus.TIMEOUT
            if late or step < SHORTEST * self._tolerance:
                return blocked[0], f"stopped at {1e3 * self.s:.6g} of {1e3 * self._path.length:.6g} mm: {blocked[1]}"
        return InverseStatus.REACHED, f"{len(self.rows)} commands, {self.rows[-1][0]:.3g} s"

    def _stretch(self, end: float) -> tuple[InverseStatus, str] | None:
        """To the arc length ``end`` of the path, in a straight line of commands; why not, if not."""
        aim = Aim(self._path.at(end), within=SHARE * self._tolerance)
        found = descend(self.walker.branch(), aim, self._search.bounds, STEPS)
        if found.end is not End.MET:
            return outcome(self._search.bounds, found)
        before, there = self.walker.answer, found.walker.answer
        straight = self.walker.branch()
        half = 0.5 * (before.alpha + there.alpha), 0.5 * (before.D + there.D)
        places, refusal = [], None
        for command in (half, (there.alpha, there.D)):
            refusal = refusal or straight.go(*command)
            places.append(straight.answer.tip.position)
        if refusal is not None:
            late = refusal is Refusal.TIMEOUT
            return InverseStatus.TIMEOUT if late else InverseStatus.SNAP, f"on the way on {refusal.value}"
        deviation = float(distances(np.array(places), np.array([self._path.at(self.s), self._path.at(end)])).max())
        if deviation > self._tolerance:
            return InverseStatus.NOT_CONVERGED, "between two commands the tip leaves the path"
        way = float(np.linalg.norm(straight.answer.tip.position - before.tip.position))
        self.walker = straight
        lasts = self._rates.time(there.alpha - before.alpha, there.D - before.D, way)
        self._take_down(self.rows[-1][0] + lasts, end, deviation)
        return None


def motion(search: InverseSearch, walker: Walker, waypoints: ArrayLike, tolerance: float, rates: Rates) -> Motion:
    """From where ``walker`` stands to the first of the waypoints (M, 3) [m], and along them, within the ``tolerance``
    [m].  See ``EquilibriumSolver.motion``."""
    path = Polyline(waypoints)
    first = search.search(Aim(path.corners[0], within=SHARE * tolerance), walker)
    there = Walker(search.solver, first.equilibrium, walker.floor, walker.deadline)
    track = _Track(there, search, path, tolerance, rates)
    if first.success:
        status, message = track.advance()
    else:
        status, message = first.status, f"the first waypoint is not reached: {first.message}"
    times, steps, tips, deviation, progress = zip(*track.rows, strict=True)
    return Motion(
        status, message, np.array(times), np.array([step.alpha for step in steps]),
        np.array([step.D for step in steps]), np.array(tips), np.array([step.margin for step in steps]),
        np.array(deviation), np.array(progress), path.length, first.way,
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Deployment:
    """How well a body keeps to its tip's track.

    stray (K,) [m] : the farthest that any place of the body is from where the tip, or the body at the start, has been;
    worst : the largest of them.  tip (K, 3) [m] : the track.
    """

    stray: Array
    tip: Array

    @property
    def worst(self) -> float:
        return float(self.stray.max())


def follow_the_leader(
    solver: EquilibriumSolver, alpha: ArrayLike, D: ArrayLike, loads: Loads | None, places: int
) -> Deployment:
    """See ``EquilibriumSolver.follow_the_leader``.  Raises ``FieldError`` where a command has no equilibrium."""
    other, tips, stray = solver.fork(), list[Array](), list[float]()
    body = np.empty((0, 3))
    for index, (angles, depths) in enumerate(zip(np.asarray(alpha), np.asarray(D), strict=True)):
        answer = other.solve(angles, depths, loads=loads)
        if not answer.success:
            raise FieldError(f"D[{index}]", depths.tolist(), "commands with an equilibrium", answer.message)
        shape = answer.backbone(places).position
        body = body if index else shape
        tips.append(answer.tip.position)
        stray.append(float(distances(shape, np.concatenate([body, np.array(tips)])).max()))
    return Deployment(np.array(stray), np.array(tips))
