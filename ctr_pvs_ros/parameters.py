"""The node's parameters: one table with description, unit, range and default, read into a frozen Settings."""

from __future__ import annotations

import math
from collections.abc import Iterable
from collections.abc import Mapping
from dataclasses import dataclass
from dataclasses import fields
from typing import Any

from rcl_interfaces.msg import FloatingPointRange
from rcl_interfaces.msg import IntegerRange
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.node import Node
from rclpy.parameter import Parameter

MAX_BACKBONE_POSES = 10_000
#: Where external loads can act.
LOADED_FIDELITIES = ("auto", "full")
LOADED_FORCE_MODELS = ("virtual_work",)


@dataclass(frozen=True)
class Settings:
    """The values of all parameters; see PARAMETERS for what each means."""

    robot_file: str
    frame_id: str
    tip_frame_id: str
    joint_prefix: str
    translation_sign: int
    tolerance: float
    fidelity: str
    force_model: str
    initial_command: tuple[float, ...]
    publish_backbone_s: bool
    publish_jacobian: bool
    publish_tf: bool
    use_external_wrench: bool
    backbone_poses: int
    rotation_limits: tuple[float, ...]
    translation_limits: tuple[float, ...]
    on_snap: str
    servo_cp_goal: str
    rotation_rate: float
    translation_rate: float
    command_timeout: float
    wrench_timeout: float
    compute_budget: float
    merge_partial: bool
    clamp_to_limits: bool
    accept_nameless: bool
    ignore_unknown_joints: bool
    unwrap_rotations: bool
    margin_warn: float
    margin_stop: float


@dataclass(frozen=True)
class ParameterRule:
    """What is declared for one parameter. `bounds` is inclusive; `choices` lists the allowed values."""

    default: Any
    description: str
    bounds: tuple[float, float] | None = None
    choices: tuple[str | int, ...] = ()
    read_only: bool = False


PARAMETERS: dict[str, ParameterRule] = {
    "robot_file": ParameterRule("", "Path of the robot file (YAML). Required.", read_only=True),
    "frame_id": ParameterRule(
        "ctr_base", "Frame of all poses: origin at the insertion orifice, +x along the insertion.", read_only=True
    ),
    "tip_frame_id": ParameterRule(
        "ctr_tip", "Frame of the tip, for wrenches and TF: that of the pose on setpoint_cp.", read_only=True
    ),
    "joint_prefix": ParameterRule(
        "", "Stands before the names of all joints, as in a URDF with several robots.", read_only=True
    ),
    "translation_sign": ParameterRule(
        1,
        "1: the position of a translation is D, the distance from the tube's base to the orifice; -1: it is -D, which "
        "others call beta, and forces are counted along it.",
        choices=(1, -1),
        read_only=True,
    ),
    "tolerance": ParameterRule(
        1e-5, "Largest estimated tip error of an answer [m].", bounds=(1e-10, 1.0), read_only=True
    ),
    # The solver knows these levels and force models. It is not asked: importing it takes longer than a refusal may.
    "fidelity": ParameterRule(
        "auto",
        "Model level; auto picks the smallest that meets the tolerance.",
        choices=("auto", "torsionless", "torsion", "full"),
        read_only=True,
    ),
    "force_model": ParameterRule(
        "virtual_work",
        "How insertion forces are computed; virtual_work: derivative of the elastic energy.",
        choices=("virtual_work", "renda2021"),
        read_only=True,
    ),
    "initial_command": ParameterRule(
        [],
        "Command solved at start-up: all rotations [rad], then all translations [m], outermost first. Empty: none.",
        read_only=True,
    ),
    "publish_backbone_s": ParameterRule(
        False, "Publish the arc length of each backbone pose [m] on backbone_s.", read_only=True
    ),
    "publish_jacobian": ParameterRule(
        False, "Publish the rates of the tip by the joints on jacobian [m and rad by rad and m].", read_only=True
    ),
    "publish_tf": ParameterRule(False, "Tell TF of the tip: frame_id to tip_frame_id.", read_only=True),
    "use_external_wrench": ParameterRule(
        False, "Take the external load on the tip [N, N m] from external_wrench.", read_only=True
    ),
    "backbone_poses": ParameterRule(
        60, "Number of poses on the backbone, both ends included.", bounds=(2, MAX_BACKBONE_POSES)
    ),
    "rotation_limits": ParameterRule(
        [],
        "Limits of the rotations within those of the robot file [rad]: low and high of each tube in turn, outermost "
        "first. Empty: the robot file's alone.",
    ),
    "translation_limits": ParameterRule(
        [],
        "Limits of the translations within those of the robot file [m]: low and high of each tube in turn, outermost "
        "first. Empty: the robot file's alone.",
    ),
    "on_snap": ParameterRule(
        "follow",
        "When a command makes the tubes snap: follow publishes the landing, hold keeps the answer before the snap, "
        "stop holds and refuses all further commands until this parameter is set again.",
        choices=("follow", "hold", "stop"),
    ),
    "servo_cp_goal": ParameterRule(
        "position",
        "What of a pose on servo_cp the tip should meet; tangent: and its x axis, orientation: and all of it.",
        choices=("position", "tangent", "orientation"),
    ),
    "rotation_rate": ParameterRule(
        0.0, "Most that poses on servo_cp turn a tube [rad/s]; 0: no limit.", bounds=(0.0, 1000.0)
    ),
    "translation_rate": ParameterRule(
        0.0, "Most that poses on servo_cp slide a tube [m/s]; 0: no limit.", bounds=(0.0, 100.0)
    ),
    "command_timeout": ParameterRule(
        0.0, "Diagnostics say stale when no command came for this long [s]; 0: never.", bounds=(0.0, 86400.0)
    ),
    "wrench_timeout": ParameterRule(
        0.0,
        "Diagnostics warn when no wrench came for this long, and the last load is held [s]; 0: never.",
        bounds=(0.0, 86400.0),
    ),
    "compute_budget": ParameterRule(1.0, "Wall-clock limit of one solve [s].", bounds=(1e-4, 60.0)),
    "merge_partial": ParameterRule(
        False, "Complete a command that names only some joints from the last accepted one; otherwise refuse it."
    ),
    "clamp_to_limits": ParameterRule(
        False, "Move a command outside the limits to the nearest one inside, and report it; otherwise refuse it."
    ),
    "accept_nameless": ParameterRule(
        False, "Accept a JointState without names: rotation and translation of each tube in turn, outermost first."
    ),
    "ignore_unknown_joints": ParameterRule(
        False, "Pass over joints that are none of this robot's, as on a shared joint_states; otherwise refuse them."
    ),
    "unwrap_rotations": ParameterRule(
        False, "Take each rotation for the one nearest to the last command's that is whole turns away from it."
    ),
    "margin_warn": ParameterRule(
        0.1, "Diagnostics warn below this stability margin [no unit, 1 far from a fold, 0 at it].", bounds=(0.0, 1.0)
    ),
    "margin_stop": ParameterRule(
        0.0,
        "Answers below this stability margin are not published [no unit]; 0: all stable ones are.",
        bounds=(0.0, 1.0),
    ),
}

