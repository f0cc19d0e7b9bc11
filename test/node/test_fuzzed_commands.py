"""Ten thousand fuzzed commands, read without a graph: every refusal has its reason and tells it in one bounded line."""

import math

import pytest
from joint_state_fuzz import fuzz

from ctr_pvs_ros.inputs.commands import CommandReader
from ctr_pvs_ros.inputs.commands import RejectedCommand

COUNT = 10_000
LONGEST_LINE = 400  # characters


def test_fuzzed_commands_are_refused_with_reason_field_value_and_limit(seed_robot):
    reader = CommandReader(seed_robot)
    accepted = 0
    for message in fuzz(1, COUNT):
        if not message.reasons:
            command = reader.read(message.names, message.positions)
            assert all(map(math.isfinite, [*command.alpha, *command.D]))
            accepted += 1
            continue
        with pytest.raises(RejectedCommand) as rejection:
            reader.read(message.names, message.positions)
        told = str(rejection.value)
        assert rejection.value.reason in message.reasons, (message, told)
        assert "\n" not in told and len(told) < LONGEST_LINE
        assert all(word in told for word in message.words), (message, told)
    assert 0.05 * COUNT < accepted < 0.15 * COUNT
