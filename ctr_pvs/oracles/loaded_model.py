"""Tubes under dead loads by shooting, for comparison and as a test oracle; nothing the package serves imports it.

The equations of ``loaded_equations`` are integrated from the orifice; the unknown bending moment there and the tubes'
base torques leave, at the right values, no torque at any tube's end and no bending moment beyond the tip.  Newton's
method, its Jacobian exact by complex steps that all go through one integration.

It finds one solution of the equations, near where it starts: neither its branch nor its stability is known.
``along_path`` goes to a command and its loads as a robot would, in steps short enough to stay on one branch.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from dataclasses import field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from numpy.typing import NDArray
from scipy.integrate import OdeSolution
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from ctr_pvs.model.sections import SAME_PLACE
from ctr_pvs.oracles.loaded_equations import FRAME
from ctr_pvs.oracles.loaded_equations import MOMENT
from ctr_pvs.oracles.loaded_equations import PLACE
from ctr_pvs.oracles.loaded_equations import Field
from ctr_pvs.oracles.loaded_equations import LoadedProblem
from ctr_pvs.oracles.loaded_equations import Piece
from ctr_pvs.oracles.loaded_equations import after_loads
from ctr_pvs.oracles.loaded_equations import carried_over
from ctr_pvs.robot.loads import Loads
from ctr_pvs.robot.robot import Robot

Array = NDArray[np.float64]

#: Of the complex steps: far below rounding, so that they cost no digits.
COMPLEX_STEP = 1e-40
#: Integration steps in a piece, at least: complex steps are too small for the integrator to see their errors, and next
#: to a straight robot it would take one.
FEWEST = 3
MOST_STEPS = 40
#: Share of a Newton step below which it is given up.
SMALLEST = 1e-2
#: A full Newton step may change moments by this much, in units of what bends the robot by one radian.
MOST_CHANGE = 1.0
#: What may be left of the conditions, relative to the integration's tolerance.
SLACK = 100.0
CONVERGED, NO_DESCENT, SINGULAR, TOO_MANY = range(4)
MESSAGES = (
    "converged",
    "no step leaves less of the conditions",
    "the conditions do not determine the moments: a fold, or next to one",
    f"more than {MOST_STEPS} Newton steps",
)


@dataclass(frozen=True, eq=False)
class Stretch:
    """One piece of a solution: its states y (15 + 3p,) at start and end, before what jumps there, and in between."""

    piece: Piece
    begin: Array
    end: Array
    between: OdeSolution = field(repr=False)


@dataclass(frozen=True, eq=False)
class LoadedSolution:
    """What shooting made of one command under loads; where ``success`` is false, the state it stopped in.

    alpha, D : (N,) the command [rad], [m]; problem : with its loads.
    success, status, message : of Newton's method.  Success tells neither the branch nor whether the solution is stable.
    residual : largest moment [N m] left at a tube's end or beyond the tip.
    iterations : Newton steps.  base_torque (N,) : T_j(0), 0 for tubes in the guide; base_moment (3,) : m(0+) [N m].
    """

    alpha: Array
    D: Array
    problem: LoadedProblem
    success: bool
    status: int
    message: str
    residual: float
    iterations: int
    base_torque: Array
    base_moment: Array
    stretches: tuple[Stretch, ...] = field(repr=False)

    @property
    def torque(self) -> Array:
        """tau_alpha (N,) [N m]: what the actuators supply along +alpha."""
        return -self.base_torque

    @property
    def base_force(self) -> Array:
        """n(0+) (3,) [N]: all forces beyond the orifice."""
        pieces = self.problem.pieces
        return pieces[0].force(pieces[0].start) if pieces else np.zeros(3)

    @property
    def tip(self) -> Array:
        """Position (3,) [m] of the farthest tip."""
        return self.stretches[-1].end[PLACE] if self.stretches else np.zeros(3)

    @property
    def psi_tip(self) -> Array:
        """psi (N,) [rad] at each tube's own end; of a tube in the guide, at the orifice."""
        psi = self.alpha + self.problem.guide_compliance * self.base_torque
        for stretch in self.stretches:
            psi[stretch.piece.tubes] = stretch.end[stretch.piece.psi]
        return psi

    @cached_property
    def orientation(self) -> Array:
        """Unit quaternion x, y, z, w (4,) of the farthest tube's material frame at the tip."""
        frame = self.stretches[-1].end[FRAME].reshape(3, 3) if self.stretches else np.eye(3)
        roll = Rotation.from_rotvec([self.psi_tip[self.problem.leader], 0.0, 0.0])
        return np.asarray((Rotation.from_matrix(frame) * roll).as_quat())

    def _each(self, s: ArrayLike, read: Callable[[Stretch, Array, Array], Array]) -> Array:
        """``read(stretch, s, y)`` (n, g) of every stretch, put together for all ``s`` (g,), as (g, n)."""
        s = np.asarray(s, dtype=float)
        ends = np.array([stretch.piece.end for stretch in self.stretches])
        index = np.clip(np.searchsorted(ends, s - SAME_PLACE), 0, len(ends) - 1)
        parts = {i: np.flatnonzero(index == i) for i in np.unique(index).tolist()}
        values = {i: read(self.stretches[i], s[here], self.stretches[i].between(s[here])) for i, here in parts.items()}
        out = np.empty((len(s), len(next(iter(values.values())))))
        for i, here in parts.items():
            out[here] = values[i].T
        return out

    def centreline(self, s: ArrayLike) -> Array:
        """Positions (g, 3) [m] at arc lengths ``s`` (g,) [m]."""
        return self._each(s, lambda stretch, s, y: y[PLACE])

    def frames(self, s: ArrayLike) -> Array:
        """Bishop frames R (g, 3, 3) at arc lengths ``s`` (g,) [m]."""
        return self._each(s, lambda stretch, s, y: y[FRAME]).reshape(-1, 3, 3)

    def moment(self, s: ArrayLike) -> Array:
        """m (g, 3) [N m] of all tubes, in the base frame, at arc lengths ``s`` (g,) [m]."""
        return self._each(s, lambda stretch, s, y: y[MOMENT])

    def angles_at(self, s: ArrayLike) -> Array:
        """psi (g, N) [rad] at arc lengths ``s`` (g,) [m], NaN past a tube's tip (the tip itself still counts)."""

        return self._each(s, lambda stretch, s, y: self._of_tubes(stretch, y[stretch.piece.psi]))

    def torques_at(self, s: ArrayLike) -> Array:
        """T_j (g, N) [N m] at arc lengths ``s`` (g,) [m], NaN past a tube's tip."""
        return self._each(s, lambda stretch, s, y: self._of_tubes(stretch, y[stretch.piece.torque]))

    def _of_tubes(self, stretch: Stretch, rows: Array) -> Array:
        out = np.full((len(self.alpha), rows.shape[1]), np.nan)
        out[stretch.piece.tubes] = rows
        return out


