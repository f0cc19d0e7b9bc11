"""What ctr_client prints: statuses and answers as text for people and as JSON. Reads messages, but needs no ROS."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING
from typing import Any

from ctr_pvs_ros.client.words import ROTATION

if TYPE_CHECKING:
    from geometry_msgs.msg import PoseStamped
    from geometry_msgs.msg import Wrench
    from sensor_msgs.msg import JointState

    from ctr_pvs_interfaces.msg import EquilibriumStatus
    from ctr_pvs_interfaces.msg import InverseSolution
    from ctr_pvs_interfaces.srv import SolveEquilibrium
    from ctr_pvs_interfaces.srv import SolveInverse

#: By the numbers of EquilibriumStatus.outcome and of the bits of .trigger.
OUTCOMES = ("accepted", "refused", "failed", "snap")
TRIGGERS = {1: "command", 2: "wrench", 4: "pose"}
ANSWERED = ("accepted", "snap")
OF_STATUS = (
    "reason",
    "message",
    "hint",
    "stability_margin",
    "snap_reserve",
    "error_estimate",
    "solve_time",
    "fidelity",
    "degrees_of_freedom",
    "tip_distance",
)
OF_SEARCH = ("success", "status", "message", "iterations", "solve_time")
OF_SOLUTION = ("distance", "angle", "stability_margin", "way_stability_margin")
OF_RESPONSE = (
    "success",
    "status",
    "message",
    "torque",
    "force",
    "force_lower",
    "force_upper",
    "force_interval_reversed",
    "stability_margin",
    "fidelity",
    "degrees_of_freedom",
    "error_estimate",
    "residual",
    "iterations",
    "energy",
    "solve_time",
)


def outcome_of(status: EquilibriumStatus) -> str:
    """In a word."""
    return OUTCOMES[status.outcome]


def answered(status: EquilibriumStatus) -> bool:
    """Whether the outputs carry its stamp."""
    return outcome_of(status) in ANSWERED


def status_in_words(status: EquilibriumStatus) -> str:
    """What became of a command, without its numbers."""
    outcome, message = outcome_of(status), status.message
    said = status.reason == outcome or message.startswith(f"{status.reason}: ")
    return f"{outcome}: {'' if said else f'{status.reason}: '}{message}{f'; {status.hint}' if status.hint else ''}"


def status_as_text(
    status: EquilibriumStatus, tip: PoseStamped | None, joints: JointState | None, degrees: bool = False
) -> str:
    """Some lines: what became of a command, and the answer where there is one."""
    said = status.message.startswith(f"{status.reason}: ")
    rows = [(outcome_of(status), status.message if said else f"{status.reason}: {status.message}")]
    rows += [("hint", status.hint)] if status.hint else []
    rows += _quality(status.stability_margin, status.snap_reserve, status.error_estimate)
    rows += _solve(status)
    rows += [("load", wrench)] if (wrench := _wrench(status.applied_wrench)) else []
    rows += [("tip", _tip(tip))] if tip is not None else []
    if joints is not None:
        rows += _joint_rows(joints, degrees)
    return _aligned(rows)


def status_as_line(status: EquilibriumStatus, tip: PoseStamped | None) -> str:
    """One line; what is said beside the numbers stands at its end."""
    stamp = status.header.stamp
    outcome = outcome_of(status)
    parts = [f"{stamp.sec}.{stamp.nanosec // 1_000_000:03d} {outcome:8s} {status.reason:13s}"]
    if answered(status):
        place = _position(tip.pose) if tip is not None else "not heard"
        parts.append(f"margin {_number(status.stability_margin)} reserve {_number(status.snap_reserve)} tip {place}")
    parts += [] if outcome == "accepted" else [status.message]
    parts += [status.hint] if status.hint else []
    return "  ".join(parts)


def status_as_json(status: EquilibriumStatus, tip: PoseStamped | None, joints: JointState | None = None) -> str:
    """One line of JSON."""
    content = {
        "stamp": _stamp(status),
        "outcome": outcome_of(status),
        "trigger": [name for bit, name in TRIGGERS.items() if status.trigger & bit],
        **{name: getattr(status, name) for name in OF_STATUS},
        "applied_wrench": {name: _xyz(getattr(status.applied_wrench, name)) for name in ("force", "torque")},
        "tip": None if tip is None else _pose(tip.pose),
    }
    if joints is not None:
        content["joints"] = {name: list(getattr(joints, name)) for name in ("name", "position", "effort")}
    return _json(content)


def response_as_text(response: SolveEquilibrium.Response) -> str:
    """Some lines: the status, and the answer where there is one; tubes are counted from the outermost."""
    rows = [(response.status, response.message)]
    if response.success:
        rows += _quality(response.stability_margin, math.nan, response.error_estimate)
        rows += _solve(response)
        rows += [("tip", _tip(response.tip))]
        count = len(response.torque)
        rows += [(f"tube {index + 1} of {count}", _tube(response, index)) for index in range(count)]
    return _aligned(rows)


def response_as_json(response: SolveEquilibrium.Response) -> str:
    """One line of JSON."""
    content = {name: getattr(response, name) for name in OF_RESPONSE}
    poses = [_pose(pose) for pose in response.backbone.poses]
    return _json(
        {
            **content,
            "stamp": _stamp(response.tip),
            "frame_id": response.tip.header.frame_id,
            "tip": _pose(response.tip.pose) if response.success else None,
            "backbone": {
                "s": list(response.backbone_s),
                **{name: [pose[name] for pose in poses] for name in ("position", "orientation")},
            },
        }
    )


def search_as_text(response: SolveInverse.Response, degrees: bool = False) -> str:
    """Some lines: the status, and every command that was found."""
    rows = [(response.status, response.message)]
    solutions = [response.solution, *response.others] if response.solution.command.name else []
    if solutions:
        rows.append(("solve time", f"{response.solve_time * 1e3:.2f} ms, {response.iterations} steps tried"))
    for number, solution in enumerate(solutions, start=1):
        rows += [("solution", f"{number} of {len(solutions)}")] if len(solutions) > 1 else []
        rows += _solution(solution, degrees)
    return _aligned(rows)


def search_as_json(response: SolveInverse.Response) -> str:
    """One line of JSON."""
    content = {name: getattr(response, name) for name in OF_SEARCH}
    solutions = [response.solution, *response.others] if response.solution.command.name else []
    return _json({**content, "solutions": [_solution_content(solution) for solution in solutions]})


def _solution(solution: InverseSolution, degrees: bool) -> list[tuple[str, str]]:
    way = solution.way_stability_margin
    told = f"{len(way)} commands, least margin {min(way):.4f} (--json: all)" if len(way) else "none known"
    return [
        *_quality(solution.stability_margin, math.nan, math.nan),
        ("tip", _tip(solution.tip)),
        *_joint_rows(solution.command, degrees),
        ("way", told),
    ]


def _solution_content(solution: InverseSolution) -> dict[str, Any]:
    joints = {name: list(getattr(solution.command, name)) for name in ("name", "position", "effort")}
    count, way = len(joints["name"]), list(solution.way)
    return {
        **{name: getattr(solution, name) for name in OF_SOLUTION},
        "joints": joints,
        "tip": _pose(solution.tip.pose),
        "way": [way[first : first + count] for first in range(0, len(way), count)],
    }


def _quality(margin: float, reserve: float, error: float) -> list[tuple[str, str]]:
    """What is known of them."""
    told = (
        ("margin", margin, f"{margin:.4f} (1 far from a snap, 0 at it)"),
        ("snap reserve", reserve, f"{reserve:.4f} (1 relaxed, 0 at a snap)"),
        ("error estimate", error, f"{error:.1e} m, of the tip"),
    )
    return [(label, text) for label, value, text in told if not math.isnan(value)]


def _solve(told: Any) -> list[tuple[str, str]]:
    """Of a status or a response."""
    if math.isnan(told.solve_time):
        return []
    by = f", {told.fidelity} with {told.degrees_of_freedom} unknowns" if told.degrees_of_freedom else ""
    return [("solve time", f"{told.solve_time * 1e3:.2f} ms{by}")]


def _joint_rows(joints: JointState, degrees: bool) -> list[tuple[str, str]]:
    return [
        (name, _joint(name, position, effort, degrees))
        for name, position, effort in zip(joints.name, joints.position, joints.effort, strict=True)
    ]


def _joint(name: str, position: float, effort: float, degrees: bool) -> str:
    if not name.endswith(ROTATION):
        return f"{position:10.6f} m    {effort + 0.0:10.4f} N"
    turned = f"{math.degrees(position):10.3f} deg" if degrees else f"{position:10.6f} rad"
    return f"{turned}  {effort + 0.0:10.4f} N m"


def _tube(response: SolveEquilibrium.Response, index: int) -> str:
    lower, upper = response.force_lower[index], response.force_upper[index]
    text = f"{response.torque[index] + 0.0:10.4f} N m {response.force[index] + 0.0:10.4f} N"
    return text if lower == upper else f"{text}, from {lower:.4f} to {upper:.4f} N"


def _tip(tip: PoseStamped) -> str:
    return f"{_position(tip.pose)} in {tip.header.frame_id}"


def _position(pose: Any) -> str:
    return " ".join(f"{1e3 * value + 0.0:8.3f}" for value in _xyz(pose.position)) + " mm"


def _number(value: float) -> str:
    return "unknown" if math.isnan(value) else f"{value:.4f}"


def _wrench(wrench: Wrench) -> str:
    """On the tip; nothing where nothing acts."""
    parts = ((_xyz(wrench.force), "N"), (_xyz(wrench.torque), "N m"))
    return ", ".join(f"{' '.join(f'{value:g}' for value in vector)} {unit}" for vector, unit in parts if any(vector))


def _aligned(rows: Sequence[tuple[str, str]]) -> str:
    width = max(len(label) for label, _ in rows)
    return "\n".join(f"{label:{width}s}  {text}" for label, text in rows)


def _stamp(message: Any) -> dict[str, int]:
    stamp = message.header.stamp
    return {"sec": stamp.sec, "nanosec": stamp.nanosec}


def _pose(pose: Any) -> dict[str, list[float]]:
    turn = pose.orientation
    return {"position": _xyz(pose.position), "orientation": [turn.x, turn.y, turn.z, turn.w]}


def _xyz(vector: Any) -> list[float]:
    return [vector.x, vector.y, vector.z]


def _json(content: Any) -> str:
    return json.dumps(_plain(content), allow_nan=False)


def _plain(value: Any) -> Any:
    """As JSON has it: no number for a NaN, and lists for what messages have as arrays."""
    if isinstance(value, dict):
        return {name: _plain(part) for name, part in value.items()}
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, str | bool | int) or value is None:
        return value
    return [_plain(part) for part in value]
