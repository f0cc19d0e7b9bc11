"""Tubes under dead loads by collocation of all pieces at once, with ``scipy.integrate.solve_bvp``.

The same equations as ``loaded_model``, solved in another way: nothing is integrated from one end to the other, so no
error grows on the way.  It stops where scipy stops and says what scipy says: success tells neither the branch nor
whether the solution is stable.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from numpy.typing import NDArray
from scipy.integrate import solve_bvp

from ctr_pvs.oracles.loaded_equations import FRAME
from ctr_pvs.oracles.loaded_equations import MOMENT
from ctr_pvs.oracles.loaded_equations import PLACE
from ctr_pvs.oracles.loaded_equations import TUBES
from ctr_pvs.oracles.loaded_equations import LoadedProblem
from ctr_pvs.oracles.loaded_equations import Piece
from ctr_pvs.oracles.loaded_equations import after_loads
from ctr_pvs.oracles.loaded_equations import carried_over
from ctr_pvs.oracles.loaded_model import LoadedSolution
from ctr_pvs.robot.loads import Loads
from ctr_pvs.robot.robot import Robot

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class CollocatedSolution:
    """What solve_bvp made of one command under loads; where ``success`` is false, the state it stopped in.

    success, status, message, residual (largest relative r.m.s. residual of a mesh interval), nodes : scipy's own.
    tip (3,) [m]; torque (N,) : tau_alpha [N m]; base_moment (3,) : m(0+) [N m]; psi_tip (N,) [rad] at each tube's end.
    """

    success: bool
    status: int
    message: str
    residual: float
    nodes: int
    tip: Array
    torque: Array
    base_moment: Array
    psi_tip: Array


class LoadedCollocation:
    """The problem as one on x in [0, 1]: y (n, g) stacks the states of piece after piece, without their B; moments in
    the problem's unit."""

    def __init__(self, problem: LoadedProblem) -> None:
        self.problem, self.pieces = problem, problem.pieces
        *self.rows, self.n = np.cumsum([0, *(TUBES + 2 * piece.p for piece in self.pieces)]).tolist()

    def state(self, piece: Piece, y: Array) -> Array:
        """A piece's rows (15 + 2p, c) as its state (15 + 3p, c)."""
        out = np.concatenate([y, np.zeros((piece.p, y.shape[1]))])
        out[MOMENT] *= self.problem.unit
        out[piece.torque] *= self.problem.unit
        return out

    def scaled(self, piece: Piece, y: Array) -> Array:
        """The other way."""
        out = y[: TUBES + 2 * piece.p].copy()
        out[MOMENT] /= self.problem.unit
        out[piece.torque] /= self.problem.unit
        return out

    def split(self, y: Array) -> list[Array]:
        """Every piece's state (15 + 3p, c), of y (n, c)."""
        return [
            self.state(piece, y[row : row + TUBES + 2 * piece.p])
            for row, piece in zip(self.rows, self.pieces, strict=True)
        ]

    def rates(self, x: Array, y: Array) -> Array:
        """dy/dx (n, g)."""
        return np.concatenate(
            [
                self.scaled(piece, piece.length * piece.rates(piece.start + piece.length * x, state))
                for piece, state in zip(self.pieces, self.split(y), strict=True)
            ]
        )

    def conditions(self, start: Array, end: Array) -> Array:
        """(n,) what is left of the conditions, all of them of order one."""
        problem, unit, first = self.problem, self.problem.unit, self.pieces[0]
        starts, ends = self.split(start[:, None]), self.split(end[:, None])
        y = starts[0][:, 0]
        compliance = problem.guide_compliance[first.tubes]
        left = [y[FRAME] - np.eye(3).ravel(), y[PLACE]]
        left += [y[first.psi] - problem.alpha[first.tubes] - compliance * y[first.torque]]
        left += [np.array([y[MOMENT][0] - y[first.torque].sum()]) / unit]
        beyond = [after_loads(piece, state) for piece, state in zip(self.pieces, ends, strict=True)]
        for (piece, following), state, ahead in zip(
            itertools.pairwise(self.pieces), beyond[:-1], starts[1:], strict=True
        ):
            jump = carried_over(piece, following, state) - ahead
            left.append(self.scaled(following, jump)[:, 0])
        left += [state[piece.torque][piece.ends, 0] / unit for piece, state in zip(self.pieces, beyond, strict=True)]
        last = beyond[-1][:, 0]
        left.append(last[MOMENT] @ last[FRAME].reshape(3, 3)[:, 1:] / unit)
        return np.concatenate(left)

    def first_state(self, x: Array, guess: LoadedSolution | None) -> Array:
        """y (n, g) to start from: the guess's fields, or a straight robot without moments."""
        parts = []
        for piece in self.pieces:
            s = piece.start + piece.length * x
            y = np.zeros((piece.size, len(x)))
            if guess is None or not guess.stretches:
                y[FRAME], y[PLACE] = np.eye(3).reshape(9, 1), np.outer([1.0, 0.0, 0.0], s)
                y[piece.psi] = self.problem.alpha[piece.tubes, None]
            else:
                s = np.clip(s, 0.0, guess.problem.domain.length)
                y[FRAME], y[PLACE] = guess.frames(s).reshape(-1, 9).T, guess.centreline(s).T
                y[MOMENT] = guess.moment(s).T
                y[piece.psi] = np.nan_to_num(guess.angles_at(s).T[piece.tubes])
                y[piece.torque] = np.nan_to_num(guess.torques_at(s).T[piece.tubes])
            parts.append(self.scaled(piece, y))
        return np.concatenate(parts)


def solve_loaded_bvp(
    robot: Robot,
    alpha: ArrayLike,
    D: ArrayLike,
    loads: Loads | None = None,
    guess: LoadedSolution | None = None,
    tolerance: float = 1e-8,
    max_nodes: int = 2000,
    first_nodes: int = 11,
) -> CollocatedSolution:
    """Solves by collocation.

    Args:
        alpha, D: (N,) the command [rad], [m].
        loads: None is no load.
        guess: a solution whose fields to start from; None is a straight robot without moments.
        tolerance, max_nodes: of solve_bvp; first_nodes : of the even mesh it starts from.

    Raises:
        CommandError: for a command the robot cannot take.
        LoadError: for loads that cannot act there.
        ValueError: for a robot of which nothing is beyond the orifice.
    """
    problem = LoadedProblem(robot, alpha, D, Loads() if loads is None else loads)
    if not problem.pieces:
        raise ValueError(f"nothing is beyond the orifice at D = {problem.D.tolist()} m: there is nothing to solve")
    system, x = LoadedCollocation(problem), np.linspace(0.0, 1.0, first_nodes)
    result = solve_bvp(
        system.rates, system.conditions, x, system.first_state(x, guess), tol=tolerance, max_nodes=max_nodes
    )
    starts, ends = system.split(result.y[:, :1]), system.split(result.y[:, -1:])
    first = problem.pieces[0]
    torque = np.zeros(robot.n_tubes)
    torque[first.tubes] = -starts[0][first.torque, 0]
    psi = problem.alpha - problem.guide_compliance * torque
    for piece, state in zip(problem.pieces, ends, strict=True):
        psi[piece.tubes] = state[piece.psi, 0]
    return CollocatedSolution(
        bool(result.success),
        int(result.status),
        result.message,
        float(result.rms_residuals.max()),
        len(result.x),
        ends[-1][PLACE, 0],
        torque,
        starts[0][MOMENT, 0],
        psi,
    )
