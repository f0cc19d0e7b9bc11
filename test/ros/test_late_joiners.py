"""Who comes late finds the last answer on every output, whoever listened before."""

from geometry_msgs.msg import PoseArray
from geometry_msgs.msg import PoseStamped
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64

JOINTS = ["outer_rotation", "outer_translation", "inner_rotation", "inner_translation"]
OUTPUTS = {"setpoint_js": JointState, "setpoint_cp": PoseStamped, "backbone": PoseArray, "stability_margin": Float64}


class Listener:
    """Subscribes to all outputs, and can leave again."""

    def __init__(self, peer):
        self.peer = peer
        self.heard = {topic: peer.subscribe(kind, topic) for topic, kind in OUTPUTS.items()}

    def stamps(self):
        messages = [self.heard[topic] for topic in ("setpoint_js", "setpoint_cp", "backbone")]
        return [[message.header.stamp.sec for message in of_topic] for of_topic in messages]

    def wait_for_all(self):
        self.peer.wait(lambda: all(self.heard.values()), "the last answer on all outputs")


def send(peer, stamp):
    """The command of this number; returns once the node has answered it."""
    message = JointState(name=JOINTS, position=[0.0, 0.0935, 0.01 * stamp, 0.2085])
    message.header.stamp.sec = stamp
    peer.send(message)
    peer.diagnostics(lambda values: values["answers published"] == str(stamp))


def leave(peer, listeners):
    """Take away every subscription to an output."""
    for subscription in list(peer.ros.subscriptions):
        if subscription.topic_name.rpartition("/")[2] in OUTPUTS:
            peer.ros.destroy_subscription(subscription)
    listeners.clear()


def test_the_first_listener_of_all_finds_the_last_answer(start_node):
    peer = start_node("/late")
    leave(peer, [])
    send(peer, 1)
    send(peer, 2)
    first = Listener(peer)
    first.wait_for_all()
    assert first.stamps() == [[2], [2], [2]]
    leave(peer, [first])
    # Nobody listens to this one, but an older answer lies waiting on every output.
    send(peer, 3)
    second = Listener(peer)
    second.wait_for_all()
    assert second.stamps() == [[3], [3], [3]]
