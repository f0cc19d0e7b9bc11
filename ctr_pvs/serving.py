"""A model of one D and one choice of degrees, prepared so that a warm solve takes a few array operations.

The unknowns are split in two: those *solved for*, and those of two polynomial degrees more, which only *check* the
answer.  A check factorises the Hessian of all of them.  So it sees a fold that the coarser model would miss, and one
Newton step of the finer model is the estimate of what the coarser one leaves out.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable
from collections.abc import Hashable
from functools import lru_cache
from typing import Any
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.blas import dasum
from scipy.linalg.blas import daxpy
from scipy.linalg.blas import dnrm2
from scipy.linalg.blas import idamax
from scipy.linalg.lapack import dppsv
from scipy.linalg.lapack import dpptrf
from scipy.linalg.lapack import dsyevd

from ctr_pvs.convexity import REACH
from ctr_pvs.convexity import least_cosines
from ctr_pvs.energy import TorsionEnergy
from ctr_pvs.fidelity import ellipse
from ctr_pvs.fidelity import tip_share
from ctr_pvs.lazy import lazy
from ctr_pvs.pair_form import PackedForm
from ctr_pvs.pair_form import Pairs
from ctr_pvs.solve import CONTRACTION
from ctr_pvs.solve import RESIDUAL_TWIST
from ctr_pvs.solve import residual_limit
from ctr_pvs.swing import tip_weights
from ctr_pvs.twist import Degrees
from ctr_pvs.unknowns import KEPT
from ctr_pvs.unknowns import Unknowns

Array = NDArray[np.float64]
T = TypeVar("T")

#: The check adds this many polynomial degrees: a Ritz value of low degree is optimistic.
FINER = 2
#: A Newton step shorter than this [rad] leaves about its square: time to look at the residual.
LAST_STEP = 2e-6
MOST_STEPS = 8
#: Largest change [rad] of the angle between two tubes in one step.
LARGEST_TURN = 1.0


def raised(degree: Degrees) -> Degrees:
    """The degrees that check ``degree``."""
    return degree + FINER if isinstance(degree, int) else tuple(d + FINER for d in degree)


class Served:
    """A stable equilibrium of ``model`` with all that the next step from it needs.

    z : (n + N + 1,) unknowns, base angles and 1.  angles : of ``Pairs.waves``.  answers : (N, n) minus dq / d alpha.
    residual : bound of the twist [rad] that the unbalanced torque would cause.
    change : (n + extra,) minus the Newton step of the finer model.
    bound : of the motion [m] of any point of the backbone by it; infinite where it is too long to be believed.
    """

    __slots__ = ("angles", "answers", "bound", "change", "iterations", "model", "residual", "z")

    def __init__(
        self, model: ServingModel, z: Array, angles: Array, residual: float, change: Array, bound: float
    ) -> None:
        self.model, self.z, self.angles, self.residual = model, z, angles, residual
        self.change, self.bound = change, bound
        self.answers, self.iterations = model.no_answers, 0

    @property
    def tip_estimate(self) -> float:
        """Estimate of the tip error [m]: as ``bound``, but high degrees count for as little as they do for the tip."""
        if self.model.n == 0:
            return 0.0
        return float(dasum(self.model.weights.dot(self.model.tip_shares * self.change)))

    @property
    def alpha(self) -> Array:
        return self.z[self.model.n : -1]

    @property
    def q(self) -> Array:
        """The unknowns in the order of ``model.energy``, those that only check being zero."""
        return self.model.spread(self.z[: self.model.n])


class ServingModel:
    """Tables of one D for unknowns of ``degree``; n : number of unknowns solved for.

    energy : of two degrees more.  weights (W, n + extra) turn a change of the unknowns into motions [m] of the backbone
    that add up to a bound of the motion of any of its points, the tip among them.
    """

    def __init__(self, energy: TorsionEnergy, degree: tuple[int, ...]) -> None:
        self.energy, self.degree = energy, degree
        self.order, self.n = _order(energy.space.unknowns)
        self.finer = energy.n
        self.pairs = Pairs(energy, self.order)
        self.rows = len(self.pairs.amplitude)
        self.waves = self.pairs.waves(self.n)
        self.check_form = PackedForm(self.pairs, self.finer, tangents=False)
        self.form = PackedForm(self.pairs, self.n, tangents=True)
        self.weights = tip_weights(energy)[:, self.order]
        squares = energy.space.unknowns.nodes.squares.dot((energy.space.modes**2).T)
        self.twist_norm = math.sqrt(squares.max(initial=0.0))
        self.tubes = energy.materials.robot.n_tubes
        self.no_answers = np.zeros((self.tubes, self.n))
        self._prepared: dict[Hashable, Any] = {}
        self._first_twist = self._twist_at_first_order()

    @lazy
    def tip_shares(self) -> Array:
        """(n + extra,) how much of a change of each unknown is let count for the tip: all of those solved for."""
        shares = np.ones(self.finer)
        for block in self.energy.space.blocks:
            if block.basis.degree:
                degree = np.tile(np.arange(block.basis.degree + 1), block.frame.shape[1] * block.basis.panels)
                shares[block.columns] = tip_share(ellipse(self.energy.materials, block.section), degree)
        shares = shares[self.order]
        shares[: self.n] = 1.0
        return shares

    def _twist_at_first_order(self) -> list[tuple[int, int, float, float]]:
        """Per pair of tubes: strength [m] and phase of the sine that tells how far twist moves the tip at first order.

        The twist that torsional stiffness alone would hold, as if the coupling held it as much as it can at best: so
        that rather too many states are looked at again.
        """
        turned = self.pairs.map[:, : self.n].T
        strength = np.abs(self.weights[:, : self.n].dot(turned)).sum(axis=0)
        stiffest = 1.0 + float((turned * turned).dot(self.pairs.amplitude).sum())
        waves = self.pairs.wave * (strength / stiffest)
        totals = self.pairs.member.dot(waves).tolist()
        return [(*ij, *cmath.polar(total)) for ij, total in zip(self.pairs.tubes, totals, strict=True) if total]

    def prepare(self, what: Hashable, make: Callable[[ServingModel], T]) -> T:
        """Tables that an output needs of this model, made by ``make`` when first asked for."""
        if what not in self._prepared:
            self._prepared[what] = make(self)
        made: T = self._prepared[what]
        return made

    def spread(self, q: Array) -> Array:
        out = np.zeros(self.finer)
        out[self.order[: len(q)]] = q
        return out

    def start(self, q: Array, alpha: Array) -> Array:
        """z for unknowns in the order of ``energy``."""
        z = np.empty(self.n + self.tubes + 1)
        z[: self.n] = q.take(self.order[: self.n])
        z[self.n : -1] = alpha
        z[-1] = 1.0
        return z

    def solve(self, z: Array, before: Array | None, slack: float) -> Served | None:
        """Newton from ``z``, changed in place, to the equilibrium of its base angles, and the check.

        before : angles of the state whose branch must not be left, or None for any stable state.
        slack : [rad] by which the finer model may differ from this one.

        None if Newton leaves its basin, or if the energy is not certainly convex, at the finer degree, around both
        states.
        """
        n, waves, size = self.n, self.waves, self.form.size
        if n == 0:
            return self._check(z, None, slack)
        previous, iteration = np.inf, 0
        while iteration < MOST_STEPS:
            out = self.form.terms(np.sin(waves.dot(z)))
            daxpy(z, out, n, 1.0, 0, 1, size)  # the gradient
            _, info = dppsv(n, out, out[size:].reshape(self.form.sides, n).T, 0, 1)
            if info:
                return None
            daxpy(out, z, n, -1.0, size)
            iteration += 1
            twist = self.twist_norm * dnrm2(out, n, size)
            if twist > LAST_STEP:
                if iteration > 1 and not twist < CONTRACTION * previous:
                    return None
                previous = twist
                continue
            served = self._check(z, before, slack)
            if served is None:
                return None
            if served.residual <= RESIDUAL_TWIST or served.residual <= residual_limit(z[n:-1]):
                served.answers, served.iterations = out[size + n :].reshape(-1, n), iteration
                return served
        return None

    def convex_around(self, angles: Array, reach: float) -> bool:
        """True if the energy is certainly convex, at the finer degree, within ``reach`` [rad] of ``angles``."""
        sines = np.sin(angles)
        sines[-1] = reach
        return self.n == 0 or dpptrf(self.finer, self.check_form.terms(sines))[1] == 0

    def margin(self, served: Served) -> float:
        """Smallest eigenvalue of the finer model's Hessian relative to torsional stiffness, clipped at 1."""
        if self.n == 0:
            return 1.0
        hessian = self.check_form.unpacked(np.sin(served.angles))
        values, _, info = dsyevd(hessian, 0, 1)
        assert info == 0
        return min(1.0, float(values[0]))

    def may_be_untwisted(self, alpha: Array, goal: float) -> bool:
        """A first look, from D and ``alpha`` alone, whether the twist moves the tip by no more than ``goal`` [m]."""
        pull = 0.0
        for first, second, strength, phase in self._first_twist:
            pull += strength * math.sin(phase + alpha[second] - alpha[first])
        return abs(pull) <= goal

    def untwisted(self, alpha: Array, before: Array | None, slack: float) -> Served | None:
        """The state without twist, eq. (28)-(31), and what it neglects; None if it is not certainly stable and on the
        branch of ``before``."""
        z = self.start(np.zeros(self.finer), alpha)
        return self._check(z, before, slack)

    def _check(self, z: Array, before: Array | None, slack: float) -> Served | None:
        """The state ``z``; None if the finer model is not certainly convex around it and ``before``."""
        angles = self.waves.dot(z)
        if self.n == 0:
            return Served(self, z, angles, 0.0, np.zeros(0), 0.0)
        sines = np.sin(angles)
        reach = slack
        if before is not None:
            moved = angles - before
            turned = abs(moved.item(idamax(moved)))
            if turned > LARGEST_TURN:
                return None
            reach += REACH * turned
        sines[-1] = reach
        residual, change, info = self._factorised(z, sines)
        if info and before is not None:
            # Near a fold: bound every cosine by its own least value rather than all by the largest change.
            theta = slice(self.rows, 2 * self.rows)
            sines[: self.rows], sines[-1] = least_cosines(before[theta], angles[theta], slack), 0.0
            residual, change, info = self._factorised(z, sines)
        if info:
            return None
        coarse = self.twist_norm * dnrm2(change) > slack
        return Served(self, z, angles, residual, change, np.inf if coarse else dasum(self.weights.dot(change)))

    def _factorised(self, z: Array, sines: Array) -> tuple[float, Array, int]:
        """Residual, Newton step of the finer model, and not 0 if its Hessian is not positive definite."""
        size = self.check_form.size
        out = self.check_form.terms(sines)
        daxpy(z, out, self.n, 1.0, 0, 1, size)
        residual = self.twist_norm * dnrm2(out, self.n, size)
        change, info = dppsv(self.finer, out, out[size:], 0, 1)
        return residual, change, info


@lru_cache(maxsize=KEPT)
def _order(given: Unknowns) -> tuple[NDArray[np.int64], int]:
    """(n + extra,) the unknowns solved for, then those above: the two highest degrees of each section; how many are
    solved for.  Constants always are."""
    parts = [np.zeros(0, dtype=bool)]
    for basis, columns in zip(given.bases, given.columns, strict=True):
        kept = np.arange(basis.degree + 1) <= max(0, basis.degree - FINER)
        parts.append(np.tile(kept, (columns.stop - columns.start) // len(kept)))
    solved = np.concatenate(parts)
    order = np.argsort(~solved, kind="stable")
    order.flags.writeable = False
    return order, int(np.count_nonzero(solved))
