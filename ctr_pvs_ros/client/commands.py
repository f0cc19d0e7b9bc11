"""The executable ctr_client, see front: command a running node, watch it, and ask its services, from a shell."""

from __future__ import annotations

import argparse
import os
import signal
import sys
from collections.abc import Callable
from collections.abc import Iterator
from contextlib import contextmanager

import rclpy
from geometry_msgs.msg import PoseStamped
from geometry_msgs.msg import Vector3
from geometry_msgs.msg import Wrench
from rclpy.exceptions import NameValidationException
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.validate_node_name import validate_node_name
from sensor_msgs.msg import JointState

from ctr_pvs.cli.live.view import address_of
from ctr_pvs.cli.live.view import new_server
from ctr_pvs.cli.words import UsageError
from ctr_pvs_interfaces.srv import SolveEquilibrium
from ctr_pvs_interfaces.srv import SolveInverse
from ctr_pvs_ros.client import texts as client_texts
from ctr_pvs_ros.client.client import NoReply
from ctr_pvs_ros.client.client import ServiceClient
from ctr_pvs_ros.client.status_client import StatusClient
from ctr_pvs_ros.client.status_client import StatusWatcher

ANSWERED, NOT_ANSWERED, BAD_USAGE, INTERRUPTED = 0, 1, 2, 130
#: What only shows what others do goes on until it is told to end, which is no interruption.
LOOKING = ("watch", "view")
# What a wrong namespace, node name or domain ends in; rclpy's RCLError is a RuntimeError.
START_FAULTS = (NameValidationException, RuntimeError)
TIME_TO_FIND = 5.0  # s; after it the watcher says that it waits


def main(arguments: argparse.Namespace) -> int:
    """Do what the words ask for, see client_words; returns the exit code."""
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        with _ros_node(arguments) as node:
            return RUN[arguments.command](node, arguments)
    except UsageError as error:
        print(f"ctr_client: {error}", file=sys.stderr)
        return BAD_USAGE
    except NoReply as error:
        print(f"ctr_client: {error}", file=sys.stderr)
        return NOT_ANSWERED
    except BrokenPipeError:  # whoever read has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return ANSWERED
    except KeyboardInterrupt:
        return ANSWERED if arguments.command in LOOKING else INTERRUPTED


@contextmanager
def _ros_node(arguments: argparse.Namespace) -> Iterator[Node]:
    """A node for the client, beside the one it talks with; signals are left to Python, which sees them at once."""
    try:
        validate_node_name(arguments.node)
        rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
        node = rclpy.create_node(
            f"ctr_client_{os.getpid()}",
            namespace=arguments.namespace,
            enable_rosout=False,
            start_parameter_services=False,
        )
    except START_FAULTS as error:
        raise UsageError(" ".join(str(error).split()).rstrip(" ^")) from error
    try:
        yield node
    finally:
        for number in (signal.SIGINT, signal.SIGTERM):  # a second one must not break the end
            signal.signal(number, signal.SIG_IGN)
        node.destroy_node()
        rclpy.try_shutdown()


def _find(wait: Callable[[float], None], timeout: float) -> None:
    """Wait until whom it is about is there; raises UsageError."""
    try:
        wait(timeout)
    except NoReply as error:
        domain = os.environ.get("ROS_DOMAIN_ID", "0")
        advice = f"is it running, under this --namespace and --node, and in this ROS_DOMAIN_ID ({domain})?"
        raise UsageError(f"{error}: {advice}") from error


def _send(node: Node, arguments: argparse.Namespace) -> int:
    client = StatusClient(node, arguments.node)
    _find(client.wait_for_node, arguments.wait)
    names, positions = zip(*arguments.joints, strict=True)
    try:
        told = client.command(names, positions, arguments.wait)
    except NoReply as error:
        causes = "it was overtaken by a newer one, or names joints of others only, or --wait is too short"
        raise NoReply(f"{error}: {causes}") from error
    if arguments.json:
        print(client_texts.status_as_json(told.status, told.tip, told.joints))
    else:
        print(client_texts.status_as_text(told.status, told.tip, told.joints, arguments.degrees))
    return ANSWERED if client_texts.answered(told.status) else NOT_ANSWERED


def _watch(node: Node, arguments: argparse.Namespace) -> int:
    as_line = client_texts.status_as_json if arguments.json else client_texts.status_as_line
    watcher = StatusWatcher(node, arguments.node)
    try:
        watcher.wait_for_node(TIME_TO_FIND)
    except NoReply as error:
        print(f"ctr_client: {error}, waiting", file=sys.stderr)
    for count, (status, tip) in enumerate(watcher.follow(), start=1):
        print(as_line(status, tip), flush=True)
        if count == arguments.count:
            break
    return ANSWERED


def _view(node: Node, arguments: argparse.Namespace) -> int:
    server = new_server(arguments.host, arguments.port, f"ctr_client: {arguments.node}")

    from ctr_pvs.cli.live.followed import FollowedPage
    from ctr_pvs_ros.client.follower import Follower

    follower = Follower(node, arguments.node)
    page = FollowedPage(server, follower.name, arguments.largest_force)
    try:
        print(f"{follower.name}: {address_of(server)} (Ctrl-C ends)", flush=True)
        follower.show_on(page)
    finally:
        page.stop()
    return ANSWERED


def _solve(node: Node, arguments: argparse.Namespace) -> int:
    client = ServiceClient(node, arguments.node)
    _find(client.wait_for_services, arguments.wait)
    request = SolveEquilibrium.Request(
        joints=_joints(arguments), warm_start=arguments.warm, tip_wrench=_tip_wrench(arguments)
    )
    response = client.solve(request, arguments.wait)
    print((client_texts.response_as_json if arguments.json else client_texts.response_as_text)(response))
    return ANSWERED if response.success else NOT_ANSWERED


def _inverse(node: Node, arguments: argparse.Namespace) -> int:
    client = ServiceClient(node, arguments.node)
    _find(client.wait_for_services, arguments.wait)
    target = PoseStamped()
    for part, names, values in (
        (target.pose.position, "xyz", arguments.position),
        (target.pose.orientation, "xyzw", arguments.orientation or (0.0, 0.0, 0.0, 1.0)),
    ):
        for name, value in zip(names, values, strict=True):
            setattr(part, name, value)
    request = SolveInverse.Request(
        target=target,
        goal=arguments.goal,
        within=arguments.within,
        within_angle=arguments.within_angle,
        start=_joints(arguments),
        tip_wrench=_tip_wrench(arguments),
        margin_floor=arguments.margin_floor,
        all=arguments.all,
        time_limit=arguments.time_limit,
    )
    response = client.inverse(request, arguments.wait)
    if arguments.json:
        print(client_texts.search_as_json(response))
    else:
        print(client_texts.search_as_text(response, arguments.degrees))
    return ANSWERED if response.success else NOT_ANSWERED


def _joints(arguments: argparse.Namespace) -> JointState:
    return JointState(name=[name for name, _ in arguments.joints], position=[place for _, place in arguments.joints])


def _tip_wrench(arguments: argparse.Namespace) -> Wrench:
    force, moment = (Vector3(**dict(zip("xyz", vector, strict=True))) for vector in (arguments.force, arguments.moment))
    return Wrench(force=force, torque=moment)


RUN = {"send": _send, "watch": _watch, "view": _view, "solve": _solve, "inverse": _inverse}
