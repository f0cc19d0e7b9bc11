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
    from viser import ViserServer

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
    declare_page(view, "on a slider")
    view.set_defaults(run=_view)


def declare_page(parser: argparse.ArgumentParser, largest: str) -> None:
    """Adds where a page is served, and the ``largest`` force on it."""
    parser.add_argument("--port", type=whole_number(1, 65535), default=8080, metavar="P", help="(%(default)s)")
    parser.add_argument(
        "--host", default="127.0.0.1", metavar="H", help="address to serve at (%(default)s: this machine only)"
    )
    parser.add_argument("--largest-force", type=_force, default=1.0, metavar="F", help=f"{largest} [N] (%(default)g)")


def _force(text: str) -> float:
    value, (low, high) = number(text), LARGEST_FORCE
    if not low <= value <= high:
        raise argparse.ArgumentTypeError(f"expected {low:g} to {high:g} N, got {value:g}")
    return value


def _view(arguments: argparse.Namespace) -> int:
    robot = load_robot(arguments.robot)
    page = served(robot, arguments.tolerance, arguments.host, arguments.port, arguments.largest_force)
    try:
        print(f"{robot.name}: {address_of(page.server)} (Ctrl-C ends)", flush=True)
        threading.Event().wait()
    except KeyboardInterrupt:
        print()
    finally:
        page.stop()
    return SUCCESS


def served(robot: Robot, tolerance: float, host: str, port: int, largest_force: float) -> Page:
    """The page, on a server of its own.

    Raises ``UsageError`` without viser, and for an address that cannot be served at.
    """
    server = new_server(host, port, f"ctr_pvs: {robot.name}")

    from ctr_pvs.cli.live.page import Page
    from ctr_pvs.cli.live.state import LiveRobot

    return Page(server, LiveRobot(robot, tolerance), largest_force)


def new_server(host: str, port: int, label: str) -> ViserServer:
    """An empty page that asks the network for nothing; raises as ``served`` does."""
    try:
        import viser
    except ImportError as error:
        raise UsageError("view needs viser (pip install 'ctr_pvs[view]')") from error
    _check_free(host, port)
    server = viser.ViserServer(host, port, label=label, verbose=False)
    server.gui.configure_theme(show_logo=False, show_share_button=False)
    return server


def address_of(server: ViserServer) -> str:
    """Its URL."""
    host = server.get_host()
    return f"http://{f'[{host}]' if ':' in host else host}:{server.get_port()}"


def _check_free(host: str, port: int) -> None:
    """viser would take another port without a word."""
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        with socket.socket(family, kind, protocol) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind(address)
    except OSError as error:
        raise UsageError(f"--host, --port: cannot serve at {host} port {port}: {error}") from error
