"""The frames of z-forward codes beside ours, with one arc in both: the picture in docs/conventions.md.

pip install matplotlib
python3 examples/conventions.py conventions.png
"""

from __future__ import annotations

import sys

import matplotlib as mpl
import numpy as np

from ctr_pvs import EquilibriumSolver
from ctr_pvs import Robot
from ctr_pvs import Segment
from ctr_pvs import Tube

mpl.use("Agg")
import matplotlib.pyplot as plt

LENGTH, CURVATURE = 0.1, 12.0  # m, 1/m
STIFF = (0.02, 0.015)  # N m^2, of no matter for a tube by itself
#: Pre-curvatures kappa_y + i kappa_z that are drawn: what a z-forward code calls u_x, and u_y.
ARCS = ((CURVATURE + 0j, "C0", r"u_x = \kappa_y > 0"), (1j * CURVATURE, "C1", r"u_y = \kappa_z > 0"))
#: Their axis number k is our axis OURS[k]: their z is our x, and so on around.
OURS = (1, 2, 0)


def arc(kappa: complex) -> np.ndarray:
    """(60, 3) positions [mm] in our axes of a tube of constant pre-curvature at alpha = 0."""
    robot = Robot("one", (Tube("one", (Segment(LENGTH, *STIFF, (kappa,)),)),))
    return 1e3 * EquilibriumSolver(robot).solve([0.0], [0.0]).backbone(60).position


def draw(axes, to_page: tuple[int, ...], title: str) -> None:
    """The arcs and the axes of a frame whose axis k is our axis to_page[k]; the tangent always points up the page."""
    for kappa, colour, label in ARCS:
        axes.plot(*arc(kappa)[:, OURS].T, color=colour, linewidth=4.0, label=f"${label}$")
    for name, ours in zip("xyz", to_page, strict=True):
        tip = np.zeros(3)
        tip[OURS.index(ours)] = 45.0
        axes.quiver(0, 0, 0, *tip, color="black", arrow_length_ratio=0.12)
        axes.text(*(1.15 * tip), name, fontsize=12)
    axes.set(title=title, xlim=(-60, 60), ylim=(-60, 60), zlim=(0, 75))
    axes.set_box_aspect((120, 120, 75), zoom=1.3)
    axes.view_init(elev=22, azim=-55)
    axes.set_axis_off()


def main(path: str) -> None:
    figure = plt.figure(figsize=(8.0, 3.4), layout="constrained")
    for number, (to_page, title) in enumerate(((OURS, "z-forward codes"), ((0, 1, 2), "here")), start=1):
        draw(figure.add_subplot(1, 2, number, projection="3d"), to_page, title)
    figure.axes[0].legend(loc="upper left")
    figure.savefig(path, dpi=110)


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "conventions.png")
