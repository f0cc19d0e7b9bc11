"""TF of the tip; only where tf2_msgs is installed, else the node says that it is not."""

import importlib.util

import pytest
from geometry_msgs.msg import PoseStamped

from ros.load import JOINTS

GOOD = dict(zip(JOINTS, (0.0, 0.0935, 0.5, 0.2085), strict=True))
TIMEOUT = 5.0
HAVE_TF = importlib.util.find_spec("tf2_msgs") is not None


@pytest.fixture(scope="module")
def peer(start_node):
    return start_node("/with_tf", publish_tf="true", frame_id="orifice", tip_frame_id="needle")


@pytest.mark.skipif(HAVE_TF, reason="tf2_msgs is installed")
def test_a_missing_package_is_told_once_and_the_rest_works(peer):
    for _ in range(3):
        peer.client.command(GOOD, TIMEOUT)
    assert peer.log.read_text(encoding="utf-8").count("tf2_msgs is not installed") == 1


@pytest.mark.skipif(not HAVE_TF, reason="tf2_msgs is not installed: no TF")
def test_the_tip_is_told_with_each_answer_and_again_to_late_joiners(peer):
    from tf2_msgs.msg import TFMessage

    reply = peer.client.command(GOOD, TIMEOUT)
    heard = []
    peer.ros.create_subscription(TFMessage, "/tf", heard.append, 100)
    peer.wait(lambda: bool(heard), "transform for a late joiner")
    tips = peer.subscribe(PoseStamped, "setpoint_cp")
    peer.wait(lambda: bool(tips), "last answer")
    heard.clear()
    reply = peer.client.command({**GOOD, "inner_rotation": 0.7}, TIMEOUT)
    peer.wait(lambda: bool(heard), "transform")
    (transform,) = heard[-1].transforms
    assert (transform.header.frame_id, transform.child_frame_id) == ("orifice", "needle")
    assert transform.header.stamp == reply.tip.header.stamp
    place, pose = transform.transform, reply.tip.pose
    assert [place.translation.x, place.translation.y, place.translation.z] == [
        pose.position.x,
        pose.position.y,
        pose.position.z,
    ]
    assert place.rotation == pose.orientation
