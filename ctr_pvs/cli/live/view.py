"""ctr-pvs view: serves the live page until Ctrl-C."""

from __future__ import annotations

import argparse
import socket
import threading
from typing import TYPE_CHECKING
from typing import Any

from ctr_pvs.cli.command import SUCCESS
from ctr_pvs.cli.command import declare_robot
from ctr_pvs.cli.words import UsageError
from ctr_pvs.cli.words import number
from ctr_pvs.cli.words import whole_number
from ctr_pvs.robot.file import load_robot
from ctr_pvs.robot.robot import Robot

if TYPE_CHECKING:
    from ctr_pvs.cli.live.page import Page

LARGEST_FORCE = (0.01, 1000.0)  # N


def declare_view(subcommands: argparse._SubParsersAction[Any]) -> None:
    """Adds the sub-command."""
    view = subcommands.add_parser(
        "view",
        allow_abbrev=False,
        help="a live page with sliders, in a browser",
        description="Serves a page on which sliders move the tubes and push the tip, until Ctrl-C (needs viser: "
        "pip install 'ctr_pvs[view]'). It needs no network, and has no password: only this machine can reach "
        "it, unless --host says otherwise.",
    )
    declare_robot(view)
    view.add_argument("--port", type=whole_number(1, 65535), default=8080, metavar="P", help="(%(default)s)")
    view.add_argument(
        "--host", default="127.0.0.1", metavar="H", help="address to serve at (%(default)s: this machine only)"
    )
    view.add_argument("--largest-force", type=number, default=1.0, metavar="F", help="on a slider [N] (%(default)g)")
    view.set_defaults(run=_view)


def _view(arguments: argparse.Namespace) -> int:
    robot = load_robot(arguments.robot)
    low, high = LARGEST_FORCE
    if not low <= arguments.largest_force <= high:
        raise UsageError(f"--largest-force: expected {low:g} to {high:g} N, got {arguments.largest_force:g}")
    page = served(robot, arguments.tolerance, arguments.host, arguments.port, arguments.largest_force)
    host = f"[{arguments.host}]" if ":" in arguments.host else arguments.host
    try:
        print(f"{robot.name}: http://{host}:{page.server.get_port()} (Ctrl-C ends)", flush=True)
        threading.Event().wait()
    except KeyboardInterrupt:
        print()
    finally:
        page.server.stop()
    return SUCCESS


def served(robot: Robot, tolerance: float, host: str, port: int, largest_force: float) -> Page:
    """The page, on a server of its own.

    Raises ``UsageError`` without viser, and for an address that cannot be served at.
    """
    try:
        import viser
    except ImportError as error:
        raise UsageError("view needs viser (pip install 'ctr_pvs[view]')") from error
    _check_free(host, port)

    from ctr_pvs.cli.live.page import Page
    from ctr_pvs.cli.live.state import LiveRobot

    live = LiveRobot(robot, tolerance)
    return Page(viser.ViserServer(host, port, label=f"ctr_pvs: {robot.name}", verbose=False), live, largest_force)


def _check_free(host: str, port: int) -> None:
    """viser would take another port without a word."""
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        with socket.socket(family, kind, protocol) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind(address)
    except OSError as error:
        raise UsageError(f"--host, --port: cannot serve at {host} port {port}: {error}") from error
