"""Play: the classical operator's invariants, and what a robot file may say of it."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from ctr_pvs import RobotError
from ctr_pvs import RobotFileError
from ctr_pvs import load_robot
from ctr_pvs.robot.play import Play
from ctr_pvs.robot.play import PlayWidths

TEXT = """
name: two
tubes:
  - {name: outer, bending_stiffness: 0.05, torsional_stiffness: 0.04, segments: [{length: 0.1, curvature_y: [5.0]}]}
  - {name: inner, bending_stiffness: 0.02, torsional_stiffness: 0.02, segments: [{length: 0.2, curvature_y: [9.0]}]}
"""


def run(widths, commands):
    play = Play(widths)
    return np.array([play.update(command) for command in commands])


def test_no_width_is_no_play():
    commands = np.random.default_rng(1).normal(size=(50, 3))
    assert np.array_equal(run(np.zeros(3), commands), commands)


def test_it_is_never_more_than_half_a_width_off():
    commands = np.random.default_rng(2).normal(size=(400, 2)).cumsum(axis=0)
    off = run([0.4, 1.0], commands) - commands
    assert np.abs(off).max(axis=0) == pytest.approx([0.2, 0.5])


def test_it_knows_no_time_only_order():
    """Rate independence: steps cut finer, and waiting, change nothing of where it ends."""
    rng = np.random.default_rng(3)
    coarse = rng.normal(size=(30, 1)).cumsum(axis=0)
    fine = [coarse[0] * 1.0]
    for a, b in pairwise(coarse):
        fine += [a + (b - a) * t for t in np.linspace(0.0, 1.0, rng.integers(2, 9))]
    coarse_out, fine_out = run([0.7], coarse), run([0.7], fine)
    assert fine_out[-1] == pytest.approx(coarse_out[-1])


def test_a_cycle_is_a_loop_as_wide_as_the_play():
    swing = np.concatenate([np.linspace(0, 1, 41), np.linspace(1, -1, 81), np.linspace(-1, 1, 81)])[:, None]
    out = run([0.3], swing)[:, 0]
    down, up = out[41:122], out[121:]
    middle = np.abs(swing[41:122, 0]).argmin(), np.abs(swing[121:, 0]).argmin()
    assert down[middle[0]] - up[middle[1]] == pytest.approx(0.3)
    area = np.trapezoid(out[41:], swing[41:, 0])
    assert abs(area) == pytest.approx(0.3 * (2.0 - 0.3), rel=1e-2)  # of the parallelogram


def test_what_might_come_is_not_remembered():
    play = Play([1.0])
    play.update([0.0])
    assert play.after([2.0]) == pytest.approx([1.5])
    assert play.at == pytest.approx([0.0])
    assert play.moved(None).update([2.0]) == pytest.approx([2.0])
    assert play.at == pytest.approx([0.0])


def test_a_robot_file_may_have_it(tmp_path):
    file = tmp_path / "robot.yaml"
    file.write_text(TEXT + "play: {alpha: {inner: 0.05}, D: {outer: 0.001}}\n")
    robot = load_robot(file)
    assert robot.play == PlayWidths((0.0, 0.05), (0.001, 0.0))
    assert robot.play.of(2).tolist() == [0.0, 0.05, 0.001, 0.0]
    file.write_text(TEXT)
    assert not load_robot(file).play


@pytest.mark.parametrize(
    ("line", "place"),
    [
        ("play: {alpha: {middle: 0.1}}", "play.alpha.middle"),
        ("play: {alpha: {inner: -0.1}}", "play.alpha.inner"),
        ("play: {D: {inner: .nan}}", "play.D.inner"),
        ("play: {beta: {inner: 0.1}}", "play.beta"),
        ("play: 3", "play"),
    ],
)
def test_wrong_play_is_named(tmp_path, line, place):
    file = tmp_path / "robot.yaml"
    file.write_text(TEXT + line + "\n")
    with pytest.raises(RobotFileError) as caught:
        load_robot(file)
    assert caught.value.field == place and "\n" not in str(caught.value)


def test_widths_of_another_robot_are_refused():
    with pytest.raises(RobotError, match="one width for each of the 3 tubes"):
        PlayWidths((0.1, 0.2)).of(3)
    with pytest.raises(RobotError, match="from 0 to"):
        PlayWidths(D=(1.0,))
