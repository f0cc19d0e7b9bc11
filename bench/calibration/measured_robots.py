"""Calibration on measured robots of two other groups, from the user's own downloads; nothing of them is kept here.

    python -m bench.calibration.measured_robots --three-tubes jointTipTrajectory_measured_short.txt
    python -m bench.calibration.measured_robots --nylon 19_05_23-13_23_2-tubes_rotate.csv

Three tubes: github.com/hjhdog1/ConcentricTubes, 1,307 tips, one moment after another; numbers of the robot from that
repository's own model.  Nylon: github.com/comet-lab/CTR_Kinematic_Verification, 3,330 frames, ten for each of 333
commands.  Every second block of 50 rows is held out.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

from bench.common.document import table
from ctr_pvs import Robot
from ctr_pvs import Segment
from ctr_pvs import Tube
from ctr_pvs.robot.cross_section import annulus_stiffness
from ctr_pvs.tasks.calibrate import Calibration
from ctr_pvs.tasks.calibrate import calibrate
from ctr_pvs.tasks.calibration.report import as_text
from ctr_pvs.tasks.calibration.table import Measurements
from ctr_pvs.tasks.calibration.table import unwrapped

MM = 1e-3
#: Poisson's ratio stays within two standard deviations of its prior, or may go where the data want it.
PHYSICAL, FREE = {"poisson": (0.2, 0.4)}, {"poisson": (-0.6, 0.5)}
#: Hardly a prior.
NO_PRIOR = {"poisson": (0.3, 10.0)}
TUBES = ("bending:middle", "bending:inner", "curvature", "poisson")
JOINTS = ("alpha", "D", "registration")
PLAY = ("play_alpha:middle", "play_alpha:inner")


def three_tubes() -> Robot:
    """Radii of 265, 265 and 55 mm, K as 1 : 1 : 2/7; only ratios count without loads."""
    K = 0.05
    return Robot(
        "three_tubes",
        (
            _tube("outer", 0.0, 150.0, 265.0, K),
            _tube("middle", 17.0, 150.0, 265.0, K),
            _tube("inner", 184.0, 86.3938, 55.0, 2.0 * K / 7.0),
        ),
    )


def _tube(name: str, straight: float, curved: float, radius: float, K: float) -> Tube:
    """Lengths and radius in mm; the plane of curvature is that of the repository's model."""
    first = [Segment(MM * straight, K, K / 1.3)] if straight else []
    return Tube(name, (*first, Segment(MM * curved, K, K / 1.3, (1j / (MM * radius),))))


def three_tube_tips(file: Path) -> Measurements:
    """A row: time, three rotations [rad], three base positions [mm], the tip [mm] and its axes."""
    rows = np.loadtxt(file)
    return Measurements(unwrapped(rows[:, 1:4]), -MM * rows[:, 4:7], MM * rows[:, 7:10])


def nylon() -> Robot:
    """Two tubes of 50 mm arcs."""

    def tube(name: str, inner: float, outer: float, straight: float, curvature: float) -> Tube:
        K, GJ = annulus_stiffness(1.935e9, 1.935e9 / 2.6, MM * inner, MM * outer)
        return Tube(name, (Segment(MM * straight, K, GJ), Segment(MM * 50.0, K, GJ, (1j * curvature,))))

    return Robot("nylon", (tube("outer", 4.6, 5.8, 91.21, 11.0), tube("inner", 2.8, 4.0, 161.0, 14.0)))


def nylon_tips(file: Path, frames: int = 10) -> Measurements:
    """Means over the frames of a command.  A row: pose of the base (7), translations [mm] and rotations [deg] of three
    axes, pose of the tip [m]."""
    rows = np.loadtxt(file, delimiter=",")
    rows = rows[: len(rows) // frames * frames].reshape(-1, frames, rows.shape[1]).mean(axis=1)
    D = MM * (np.array([91.21, 161.0]) - rows[:, 7:9])
    return Measurements(np.radians(rows[:, 10:12]), D, rows[:, 13:16])


def _row(name: str, found: Calibration) -> list[str]:
    held, poisson = found.after.held_out, [p.value for p in found.parameters if p.name == "poisson"]
    assert held is not None
    numbers = [f"{1e3 * x:.2f}" for x in (held.median, held.ninety, held.largest)]
    return [name, *numbers, f"{poisson[0]:.2f}" if poisson else "0.30", str(found.evaluations), f"{found.seconds:.0f}"]


HEAD = [
    "what is fitted", "held out: median [mm]", "90 %", "largest", "Poisson's ratio", "solves", "time [s]", "CPU [s]"
]  # fmt: skip


def three_tube_table(file: Path) -> str:
    robot, data = three_tubes(), three_tube_tips(file)
    squares = {"bounds": PHYSICAL, "robust": 1e3}
    fits = {
        "registration": (("registration",), {}),
        "tubes": ((*TUBES, "registration"), squares),
        "tubes and sensor": ((*TUBES, "registration", "sensor"), squares),
        "tubes and joints": ((*TUBES, *JOINTS), squares),
        "tubes and rotations, any Poisson's ratio": (
            (*TUBES, "alpha", "registration"), {"bounds": FREE, "priors": NO_PRIOR, "robust": 1e3}
        ),
        "tubes, translations and play": ((*TUBES, "D", "registration", *PLAY), squares),
        "tubes, translations and play, robust": ((*TUBES, "D", "registration", *PLAY), {"bounds": PHYSICAL}),
        "tubes, translations, sensor and play": ((*TUBES, "D", "registration", "sensor", *PLAY), squares),
        "tubes, translations, sensor and play, robust": (
            (*TUBES, "D", "registration", "sensor", *PLAY), {"bounds": PHYSICAL}
        ),
        "tubes, joints and play": ((*TUBES, *JOINTS, *PLAY), squares),
        "tubes, joints and play, robust": ((*TUBES, *JOINTS, *PLAY), {"bounds": PHYSICAL}),
    }  # fmt: skip
    return _table({name: partial(calibrate, robot, data, fit, **options) for name, (fit, options) in fits.items()})


def nylon_table(file: Path) -> str:
    robot, data = nylon(), nylon_tips(file)
    fits = {
        "registration": ("registration",),
        "registration and sensor": ("registration", "sensor"),
        "tubes and joints": ("bending", "curvature", "alpha", "D", "registration"),
        "tubes, joints and sensor": ("bending", "curvature", "alpha", "D", "registration", "sensor"),
        "tubes, joints and play": ("bending", "curvature", "alpha", "D", "registration", "play_alpha"),
    }
    return _table({name: partial(calibrate, robot, data, fit) for name, fit in fits.items()})


def _table(fits: dict[str, Callable[[], Calibration]]) -> str:
    rows = []
    for name, fit in fits.items():
        began = time.process_time()
        found = fit()
        rows.append([*_row(name, found), f"{time.process_time() - began:.0f}"])
        print(f"\n{name}\n{as_text(found)}", file=sys.stderr, flush=True)
    return table(HEAD, rows)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--three-tubes", type=Path, metavar="FILE", help="your copy of the three-tube robot's rows")
    parser.add_argument("--nylon", type=Path, metavar="FILE", help="your copy of the nylon robot's frames")
    arguments = parser.parse_args()
    if arguments.three_tubes is None and arguments.nylon is None:
        parser.error("give --three-tubes or --nylon")
    if arguments.three_tubes is not None:
        print(three_tube_table(arguments.three_tubes), flush=True)
    if arguments.nylon is not None:
        print(nylon_table(arguments.nylon), flush=True)


if __name__ == "__main__":
    main()
