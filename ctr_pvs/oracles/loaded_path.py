"""The way on which a robot comes to a command under loads: from its relaxed state, turned unloaded, then loaded.

Shooting knows no stability, so these are only short steps, each from the solution before: right wherever no fold lies
on the way, and stopped at one that Newton's method cannot step across.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.optimize import root

from ctr_pvs.model.basis import gauss_legendre
from ctr_pvs.oracles.loaded_equations import LoadedProblem
from ctr_pvs.oracles.loaded_model import LoadedSolution
from ctr_pvs.oracles.loaded_model import solve_loaded
from ctr_pvs.robot.loads import Loads
from ctr_pvs.robot.robot import Robot

Array = NDArray[np.float64]

ANGLE_STEP = 0.35  # rad
LOAD_STEP = 0.25  # of the load
#: A step may turn the tip by this much [rad], and is shortened down to this share of the path.
MOST_TURN, SHORTEST = 0.5, 0.05
#: Of the integration on the way, where the end is solved as asked for; in the search for the relaxed robot.
ROUGH, FINE = 1e-8, 1e-10


def relaxed_angles(robot: Robot, D: ArrayLike) -> Array:
    """alpha (N,) [rad] at which no tube carries torque without loads: downhill from 0 with rigid tubes, then exactly.

    The robot's turn as a whole, which no torque holds, is the one that keeps the angles' mean at 0.
    """
    problem = LoadedProblem(robot, np.zeros(robot.n_tubes), D, Loads())

    def energy(alpha: Array) -> float:
        return _rigid_energy(problem, alpha) / problem.unit

    def torque(alpha: Array) -> Array:
        return np.asarray(solve_loaded(robot, alpha, D, rtol=FINE).torque / problem.unit)

    rigid = minimize(energy, np.zeros(robot.n_tubes)).x
    found = root(torque, rigid, method="lm", options={"xtol": 1e-14, "ftol": 1e-14})
    return np.asarray(found.x - found.x.mean())


def _rigid_energy(problem: LoadedProblem, alpha: Array) -> float:
    """Bending energy [J] that depends on alpha (N,), with psi = alpha all along."""
    rule, energy = gauss_legendre(12), 0.0
    for piece in problem.pieces:
        s = piece.start + piece.length * rule.x
        kappa = problem.materials.pre_curvature(piece.section, s)[:, piece.tubes]
        shared = (kappa * np.exp(1j * alpha[piece.tubes])) @ piece.bending
        energy -= 0.5 * piece.length * float(rule.weights @ np.abs(shared) ** 2) / float(piece.bending.sum())
    return energy


def along_path(
    robot: Robot,
    alpha: ArrayLike,
    D: ArrayLike,
    loads: Loads | None = None,
    relaxed: ArrayLike | None = None,
    rtol: float = 1e-11,
) -> LoadedSolution:
    """The solution at a command under loads that a cold start is to find: the robot relaxed at its D, turned without
    loads on the straight path to alpha, loaded in proportion.

    Args:
        alpha, D: (N,) the command [rad], [m].
        relaxed: (N,) base angles [rad] to set out from; None looks for them.
        rtol: of the integration at the end.

    Raises:
        CommandError, LoadError: as ``solve_loaded``.
    """
    alpha, loads = np.asarray(alpha, dtype=float), Loads() if loads is None else loads
    LoadedProblem(robot, alpha, D, loads)  # raises now, not on the way
    begin = relaxed_angles(robot, D) if relaxed is None else np.asarray(relaxed, dtype=float)
    begin = begin + (alpha - begin).mean()  # turned as a whole, which changes nothing
    turn, ramp = alpha - begin, loads

    def turned(t: float, guess: LoadedSolution | None) -> LoadedSolution:
        return solve_loaded(robot, begin + t * turn, D, None, guess, ROUGH)

    def loaded(t: float, guess: LoadedSolution | None) -> LoadedSolution:
        return solve_loaded(robot, alpha, D, ramp.scaled(t), guess, ROUGH)

    solution = _follow(turned, turned(0.0, None), ANGLE_STEP / max(ANGLE_STEP, float(np.abs(turn).max())))
    if solution.success and not loads.is_none:
        solution = _follow(loaded, solution, LOAD_STEP)
    return solve_loaded(robot, alpha, D, loads, solution, rtol) if solution.success else solution


def _follow(
    solve: Callable[[float, LoadedSolution | None], LoadedSolution], solution: LoadedSolution, usual: float
) -> LoadedSolution:
    """``solve(1, ..)`` in steps of at most ``usual``; where they grow too short, the last solution, as a failure."""
    t, step = 0.0, usual
    while t < 1.0 and solution.success:
        target = min(1.0, t + step)
        ahead = solve(target, solution)
        if ahead.success and _turn(solution, ahead) <= MOST_TURN:
            solution, t, step = ahead, target, min(usual, 2.0 * step)
        elif step < SHORTEST * usual:
            return replace(solution, success=False, message=f"the path ends at {t:.4g} of it: a fold")
        else:
            step *= 0.5
    return solution


def _turn(a: LoadedSolution, b: LoadedSolution) -> float:
    """Angle [rad] between the tips' material frames."""
    return float(2.0 * np.arccos(min(1.0, abs(float(a.orientation @ b.orientation)))))
