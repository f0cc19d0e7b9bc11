"""Fits of synthetic measurements: the truth comes back, its errors are told, and what cannot be known is named."""

from __future__ import annotations

import numpy as np
import pytest
import yaml
from calibration_scenes import FIT
from calibration_scenes import ROBOT
from calibration_scenes import measured

from ctr_pvs import Robot
from ctr_pvs import RobotError
from ctr_pvs import Segment
from ctr_pvs import Tube
from ctr_pvs import load_robot
from ctr_pvs.errors import FieldError
from ctr_pvs.errors import TableError
from ctr_pvs.robot.robot import Limits
from ctr_pvs.tasks.calibrate import calibrate
from ctr_pvs.tasks.calibrate import held_out_blocks
from ctr_pvs.tasks.calibration.parameters import chosen
from ctr_pvs.tasks.calibration.parameters import robot_with
from ctr_pvs.tasks.calibration.report import comments
from ctr_pvs.tasks.calibration.table import Measurements
from ctr_pvs.tasks.calibration.tips import TipModel

NOISE = 5e-4


def within(sets: int, first: int) -> dict[str, float]:
    """For each parameter, in which share of sets the truth lies within three standard errors."""
    hits: dict[str, list[bool]] = {}
    for seed in range(first, first + sets):
        data, truth = measured(np.random.default_rng(seed), 60, NOISE)
        found = calibrate(ROBOT, data, FIT, block=None)
        assert found.converged
        assert 0.6 * NOISE < found.position_std < 1.4 * NOISE
        for parameter in found.parameters:
            if parameter.name in truth:
                hits.setdefault(parameter.name, []).append(
                    abs(parameter.value - truth[parameter.name]) <= 3.0 * parameter.error
                )
    return {name: float(np.mean(values)) for name, values in hits.items()}


def test_the_truth_lies_within_the_errors_told():
    shares = within(4, 0)
    assert np.mean(list(shares.values())) >= 0.95, shares


@pytest.mark.soak
def test_the_truth_lies_within_the_errors_told_in_a_hundred_sets():
    shares = within(100, 1000)
    assert min(shares.values()) >= 0.95, shares


def test_exact_measurements_give_the_exact_robot():
    data, truth = measured(np.random.default_rng(5), 40, 0.0)
    found = calibrate(ROBOT, data, FIT, block=None, position_std=1e-6, tolerance=1e-8)
    assert found.after.fitted.largest < 1e-6 < 1e-4 < found.before.fitted.median
    for name, value in truth.items():
        assert found.value(name) == pytest.approx(value, abs=2e-3), name
    bent = found.robot.tubes[1].segments[1].bending_stiffness / ROBOT.tubes[1].segments[1].bending_stiffness
    assert bent == pytest.approx(truth["bending:inner"], abs=2e-3)


def test_sensor_and_length_and_directions_come_back():
    fit = ("length:inner:2", "sensor", "torsion:inner", "registration")
    data, truth = measured(np.random.default_rng(6), 40, 0.0, fit=fit, axes=True)
    found = calibrate(ROBOT, data, fit, block=None, position_std=1e-5, direction_std=1e-4, tolerance=1e-8)
    assert found.after.fitted.largest < 1e-5
    for name in ("length:inner:2", "sensor:y", "sensor:z"):
        assert found.value(name) == pytest.approx(truth[name], abs=3e-4), name
    # The far end of a tube and a sensor before it are nearly one thing.
    together = found.value("length:inner:2") + found.value("sensor:x")
    assert together == pytest.approx(truth["length:inner:2"] + truth["sensor:x"], abs=5e-5)


def test_play_comes_back():
    fit = ("play_alpha:inner", "play_D:inner", "registration")
    data, truth = measured(np.random.default_rng(7), 120, 1e-4, fit=fit, truth={"play_alpha:inner": 0.3,
                                                                               "play_D:inner": 2e-3})  # fmt: skip
    found = calibrate(ROBOT, data, fit, block=None)
    assert found.value("play_alpha:inner") == pytest.approx(0.3, abs=0.02)
    assert found.value("play_D:inner") == pytest.approx(2e-3, abs=3e-4)
    assert found.robot.play.alpha == (0.0, found.value("play_alpha:inner"))
    without = calibrate(ROBOT, data, ("registration",), block=None)
    assert found.after.fitted.median < 0.3 * without.after.fitted.median
    assert truth["play_alpha:inner"] == 0.3


