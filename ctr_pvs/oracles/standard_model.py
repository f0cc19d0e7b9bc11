"""The boundary-value model the field uses, for comparison and as a test oracle; nothing the package serves imports it.

Two classic ways to solve the equations of ``standard_equations``: collocation of all sections at once
(``solve_standard_bvp``), and shooting from the orifice for the base torques that leave none at the tips
(``solve_standard_shooting``).  Both stop where scipy stops and say what scipy says: near folds they can report success
on another branch, or on an unstable one.  The centreline follows from R' = R hat(0, k_y, k_z), r' = R e_x.

Of the package's solver it uses only the robot and its materials, not its energy, basis, quadrature or backbone.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from collections.abc import Iterator
from dataclasses import dataclass
from dataclasses import field
from functools import cached_property
from typing import Literal
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike
from numpy.typing import NDArray
from scipy.integrate import OdeSolution
from scipy.integrate import solve_bvp
from scipy.integrate import solve_ivp
from scipy.optimize import root

from ctr_pvs.model.sections import SAME_PLACE
from ctr_pvs.oracles.standard_equations import Problem
from ctr_pvs.oracles.standard_equations import Section
from ctr_pvs.robot.robot import Robot

Array = NDArray[np.float64]
#: Of one section: psi (p, ...) [rad] at arc lengths s (...) [m].
Angles = Callable[[Array], Array]

#: Tolerances of the integration from curvature to tip: below those of the methods compared.
FRAME_RTOL, FRAME_ATOL = 1e-11, 1e-13
NOTHING_TO_SOLVE = "No two tubes outside: no torque."


class AngleField(Protocol):
    """Anything that knows twist angles: a ``StandardSolution``, or an equilibrium's ``shape``."""

    def angles_at(self, s: Array, /) -> Array:
        """psi (g, N) [rad] at arc lengths ``s`` (g,) [m], NaN past a tube's tip."""
        ...


@dataclass(frozen=True, eq=False)
class StandardSolution:
    """What one method made of one command; where ``success`` is false, the state it stopped in.

    alpha, D : (N,) the command [rad], [m].
    success, status, message : scipy's own.  Success tells neither the branch nor whether the solution is stable.
    torque : (N,) tau_alpha [N m]: what the actuators supply along +alpha, minus the torque at the tubes' bases.
    residual : what is left of the equations, as the method measures it.  Collocation: largest relative r.m.s. residual
        of a mesh interval.  Shooting: largest torque [N m] left at a tip.
    evaluations : right-hand sides evaluated, counted by places along s.
    nodes : mesh nodes, or integration steps of the last shot.

    The tip is not part of the solution: it is integrated when first asked for.
    """

    alpha: Array
    D: Array
    success: bool
    status: int
    message: str
    torque: Array
    residual: float
    evaluations: int
    nodes: int
    _problem: Problem = field(repr=False)
    _psi: tuple[Angles, ...] = field(repr=False)

    def angles_at(self, s: Array, /) -> Array:
        """psi (g, N) [rad] at arc lengths ``s`` (g,) [m], NaN past a tube's tip (the tip itself still counts).

        At the orifice and before it, every tube has the angle with which it leaves the guide or ends there.
        """
        s = np.asarray(s, dtype=float)
        domain = self._problem.domain
        psi = np.full((len(s), len(self.alpha)), np.nan)
        section = domain.locate(s)
        for m in np.unique(section) if self._psi else ():
            here = np.flatnonzero((section == m) & (s <= domain.length + SAME_PLACE))
            psi[np.ix_(here, self._problem.sections[m].tubes)] = self._psi[m](s[here]).T
        psi[s <= 0.0] = self.alpha - self._problem.guide_compliance * self.torque
        return psi

    @cached_property
    def tip(self) -> Array:
        """Position (3,) [m] of the farthest tip in the base frame."""
        state = np.concatenate([np.eye(3).ravel(), np.zeros(3)])
        for part, angles in zip(self._problem.sections, self._psi, strict=True):

            def slope(s: float, state: Array, part: Section = part, angles: Angles = angles) -> Array:
                k = complex(part.curvature(np.array(s), angles(np.array(s))))
                hat = np.array([[0.0, -k.imag, k.real], [k.imag, 0.0, 0.0], [-k.real, 0.0, 0.0]])
                frame = state[:9].reshape(3, 3)
                return np.concatenate([(frame @ hat).ravel(), frame[:, 0]])

            state = solve_ivp(slope, part.span, state, method="DOP853", rtol=FRAME_RTOL, atol=FRAME_ATOL).y[:, -1]
        return state[9:]


