"""examples/record_and_replay.py: a session recorded to a rosbag2 file comes out of a fresh node bit for bit."""

import math
import random
import subprocess
import sys
from pathlib import Path

import pytest
from joint_state_fuzz import fuzz

from ros.load import Load
from ros.load import joint_state
from ros.load import stamp_of

pytest.importorskip("rosbags", reason="rosbags is not installed: nothing is recorded or replayed")

pytestmark = pytest.mark.alone  # discovery takes its time on a busy machine

EXAMPLE = Path(__file__).parents[2] / "examples" / "record_and_replay.py"
JOINTS = ["outer_rotation", "outer_translation", "inner_rotation", "inner_translation"]
ANSWERS = 40
TIMEOUT = 5.0


def session():
    """A walk through both rotations and translations, with a snap in it; stamped."""
    rng = random.Random(4)
    for stamp in range(1, ANSWERS + 1):
        turn = math.radians(290.0) if stamp == ANSWERS // 2 else rng.uniform(-3.0, 3.0)
        yield joint_state(JOINTS, [0.0, rng.uniform(0.08, 0.1), turn, rng.uniform(0.2, 0.25)], stamp)


def example(*words):
    """Command line of the example."""
    return [sys.executable, EXAMPLE, *map(str, words)]


def drive(load):
    """The session, in lock step and with a broken command before each good one."""
    broken = (message for message in fuzz(5, 1000) if message.reasons)
    for command in session():
        rubbish = next(broken)
        load.send(joint_state(rubbish.names, rubbish.positions))
        load.send(command)
        stamp = stamp_of(command)
        assert load.spin_until(lambda stamp=stamp: stamp in load.answered, TIMEOUT)


def test_the_same_bag_in_gives_the_same_bits_out(start_node, tmp_path):
    first = start_node("/recorded", publish_backbone_s="true")
    load = Load(first.namespace)
    bag = tmp_path / "session"
    command = example("record", bag, "--namespace", first.namespace, "--answers", ANSWERS)
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as recorder:
        assert load.spin_until(lambda: load.listeners == 2, TIMEOUT), "the recorder does not come"
        assert "waiting" in recorder.stdout.readline()
        assert "recording" in recorder.stdout.readline()
        drive(load)
        assert recorder.wait(10.0) == 0
    load.close()
    first.process.stop()
    second = start_node("/replayed", publish_backbone_s="true")
    replay = subprocess.run(
        example("replay", bag, "--namespace", second.namespace), capture_output=True, text=True, timeout=60.0
    )
    assert replay.returncode == 0, replay.stdout + replay.stderr
    assert f"{ANSWERS} commands replayed; all outputs bit-identical" in replay.stdout
    for topic in ("setpoint_js", "setpoint_cp", "backbone", "stability_margin", "backbone_s"):
        assert f"{topic}: {ANSWERS} messages, 0 different" in replay.stdout