def test_what_the_data_cannot_tell_is_named():
    """Without a load only ratios of stiffness shape a robot, and a common rotation of all tubes is its roll."""
    data, _ = measured(np.random.default_rng(8), 40, NOISE)
    found = calibrate(ROBOT, data, ("bending:outer", "bending:inner", "registration"), block=None)
    assert any("bending stiffness of outer" in line and "bending stiffness of inner" in line for line in found.untold)
    found = calibrate(ROBOT, data, ("alpha:outer", "alpha:inner", "registration"), block=None)
    assert any("rotation offset" in line and "registration" in line for line in found.untold)
    found = calibrate(ROBOT, data, ("curvature", "registration"), block=None)
    assert found.untold == ()


def test_outliers_count_for_little():
    data, _ = measured(np.random.default_rng(9), 60, NOISE, fit=("curvature", "registration"), truth={
        "curvature:outer": 1.1, "curvature:inner": 0.9})  # fmt: skip
    spoilt = data.position.copy()
    spoilt[::10] += 0.05
    found = calibrate(ROBOT, Measurements(data.alpha, data.D, spoilt), ("curvature", "registration"), block=None)
    assert found.value("curvature:outer") == pytest.approx(1.1, abs=0.03)
    assert found.value("curvature:inner") == pytest.approx(0.9, abs=0.03)


def test_a_force_on_the_tip_tells_stiffness_itself():
    """Under loads the columns of the tubes are differences; one stiffness alone can then be told."""
    rng = np.random.default_rng(10)
    parameters = chosen(ROBOT, ("bending:outer", "bending:inner"))
    force = rng.normal(scale=0.3, size=(8, 3))
    data, _ = measured(rng, 8, 0.0, fit=("registration",))
    blank = Measurements(data.alpha, data.D, data.position, None, force)
    model = TipModel(ROBOT, parameters, blank, True, 1e-8)
    truth = np.array([1.08, 0.95])
    told = Measurements(data.alpha, data.D, model.told(model.tips(truth), truth)[0], None, force)
    found = calibrate(
        ROBOT, told, ("bending:outer", "bending:inner"), block=None, position_std=1e-5, tolerance=1e-8
    )  # fmt: skip
    assert [p.value for p in found.parameters] == pytest.approx(truth, abs=1e-3)
    assert found.untold == ()


def test_held_out_rows_have_no_say():
    data, _ = measured(np.random.default_rng(11), 60, NOISE)
    held = held_out_blocks(60, 10)
    assert held.tolist() == ([False] * 10 + [True] * 10) * 3
    spoilt = data.position.copy()
    spoilt[held] += 0.1
    fit = ("curvature", "registration")
    clean = calibrate(ROBOT, data, fit, block=10)
    other = calibrate(ROBOT, Measurements(data.alpha, data.D, spoilt), fit, block=10)
    assert [p.value for p in other.parameters] == pytest.approx([p.value for p in clean.parameters], abs=1e-9)
    assert other.after.held_out.median > 0.09 > clean.after.held_out.median
    assert clean.after.held_out.rows == clean.after.fitted.rows == 30


@pytest.mark.parametrize("axes", [False, True])
def test_every_column_is_that_of_differences(axes):
    fit = (*FIT, "length", "sensor", "play_alpha", "play_D", "alpha:outer", "bending:outer")
    rng = np.random.default_rng(12)
    data, truth = measured(rng, 12, NOISE, fit=fit, axes=axes, spread=0.3)
    parameters = chosen(ROBOT, fit)
    values = np.array([truth.get(p.name, 0.02) for p in parameters])
    for index, parameter in enumerate(parameters):
        if parameter.kind.startswith("play"):
            values[index] = {"rad": 0.06, "m": 1e-3}[parameter.unit]
    model = TipModel(ROBOT, parameters, data, True, 1e-9)
    jacobian = model.jacobian(model.tips(values), values, np.ones(12, dtype=bool))
    for index, parameter in enumerate(parameters):
        h, told = 1e-3 * parameter.scale, []
        for sign in (1.0, -1.0):
            there = values.copy()
            there[index] += sign * h
            told.append(np.hstack(model.told(model.tips(there), there)))
        slope = (told[0] - told[1]) / (2.0 * h)
        size = np.abs(slope).max() + 1e-9
        assert jacobian[:, :, index] == pytest.approx(slope, abs=2e-4 * size + 2e-6), parameter.name


def test_torsion_columns_are_those_of_differences():
    parameters = chosen(ROBOT, ("torsion",))
    data, _ = measured(np.random.default_rng(13), 6, 0.0)
    model, values = TipModel(ROBOT, parameters, data, True, 1e-9), np.array([1.1, 0.9])
    jacobian = model.jacobian(model.tips(values), values, np.ones(6, dtype=bool))
    for index in range(2):
        moved = [model.tips(values + sign * 1e-4 * np.eye(2)[index]).position for sign in (1.0, -1.0)]
        assert jacobian[:, :, index] == pytest.approx((moved[0] - moved[1]) / 2e-4, abs=2e-6)