def solve_standard_bvp(
    robot: Robot,
    alpha: ArrayLike,
    D: ArrayLike,
    tolerance: float = 1e-8,
    guess: AngleField | None = None,
    max_nodes: int = 5000,
    first_nodes: int = 11,
) -> StandardSolution:
    """Solves by ``scipy.integrate.solve_bvp``: collocation of all sections at once, each mapped onto [0, 1].

    Args:
        alpha, D: (N,) the command [rad], [m].
        tolerance: ``tol`` of solve_bvp: relative residual of the equations, not an error of tip or angles.
        guess: where to start, a solution of either method or an equilibrium's ``shape``; None is zero twist,
            psi = alpha.
        max_nodes: of the mesh, which scipy refines but never thins out.
        first_nodes: of the even mesh it starts from.  The mesh of the guess is not kept: along a path it would only
            grow, and a fine mesh was seen to fail before the fold.

    Raises:
        CommandError: for a command the robot cannot take.
    """
    problem = Problem(robot, alpha, D)
    torque = np.zeros(robot.n_tubes)
    if not problem.sections:
        return StandardSolution(problem.alpha, problem.D, True, 0, NOTHING_TO_SOLVE, torque, 0.0, 0, 0, problem, ())
    system = Collocation(problem)
    x = np.linspace(0.0, 1.0, first_nodes)
    result = solve_bvp(
        system.rates,
        system.conditions,
        x,
        system.first_state(x, guess),
        fun_jac=system.jacobian,
        bc_jac=system.conditions_jacobian,
        tol=tolerance,
        max_nodes=max_nodes,
    )

    def angles(part: Section, row: int) -> Angles:
        return lambda s: result.sol((s - part.start) / part.length)[row : row + part.p]

    p = problem.sections[0].p
    torque[problem.present] = -problem.torque_unit * result.y[p : 2 * p, 0]
    return StandardSolution(
        problem.alpha,
        problem.D,
        bool(result.success),
        int(result.status),
        result.message,
        torque,
        float(result.rms_residuals.max()),
        system.evaluations,
        len(result.x),
        problem,
        tuple(angles(part, row) for part, row in zip(problem.sections, system.rows, strict=True)),
    )


class Collocation:
    """The multi-section problem as one on x in [0, 1]: y (n, g) stacks the states of section after section.

    All conditions are linear, ``at_start @ y(0) + at_end @ y(1) = right``, so their Jacobian is constant.
    """

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.evaluations = 0
        *self.rows, self.n = np.cumsum([0, *(2 * part.p for part in problem.sections)]).tolist()
        self.at_start, self.at_end, self.right = self._conditions()

    def _conditions(self) -> tuple[Array, Array, Array]:
        problem, sections = self.problem, self.problem.sections
        at_start, at_end, right = np.zeros((self.n, self.n)), np.zeros((self.n, self.n)), np.zeros(self.n)
        p = sections[0].p
        base = np.arange(p)
        at_start[base, base] = 1.0
        at_start[base, p + base] = -problem.guide_compliance[problem.present] * problem.torque_unit
        right[base] = problem.alpha[problem.present]
        condition = itertools.count(p)
        for m, part in enumerate(sections):
            following = sections[m + 1].tubes.tolist() if m + 1 < len(sections) else []
            for i, tube in enumerate(part.tubes.tolist()):
                angle, torque = self.rows[m] + i, self.rows[m] + part.p + i
                if tube not in following:  # it ends here
                    at_end[next(condition), torque] = 1.0
                    continue
                angle_after = self.rows[m + 1] + following.index(tube)
                for before, after in ((angle, angle_after), (torque, angle_after + len(following))):
                    c = next(condition)
                    at_end[c, before], at_start[c, after] = 1.0, -1.0
        return at_start, at_end, right

    def _split(self, x: Array, y: Array) -> Iterator[tuple[slice, Section, Array, Array]]:
        """Rows, section, arc lengths s (g,) [m] and state (2p, g) of every section."""
        for row, part in zip(self.rows, self.problem.sections, strict=True):
            rows = slice(row, row + 2 * part.p)
            yield rows, part, part.start + part.length * x, y[rows]

    def rates(self, x: Array, y: Array) -> Array:
        """dy/dx (n, g)."""
        self.evaluations += len(x)
        return np.concatenate([part.length * part.rates(s, here) for _, part, s, here in self._split(x, y)])

    def jacobian(self, x: Array, y: Array) -> Array:
        """d(dy/dx)/dy (n, n, g), a block for each section."""
        out = np.zeros((self.n, self.n, len(x)))
        for rows, part, s, here in self._split(x, y):
            out[rows, rows] = part.length * part.jacobian(s, here)
        return out

    def conditions(self, start: Array, end: Array) -> Array:
        """(n,) what is left of the conditions."""
        return self.at_start @ start + self.at_end @ end - self.right

    def conditions_jacobian(self, start: Array, end: Array) -> tuple[Array, Array]:
        """Derivatives (n, n) of ``conditions`` by y(0) and y(1)."""
        return self.at_start, self.at_end

    def first_state(self, x: Array, guess: AngleField | None) -> Array:
        """y (n, g) to start from on the mesh ``x`` (g,): the guess's angles, and torques from their slope."""
        y = np.zeros((self.n, len(x)))
        last = self.problem.alpha[None]
        for _, part, s, here in self._split(x, y):
            if guess is not None:
                last = _held(np.concatenate([last[-1:], guess.angles_at(s)]))[1:]
            here[: part.p] = last[:, part.tubes].T
            here[part.p :] = np.gradient(here[: part.p], s, axis=1) / part.compliance[:, None]
        return y


