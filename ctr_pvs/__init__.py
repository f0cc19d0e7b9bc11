"""Statics of concentric tube robots by piecewise variable strain: shapes, actuation loads, stability.

>>> from ctr_pvs import EquilibriumSolver, load_robot
>>> solver = EquilibriumSolver(load_robot("config/renda2021.yaml"), tolerance=1e-6)
>>> answer = solver.solve(alpha=[0.0, 1.0], D=[0.0935, 0.2085])
>>> answer.tip.position, answer.torque, answer.stability_margin

What solves is imported when it is first asked for: it brings the compiler along, and whoever only reads a robot file
need not wait for that.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING
from typing import Any

from ctr_pvs.answer.backbone import Backbone
from ctr_pvs.answer.backbone import Pose
from ctr_pvs.answer.status import NoEquilibriumError
from ctr_pvs.answer.status import Status
from ctr_pvs.errors import CommandError
from ctr_pvs.errors import LoadError
from ctr_pvs.errors import RobotError
from ctr_pvs.errors import RobotFileError
from ctr_pvs.errors import RobotWarning
from ctr_pvs.robot.file import load_robot
from ctr_pvs.robot.loads import Loads
from ctr_pvs.robot.loads import PointForce
from ctr_pvs.robot.robot import Limits
from ctr_pvs.robot.robot import Robot
from ctr_pvs.robot.robot import Segment
from ctr_pvs.robot.robot import Tube

if TYPE_CHECKING:
    from ctr_pvs.answer.equilibrium import Equilibrium
    from ctr_pvs.solve.batch import Batch
    from ctr_pvs.solve.equilibria import equilibria
    from ctr_pvs.tasks.inverse import InverseResult
    from ctr_pvs.tasks.inverse import InverseStatus
    from ctr_pvs.tasks.motion import Deployment
    from ctr_pvs.tasks.motion import Motion
    from ctr_pvs.tasks.motion import Rates
    from ctr_pvs.tasks.solver import EquilibriumSolver

__all__ = [
    "Backbone",
    "Batch",
    "CommandError",
    "Deployment",
    "Equilibrium",
    "EquilibriumSolver",
    "InverseResult",
    "InverseStatus",
    "Limits",
    "LoadError",
    "Loads",
    "Motion",
    "NoEquilibriumError",
    "PointForce",
    "Pose",
    "Rates",
    "Robot",
    "RobotError",
    "RobotFileError",
    "RobotWarning",
    "Segment",
    "Status",
    "Tube",
    "equilibria",
    "load_robot",
]

_LATER = {
    "Batch": "ctr_pvs.solve.batch",
    "Deployment": "ctr_pvs.tasks.motion",
    "Equilibrium": "ctr_pvs.answer.equilibrium",
    "EquilibriumSolver": "ctr_pvs.tasks.solver",
    "InverseResult": "ctr_pvs.tasks.inverse",
    "InverseStatus": "ctr_pvs.tasks.inverse",
    "Motion": "ctr_pvs.tasks.motion",
    "Rates": "ctr_pvs.tasks.motion",
    "equilibria": "ctr_pvs.solve.equilibria",
}

if not TYPE_CHECKING:  # checkers would take any name for one of ours

    def __getattr__(name: str) -> Any:
        if name not in _LATER:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        value = globals()[name] = getattr(import_module(_LATER[name]), name)
        return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
