"""Robust least squares with priors: from measured rows to values, their standard errors, and what cannot be told."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from ctr_pvs.errors import TableError
from ctr_pvs.tasks.calibration.parameters import Parameter
from ctr_pvs.tasks.calibration.registration import best_registration
from ctr_pvs.tasks.calibration.tips import Frame
from ctr_pvs.tasks.calibration.tips import TipModel
from ctr_pvs.tasks.calibration.tips import Tips

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Report = Callable[[str], None]

#: A fit ends where a step changes the sum of squares, or the values, by less than this share.
FINE = 1e-5
#: Least deviation of a coordinate that is taken from residuals [m].
LEAST_STD = 1e-9
#: Median of the length of a vector of three normal numbers.
MEDIAN_3D = 1.5382
#: Where play begins, in units of its scale: at zero it could not shrink.
FIRST_PLAY = 0.1
#: What a row without an equilibrium counts for [standard deviations], and evaluations of a fit.
LOST, MOST_EVALUATIONS = 30.0, 60
#: A fit that brings the deviation of what is left below this share of what it was weighed with is repeated, so often.
SETTLED, MOST_STAGES = 0.9, 8


@dataclass(frozen=True, eq=False)
class Fitted:
    """values (P,), their standard errors (P,), tips of the model, the position's standard deviation [m] that counted.

    weak : directions (k, P), in units of the parameters' scales, that the data tell less of than the priors do; seen
    (k,) : the standard deviation that the data alone would give along them, in those units.
    """

    values: Array
    errors: Array
    tips: Tips
    position_std: float
    weak: Array
    seen: Array
    evaluations: int
    converged: bool


class Problem:
    """Residuals and Jacobian of ``model`` over the rows that are not held out, for scipy.

    Priors are residuals too, which no loss makes smaller.
    """

    def __init__(
        self, model: TipModel, rows: Mask, position_std: float, direction_std: float, robust: float, report: Report
    ) -> None:
        self.robust = robust
        self.model, self.rows, self.report = model, rows, report
        a = model.data.n_axes
        self.std = np.concatenate([np.full(3, position_std), np.full(3 * a, direction_std)])
        self.mean = np.array([parameter.mean for parameter in model.parameters])
        self.prior = np.array([0.0 if math.isinf(p.std) else 1.0 / p.std for p in model.parameters])
        self.evaluations = 0
        self._last: tuple[bytes, Tips] | None = None

    def tips(self, values: Array) -> Tips:
        """Of all rows; those of the last values are kept."""
        if self._last is None or self._last[0] != values.tobytes():
            self._last = values.tobytes(), self.model.tips(values)
        return self._last[1]

    def off(self, tips: Tips, values: Array) -> Array:
        """(M, 3 + 3 a) told less measured; NaN where the model has no equilibrium."""
        position, axes = self.model.told(tips, values)
        data = self.model.data
        parts = [position - data.position] + ([] if data.axes is None else [axes - data.axes])
        return np.hstack(parts)

    def residuals(self, values: Array) -> Array:
        """Of the rows, then of the priors, in standard deviations."""
        self.evaluations += 1
        tips = self.tips(values)
        scaled = np.nan_to_num(self.off(tips, values)[self.rows] / self.std, nan=LOST)
        self.report(f"  solve {self.evaluations}: median {1e3 * self.median(tips, values):.3f} mm")
        return np.concatenate([scaled.ravel(), (values - self.mean) * self.prior])

    def jacobian(self, values: Array) -> Array:
        rates = self.model.jacobian(self.tips(values), values, self.rows)[self.rows] / self.std[:, None]
        return np.vstack([rates.reshape(-1, len(values)), np.diag(self.prior)])

    def loss(self, z: Array) -> Array:
        """(3, m) soft L1 and its derivatives for the squares of the rows' residuals; the priors' as they are."""
        out = np.stack([z, np.ones_like(z), np.zeros_like(z)])
        data, c = slice(0, len(z) - len(self.mean)), self.robust**2
        t = 1.0 + z[data] / c
        out[0, data], out[1, data], out[2, data] = 2.0 * c * (np.sqrt(t) - 1.0), t**-0.5, -0.5 / c * t**-1.5
        return out

    def median(self, tips: Tips, values: Array) -> float:
        """Of the distance [m] over the rows."""
        return float(np.nanmedian(np.linalg.norm(self.off(tips, values)[self.rows, :3], axis=1)))


def start_values(model: TipModel) -> Array:
    """(P,) where a fit begins: at the means of the priors, within bounds."""
    values = []
    for parameter in model.parameters:
        mean = FIRST_PLAY * parameter.scale if parameter.kind.startswith("play") else parameter.mean
        values.append(min(max(mean, parameter.low), parameter.high))
    return np.array(values)


def register(model: TipModel, tips: Tips, values: Array, rows: Mask) -> None:
    """Places the base by the rows' tips at once, if a whole registration is among the parameters."""
    if len(model.columns("registration")) < 6:
        return
    known = rows & np.isfinite(tips.position[:, 0])
    if np.count_nonzero(known) < 3:
        raise TableError("rows", int(np.count_nonzero(known)), "at least 3 rows at which the robot has an equilibrium")
    sensor = model.placed(values)[2]
    told = tips.position + tips.frame @ sensor
    model.frame = Frame(*best_registration(told[known], model.data.position[known]))