def test_the_new_robot_can_be_read_again(tmp_path):
    data, _ = measured(np.random.default_rng(14), 40, NOISE)
    found = calibrate(ROBOT, data, (*FIT, "play_alpha:inner"), block=None)
    file = tmp_path / "new.yaml"
    file.write_text(found.robot_file(comments(found, "tips.csv")))
    assert load_robot(file) == found.robot
    assert "Fitted to tips.csv" in file.read_text() and "alpha:inner" in file.read_text()
    assert yaml.safe_load(file.read_text())["play"]["alpha"]["inner"] == found.value("play_alpha:inner")


@pytest.mark.parametrize("name", ["three_tubes", "renda2021"])
def test_the_text_of_a_robot_is_the_robot(name, tmp_path):
    from ctr_pvs.tasks.calibration.robot_text import robot_text

    file, robot = tmp_path / "again.yaml", load_robot(name)
    file.write_text(robot_text(robot))
    assert load_robot(file) == robot


def test_the_text_of_a_helix_is_the_helix(tmp_path):
    """One whose curvature changes, too; what a file has no words for is refused, not left out."""
    from ctr_pvs.tasks.calibration.robot_text import robot_text

    def robot(*curvature):
        return Robot("one", (Tube("a", (Segment(0.1, 0.05, 0.04, curvature, turn=20.0),)),))

    file = tmp_path / "again.yaml"
    for told in (robot(16.7), robot(16.7, -550.0), robot()):
        file.write_text(robot_text(told))
        assert load_robot(file).tubes[0].segments[0].pre_curvature(0.07) == told.tubes[0].segments[0].pre_curvature(
            0.07
        )
    with pytest.raises(RobotError, match="real coefficients beside a turn"):
        robot_text(robot(16.7 + 2.0j))


def test_limits_are_of_commands_not_of_tubes():
    """An offset may bring a tube beyond what its actuator can be told."""
    from dataclasses import replace

    data, truth = measured(np.random.default_rng(15), 30, 0.0, fit=("D:inner", "registration"))
    low, high = data.D.min(axis=0), data.D.max(axis=0)
    robot = replace(ROBOT, limits=Limits(D=tuple(zip(low.tolist(), high.tolist(), strict=True))))
    found = calibrate(robot, data, ("D:inner", "registration"), block=None, position_std=1e-5)
    assert found.value("D:inner") == pytest.approx(truth["D:inner"], abs=1e-5)


def test_stiffness_follows_what_the_parameters_say():
    parameters = chosen(ROBOT, ("bending:inner", "poisson"))
    inner = robot_with(ROBOT, parameters, np.array([1.2, 0.25])).tubes[1].segments[0]
    assert inner.bending_stiffness == pytest.approx(0.024) and inner.torsional_stiffness == pytest.approx(0.0192)
    parameters = chosen(ROBOT, ("bending:inner", "torsion:inner"))
    inner = robot_with(ROBOT, parameters, np.array([1.2, 0.5])).tubes[1].segments[0]
    assert inner.torsional_stiffness == pytest.approx(0.02 / 1.3 * 0.6)


@pytest.mark.parametrize(
    ("options", "match"),
    [
        ({"fit": ["bend"]}, "fit: expected one of"),
        ({"fit": ["poisson", "torsion"]}, "one of them"),
        ({"fit": []}, "at least one parameter"),
        ({"priors": {"poisson": (0.3, 0.0)}}, "standard deviation above 0"),
        ({"priors": {"nonsense": (0.3, 0.1)}}, "priors: expected one of"),
        ({"bounds": {"poisson": (0.4, 0.3)}}, "a lower and an upper bound"),
        ({"fit": ["play_alpha"], "history": False}, "play"),
        ({"block": 0}, "at least one row"),
    ],
)
def test_wrong_options_are_told_in_one_line(options, match):
    data = Measurements(np.zeros((6, 2)), np.full((6, 2), 0.05), np.zeros((6, 3)))
    with pytest.raises(FieldError, match=match) as caught:
        calibrate(ROBOT, data, **options)
    assert "\n" not in str(caught.value)


def test_a_patterned_tube_has_no_poissons_ratio():
    with pytest.raises(FieldError, match="fit torsion instead"):
        chosen(load_robot("three_tubes"), ["poisson"])


def test_too_few_rows_for_the_parameters():
    data = Measurements(np.zeros((4, 2)), np.full((4, 2), 0.05), np.zeros((4, 3)))
    with pytest.raises(TableError, match="as many measured numbers as parameters"):
        calibrate(ROBOT, data, FIT, block=2)