#: Arrays of numbers. ROS has several types of those, and none for an empty one, so they are declared without a type.
ARRAYS = tuple(name for name, rule in PARAMETERS.items() if rule.default == [])


class ParameterError(ValueError):
    """A parameter value that passes its type and range but breaks another rule."""


def declare(node: Node) -> list[str]:
    """Declare all parameters; raises rclpy's ParameterException for a value of a wrong type or out of range.

    Returns:
        The names that were given at start-up and are no parameter's.
    """
    given = node._parameter_overrides  # what rclpy has no other name for
    for name, rule in PARAMETERS.items():
        empty = name in given and given[name].value is None  # as `[]` arrives, which is a value here
        node.declare_parameter(name, rule.default, _descriptor(rule), ignore_override=empty)
    return sorted(name for name in given if not node.has_parameter(name))


def read(node: Node, changed: Mapping[str, Any] | None = None) -> Settings:
    """The declared parameters as they are, or as they would be with `changed`; raises ParameterError."""
    values = {field.name: _value(node, field.name) for field in fields(Settings)}
    values.update({name: value for name, value in (changed or {}).items() if name in values})
    for name in ARRAYS:
        values[name] = _numbers(name, values[name])
    settings = Settings(**values)
    _check(settings)
    return settings


def _numbers(name: str, value: Any) -> tuple[float, ...]:
    """A parameter that may be an array of any type."""
    if isinstance(value, str | bytes) or not isinstance(value, Iterable):
        raise ParameterError(f"parameter {name}: expected an array of numbers, got {value!r}")
    array = list(value)
    if not all(isinstance(number, int | float) and not isinstance(number, bool) for number in array):
        raise ParameterError(f"parameter {name}: expected an array of numbers, got {array!r}")
    if not all(map(math.isfinite, array)):
        raise ParameterError(f"parameter {name}: expected finite numbers, got {array!r}")
    return tuple(map(float, array))


def _value(node: Node, name: str) -> Any:
    return node.get_parameter_or(name, Parameter(name, Parameter.Type.NOT_SET)).value


def _descriptor(rule: ParameterRule) -> ParameterDescriptor:
    descriptor = ParameterDescriptor(description=rule.description, read_only=rule.read_only)
    if rule.choices:
        descriptor.additional_constraints = "one of: " + ", ".join(map(str, rule.choices))
    if rule.default == []:
        descriptor.dynamic_typing = True
        descriptor.additional_constraints = "an array of finite numbers, whole or not; [] for none"
    if rule.bounds is not None and isinstance(rule.default, int):
        descriptor.integer_range = [IntegerRange(from_value=int(rule.bounds[0]), to_value=int(rule.bounds[1]))]
    elif rule.bounds is not None:
        descriptor.floating_point_range = [FloatingPointRange(from_value=rule.bounds[0], to_value=rule.bounds[1])]
    return descriptor


def _check(settings: Settings) -> None:
    """The rules that a descriptor cannot express."""
    for name, rule in PARAMETERS.items():
        value = getattr(settings, name)
        if rule.choices and value not in rule.choices:
            expected = ", ".join(map(str, rule.choices))
            raise ParameterError(f"parameter {name}: expected one of {expected}, got {value!r}")
    if not settings.robot_file:
        raise ParameterError("parameter robot_file: expected the path of a robot file, got nothing")
    if settings.tip_frame_id in ("", settings.frame_id):
        other = f"a name other than frame_id ({settings.frame_id!r})"
        raise ParameterError(f"parameter tip_frame_id: expected {other}, got {settings.tip_frame_id!r}")
    if settings.use_external_wrench:
        _check_takes_loads(settings)
    if settings.margin_stop > settings.margin_warn:
        limit = f"at most margin_warn ({settings.margin_warn:g})"
        raise ParameterError(f"parameter margin_stop: expected {limit}, got {settings.margin_stop:g}")


def _check_takes_loads(settings: Settings) -> None:
    """Bending is free under load, and eq. (41) knows no loads: the solver would refuse every one."""
    for name, loaded in (("fidelity", LOADED_FIDELITIES), ("force_model", LOADED_FORCE_MODELS)):
        value = getattr(settings, name)
        if value not in loaded:
            rule = f"{' or '.join(loaded)} where use_external_wrench is set"
            raise ParameterError(f"parameter {name}: expected {rule}, got {value!r}")
