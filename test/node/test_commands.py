"""Commands are matched by name, and refused with a reason."""

import math
from dataclasses import replace

import numpy as np
import pytest

from ctr_pvs import Robot
from ctr_pvs import Segment
from ctr_pvs import Tube
from ctr_pvs.robot.robot import Limits
from ctr_pvs_ros.inputs.commands import Command
from ctr_pvs_ros.inputs.commands import CommandReader
from ctr_pvs_ros.inputs.commands import Leniency
from ctr_pvs_ros.inputs.commands import Reason
from ctr_pvs_ros.inputs.commands import RejectedCommand
from ctr_pvs_ros.inputs.joints import Joints

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
    assert reader.joints.names == NAMES


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
        (NAMES, (0.1, 0.02, 1e308, 0.04), Reason.OUT_OF_LIMITS, ["inner_rotation", "1e+308"]),
        (
            NAMES,
            (0.1, -0.01, 0.0, 0.04),
            Reason.OUT_OF_LIMITS,
            ["outer_translation", "-0.01", "'outer'", "translation_sign"],
        ),
        (NAMES, (0.1, 0.02, 0.0, 0.21), Reason.OUT_OF_LIMITS, ["inner_translation", "0.21", "0.2"]),
        (NAMES, (0.1, 0.05, 0.0, 0.04), Reason.OUT_OF_LIMITS, ["inner_translation", "0.04", "0.05"]),
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
    command = reader.read(NAMES, (0.1, -0.0005, -0.3, 0.5), lenient)
    assert command.D.tolist() == [0.0, 0.2]
    assert command.notes == (
        "outer_translation moved from -0.0005 to 0 m",
        "inner_translation moved from 0.5 to 0.2 m, 0.3 m FURTHER IN",
    )
    assert reader.read(NAMES, POSITIONS, lenient).notes == ()


def test_clamping_does_not_insert_a_tube_all_the_way(reader):
    """A negative D is no place near the orifice, but another way of counting."""
    with pytest.raises(RejectedCommand, match=r"outer_translation.*beta = -D.*translation_sign") as caught:
        reader.read(NAMES, (0.1, -0.09, -0.3, 0.1), Leniency(clamp_to_limits=True))
    assert caught.value.reason is Reason.OUT_OF_LIMITS


def test_joints_of_others_are_passed_over_where_asked(reader):
    lenient = Leniency(ignore_unknown_joints=True)
    names, positions = ("elbow", *NAMES, "elbow", "wrist"), (math.nan, *POSITIONS, 3.0, 1e308)
    command = reader.read(names, positions, lenient)
    assert command.alpha.tolist() == [0.1, -0.3] and command.D.tolist() == [0.02, 0.04]
    with pytest.raises(RejectedCommand) as caught:
        reader.read((*names, NAMES[0]), (*positions, 0.0), lenient)
    assert caught.value.reason is Reason.DUPLICATE_JOINT
    with pytest.raises(RejectedCommand) as caught:
        reader.read(("elbow", NAMES[0]), (0.0, 0.0), lenient)
    assert caught.value.reason is Reason.MISSING_JOINT
    assert reader.is_for_others(("elbow", "wrist"), lenient)
    assert not reader.is_for_others(("elbow", "wrist"), Leniency())
    assert not reader.is_for_others(("elbow", NAMES[0]), lenient)
    assert not reader.is_for_others((), lenient)


def test_rotations_are_unwrapped_where_asked(reader):
    """An encoder that wraps goes 170, 178, -178 deg; the tube has gone on to 182."""
    last, lenient = None, Leniency(unwrap_rotations=True)
    for degrees, expected in ((170, 170), (178, 178), (-178, 182), (-170, 190), (178, 178), (541, 181)):
        last = reader.read(NAMES, (0.0, 0.02, math.radians(degrees), 0.04), lenient, last)
        assert math.degrees(last.alpha[1]) == pytest.approx(expected)
        assert last.alpha[0] == 0.0 and last.D.tolist() == [0.02, 0.04] and last.hints == ()


