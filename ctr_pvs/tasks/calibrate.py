"""From measured tips to a robot: which parameters explain them, how well, and which of them the data cannot tell.

>>> from ctr_pvs import load_robot
>>> from ctr_pvs.tasks.calibrate import calibrate, read_measurements
>>> robot = load_robot("renda2021")
>>> found = calibrate(robot, read_measurements("tips.csv", robot.n_tubes), fit=["curvature", "alpha", "registration"])
>>> found.after.held_out.median, found.parameters, found.untold
>>> found.robot  # with the new numbers; found.robot_file() is its text

docs/calibration.md tells what is fitted how, and what a fit can and cannot tell.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from collections.abc import Iterable
from collections.abc import Mapping
from collections.abc import Sequence
from dataclasses import dataclass
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.errors import FieldError
from ctr_pvs.errors import TableError
from ctr_pvs.robot.play import PlayWidths
from ctr_pvs.robot.robot import Robot
from ctr_pvs.tasks.calibration.fit import Fitted
from ctr_pvs.tasks.calibration.fit import fit as fit_rows
from ctr_pvs.tasks.calibration.fit import register
from ctr_pvs.tasks.calibration.fit import weak_words
from ctr_pvs.tasks.calibration.parameters import USUAL
from ctr_pvs.tasks.calibration.parameters import Parameter
from ctr_pvs.tasks.calibration.parameters import chosen
from ctr_pvs.tasks.calibration.parameters import robot_with
from ctr_pvs.tasks.calibration.registration import quaternion
from ctr_pvs.tasks.calibration.robot_text import robot_text
from ctr_pvs.tasks.calibration.table import Measurements
from ctr_pvs.tasks.calibration.table import read_measurements as read_measurements
from ctr_pvs.tasks.calibration.tips import TipModel
from ctr_pvs.tasks.calibration.tips import Tips

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

#: In standard deviations, see ``calibrate``.
ROBUST = 1.5
#: Rows of a block, of which every second one is held out.
BLOCK = 50


@dataclass(frozen=True)
class Spread:
    """Of the distance [m] between told and measured tips over ``rows`` rows, and in shares of the length that is out of
    the orifice.  ``lost`` rows have no equilibrium in the model and count in nothing else."""

    rows: int
    lost: int
    median: float
    ninety: float
    largest: float
    median_share: float
    ninety_share: float
    largest_share: float


@dataclass(frozen=True)
class Errors:
    """Over the rows that were fitted, and over those held out (None without)."""

    fitted: Spread
    held_out: Spread | None


@dataclass(frozen=True)
class FittedParameter:
    """value and its standard error; mean and standard deviation of its prior; at_bound : the value is on one of its
    bounds, and its error means little.  words, unit : for people."""

    name: str
    value: float
    error: float
    mean: float
    std: float
    at_bound: bool
    words: str
    unit: str


@dataclass(frozen=True, eq=False)
class Calibration:
    """What came of a fit.

    robot : with the fitted numbers and play.  parameters : in order.  before, after : errors of the robot as it was,
    registered by a rigid motion if the registration was fitted, and as it is.  untold : a line for each direction of
    which the data tell less than the priors.  position_std [m] : of a coordinate, that weighed data against priors.
    rotation (4,) quaternion x, y, z, w and translation (3,) [m] : of the robot's base in the frame of the measurement.
    sensor (3,) [m] : in the frame of the tip.  off_before, off (M, 3) [m] : told less measured; held_out (M,).
    seconds, evaluations, converged : of the fit.
    """

    robot: Robot
    parameters: tuple[FittedParameter, ...]
    before: Errors
    after: Errors
    untold: tuple[str, ...]
    position_std: float
    rotation: Array
    translation: Array
    sensor: Array
    off_before: Array
    off: Array
    held_out: Mask
    seconds: float
    evaluations: int
    converged: bool

    def value(self, name: str) -> float:
        """Of the parameter of this name."""
        return next(parameter.value for parameter in self.parameters if parameter.name == name)

    def robot_file(self, comments: Sequence[str] = ()) -> str:
        """The new robot as the text of a robot file, with ``comments`` before it."""
        return robot_text(self.robot, comments)


def held_out_blocks(rows: int, block: int = BLOCK) -> Mask:
    """(rows,) true in every second block of rows, the first not."""
    if block < 1:
        raise FieldError("block", block, "at least one row")
    return np.asarray((np.arange(rows) // block) % 2 == 1)


def calibrate(
    robot: Robot,
    data: Measurements,
    fit: Iterable[str] = USUAL,
    *,
    priors: Mapping[str, Sequence[float]] | None = None,
    bounds: Mapping[str, Sequence[float]] | None = None,
    position_std: float | None = None,
    direction_std: float = 0.05,
    robust: float = ROBUST,
    history: bool = True,
    block: int | None = BLOCK,
    tolerance: float = 1e-5,
    progress: Callable[[str], None] | None = None,
) -> Calibration:
    """Fits parameters of ``robot`` to ``data`` by robust least squares with Gaussian priors.

    fit : names of parameters or groups, see ``calibration.parameters``; priors, bounds : of them, (mean, std) and (low,
        high).  position_std [m] : of a measured coordinate, what the model leaves out counted; None takes it from the
        residuals.  direction_std : of a component of a measured axis.  robust : what is off by more than so many
        standard deviations counts less than squared; large for plain least squares.
    history : rows are a path in the order of their measurement, which play needs, and branches near snaps; else each
        row is a cold start.  block : of this many rows every second block is held out, None holds none.
    tolerance : of the model's tips [m].  progress : called with a line from time to time.

    Raises ``TableError`` for data that do not fit the robot or are too few, ``FieldError`` for wrong options.
    """
    began, report = time.perf_counter(), progress or (lambda line: None)
    parameters = chosen(robot, fit, priors, bounds)
    for name, value in (("position_std", position_std), ("direction_std", direction_std), ("robust", robust)):
        if value is not None and not value > 0.0:
            raise FieldError(name, value, "a number above 0")
    if data.alpha.shape[1] != robot.n_tubes:
        raise TableError("alpha", data.alpha.shape, f"a column for each of the {robot.n_tubes} tubes")
    if any(parameter.kind.startswith("play") for parameter in parameters) and not history:
        raise FieldError("fit", "play", "no play where rows are no path", "play is a matter of history")
    held = np.zeros(len(data), dtype=bool) if block is None else held_out_blocks(len(data), block)
    numbers = int(np.count_nonzero(~held)) * (3 + 3 * data.n_axes)
    if numbers < len(parameters):
        raise TableError("rows", len(data), f"as many measured numbers as parameters: {len(parameters)}, not {numbers}")
    off_before, before = _before(robot, parameters, data, held, history, tolerance)
    report(f"before: median {1e3 * before.fitted.median:.3f} mm over {before.fitted.rows} rows")
    model = TipModel(robot, parameters, data, history, tolerance)
    fitted = fit_rows(model, ~held, position_std, direction_std, robust, report)
    off, after = _errors(model, fitted.tips, fitted.values, held)
    R, t, sensor = model.placed(fitted.values)
    return Calibration(
        _new_robot(robot, parameters, fitted.values), _told(parameters, fitted), before, after,
        tuple(weak_words(parameters, fitted)), fitted.position_std, quaternion(R), t, sensor, off_before, off, held,
        time.perf_counter() - began, fitted.evaluations, fitted.converged,
    )  # fmt: skip


def _before(
    robot: Robot, parameters: list[Parameter], data: Measurements, held: Mask, history: bool, tolerance: float
) -> tuple[Array, Errors]:
    """Told less measured (M, 3) [m] by the robot as it is, placed as well as a rigid motion can if that is fitted."""
    placing = [parameter for parameter in parameters if parameter.kind == "registration"]
    model, values = TipModel(robot, placing, data, history, tolerance), np.zeros(len(placing))
    tips = model.tips(values)
    register(model, tips, values, ~held)
    return _errors(model, tips, values, held)


def _errors(model: TipModel, tips: Tips, values: Array, held: Mask) -> tuple[Array, Errors]:
    off = model.told(tips, values)[0] - model.data.position
    distance = np.linalg.norm(off, axis=1)
    outside = _spread(distance[held], tips.length[held]) if held.any() else None
    return off, Errors(_spread(distance[~held], tips.length[~held]), outside)


def _spread(distance: Array, length: Array) -> Spread:
    known = np.isfinite(distance)
    if not known.any():
        raise TableError("rows", len(distance), "rows at which the robot has an equilibrium")
    distance, length = distance[known], length[known]
    shares = np.divide(distance, length, out=np.full(len(length), np.nan), where=length > 0.0)
    told = [(np.median(x), np.quantile(x, 0.9), np.max(x)) for x in (distance, shares)]
    numbers = [float(number) for three in told for number in three]
    return Spread(len(distance), int(np.count_nonzero(~known)), *numbers)


def _told(parameters: list[Parameter], fitted: Fitted) -> tuple[FittedParameter, ...]:
    rows = []
    for p, value, error in zip(parameters, fitted.values.tolist(), fitted.errors.tolist(), strict=True):
        at_bound = min(value - p.low, p.high - value) < 1e-3 * p.scale
        rows.append(FittedParameter(p.name, value, error, p.mean, p.std, at_bound, p.words, p.unit))
    return tuple(rows)


def _new_robot(robot: Robot, parameters: list[Parameter], values: Array) -> Robot:
    """The robot with its new tubes and play."""
    widths, N = robot.play.of(robot.n_tubes), robot.n_tubes
    for parameter, value in zip(parameters, values.tolist(), strict=True):
        if parameter.kind.startswith("play"):
            widths[parameter.tube + (N if parameter.kind == "play_D" else 0)] = value
    play = PlayWidths(tuple(widths[:N].tolist()), tuple(widths[N:].tolist()))
    return replace(robot_with(robot, parameters, values), play=play)
