"""Robots and commands of docs/insertion_forces.md."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ctr_pvs import Equilibrium
from ctr_pvs import EquilibriumSolver
from ctr_pvs import Robot
from ctr_pvs.renda2021.loads import TABLE2
from ctr_pvs.renda2021.numbers import PRINTED
from ctr_pvs.renda2021.robots import curved_robot
from ctr_pvs.renda2021.robots import fig4_robot

Array = NDArray[np.float64]

TOLERANCE = 1e-9
SEED = fig4_robot()

#: The loop round the cusp: commands (alpha_1, alpha_2, D_1, D_2) [rad], [m].
CUSP_LOOP = tuple(
    np.array([0.0, np.radians(angle), 0.09, 1e-3 * D2])
    for angle, D2 in ((190, 170.5), (120, 170.5), (120, 130.0), (240, 130.0), (240, 170.5), (190, 170.5))
)


@dataclass(frozen=True)
class Case:
    """A two-tube robot at one command.  printed : tau_D2 [N] as Table II has it, where this is one of its rows."""

    name: str
    robot: Robot
    alpha: Array
    D: Array
    printed: str = ""

    def solve(self) -> Equilibrium:
        return EquilibriumSolver(self.robot, TOLERANCE).solve(self.alpha, self.D)

    @property
    def tip(self) -> float:
        """Arc length [m] at which tube 1 ends."""
        return float(self.robot.tubes[0].length - self.D[0])


def table_2_cases() -> list[Case]:
    """Rows b) to f) of Table II, in the geometry that ``ctr-pvs reproduce`` uses."""
    return [
        Case(
            f"{row})",
            curved_robot("table2", case.L, case.outer, case.inner),
            np.radians([0.0, case.alpha_2]),
            np.array(case.D),
            PRINTED[f"table2_{row}_force"].text,
        )
        for row, case in TABLE2.items()
        if row != "a"
    ]


def jump_case() -> Case:
    """The seed's tubes with the start of tube 2's curved part amid the overlap: eq. (41) does not apply."""
    return Case("Fig. 3 tubes", SEED, np.radians([0.0, 100.0]), np.array([0.1, 0.1705]))
