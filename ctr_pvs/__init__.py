"""Statics of concentric tube robots by piecewise variable strain: shapes, actuation loads, stability.

>>> from ctr_pvs import EquilibriumSolver, load_robot
>>> solver = EquilibriumSolver(load_robot("config/renda2021.yaml"), tolerance=1e-6)
>>> answer = solver.solve(alpha=[0.0, 1.0], D=[0.0935, 0.2085])
>>> answer.tip.position, answer.torque, answer.stability_margin
"""

from ctr_pvs.backbone import Backbone
from ctr_pvs.backbone import Pose
from ctr_pvs.batch import Batch
from ctr_pvs.equilibrium import Equilibrium
from ctr_pvs.errors import CommandError
from ctr_pvs.errors import RobotError
from ctr_pvs.errors import RobotFileError
from ctr_pvs.robot.file import load_robot
from ctr_pvs.robot.robot import Limits
from ctr_pvs.robot.robot import Robot
from ctr_pvs.robot.robot import Segment
from ctr_pvs.robot.robot import Tube
from ctr_pvs.solver import EquilibriumSolver
from ctr_pvs.status import NoEquilibriumError
from ctr_pvs.status import Status

__all__ = [
    "Backbone",
    "Batch",
    "CommandError",
    "Equilibrium",
    "EquilibriumSolver",
    "Limits",
    "NoEquilibriumError",
    "Pose",
    "Robot",
    "RobotError",
    "RobotFileError",
    "Segment",
    "Status",
    "Tube",
    "load_robot",
]
