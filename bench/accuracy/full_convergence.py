"""How the `full` level converges to `torsion` as its bases grow: the table of docs/model_levels.md.

scripts/in_env.sh python3 -m bench.accuracy.full_convergence
"""

from __future__ import annotations

import numpy as np

from bench.common.places import CONFIG
from ctr_pvs import EquilibriumSolver
from ctr_pvs import Robot
from ctr_pvs import Segment
from ctr_pvs import Tube
from ctr_pvs import load_robot
from ctr_pvs.oracles.standard_model import solve_standard_bvp
from ctr_pvs.pvs.energy import FullEnergy
from ctr_pvs.pvs.frames import tip_position
from ctr_pvs.pvs.solution import FullSolution
from ctr_pvs.pvs.solution import solve_full
from ctr_pvs.pvs.strain_basis import PolynomialBasis

DEGREES = (1, 2, 3, 4, 5, 6, 8, 10, 12)
FINE = 1e-10  # m, backbone integration


def four_tubes() -> Robot:
    """Four tubes with different planes of pre-curvature; tips in mixed order."""
    shapes = [(0.05, 0.06, 9.0), (0.08, 0.07, 4.0 + 6.0j), (0.11, 0.05, -5.0 + 3.0j), (0.14, 0.08, 11.0j)]
    tubes = []
    for index, (straight, curved, kappa) in enumerate(shapes):
        K = 0.05 / (index + 1)
        tubes.append(Tube(f"t{index}", (Segment(straight, K, K / 1.3), Segment(curved, K, K / 1.3, (kappa,)))))
    return Robot("four", tuple(tubes))


def scenes() -> list[tuple[str, Robot, list[float], list[float]]]:
    seed, fig2 = (load_robot(CONFIG / f"{name}.yaml") for name in ("renda2021", "renda2021_fig2"))
    three = load_robot(CONFIG / "three_tubes.yaml")
    middle = [0.4 * tube.length for tube in three.tubes]
    return [
        ("Fig. 2, 180 deg", fig2, [0.0, np.pi], [0.0, 0.0]),
        ("Fig. 4 full, 260 deg", seed, [0.0, np.radians(260)], [0.0935, 0.2085]),
        ("Fig. 4 partial, 200 deg", seed, [0.0, np.radians(200)], [0.0935, 0.1705]),
        ("three tubes", three, [0.0, 1.0, -1.5], sorted(middle)),
        ("four tubes", four_tubes(), [0.0, 1.0, -1.0, 2.0], [0.03, 0.05, 0.08, 0.1]),
    ]


def main() -> None:
    columns = []
    for name, robot, alpha, D in scenes():
        torsion = EquilibriumSolver(robot, tolerance=1e-10).solve(alpha, D)
        if not torsion.success:
            raise SystemExit(f"{name}: {torsion.message}")
        tip = tip_position(torsion.shape, FINE)
        standard = solve_standard_bvp(robot, alpha, D, tolerance=1e-9, guess=torsion.shape)
        column = [name]
        for degree in DEGREES:
            materials = torsion.shape.materials
            energy = FullEnergy(materials, torsion.alpha, PolynomialBasis(degree), nodes=degree + 8)
            result = solve_full(energy, energy.project(torsion.shape))
            solution = FullSolution(energy, result.q)
            column.append(f"{np.linalg.norm(tip_position(solution.shape, FINE) - tip):.1e} ({energy.n})")
        column.append(f"{np.linalg.norm(standard.tip - tip):.1e}")
        columns.append(column)
    labels = ["degree", *map(str, DEGREES), "standard model"]
    for index, row in enumerate(zip(labels, *columns, strict=True)):
        print("| " + " | ".join(row) + " |")
        if index == 0:
            print("|" + "---|" * len(row))


if __name__ == "__main__":
    main()
