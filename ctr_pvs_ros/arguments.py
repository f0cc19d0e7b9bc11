"""What the command line asks for, held against what the node has got.

Where a parameter file and the command line give one parameter values of different types, ROS 2 keeps both and takes the
one whose type it looks for first: `-p tolerance:=abc` is then passed over, and nothing is said.
"""

from __future__ import annotations

from collections.abc import Iterator
from collections.abc import Sequence
from typing import Any

import yaml
from rclpy.node import Node

from ctr_pvs_ros.parameters import ParameterError

FLAGS = ("-p", "--param")


def check_parameters_given(arguments: Sequence[str], node: Node) -> None:
    """Raises ParameterError where a parameter of the node is not what the command line says."""
    for name, text in dict(_given(arguments, node.get_name())).items():
        if not node.has_parameter(name):
            continue
        value = node.get_parameter(name).value
        if not _is(text, value):
            expected = f"a value like the parameter file's ({value!r}), which would stand"
            raise ParameterError(f"parameter {name}: expected {expected}, got {text!r}")


def _given(arguments: Sequence[str], node_name: str) -> Iterator[tuple[str, str]]:
    """Name and text of each parameter rule that holds for the node."""
    in_ros_arguments = False
    for flag, rule in zip(arguments, [*arguments[1:], ""], strict=True):
        if flag == "--ros-args":
            in_ros_arguments = True
        elif flag == "--":
            in_ros_arguments = False
        elif in_ros_arguments and flag in FLAGS:
            left, _, text = rule.partition(":=")
            node, _, name = left.rpartition(":")
            if node in ("", node_name, "/**"):
                yield name, text


def _is(text: str, value: Any) -> bool:
    """Whether a text stands for a value."""
    if isinstance(value, str):
        return True  # every other type that a text may stand for is looked for first, and refused
    if isinstance(value, bool):
        return yaml.safe_load(text) is value
    try:
        if isinstance(value, int | float):
            return float(text) == value
        return list(map(float, yaml.safe_load(text))) == list(map(float, value))
    except (TypeError, ValueError):
        return False
