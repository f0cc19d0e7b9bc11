"""Every equilibrium of a command, stable or not: listed completely where only two tubes pull at each other.

With one relative angle the equilibria are the points where the curve of ``tip_curve`` meets the command; none is
missed.  With more, they come from ``multistart``, which proves nothing; the answer says so.

Either way a rule of Morse's theory can tell that some are missing: the energy grows without bound in all directions of
q, so the equilibria with an even number of unstable directions are one more than those with an odd number.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from numpy.typing import NDArray

from ctr_pvs.continuation import DEGREES
from ctr_pvs.energy import TorsionEnergy
from ctr_pvs.equilibrium import Equilibrium
from ctr_pvs.errors import FieldError
from ctr_pvs.models import Models
from ctr_pvs.multistart import search
from ctr_pvs.oracles.tip_curve import DEPTH
from ctr_pvs.oracles.tip_curve import PairFold
from ctr_pvs.oracles.tip_curve import TipCurve
from ctr_pvs.oracles.tube_pair import TubePair
from ctr_pvs.oracles.tube_pair import materials_at
from ctr_pvs.oracles.tube_pair import tube_pair
from ctr_pvs.refine import INTEGRATION_SHARE
from ctr_pvs.refine import LOOSER
from ctr_pvs.refine import tip_position
from ctr_pvs.robot.robot import Robot
from ctr_pvs.solution import TorsionSolution
from ctr_pvs.solve import residual_limit
from ctr_pvs.solve import twist_size
from ctr_pvs.status import Status
from ctr_pvs.twist import TorqueField
from ctr_pvs.twist import TwistSpace
from ctr_pvs.unknowns import CONSTANT

Array = NDArray[np.float64]

#: An exact equilibrium may lie no farther than this [rad] from its guess ..
ROOM = 0.3
#: .. and no farther than this share of the way to the next guess.
SHARE_OF_GAP = 0.4
NEWTON_STEPS = 12
#: Degree of the twist rates with which many starts are tried.
SEARCH_DEGREE = DEGREES[0]


@dataclass(frozen=True, eq=False)
class Equilibria:
    """The equilibria of one command, by energy; unstable ones have a negative ``stability_margin``, the status
    NO_STABLE_EQUILIBRIUM, and a shape and loads like all others.

    complete : True only if the method leaves none out.
    consistent : False if Morse's rule proves that some are missing.
    method : how they were found, and what that guarantees, in one line.
    """

    found: tuple[Equilibrium, ...]
    complete: bool
    consistent: bool
    method: str

    @property
    def stable(self) -> tuple[Equilibrium, ...]:
        return tuple(one for one in self.found if one.success)


def equilibria(robot: Robot, alpha: ArrayLike, D: ArrayLike, tolerance: float = 1e-5) -> Equilibria:
    """All equilibria at base rotations ``alpha`` (N,) [rad] and base positions ``D`` (N,) [m].

    tolerance : tip error [m] that each may have.

    Angles are not wrapped: psi is told against the alpha given, though a robot cannot tell whole turns of a base.

    Raises ``CommandError`` for a command that the robot cannot take, ``FieldError`` for a wrong tolerance.
    """
    if not 1e-10 <= tolerance <= 1.0:
        raise FieldError("tolerance", tolerance, "a length from 1e-10 to 1 m")
    alpha, D = robot.check_command(alpha, D)
    polish = _Polish(Models(robot), alpha, D, float(tolerance))
    materials = polish.energy(SEARCH_DEGREE).materials
    if not materials.coupled.any():
        found = polish.exact([polish.energy(SEARCH_DEGREE).space.field(np.zeros(0))], np.array([ROOM]))
        return _sorted(found, 1, True, "no two curved tubes overlap, so no tube twists: there is exactly one")
    pair = tube_pair(materials)
    if pair is not None:
        return _of_pair(polish, pair)
    return _of_many(polish)


def tip_curve(robot: Robot, D: ArrayLike) -> TipCurve:
    """The curve of all equilibria at base positions ``D`` (N,) [m].

    Raises ``CommandError`` for a D that the robot cannot take, ``FieldError`` unless exactly two tubes are curved
    where they overlap.
    """
    pair = tube_pair(materials_at(robot, D))
    if pair is None:
        raise FieldError("D", np.asarray(D).tolist(), "base positions where exactly two pre-curved tubes overlap")
    return TipCurve(pair)


def folds(robot: Robot, D: ArrayLike) -> tuple[PairFold, ...]:
    """Where branches of equilibria end at ``D`` (N,) [m], over one period of the tip angle; raises like
    ``tip_curve``."""
    return tip_curve(robot, D).folds


def _of_pair(polish: _Polish, pair: TubePair) -> Equilibria:
    curve = TipCurve(pair)
    tips = curve.tips_at(float(polish.alpha[pair.b] - polish.alpha[pair.a]))
    gaps = np.diff(tips, prepend=-np.inf, append=np.inf)
    room = np.minimum(ROOM, SHARE_OF_GAP * np.minimum(gaps[:-1], gaps[1:]))
    found = polish.exact(_fields(curve, tips, polish.energy(DEGREES[-1]).space), room)
    method = (
        "integration from the tip: all equilibria lie on one curve, and every crossing with the command was taken; "
        f"folds between which the curve goes back by less than {DEPTH:g} rad could be missed"
    )
    if not curve.resolved:
        method += "; not complete: the pair is so strong that its curve could not be resolved everywhere"
    return _sorted(found, len(tips), curve.resolved, method)


def _fields(curve: TipCurve, tips: Array, space: TwistSpace) -> list[TorqueField]:
    """The torques along the robot for each tip angle (m,), in the functions of ``space``."""
    domain, sections = space.materials.domain, range(space.materials.domain.n_sections)
    bases = tuple(space.basis(m) if space.materials.coupled[m] else CONSTANT for m in sections)
    places = [domain.boundaries[m] + domain.lengths[m] * bases[m].rule.x for m in sections]
    torques = curve.integral.torques(tips, np.concatenate([np.zeros(1), *places]))
    guide, parts = torques[:, 0], np.split(torques[:, 1:], np.cumsum([len(s) for s in places])[:-1], axis=1)
    tables = [basis.tabulate(basis.rule.x)[0] * basis.rule.weights[:, None] for basis in bases]
    return [
        TorqueField(
            guide[i],
            domain.boundaries,
            bases,
            tuple(part[i].T @ table for part, table in zip(parts, tables, strict=True)),
            domain.topology,
        )
        for i in range(len(tips))
    ]


def _of_many(polish: _Polish) -> Equilibria:
    energy = polish.energy(SEARCH_DEGREE)
    result = search(energy, polish.alpha)
    fields = [energy.space.field(q) for q in result.found]
    found = polish.exact(fields, np.full(len(fields), ROOM))
    method = (
        f"search from {result.starts} starts, {result.converged} of which led to an equilibrium, to the rarest "
        f"{min(result.hits, default=0)} of them: not guaranteed complete"
    )
    return _sorted(found, len(fields), False, method)


def _sorted(found: list[_Found], expected: int, complete: bool, method: str) -> Equilibria:
    consistent = sum((-1) ** one.unstable_directions for one in found) == 1
    if len(found) < expected:
        complete = False
        method += f"; not complete: {expected - len(found)} could not be made exact"
    if not consistent:
        complete = False
        method += "; some are missing or at a fold, as the numbers of their unstable directions prove"
    answers = sorted((one.answer for one in found), key=lambda answer: answer.energy)
    return Equilibria(tuple(answers), complete, consistent, method)


@dataclass(frozen=True, eq=False)
class _Found:
    answer: Equilibrium
    unstable_directions: int


class _Polish:
    """Turns guesses into exact equilibria of the energy at one command, of a degree that meets the tolerance."""

    def __init__(self, models: Models, alpha: Array, D: Array, tolerance: float) -> None:
        self.models, self.alpha, self.D, self.tolerance = models, alpha, D, tolerance

    def energy(self, degree: int) -> TorsionEnergy:
        return self.models.energy(self.D, degree)

    def exact(self, guesses: list[TorqueField], room: Array) -> list[_Found]:
        """The equilibria next to ``guesses``, none farther than ``room`` (m,) [rad]; those that fail are left out."""
        found = [self._one(guess, float(reach)) for guess, reach in zip(guesses, room, strict=True)]
        return [one for one in found if one is not None]

    def _one(self, guess: TorqueField, room: float) -> _Found | None:
        before, best, spent = None, None, 0
        integration = LOOSER * INTEGRATION_SHARE * self.tolerance
        for degree in DEGREES:
            # Each degree sets out from the guess: that of a lower one may lie beyond a fold which it sees elsewhere.
            energy = self.energy(degree)
            state, residual, steps = stationary(energy, self.alpha, energy.space.coordinates(guess), room)
            spent += steps
            if state is None:
                before = None
                continue
            solution = TorsionSolution(energy, self.alpha, state)
            tip = tip_position(solution.shape, integration)
            integration = INTEGRATION_SHARE * self.tolerance
            if before is not None:
                estimate = float(np.linalg.norm(tip - before))
                best = self._told(solution, residual, estimate, spent)
                if estimate <= self.tolerance:
                    break
            before = tip
        return best

    def _told(self, solution: TorsionSolution, residual: float, estimate: float, spent: int) -> _Found:
        margin = solution.stability_margin()
        status, message = Status.OK, "stable equilibrium"
        if not margin > 0.0:
            status, message = Status.NO_STABLE_EQUILIBRIUM, f"an unstable equilibrium, stability margin {margin:.3g}"
        elif estimate > self.tolerance:
            status = Status.TOLERANCE_MISSED
            message = f"tip error about {estimate:.1e} m, {self.tolerance:.1e} m were asked for"
        answer = Equilibrium(
            self.alpha,
            self.D,
            status,
            message,
            self.tolerance,
            "torsion",
            known_estimate=estimate,
            residual=residual,
            iterations=spent,
            source=solution,
        )
        return _Found(answer, unstable_directions(solution))


def unstable_directions(solution: TorsionSolution) -> int:
    """Number of negative eigenvalues of the energy Hessian."""
    if solution.energy.n == 0:
        return 0
    _, hessian = solution.energy.derivatives(solution.q, solution.alpha)
    return int((np.linalg.eigvalsh(hessian) < 0.0).sum())


def stationary(energy: TorsionEnergy, alpha: Array, q: Array, room: float) -> tuple[Array | None, float, int]:
    """The equilibrium, of any kind, that Newton reaches from ``q`` (n,); its residual twist [rad]; the steps spent.

    None if it does not converge, or leaves ``q`` by more than ``room`` [rad].
    """
    start, limit, residual = q, residual_limit(alpha), np.inf
    if energy.n == 0:
        return q, 0.0, 0
    for steps in range(NEWTON_STEPS):
        gradient, hessian = energy.derivatives(q, alpha)
        residual = twist_size(energy, gradient)
        if residual <= limit:
            return q, residual, steps
        try:
            q = q - np.linalg.solve(hessian, gradient)
        except np.linalg.LinAlgError:
            return None, residual, steps
        if not twist_size(energy, q - start) <= room:
            return None, residual, steps
    return None, residual, NEWTON_STEPS
