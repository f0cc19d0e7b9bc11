"""Where the robot snaps, over the rotation of tube 2 and a force across the tip."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from bench.common.scenes import FULL_OVERLAP
from bench.common.scenes import PARTIAL_OVERLAP
from bench.common.scenes import SEED
from ctr_pvs import EquilibriumSolver
from ctr_pvs import Loads
from ctr_pvs.robot.loads import ZERO

Array = NDArray[np.float64]

Force = tuple[float, float, float]

#: The map: forces [N], and rotations as shares of the way to the fold, denser towards it; the last is left out.
FORCES, SHARES = np.linspace(-2.0, 2.0, 41), 1.0 - np.linspace(1.0, 0.0, 61) ** 2
#: Rotations [deg] at which the force itself is changed, from the largest down, up to a snap.
BY_LOAD = (170.0, 185.0, 200.0, 215.0, 230.0, 245.0)
#: Beyond all folds of the map [deg].
BEYOND = 340.0
TOLERANCE = 1e-7


@dataclass(frozen=True, eq=False)
class Fold:
    """A fold known from two independent methods, shooting and a Galerkin method of another kind: the angle [deg] at
    which turning tube 2 under ``force`` ends, or how many times ``force`` acts at ``alpha`` [deg] where loading does.
    """

    D: Array
    force: Force
    alpha: float
    value: float

    @property
    def turned(self) -> bool:
        return self.alpha == 0.0


KNOWN = (
    Fold(PARTIAL_OVERLAP, (0.0, -0.5, 0.0), 0.0, 193.037),
    Fold(PARTIAL_OVERLAP, (0.0, 0.5, 0.0), 0.0, 219.323),
    Fold(PARTIAL_OVERLAP, (0.5, 0.0, 0.0), 0.0, 200.145),
    Fold(FULL_OVERLAP, (0.0, 1.0, 0.0), 0.0, 297.191),
    Fold(PARTIAL_OVERLAP, (0.0, -1.0, 0.0), 200.0, 0.225244),
    Fold(PARTIAL_OVERLAP, (1.0, 0.0, 0.0), 200.0, 0.513572),
    Fold(FULL_OVERLAP, (0.0, -1.0, 0.0), 275.0, 0.459388),
)


def rotation_fold(D: Array, force: Force) -> float:
    """The angle alpha_2 [deg] at which the branch ends when tube 2 is turned from 0 under ``force``; infinite if it
    does not before ``BEYOND``."""
    solver = EquilibriumSolver(SEED, TOLERANCE)
    solver.solve([0.0, 0.0], D, loads=Loads(force))
    return float(np.degrees(solver.distance_to_snap(turn=np.radians(BEYOND))[1, 1]))


def load_fold(alpha: float, D: Array, force: Force, begin: Force = ZERO) -> float:
    """How many times ``force`` acts where the branch ends, beside ``begin``, with tube 2 turned to ``alpha`` [rad]
    under ``begin``; NaN if it snaps before."""
    solver, loads = EquilibriumSolver(SEED, TOLERANCE), Loads(begin)
    solver.solve([0.0, 0.0], D, loads=loads)
    if solver.solve([0.0, alpha], D, loads=loads).snaps:
        return np.nan
    return solver.load_to_snap(Loads(force))


def margins(force: float, end: float) -> Array:
    """Margins at ``SHARES`` of the way to the branch's end [deg], where it is 0."""
    solver, loads = EquilibriumSolver(SEED, TOLERANCE), Loads((0.0, force, 0.0))
    out = np.zeros(len(SHARES))
    for index, share in enumerate(SHARES[:-1]):
        answer = solver.solve([0.0, np.radians(share * end)], PARTIAL_OVERLAP, loads=loads)
        if answer.snaps or not answer.success:
            raise RuntimeError(f"no answer before the fold at {end} deg: {answer.message}")
        out[index] = answer.stability_margin
    return out


def draw_snaps(path: Path) -> None:
    """Margins, and where branches end: turned at one load, loaded at one rotation."""
    figure = Figure(figsize=(9.0, 5.6), dpi=110, layout="constrained")
    panel = figure.subplots()
    ends = np.array([rotation_fold(PARTIAL_OVERLAP, (0.0, float(force), 0.0)) for force in FORCES])
    field = np.array([margins(float(force), end) for force, end in zip(FORCES, ends, strict=True)])
    places = ends[:, None] * SHARES, np.broadcast_to(FORCES[:, None], field.shape)
    shown = panel.contourf(*places, field, np.linspace(0.0, 1.0, 11), cmap="YlGnBu_r")
    figure.colorbar(shown, ax=panel, label="stability margin")
    panel.plot(ends, FORCES, color="#d55e00", linewidth=2.4, label="snap when tube 2 is turned (distance_to_snap)")
    most = float(FORCES[-1])
    found = [most - load_fold(np.radians(a), PARTIAL_OVERLAP, (0.0, -1.0, 0.0), (0.0, most, 0.0)) for a in BY_LOAD]
    label = f"snap when the force is lowered from {most:g} N (load_to_snap)"
    panel.plot(BY_LOAD, found, "v", color="black", markersize=8.0, label=label)
    panel.axhline(0.0, color="#777777", linewidth=0.6)
    panel.set_xlim(100.0, float(ends.max()) + 8.0)
    panel.set_ylim(FORCES[0], FORCES[-1])
    panel.set_xlabel("α₂ [deg]")
    panel.set_ylabel("force along y on the tip [N]")
    panel.legend(fontsize=9, loc="upper left", framealpha=0.9)
    figure.savefig(path)
