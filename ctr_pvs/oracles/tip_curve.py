"""All equilibria of a pair of tubes as one curve: the relative base angle as an explicit function of that at the tip.

Where the tubes cease to overlap there is no torque, so for a given relative angle theta_tip there the torsion equation
integrates back to the bases without any root finding: alpha(theta_tip).  Every equilibrium is a point of this curve,
every fold a place where d alpha / d theta_tip, integrated along, is zero.  theta_tip + 2 pi belongs to alpha + 2 pi, so
one period tells everything.

The curve is sampled until a cubic through neighbouring samples, with their slopes, predicts it everywhere.  What can
be missed are two folds between which the curve goes back by less than ``DEPTH``.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from ctr_pvs.oracles.tube_pair import PairSection
from ctr_pvs.oracles.tube_pair import TubePair

Array = NDArray[np.float64]

TURN = 2.0 * np.pi
#: Relative and absolute accuracy [rad] of the integration.
ACCURACY, FINEST = 1e-11, 1e-13
#: How well [rad] the cubic must predict a sample between its ends.
DEPTH = 1e-6
#: Samples per period to begin with, the most that are spent, and the narrowest interval [rad] that is divided.
FIRST_SAMPLES, MOST_SAMPLES, NARROWEST = 129, 10_000, 1e-11
#: Where a period begins if there is no fold to begin at: no place that is special in a planar robot.
BEGIN = -3.0


class TipIntegral:
    """Integrates a pair back from given tip angles, any number at once.

    States are (theta, torque, and the derivatives of both by theta_tip), rows of (4, m); torques are in a unit that
    makes them angles.
    """

    def __init__(self, pair: TubePair) -> None:
        self.pair = pair
        compliances = [section.compliance for section in pair.sections]
        self.unit = 1.0 / (max(compliances) * sum(section.length for section in pair.sections))  # N m

    def base(self, tips: Array) -> tuple[Array, Array]:
        """alpha_b - alpha_a [rad] and its slope by theta_tip, for tip angles (m,)."""
        *_, (_, states) = self._states(tips, lambda _: np.zeros(1))
        theta, torque, theta_rate, torque_rate = states[:, 0]
        lead = self.pair.lead * self.unit
        return theta - lead * torque, theta_rate - lead * torque_rate

    def unstable_directions(self, tips: Array) -> NDArray[np.int64]:
        """(m,) number of negative eigenvalues of the energy Hessian at the equilibria with these tip angles.

        Jacobi's count: the zeros of d theta(s) / d theta_tip on the way from the tip to the base, where the lead goes
        on along the tangent.
        """
        count, positive = np.zeros(len(tips), dtype=int), np.ones(len(tips), dtype=bool)
        for _, states in self._states(tips, self._fine):
            for rate in states[2, ::-1]:
                count += positive != (rate > 0.0)
                positive = rate > 0.0
            at_base = states[2, 0] - self.pair.lead * self.unit * states[3, 0]
        return np.asarray(count + (positive != (at_base > 0.0)))

    def torques(self, tips: Array, s: Array) -> Array:
        """(m, g, N) torque [N m] of every tube at arc lengths ``s`` (g,) [m], for tip angles (m,).

        It is constant from the guide to the first coupled section, and 0 past the last one.
        """
        s, section_of = np.asarray(s, dtype=np.float64), self.pair.materials.domain.locate(s)
        carried, torque = np.zeros((len(tips), len(s))), np.zeros(len(tips))

        def places(section: PairSection) -> Array:
            x = (s[section_of == section.index] - section.start) / section.length
            return np.unique(np.append(0.0, np.clip(x, 0.0, 1.0)))

        for section, states in self._states(tips, places):
            here, torque = section_of == section.index, states[1, 0]
            if section.coupled:
                x = np.clip((s[here] - section.start) / section.length, 0.0, 1.0)
                carried[:, here] = states[1, np.searchsorted(places(section), x)].T
            else:
                carried[:, here] = torque[:, None]
        carried[:, s <= self.pair.sections[0].start] = torque[:, None]
        out = np.zeros((*carried.shape, self.pair.materials.robot.n_tubes))
        out[..., self.pair.a], out[..., self.pair.b] = -self.unit * carried, self.unit * carried
        return out

    def _fine(self, section: PairSection) -> Array:
        """Places in [0, 1] so close that no two zeros of a perturbation lie between neighbours."""
        if not section.coupled:
            return np.array([0.0])
        x = np.linspace(0.0, 1.0, 33)
        strength = section.compliance * np.abs(self.pair.pull(section.index, section.start + section.length * x))
        half_waves = section.length * np.sqrt(strength.max()) / np.pi
        return np.linspace(0.0, 1.0, 9 + 4 * int(np.ceil(half_waves)))

    def _states(self, tips: Array, places: Callable[[PairSection], Array]) -> Iterator[tuple[PairSection, Array]]:
        """Section by section from the tip: the states (4, g, m) at ``places`` (g,), which begin with 0."""
        none = np.zeros_like(tips)
        state = np.vstack([tips, none, none + 1.0, none])
        for section in reversed(self.pair.sections):
            if section.coupled:
                states = self._integrate(section, state, places(section))
            else:
                turn = section.compliance * self.unit * section.length
                states = (state - turn * np.vstack([state[1], none, state[3], none]))[:, None]
            yield section, states
            state = states[:, 0]

    def _integrate(self, section: PairSection, state: Array, x: Array) -> Array:
        length, index = section.length, section.index
        turn, shape = section.compliance * self.unit * length, state.shape
        fixed = self.pair.constant_pull(section)

        def rates(place: float, flat: Array) -> Array:
            theta, torque, theta_rate, torque_rate = flat.reshape(shape)
            pull = fixed if fixed is not None else self.pair.pull(index, np.array([section.start + place * length]))[0]
            moment = pull * (length / self.unit) * np.exp(1j * theta)
            return np.concatenate([turn * torque, moment.imag, turn * torque_rate, moment.real * theta_rate])

        found = solve_ivp(rates, (1.0, 0.0), state.ravel(), method="DOP853", t_eval=x[::-1], rtol=ACCURACY, atol=FINEST)
        return found.y.reshape(*shape, len(x)).transpose(0, 2, 1)[:, ::-1]


@dataclass(frozen=True)
class PairFold:
    """A fold: relative angles at the tip and at the bases [rad], of one period.

    maximum : whether alpha is largest here, so that the branches end as alpha grows; else they end as it falls.
    ends_stable : whether one of the two branches that meet here is stable.
    """

    theta_tip: float
    alpha: float
    maximum: bool
    ends_stable: bool


@dataclass(frozen=True, eq=False)
class Branch:
    """A stretch of the curve between neighbouring folds: samples theta_tip and alpha (k,) [rad], theta_tip growing.

    unstable_directions : negative eigenvalues of the energy Hessian, the same all along; 0 is stable.
    """

    theta_tip: Array
    alpha: Array
    unstable_directions: int

    @property
    def stable(self) -> bool:
        return self.unstable_directions == 0


class TipCurve:
    """One period of alpha(theta_tip), in branches on which alpha is monotone.

    theta_tip, alpha : (k,) samples, folds among them, over exactly one period; it begins at a fold if there is one.
    folds, branches : in the order of theta_tip; resolved : False if the samples ran out before the curve was smooth.
    """

    def __init__(self, pair: TubePair) -> None:
        self.integral = TipIntegral(pair)
        samples, self.resolved = _sampled(self.integral.base)
        folds = self._folds(samples)
        samples = np.column_stack([samples[:, :-1], folds])  # the last sample is the first of the next period
        samples = samples[:, np.argsort(samples[0])]
        first = int(np.searchsorted(samples[0], folds[0].min())) if folds.size else 0
        shift = np.array([[TURN], [TURN], [0.0]])
        samples = np.column_stack([samples[:, first:], samples[:, : first + 1] + shift])
        self.theta_tip, self.alpha = samples[0], samples[1]
        ends = np.flatnonzero(np.isin(samples[0], folds[0])) if folds.size else np.array([], dtype=int)
        self.branches = self._branches(np.unique([0, *ends, samples.shape[1] - 1]))
        self.folds = self._named(folds[:, np.argsort(folds[0])])

    def _folds(self, samples: Array) -> Array:
        """(3, f) theta_tip, alpha and slope (exactly 0) of the folds."""
        theta, _, slope = samples
        turn = np.flatnonzero((slope[:-1] > 0.0) != (slope[1:] > 0.0))
        tips = zeros(lambda tip: self.integral.base(tip)[1], theta[turn], theta[turn + 1], slope[turn], slope[turn + 1])
        alpha = self.integral.base(tips)[0] if len(tips) else tips
        return np.vstack([tips, alpha, np.zeros_like(tips)])

    def _branches(self, ends: NDArray[np.int64]) -> tuple[Branch, ...]:
        middles = []
        for a, b in itertools.pairwise(ends):
            c = (a + b) // 2
            middles.append(self.theta_tip[c] if a < c else 0.5 * (self.theta_tip[a] + self.theta_tip[b]))
        counts = self.integral.unstable_directions(np.array(middles))
        spans = [slice(a, b + 1) for a, b in itertools.pairwise(ends)]
        return tuple(
            Branch(self.theta_tip[span], self.alpha[span], int(count))
            for span, count in zip(spans, counts, strict=True)
        )

    def _named(self, folds: Array) -> tuple[PairFold, ...]:
        """Branch i begins at fold i and ends at fold i + 1."""
        named = []
        for i, (tip, alpha, _) in enumerate(folds.T.tolist()):
            before, after = self.branches[i - 1], self.branches[i]
            named.append(PairFold(tip, alpha, bool(after.alpha[-1] < after.alpha[0]), before.stable or after.stable))
        return tuple(named)

    def tips_at(self, alpha: float) -> Array:
        """All theta_tip [rad] in equilibrium at the relative base angle ``alpha`` [rad], not wrapped, in order."""
        low, high = float(self.alpha.min()), float(self.alpha.max())
        turns = np.arange(np.ceil((alpha - high) / TURN) - 1.0, np.floor((alpha - low) / TURN) + 2.0)
        targets = alpha - TURN * turns
        # On every branch alpha is monotone between its ends: at most one crossing each.
        above = self.alpha >= targets[:, None]
        turn, piece = np.nonzero(above[:, :-1] != above[:, 1:])
        target = targets[turn]
        low_tip, high_tip = self.theta_tip[piece], self.theta_tip[piece + 1]
        at_low, at_high = self.alpha[piece] - target, self.alpha[piece + 1] - target
        tips = zeros(lambda tip: self.integral.base(tip)[0] - target, low_tip, high_tip, at_low, at_high)
        return np.sort(tips + TURN * turns[turn])


def _sampled(curve: Callable[[Array], tuple[Array, Array]]) -> tuple[Array, bool]:
    """Samples (3, k) of theta, alpha and slope over one period, closed; False if they do not resolve the curve."""
    theta = np.linspace(BEGIN, BEGIN + TURN, FIRST_SAMPLES)
    samples = np.vstack([theta, *curve(theta)])
    samples[1:, -1] = samples[1:, 0] + np.array([TURN, 0.0])  # closed to the last digit
    doubtful = np.arange(FIRST_SAMPLES - 1)  # intervals, by their left ends
    resolved = True
    while len(doubtful) and resolved:
        left, right = samples[:, doubtful], samples[:, doubtful + 1]
        width = right[0] - left[0]
        middle = left[0] + 0.5 * width
        new = np.vstack([middle, *curve(middle)])
        predicted = 0.5 * (left[1] + right[1]) + 0.125 * width * (left[2] - right[2])
        rough = np.abs(new[1] - predicted) > DEPTH
        samples = np.insert(samples, doubtful + 1, new, axis=1)
        halves = doubtful + np.arange(len(doubtful))
        # An interval is left alone once its middle was foretold and neither half seems to turn back inside.
        again = [(rough | _turns_back(*half)) & (width > NARROWEST) for half in ((left, new), (new, right))]
        doubtful = np.sort(np.concatenate([halves[again[0]], halves[again[1]] + 1]))
        resolved = samples.shape[1] < MOST_SAMPLES and not np.any(rough & (width <= NARROWEST))
    return samples, resolved


def _turns_back(left: Array, right: Array) -> NDArray[np.bool_]:
    """Whether the cubic between samples whose slopes have one sign has a slope of the other inside."""
    width = right[0] - left[0]
    mean, a, b = (right[1] - left[1]) / width, left[2], right[2]
    # Its slope is a parabola a + 2 p x + q x^2 in x from 0 to 1.
    p, q = 3.0 * mean - 2.0 * a - b, 3.0 * (a + b - 2.0 * mean)
    lowest = np.clip(np.divide(-p, q, out=np.zeros_like(p), where=q != 0.0), 0.0, 1.0)
    extreme = a + 2.0 * p * lowest + q * lowest**2
    return np.asarray((a * b > 0.0) & (extreme * a < 0.0))


def zeros(function: Callable[[Array], Array], a: Array, b: Array, at_a: Array, at_b: Array) -> Array:
    """Zeros (m,) between the places ``a`` and ``b`` (m,) where ``function`` has unlike signs, all at once.

    T. R. Chandrupatla, "A new hybrid quadratic/bisection algorithm for finding the zero of a nonlinear function without
    using derivatives", Advances in Engineering Software 28 (1997): inverse quadratic steps, bisection where these would
    not help.
    """
    if not len(a):
        return np.array(a)
    c, at_c, t = a, at_a, np.full(len(a), 0.5)
    for _ in range(100):
        place = a + t * (b - a)
        value = function(place)
        same = (value > 0.0) == (at_a > 0.0)
        c, at_c = np.where(same, a, b), np.where(same, at_a, at_b)
        b, at_b = np.where(same, b, a), np.where(same, at_b, at_a)
        a, at_a = place, value
        best = np.where(np.abs(at_a) < np.abs(at_b), a, b)
        least = (4.0 * np.finfo(float).eps * np.abs(best) + 1e-15) / np.maximum(np.abs(b - c), 1e-300)
        if np.all((least > 0.5) | (at_a == 0.0) | (at_b == 0.0)):
            break
        with np.errstate(divide="ignore", invalid="ignore"):
            xi, phi = (a - b) / (c - b), (at_a - at_b) / (at_c - at_b)
            step = at_a / (at_b - at_a) * at_c / (at_b - at_c)
            step = step + (c - a) / (b - a) * at_a / (at_c - at_a) * at_b / (at_c - at_b)
        quadratic = (phi**2 < xi) & ((1.0 - phi) ** 2 < 1.0 - xi) & np.isfinite(step)
        least = np.minimum(least, 0.5)
        t = np.clip(np.where(quadratic, step, 0.5), least, 1.0 - least)
    return np.asarray(np.where(np.abs(at_a) < np.abs(at_b), a, b))