class LoadedShooting:
    """What is left of the conditions as a function of z (n,): m_perp(0), T_j(0) of the tubes beyond the orifice, in
    the problem's unit."""

    def __init__(self, problem: LoadedProblem, rtol: float) -> None:
        self.problem, self.rtol = problem, rtol
        self.n = 2 + len(problem.present)

    def start(self, z: Field) -> Field:
        """y (15 + 3p, c) just beyond the orifice, for z (n, c)."""
        problem, first = self.problem, self.problem.pieces[0]
        y = np.zeros((first.size, z.shape[1]), dtype=z.dtype)
        y[FRAME] = np.eye(3).reshape(9, 1)
        torque = problem.unit * z[2:]
        y[MOMENT] = np.concatenate([torque.sum(axis=0)[None], problem.unit * z[:2]])
        y[first.torque] = torque
        compliance, alpha = problem.guide_compliance[first.tubes], problem.alpha[first.tubes]
        y[first.psi] = alpha[:, None] + compliance[:, None] * torque
        return y

    def shoot(self, z: Field, dense: bool = False) -> tuple[Field, list[Stretch]]:
        """(n, c) what is left, for z (n, c) real or complex; with ``dense`` the states of the first column."""
        y, left, stretches = self.start(z), [], []
        pieces = self.problem.pieces
        for index, piece in enumerate(pieces):
            begin, shape = y, y.shape

            def slope(s: float, y: Field, piece: Piece = piece, shape: tuple[int, ...] = shape) -> Field:
                return piece.rates(s, y.reshape(shape)).ravel()

            run = solve_ivp(
                slope,
                (piece.start, piece.end),
                y.ravel(),
                "DOP853",
                dense_output=dense,
                max_step=piece.length / FEWEST,
                rtol=self.rtol,
                atol=1e-3 * self.rtol,
            )
            y = run.y[:, -1].reshape(shape)
            if run.sol is not None:
                stretches.append(Stretch(piece, begin[:, 0].copy(), y[:, 0].copy(), run.sol))
            y = after_loads(piece, y)
            left.append(y[piece.torque][piece.ends])
            if index + 1 < len(pieces):
                y = carried_over(piece, pieces[index + 1], y)
        R = y[FRAME].reshape(3, 3, -1)
        left.append(np.stack([(y[MOMENT] * R[:, 1]).sum(axis=0), (y[MOMENT] * R[:, 2]).sum(axis=0)]))
        return np.concatenate(left) / self.problem.unit, stretches

    def linearised(self, z: Array) -> tuple[Array, Array]:
        """What is left (n,) and its Jacobian (n, n)."""
        left, _ = self.shoot(z[:, None] + 1j * COMPLEX_STEP * np.eye(self.n))
        return left[:, 0].real, left.imag / COMPLEX_STEP

    def newton(self, z: Array) -> tuple[Array, int, int]:
        """z (n,) where the damped Newton method stops, why (an index into ``MESSAGES``), and its steps."""
        left, slope = self.linearised(z)
        for steps in range(MOST_STEPS):
            try:
                change = -np.linalg.solve(slope, left)
            except np.linalg.LinAlgError:
                return z, SINGULAR, steps
            if np.abs(left).max() <= SLACK * self.rtol:
                return z + change, CONVERGED, steps + 1
            factor = min(1.0, MOST_CHANGE / np.abs(change).max())
            while True:
                tried = z + factor * change
                left_there, slope_there = self.linearised(tried)
                if np.linalg.norm(left_there) < np.linalg.norm(left):
                    break
                factor *= 0.5
                if factor < SMALLEST:
                    return z, NO_DESCENT, steps
            z, left, slope = tried, left_there, slope_there
        return z, TOO_MANY, MOST_STEPS


