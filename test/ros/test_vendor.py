"""A client on another DDS implementation, without ROS: examples/dds_client.py on Eclipse Cyclone DDS."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("cyclonedds", reason="cyclonedds is not installed: no client of another DDS vendor")

EXAMPLE = Path(__file__).parents[2] / "examples" / "dds_client.py"
JOINTS = ["outer_rotation", "outer_translation", "inner_rotation", "inner_translation"]
TIMEOUT = 5.0


@pytest.fixture(scope="module")
def peer(start_node):
    return start_node("/vendor")


def ask(namespace, joints, timeout=TIMEOUT):
    """Exit code and output of the example."""
    words = [f"{name}={position!r}" for name, position in joints.items()]
    command = [sys.executable, EXAMPLE, *words, "--namespace", namespace, "--timeout", str(timeout)]
    answer = subprocess.run(command, capture_output=True, text=True, timeout=60.0)
    return answer.returncode, answer.stdout + answer.stderr


def test_both_vendors_get_the_same_answer(peer):
    command = dict(zip(JOINTS, (0.0, 0.0935, -2.0, 0.2085), strict=True))
    code, text = ask(peer.namespace, command)
    assert code == 0, text
    answer = json.loads(text)
    tip = peer.client.command(command, TIMEOUT).tip
    p, q = tip.pose.position, tip.pose.orientation
    assert answer["frame_id"] == tip.header.frame_id
    # A repeated command is refined from its own answer, so the last digits may differ.
    assert np.allclose(answer["position"], [p.x, p.y, p.z], rtol=0.0, atol=1e-9)
    assert np.allclose(answer["orientation"], [q.x, q.y, q.z, q.w], rtol=0.0, atol=1e-7)


def test_a_bad_command_of_the_other_vendor_is_refused_with_its_reason(peer):
    code, text = ask(peer.namespace, {"elbow": 1.0}, timeout=1.0)
    assert code == 1
    assert "no answer" in text
    _, values = peer.diagnostics(lambda values: "elbow" in values["last rejection"])
    assert values["last rejection"].startswith("unknown_joint")
