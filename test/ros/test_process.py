"""How the node's process starts and ends."""

import signal
import subprocess
import time

import pytest
import yaml
from busy_machine import check_in_time

from ctr_pvs_ros.process import NodeProcess
from ctr_pvs_ros.process import share_file
from ros.load import ENDLESS
from ros.load import JOINTS
from ros.load import NEAR
from ros.load import joint_state

pytestmark = pytest.mark.alone

ROBOT = share_file("config", "renda2021.yaml")
LIMIT = 2.0  # s, to refuse a start and to end after a signal


def refusal(tmp_path, robot_file=ROBOT, **parameters):
    """Exit code and output of a node that must refuse to start in time."""
    log = tmp_path / "log.txt"
    with log.open("wb") as output:
        process = NodeProcess(robot_file, parameters, log=output)
    began = time.monotonic()
    try:
        code = process.wait(10.0)
    except subprocess.TimeoutExpired:
        process.stop()
        raise
    check_in_time(time.monotonic() - began, LIMIT)
    return code, log.read_text(encoding="utf-8")


def test_a_wrong_robot_file_ends_start_up_with_one_clear_line(graph, tmp_path):
    robot = yaml.safe_load(ROBOT.read_text(encoding="utf-8"))
    robot["tubes"][1]["segments"][0]["length"] = -1.0
    path = tmp_path / "wrong.yaml"
    path.write_text(yaml.safe_dump(robot), encoding="utf-8")
    code, text = refusal(tmp_path, path)
    assert code != 0
    assert text.count("\n") == 1
    for word in ("wrong.yaml", "tubes[1].segments[0].length", "-1.0", "expected"):
        assert word in text


@pytest.mark.parametrize(
    ("parameters", "word"),
    [
        ({"robot_file": "/nowhere/robot.yaml"}, "/nowhere/robot.yaml"),
        ({"robot_file": ""}, "robot_file"),
        ({"tolerance": "-1.0"}, "tolerance"),
        ({"tolerance": "1"}, "tolerance"),
        ({"use_external_wrench": "true", "fidelity": "torsion"}, "fidelity"),
        ({"use_external_wrench": "true", "force_model": "renda2021"}, "force_model"),
        ({"tip_frame_id": "ctr_base"}, "tip_frame_id"),
        ({"fidelity": "perfect"}, "fidelity"),
        ({"margin_stop": "0.5", "margin_warn": "0.2"}, "margin_stop"),
        ({"initial_command": "[0.0, 0.1]"}, "initial_command"),
        ({"initial_command": "[0.0, 0.0, 0.0935, 1.0]"}, "initial_command"),
        ({"initial_command": "nothing"}, "initial_command"),
        ({"margin_warn": "[0.1, x"}, "margin_warn"),
    ],
)
def test_a_wrong_parameter_ends_start_up_with_the_reason(graph, tmp_path, parameters, word):
    code, text = refusal(tmp_path, **parameters)
    assert code != 0
    assert word in text
    assert "Traceback" not in text


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("work", ["idle", "solving"])
def test_a_signal_ends_the_node_cleanly(start_node, number, work):
    peer = start_node(f"/ends_{work}_on_{number.name.lower()}", compute_budget="60.0")
    if work == "solving":
        peer.client.command(dict(zip(JOINTS, NEAR, strict=True)), 5.0)
        peer.send(joint_state(JOINTS, ENDLESS))
        time.sleep(0.5)
    began = time.monotonic()
    assert peer.process.stop(number) == 0
    check_in_time(time.monotonic() - began, LIMIT)
    assert "Traceback" not in peer.log.read_text(encoding="utf-8")


@pytest.mark.soak
def test_twenty_starts_and_stops(start_node):
    for count in range(20):
        peer = start_node(f"/cycle_{count}")
        began = time.monotonic()
        assert peer.process.stop(signal.SIGTERM if count % 2 else signal.SIGINT) == 0
        check_in_time(time.monotonic() - began, LIMIT)