def solve_loaded(
    robot: Robot,
    alpha: ArrayLike,
    D: ArrayLike,
    loads: Loads | None = None,
    guess: LoadedSolution | None = None,
    rtol: float = 1e-11,
) -> LoadedSolution:
    """Solves by shooting.

    Args:
        alpha, D: (N,) the command [rad], [m].
        loads: None is no load.
        guess: a solution whose moments at the orifice to start from; None is zero moments.
        rtol: of the integration, at least 3e-14.

    Raises:
        CommandError: for a command the robot cannot take.
        LoadError: for loads that cannot act there.
    """
    problem = LoadedProblem(robot, alpha, D, Loads() if loads is None else loads)
    torque = np.zeros(robot.n_tubes)
    if not problem.pieces:
        return LoadedSolution(
            problem.alpha, problem.D, problem, True, CONVERGED, MESSAGES[CONVERGED], 0.0, 0, torque, np.zeros(3), ()
        )
    shooting = LoadedShooting(problem, rtol)
    z = np.zeros(shooting.n)
    if guess is not None:
        z = np.concatenate([guess.base_moment[1:], guess.base_torque[problem.present]]) / problem.unit
    z, status, iterations = shooting.newton(z)
    left, stretches = shooting.shoot(z[:, None], dense=True)
    torque[problem.present] = problem.unit * z[2:]
    return LoadedSolution(
        problem.alpha,
        problem.D,
        problem,
        status == CONVERGED,
        status,
        MESSAGES[status],
        problem.unit * float(np.abs(left).max()),
        iterations,
        torque,
        np.array([torque.sum(), *(problem.unit * z[:2])]),
        tuple(stretches),
    )
