"""The front doors of the executables: what can be said before ROS is loaded, or where there is none.

`ros2 run`, launch files and pip's scripts all come in here. Wrong words are one line on standard error and exit code 2.
"""

from __future__ import annotations

import argparse
import importlib
import importlib.util
import sys
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

from ctr_pvs.cli.version import declare_version
from ctr_pvs.cli.words import UsageError
from ctr_pvs_ros.client import words as client_words

EXIT_BAD_INPUT = 2
ENTRY = textwrap.TextWrapper(110, initial_indent="  ", subsequent_indent="      ", break_on_hyphens=False)

NODE = """\
Serves the equilibria of a concentric tube robot until a signal ends it: commands come on the topic servo_jp, the tip
goes out on setpoint_cp, and so on (docs/ros_interface.md).
"""
NODE_USAGE = (
    "equilibrium_node [--help] [--version]\n"
    "       equilibrium_node --ros-args [--params-file FILE] [-p NAME:=VALUE ...] [-r FROM:=TO ...]"
)
EXAMPLE = "Example: equilibrium_node --ros-args -p robot_file:=renda2021 -p tolerance:=1e-6 -r __ns:=/left"
GET_ROS = (
    "source a ROS 2 Jazzy workspace in which this package was built (colcon build), "
    "or get the sources and call `make run`, which brings its own ROS along"
)


class _Parser(argparse.ArgumentParser):
    """Says what is wrong in one line, without the usage before it."""

    def error(self, message: str) -> NoReturn:
        self.exit(EXIT_BAD_INPUT, f"{self.prog}: {message} (see {self.prog} --help)\n")


def equilibrium_node() -> int:
    """Entry point of the executable equilibrium_node; returns its exit code."""
    words = without_ros_arguments(sys.argv[1:])
    parser = _Parser(
        "equilibrium_node",
        usage=NODE_USAGE,
        description=NODE,
        epilog=_parameters() if {"-h", "--help"} & set(words) else None,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    declare_version(parser)
    parser.parse_args(words)
    if not _ros_is_here(parser.prog):
        return EXIT_BAD_INPUT

    from ctr_pvs_ros.executable import main

    return main()


def sweep_demo() -> int:
    """Entry point of the executable sweep_demo; returns its exit code."""
    parser = _Parser(
        "sweep_demo",
        description="Streams the sweeps of Fig. 4 through the node, in a process of its own, and checks every tip.",
        allow_abbrev=False,
    )
    declare_version(parser)
    parser.add_argument("--output", type=Path, default=Path("demo"), help="folder for the picture (%(default)s)")
    output = parser.parse_args().output
    if not _ros_is_here(parser.prog):
        return EXIT_BAD_INPUT
    if importlib.util.find_spec("matplotlib") is None:
        return _refused(parser.prog, "the picture needs matplotlib (pip install 'ctr_pvs[plot]')")
    picture = output / "fig4.png"
    try:
        try_to_write(picture)
    except OSError as error:
        return _refused(parser.prog, f"--output: cannot write {picture}: {error.strerror}")

    from ctr_pvs_ros.demo import main

    return main(picture)


def ctr_client() -> int:
    """Entry point of the executable ctr_client; returns its exit code."""
    try:
        arguments = client_words.parse(sys.argv[1:])
    except UsageError as error:
        return _refused("ctr_client", str(error))
    if not _ros_is_here("ctr_client"):
        return EXIT_BAD_INPUT

    from ctr_pvs_ros.client.commands import main

    return main(arguments)


def without_ros_arguments(words: Sequence[str]) -> list[str]:
    """The words that are not for ROS, which takes all between --ros-args and -- or the end."""
    rest: list[str] = []
    for_ros = False
    for word in words:
        if word == "--ros-args":
            for_ros = True
        elif for_ros:
            for_ros = word != "--"
        else:
            rest.append(word)
    return rest


def _parameters() -> str:
    """The parameters as the node declares them; where there is no ROS, where to read about them."""
    if _missing() is not None:
        return f"Parameters: docs/ros_interface.md.\n{EXAMPLE}"
    rules = importlib.import_module("ctr_pvs_ros.parameters").PARAMETERS
    lines = (ENTRY.fill(f"{name}: {rule.description}") for name, rule in rules.items())
    return "\n".join(["parameters, with defaults in share/ctr_pvs/config/equilibrium_node.yaml:", *lines, "", EXAMPLE])


def _missing() -> str | None:
    """A ROS package that is not there; a folder of that name without Python code, as in a checkout, does not count."""
    for package in ("rclpy", "ctr_pvs_interfaces"):
        found = importlib.util.find_spec(package)
        if found is None or found.origin is None:
            return package
    return None


def _ros_is_here(program: str) -> bool:
    package = _missing()
    if package is not None:
        _refused(program, f"needs ROS 2, and there is no Python package {package} here: {GET_ROS}")
    return package is None


def _refused(program: str, reason: str) -> int:
    print(f"{program}: {reason}", file=sys.stderr)
    return EXIT_BAD_INPUT


def try_to_write(path: Path) -> None:
    """Raises OSError if a file cannot be written there; makes its folder."""
    path.parent.mkdir(parents=True, exist_ok=True)
    there = path.exists()
    path.open("ab").close()
    if not there:
        path.unlink()
