"""How well a tip force can be told from what is measured."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from bench.common.document import table
from bench.common.scenes import PARTIAL_OVERLAP
from bench.common.scenes import SEED
from ctr_pvs import EquilibriumSolver
from ctr_pvs import Loads

#: The command and the force [N] that is looked for.
ALPHA, FORCE = np.array([0.0, 1.0]), (0.0, -0.5, 0.2)
TOLERANCE = 1e-6


def sensing_table() -> str:
    """Deviations of the force from exact measurements whose deviations are the default ones."""
    solver = EquilibriumSolver(SEED, TOLERANCE)
    answer = solver.solve(ALPHA, PARTIAL_OVERLAP, loads=Loads(FORCE))
    torque, force, tip = answer.torque, answer.force, answer.tip.position
    measured: dict[str, dict[str, ArrayLike]] = {
        "torques (1 mN m) and forces (50 mN)": {"torque": torque, "force": force},
        "position of the tip (0.5 mm)": {"tip_position": tip},
        "all of them": {"torque": torque, "force": force, "tip_position": tip},
        "torques alone": {"torque": torque},
    }
    rows = []
    for name, arguments in measured.items():
        found = solver.sense_tip_force(ALPHA, PARTIAL_OVERLAP, **arguments)  # type: ignore[arg-type]
        deviations = [f"{x:.2f} N" if np.isfinite(x) else "not seen" for x in np.sqrt(np.diag(found.covariance))]
        blind = "; ".join("(" + ", ".join(f"{x:.2f}" for x in direction) + ")" for direction in found.unseen)
        rows.append([name, *deviations, blind or "none"])
    head = ["what is measured, with its standard deviation", "along x", "y", "z", "directions not seen"]
    return table(head, rows)