def _held(psi: Array) -> Array:
    """psi (g, N) with the angle before in place of NaN: tubes of a guess for other D may end earlier."""
    for before, after in itertools.pairwise(psi):
        after[:] = np.where(np.isnan(after), before, after)
    return psi


def solve_standard_shooting(
    robot: Robot,
    alpha: ArrayLike,
    D: ArrayLike,
    rtol: float = 1e-10,
    guess: ArrayLike | None = None,
    method: Literal["hybr", "lm"] = "hybr",
    integrator: Literal["DOP853", "RK45"] = "DOP853",
) -> StandardSolution:
    """Solves by ``scipy.optimize.root`` over shots with ``scipy.integrate.solve_ivp``, from the orifice to the tips.

    The unknowns are the base torques of all tubes outside but the innermost, whose own makes their sum zero; the
    equations, that no torque is left at the tips.  Their Jacobian comes from the variational equations.  With "lm", a
    least torque that is not zero is a success too: see ``residual``.

    Args:
        alpha, D: (N,) the command [rad], [m].
        rtol: of the integration.
        guess: (N,) tau_alpha [N m] to start from, as ``torque`` of any solution; None is zero.
        method, integrator: of ``root``, which keeps its own tolerance, and of ``solve_ivp``.

    Raises:
        CommandError: for a command the robot cannot take.
    """
    problem = Problem(robot, alpha, D)
    shooting = Shooting(problem, rtol, integrator)
    free = np.zeros(shooting.n)
    success, status, message = True, 1, NOTHING_TO_SOLVE
    if shooting.n:
        if guess is not None:
            free = -np.asarray(guess, dtype=float)[problem.present[:-1]] / problem.torque_unit
        result = root(shooting.residual, free, method=method, jac=shooting.jacobian)
        free, success, status, message = result.x, bool(result.success), int(result.status), result.message
    end, torque, runs = shooting.shoot(free, dense=True)

    def angles(part: Section, run: OdeSolution) -> Angles:
        return lambda s: run(s)[: part.p]

    return StandardSolution(
        problem.alpha,
        problem.D,
        success,
        status,
        message,
        -problem.torque_unit * torque,
        problem.torque_unit * float(np.abs(end).max()),
        shooting.evaluations,
        sum(run.n_segments for run in runs),
        problem,
        tuple(angles(part, run) for part, run in zip(problem.sections, runs, strict=True)),
    )


class Shooting:
    """Tip torques as a function of the n free base torques, all in units of the problem's torque unit."""

    def __init__(self, problem: Problem, rtol: float, integrator: Literal["DOP853", "RK45"]) -> None:
        self.problem, self.rtol, self.integrator = problem, rtol, integrator
        self.n = max(len(problem.present) - 1, 0)
        self.evaluations = 0

    def residual(self, free: Array) -> Array:
        """(n,) torques left at the tips."""
        return self.shoot(free)[0][self.problem.present[:-1], 0]

    def jacobian(self, free: Array) -> Array:
        """(n, n) derivative of ``residual``."""
        return self.shoot(free, vary=True)[0][self.problem.present[:-1], 1:]

    def shoot(self, free: Array, vary: bool = False, dense: bool = False) -> tuple[Array, Array, list[OdeSolution]]:
        """Torque (N, 1) at the tubes' tips, or (N, 1 + n) with derivatives; base torque (N,); dense output if asked."""
        problem, tubes = self.problem, self.problem.present
        torque = np.zeros((len(problem.alpha), 1 + self.n if vary else 1))
        torque[tubes[:-1]] = np.column_stack([free, np.eye(self.n)])[:, : torque.shape[1]]
        torque[tubes[-1:]] = -torque.sum(axis=0)
        base = torque[:, 0].copy()
        psi = problem.torque_unit * problem.guide_compliance[:, None] * torque
        psi[:, 0] += problem.alpha
        runs = []
        for part in problem.sections:
            state = np.concatenate([psi[part.tubes], torque[part.tubes]])

            def slope(s: float, y: Array, part: Section = part, shape: tuple[int, ...] = state.shape) -> Array:
                y = y.reshape(shape)
                rates = part.rates(np.array(s), y[:, 0])
                if shape[1] == 1:
                    return rates
                return np.column_stack([rates, part.jacobian(np.array(s), y[:, 0]) @ y[:, 1:]]).ravel()

            run = solve_ivp(
                slope, part.span, state.ravel(), self.integrator, dense_output=dense, rtol=self.rtol, atol=self.rtol
            )
            self.evaluations += run.nfev
            psi[part.tubes], torque[part.tubes] = np.split(run.y[:, -1].reshape(state.shape), 2)
            if run.sol is not None:
                runs.append(run.sol)
        return torque, base, runs