def test_a_jump_by_nearly_a_turn_is_hinted_at(reader):
    def hints_from(before, after):
        last = reader.read(NAMES, (0.0, 0.02, math.radians(before), 0.04))
        command = reader.read(NAMES, (0.0, 0.02, math.radians(after), 0.04), last=last)
        assert math.degrees(command.alpha[1]) == pytest.approx(after)  # taken as it is
        return command.hints

    (hint,) = hints_from(178, -178)
    assert "inner_rotation jumped by -356 deg" in hint and "unwrap_rotations" in hint
    assert len(hints_from(0, 725)) == 1
    for before, after in ((0, 180), (0, 300), (0, 5), (170, 178)):
        assert hints_from(before, after) == ()


def test_translations_may_be_counted_the_other_way(robot):
    reader = CommandReader(robot, Joints.of(robot, "left/", -1), translation_limits=[-0.05, 0.0, -9.0, 0.0])
    names = [f"left/{name}" for name in NAMES]
    command = reader.read(names, (0.1, -0.02, -0.3, -0.04))
    assert command.D.tolist() == [0.02, 0.04]
    assert reader.joints.in_turn(command.alpha, command.D) == [0.1, -0.02, -0.3, -0.04]
    assert reader.read_in_turn([0.1, -0.3, -0.02, -0.04]).D.tolist() == [0.02, 0.04]
    partial = reader.read([names[2]], [2.0], Leniency(merge_partial=True), command)
    assert partial.alpha.tolist() == [0.1, 2.0] and partial.D.tolist() == [0.02, 0.04]
    for translation, words in ((0.02, "left/outer_translation.*D = -0.02.*translation_sign is -1"), (-0.06, "limits")):
        with pytest.raises(RejectedCommand, match=words):
            reader.read(names, (0.1, translation, -0.3, -0.1))


def test_nameless_positions_are_taken_in_order_where_asked(reader):
    lenient = Leniency(accept_nameless=True)
    command = reader.read((), POSITIONS, lenient)
    assert command.alpha.tolist() == [0.1, -0.3]
    assert command.D.tolist() == [0.02, 0.04]
    with pytest.raises(RejectedCommand) as caught:
        reader.read((), POSITIONS[:3], lenient)
    assert caught.value.reason is Reason.RAGGED


def test_limits_may_be_narrowed_but_not_widened(robot):
    limited = replace(robot, limits=Limits(((-1.0, 1.0), (-2.0, 2.0)), ((0.0, 0.05), (0.0, 0.2))))
    reader = CommandReader(limited, rotation_limits=[-9.0, 9.0, -9.0, 0.5], translation_limits=[0.0, 9.0, 0.0, 0.15])
    assert reader.read(NAMES, (-1.0, 0.05, 0.5, 0.15)).alpha.tolist() == [-1.0, 0.5]
    of_file, parameter = "limits of the robot file", "the parameter {}_limits"
    for positions, joint, whose in (
        ((-1.1, 0.02, 0.0, 0.04), "outer_rotation", of_file),
        ((0.0, 0.02, 0.6, 0.04), "inner_rotation", parameter.format("rotation")),
        ((0.0, 0.06, 0.0, 0.07), "outer_translation", of_file),
        ((0.0, 0.02, 0.0, 0.16), "inner_translation", parameter.format("translation")),
        ((0.0, 0.02, 0.0, 0.21), "inner_translation", "its length"),
    ):
        with pytest.raises(RejectedCommand, match=rf"{joint}: .*{whose}") as caught:
            reader.read(NAMES, positions)
        assert caught.value.reason is Reason.OUT_OF_LIMITS


@pytest.mark.parametrize(
    ("rotation", "translation", "words"),
    [
        ([0.0, 1.0], [], "rotation_limits.*2 tubes.*2 numbers"),
        ([], [0.0], "translation_limits.*2 tubes.*1 numbers"),
        ([1.0, 0.0, 0.0, 1.0], [], "limits.alpha.outer"),
        ([], [0.06, 0.1, 0.0, 0.05], "limits.D.inner"),
    ],
)
@pytest.mark.parametrize("sign", [1, -1])
def test_limits_that_make_no_sense_are_refused(robot, rotation, translation, words, sign):
    joints = Joints.of(robot, translation_sign=sign)
    if len(translation) == 4:
        translation = joints.pairs_along(translation)
    with pytest.raises(ValueError, match=words):
        CommandReader(robot, joints, rotation, translation)