def fit(
    model: TipModel, rows: Mask, position_std: float | None, direction_std: float, robust: float, report: Report
) -> Fitted:
    """The values that the ``rows`` and the priors ask for.

    position_std [m] : of a measured coordinate, what the model leaves out counted; where it is more, and for None, that
    of the residuals counts, which takes a few fits.  direction_std : of a component of a measured axis.
    robust : residuals beyond so many deviations count less than squared.
    """
    values = start_values(model)
    problem = Problem(model, rows, 1.0, direction_std, robust, report)
    register(model, problem.tips(values), values, rows)
    low, high = np.array([(p.low, p.high) for p in model.parameters]).T
    deviation, count, result = _spread(problem, values, position_std), 0, None
    for _ in range(MOST_STAGES):
        problem = Problem(model, rows, deviation, direction_std, robust, report)
        scale = [p.scale for p in model.parameters]
        result = least_squares(
            problem.residuals, values, problem.jacobian, (low, high), "trf", x_scale=scale,
            loss=problem.loss,  # type: ignore[arg-type] # scipy's stubs want a class
            ftol=FINE, xtol=FINE, gtol=1e-8, max_nfev=MOST_EVALUATIONS,
        )  # fmt: skip
        values, count = np.asarray(result.x), count + problem.evaluations
        left = _spread(problem, values, position_std)
        if left > SETTLED * deviation:
            break
        deviation = left
    assert result is not None
    tips = problem.tips(values)
    weak, seen, errors = _told(problem, values)
    return Fitted(values, errors, tips, problem.std[0], weak, seen, count, bool(result.status > 0))


def _spread(problem: Problem, values: Array, given: float | None) -> float:
    """Deviation [m] to weigh a coordinate with: the one that is ``given``, but no less than that of what is left now,
    for beyond it a loss that is robust sees outliers only and steps are small."""
    left = max(problem.median(problem.tips(values), values) / MEDIAN_3D, LEAST_STD)
    return left if given is None else max(left, given)


def _told(problem: Problem, values: Array) -> tuple[Array, Array, Array]:
    """Weak directions, how they are seen, and standard errors: from the Jacobian scaled by the parameters' scales."""
    scale = np.array([parameter.scale for parameter in problem.model.parameters])
    P = len(values)
    rates = problem.jacobian(values)[:-P] * scale
    off = problem.residuals(values)[:-P]
    soft = 1.0 + (off / problem.robust) ** 2
    _, sizes, right = np.linalg.svd(soft[:, None] ** -0.75 * rates, full_matrices=len(rates) < P)
    sizes = np.concatenate([sizes, np.zeros(P - len(sizes))])
    prior = np.diag((problem.prior * scale) ** 2)
    # Of an M-estimator: the spread of the slopes between the inverses of the curvature.
    inverse = np.linalg.pinv((right.T * sizes**2) @ right + prior, hermitian=True)
    slopes = (off / np.sqrt(soft))[:, None] * rates
    spread = inverse @ (slopes.T @ slopes + prior) @ inverse
    weak = sizes < 1.0
    return right[weak], 1.0 / np.maximum(sizes[weak], 1e-12), np.sqrt(np.diag(spread)) * scale


def weak_words(parameters: list[Parameter], fitted: Fitted) -> list[str]:
    """A line for every direction that the data cannot tell, by the parameters that make most of it."""
    lines = []
    for direction, seen in zip(fitted.weak, fitted.seen, strict=True):
        direction = direction * np.sign(direction[np.abs(direction).argmax()])
        order = [i for i in np.argsort(-np.abs(direction)).tolist() if abs(direction[i]) > 0.3]
        parts = [
            f"{parameters[i].words} {direction[i] * parameters[i].scale:+.3g} {parameters[i].unit}".rstrip()
            for i in order
        ]
        what = "alone" if len(parts) == 1 else "together"
        lines.append(f"{', '.join(parts)} {what}: known to {seen:.2g} times that from the data")
    return lines
