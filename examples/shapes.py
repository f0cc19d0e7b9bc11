"""Shapes of the paper's robot while its inner tube turns: the picture at the top of the README.

pip install matplotlib
python3 examples/shapes.py shapes.png
"""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np

from ctr_pvs import EquilibriumSolver
from ctr_pvs import load_robot

mpl.use("Agg")
import matplotlib.pyplot as plt

ROBOT = Path(__file__).resolve().parents[1] / "config" / "renda2021.yaml"
D = [0.0935, 0.1705]  # m
LAST = 200.0  # deg; the robot snaps at 205.92


def main(path: str) -> None:
    solver = EquilibriumSolver(load_robot(ROBOT), tolerance=1e-6)
    figure = plt.figure(figsize=(7.0, 3.6), layout="constrained")
    axes = figure.add_subplot(projection="3d")
    for degrees in np.arange(0.0, LAST + 1.0, 20.0):
        answer = solver.solve([0.0, np.radians(degrees)], D)
        colour = plt.cm.viridis(degrees / LAST)
        for tube, width in ((1, 1.5), (0, 4.0)):
            x, y, z = 1e3 * answer.tube_backbone(tube, 80).position.T
            axes.plot(x, y, z, color=colour, linewidth=width, alpha=0.9)
    axes.set(xlabel="x [mm]", ylabel="y [mm]", zlabel="z [mm]")
    axes.set_box_aspect((85, 60, 50))
    axes.view_init(elev=18, azim=-62)
    figure.colorbar(
        plt.cm.ScalarMappable(plt.Normalize(0.0, LAST), "viridis"), ax=axes, label="inner tube's base [deg]", shrink=0.7
    )
    figure.savefig(path, dpi=110)


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "shapes.png")
