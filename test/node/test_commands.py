"""Commands are matched by name, and refused with a reason."""

import math
import re

import numpy as np
import pytest

from ctr_pvs import Robot
from ctr_pvs import Segment
from ctr_pvs import Tube
from ctr_pvs_ros.commands import Command
from ctr_pvs_ros.commands import CommandReader
from ctr_pvs_ros.commands import Leniency
from ctr_pvs_ros.commands import Reason
from ctr_pvs_ros.commands import RejectedCommand
from ctr_pvs_ros.commands import narrowed

NAMES = ("outer_rotation", "outer_translation", "inner_rotation", "inner_translation")
POSITIONS = (0.1, 0.02, -0.3, 0.04)


@pytest.fixture
def robot() -> Robot:
    tubes = tuple(
        Tube(name, (Segment(length, bending_stiffness=0.05, torsional_stiffness=0.04),))
        for name, length in (("outer", 0.1), ("inner", 0.2))
    )
    return Robot("two", tubes)


@pytest.fixture
def reader(robot) -> CommandReader:
    return CommandReader(robot)


def test_joint_names_run_from_the_outermost_tube_inwards(reader):
    assert reader.names == NAMES


def test_the_order_of_names_does_not_matter(reader):
    for shift in range(4):
        order = np.roll(range(4), shift)
        command = reader.read([NAMES[i] for i in order], [POSITIONS[i] for i in order])
        assert command.alpha.tolist() == [0.1, -0.3]
        assert command.D.tolist() == [0.02, 0.04]
        assert command.notes == ()


@pytest.mark.parametrize(
    ("names", "positions", "reason", "words"),
    [
        (NAMES, POSITIONS[:3], Reason.RAGGED, ["4 positions", "got 3"]),
        (NAMES, (), Reason.RAGGED, ["4 positions", "got 0"]),
        ((), POSITIONS, Reason.NAMELESS, ["accept_nameless"]),
        ((), (), Reason.MISSING_JOINT, ["outer_rotation"]),
        ((*NAMES, NAMES[2]), (*POSITIONS, 0.0), Reason.DUPLICATE_JOINT, ["'inner_rotation'"]),
        ((*NAMES, "elbow"), (*POSITIONS, 0.0), Reason.UNKNOWN_JOINT, ["'elbow'", "outer_translation"]),
        (NAMES[:3], POSITIONS[:3], Reason.MISSING_JOINT, ["'inner_translation'"]),
        (NAMES, (0.1, 0.02, math.nan, 0.04), Reason.NON_FINITE, ["inner_rotation", "nan"]),
        (NAMES, (0.1, 0.02, -math.inf, 0.04), Reason.NON_FINITE, ["inner_rotation", "-inf"]),
        (NAMES, (0.1, 0.02, 1e308, 0.04), Reason.OUT_OF_LIMITS, ["alpha[1]", "1e+308"]),
        (NAMES, (0.1, -0.01, 0.0, 0.04), Reason.OUT_OF_LIMITS, ["D[0]", "-0.01", "'outer'"]),
        (NAMES, (0.1, 0.02, 0.0, 0.21), Reason.OUT_OF_LIMITS, ["D[1]", "0.21", "0.2"]),
        (NAMES, (0.1, 0.05, 0.0, 0.04), Reason.OUT_OF_LIMITS, ["D[1]", "0.04", "0.05"]),
    ],
)
def test_a_bad_command_is_refused_with_the_reason(reader, names, positions, reason, words):
    with pytest.raises(RejectedCommand) as caught:
        reader.read(names, positions)
    message = str(caught.value)
    assert caught.value.reason is reason
    assert "\n" not in message
    for word in words:
        assert word in message


def test_a_message_stays_short_however_long_the_names(reader):
    names = [f"{'x' * 10_000}{i}" for i in range(100)]
    with pytest.raises(RejectedCommand) as caught:
        reader.read(names, [0.0] * 100)
    assert len(str(caught.value)) < 500


def test_a_partial_command_is_completed_from_the_last_one_where_asked(reader):
    last = Command(np.array([0.1, -0.3]), np.array([0.02, 0.04]))
    lenient = Leniency(merge_partial=True)
    command = reader.read(["inner_rotation"], [2.0], lenient, last)
    assert command.alpha.tolist() == [0.1, 2.0]
    assert command.D.tolist() == [0.02, 0.04]
    for names, positions, last_command in ((["inner_rotation"], [2.0], None), ([], [], last)):
        with pytest.raises(RejectedCommand) as caught:
            reader.read(names, positions, lenient, last_command)
        assert caught.value.reason is Reason.MISSING_JOINT


def test_clamping_is_reported(reader):
    lenient = Leniency(clamp_to_limits=True)
    command = reader.read(NAMES, (0.1, -0.01, -0.3, 0.5), lenient)
    assert command.D.tolist() == [0.0, 0.2]
    assert len(command.notes) == 2
    assert reader.read(NAMES, POSITIONS, lenient).notes == ()


def test_nameless_positions_are_taken_in_order_where_asked(reader):
    lenient = Leniency(accept_nameless=True)
    command = reader.read((), POSITIONS, lenient)
    assert command.alpha.tolist() == [0.1, -0.3]
    assert command.D.tolist() == [0.02, 0.04]
    with pytest.raises(RejectedCommand) as caught:
        reader.read((), POSITIONS[:3], lenient)
    assert caught.value.reason is Reason.RAGGED


def test_limits_may_be_narrowed_but_not_widened(robot):
    narrow = narrowed(robot, [-1.0, 1.0, -2.0, 2.0], [0.0, 0.05, 0.0, 9.0])
    narrower = narrowed(narrow, [-9.0, 9.0, -9.0, 0.5], [])
    reader = CommandReader(narrower)
    assert reader.read(NAMES, (-1.0, 0.05, 0.5, 0.2)).alpha.tolist() == [-1.0, 0.5]
    for positions, word in (
        ((-1.1, 0.02, 0.0, 0.04), "alpha[0]"),
        ((0.0, 0.02, 0.6, 0.04), "alpha[1]"),
        ((0.0, 0.06, 0.0, 0.07), "D[0]"),
        ((0.0, 0.02, 0.0, 0.21), "D[1]"),
    ):
        with pytest.raises(RejectedCommand, match=re.escape(word)) as caught:
            reader.read(NAMES, positions)
        assert caught.value.reason is Reason.OUT_OF_LIMITS


def test_no_limits_change_nothing(robot):
    assert narrowed(robot, [], []) is robot


@pytest.mark.parametrize(
    ("rotation", "translation", "words"),
    [
        ([0.0, 1.0], [], "rotation_limits.*2 tubes.*2 numbers"),
        ([], [0.0], "translation_limits.*2 tubes.*1 numbers"),
        ([1.0, 0.0, 0.0, 1.0], [], "limits.alpha.outer"),
        ([], [0.06, 0.1, 0.0, 0.05], "limits.D.inner"),
    ],
)
def test_limits_that_make_no_sense_are_refused(robot, rotation, translation, words):
    with pytest.raises(ValueError, match=words):
        narrowed(robot, rotation, translation)
