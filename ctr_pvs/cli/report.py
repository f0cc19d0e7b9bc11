"""An equilibrium as text: strict JSON for scripts, a table for people."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from typing import TYPE_CHECKING
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.answer.backbone import Pose
from ctr_pvs.answer.status import NoEquilibriumError
from ctr_pvs.cli.loads import loads_as_json
from ctr_pvs.cli.loads import loads_as_line
from ctr_pvs.renda2021.columns import aligned
from ctr_pvs.robot.plausibility import implausible
from ctr_pvs.robot.robot import Robot

if TYPE_CHECKING:
    from ctr_pvs.answer.equilibrium import Equilibrium

LOAD_NOTE = (
    "Torque and force are what the actuators supply along +alpha and +D; +D pulls a tube back.\n"
    "The model has no friction and no clearance, and is quasi-static."
)
KINK_NOTE = (
    "A segment boundary or a tip sits on the orifice or on another boundary: any force within the interval holds the\n"
    "tube, and the one shown under force is for a motion towards +D."
)
BASE_NOTE = "The base wrench is what the part beyond the orifice exerts there; the guide holds against it."


def answer_as_json(robot: Robot, equilibrium: Equilibrium, poses: int, hints: list[str]) -> str:
    """One line of strict JSON in SI units, with null for what is not known.

    Args:
        robot: of which it is the equilibrium.
        equilibrium: solved or not.
        poses: number of backbone poses; twists are given at the same arc lengths.
        hints: what else is worth knowing about the command, a line each.
    """
    parts: dict[str, Callable[[], Any]] = {
        "success": lambda: equilibrium.success,
        "status": lambda: equilibrium.status.value,
        "message": lambda: equilibrium.message,
        "tip": lambda: _pose(equilibrium.tip),
        "backbone": lambda: _backbone(equilibrium, poses),
        "twist": lambda: _twist(equilibrium, poses),
        "torque": lambda: equilibrium.torque,
        "force": lambda: equilibrium.force,
        "force_interval": lambda: equilibrium.force_interval,
        "stability_margin": lambda: equilibrium.stability_margin,
        "fidelity": lambda: equilibrium.fidelity,
        "degrees_of_freedom": lambda: equilibrium.degrees_of_freedom,
        "error_estimate": lambda: equilibrium.error_estimate,
        "residual": lambda: equilibrium.residual,
        "iterations": lambda: equilibrium.iterations,
        "energy": lambda: equilibrium.energy,
        "potential": lambda: equilibrium.potential,
        "loads": lambda: loads_as_json(robot, equilibrium.applied_loads),
        "base_wrench": lambda: _wrench(equilibrium),
        "jacobian": lambda: equilibrium.jacobian,
        "compliance": lambda: equilibrium.compliance,
        "force_interval_reversed": lambda: equilibrium.force_interval_reversed,
        "warnings": lambda: implausible(robot) + _warnings(robot, equilibrium),
        "hints": lambda: hints,
    }
    return json.dumps({key: _strict(_known(part)) for key, part in parts.items()}, allow_nan=False)


def answer_as_text(robot: Robot, equilibrium: Equilibrium, degrees: bool) -> str:
    """A few lines and a table, with units.

    Args:
        robot: of which it is the equilibrium.
        equilibrium: solved or not.
        degrees: show angles in degrees, not radians.
    """
    outcome = f"{robot.name}: {equilibrium.status.value}: {equilibrium.message}"
    tip = _known(lambda: equilibrium.tip)
    if tip is None:
        return outcome
    lines = [
        outcome,
        f"tip position     {_components('xyz', 1e3 * tip.position, 4)}  mm",
        f"tip orientation  {_components('xyzw', tip.orientation, 6)}",
        "",
        *aligned(_header(equilibrium, degrees), *_rows(robot, equilibrium, degrees)),
        LOAD_NOTE,
        *([KINK_NOTE] if (equilibrium.loads.kink & ~equilibrium.force_interval_reversed).any() else []),
        *_warnings(robot, equilibrium),
        "",
        *_external(robot, equilibrium),
        f"stability margin {equilibrium.stability_margin:.4f} (below 0 unstable, 0 at a snap, at most 1)",
        _energy(equilibrium),
        f"{equilibrium.fidelity} model, {equilibrium.degrees_of_freedom} degrees of freedom, "
        f"{equilibrium.iterations} iterations, residual {equilibrium.residual:.1e} rad, "
        f"estimated tip error {1e3 * equilibrium.error_estimate:.1e} mm",
    ]
    return "\n".join(lines)


def _known(part: Callable[[], Any]) -> Any:
    """What `part` gives, or None where the answer holds no equilibrium to take it from."""
    try:
        return part()
    except NoEquilibriumError:
        return None


def _external(robot: Robot, equilibrium: Equilibrium) -> list[str]:
    """Lines about external loads; none without any."""
    loads = equilibrium.applied_loads
    if loads is None or loads.is_none:
        return []
    wrench = equilibrium.base_wrench
    return [
        f"external loads   {loads_as_line(robot, loads)}",
        f"base force       {_components('xyz', wrench.force, 4)}  N",
        f"base moment      {_components('xyz', wrench.moment, 6)}  N m",
        BASE_NOTE,
        "",
    ]


def _energy(equilibrium: Equilibrium) -> str:
    """The elastic energy, and that less the work of the loads where these make it another and have a potential."""
    energy, potential = equilibrium.energy, equilibrium.potential
    with_loads = math.isfinite(potential) and potential != energy
    return f"elastic energy {energy:.6g} J" + (f", potential with the loads {potential:.6g} J" if with_loads else "")


def _warnings(robot: Robot, equilibrium: Equilibrium) -> list[str]:
    """What a reader of the numbers should not overlook, a line each; none without an equilibrium."""
    reversed_ = _known(lambda: equilibrium.force_interval_reversed)
    if reversed_ is None:
        return []
    return [
        f"tube {tube.name}: the force interval is reversed, a concave kink: no constant force holds the tube here"
        for tube, concave in zip(robot.tubes, reversed_, strict=True)
        if concave
    ]


def _wrench(equilibrium: Equilibrium) -> dict[str, Any]:
    wrench = equilibrium.base_wrench
    return {"force": wrench.force, "moment": wrench.moment}


def _pose(pose: Pose) -> dict[str, Any]:
    return {"position": pose.position, "orientation": pose.orientation}


def _backbone(equilibrium: Equilibrium, poses: int) -> list[dict[str, Any]]:
    backbone = equilibrium.backbone(poses)
    rows = zip(backbone.s, backbone.position, backbone.orientation, strict=True)
    return [{"s": s, "position": position, "orientation": orientation} for s, position, orientation in rows]


def _twist(equilibrium: Equilibrium, poses: int) -> dict[str, Any]:
    s = equilibrium.backbone(poses).s
    return {"s": s, "psi": equilibrium.twist(s)}


def _strict(value: Any) -> Any:
    """`value` as plain lists, dicts and numbers, with None for the numbers that JSON has no word for."""
    if isinstance(value, np.ndarray | np.generic):
        return _strict(value.tolist())
    if isinstance(value, dict):
        return {key: _strict(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_strict(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def _header(equilibrium: Equilibrium, degrees: bool) -> list[str]:
    header = ["tube", "alpha [deg]" if degrees else "alpha [rad]", "D [mm]", "torque [N m]", "force [N]"]
    return [*header, "interval [N]", ""] if equilibrium.kink else header


def _rows(robot: Robot, equilibrium: Equilibrium, degrees: bool) -> list[list[str]]:
    rows = []
    for index, tube in enumerate(robot.tubes):
        alpha = equilibrium.alpha[index]
        row = [
            tube.name,
            _fixed(math.degrees(alpha), 4) if degrees else _fixed(alpha, 6),
            _fixed(1e3 * equilibrium.D[index], 4),
            _fixed(equilibrium.torque[index], 6),
            _fixed(equilibrium.force[index], 4),
        ]
        if equilibrium.kink:
            row += [_fixed(end, 4) for end in equilibrium.force_interval[index]]
        rows.append(row)
    return rows


def _components(names: str, values: NDArray[np.float64], decimals: int) -> str:
    return "  ".join(f"{name} {_fixed(value, decimals)}" for name, value in zip(names, values, strict=True))


def _fixed(value: float, decimals: int) -> str:
    """`value` with so many decimals, and no minus before a zero."""
    return f"{round(float(value), decimals) + 0.0:.{decimals}f}"
