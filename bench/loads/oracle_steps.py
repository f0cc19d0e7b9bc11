"""The boundary-value model with loads by scipy, as a user would write it: shooting, and ``solve_bvp``."""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.typing import NDArray

from bench.common.clock import Stopwatch
from bench.common.clock import Timing
from bench.loads.strokes import EXACT
from bench.loads.strokes import Served
from bench.loads.strokes import Stroke
from ctr_pvs.oracles.loaded_collocation import CollocatedSolution
from ctr_pvs.oracles.loaded_collocation import solve_loaded_bvp
from ctr_pvs.oracles.loaded_model import LoadedSolution
from ctr_pvs.oracles.loaded_model import solve_loaded
from ctr_pvs.oracles.loaded_path import along_path

Array = NDArray[np.float64]

SHOOTING, BVP = "scipy, shooting", "scipy, solve_bvp"
#: scipy's tolerances; where on the stroke [deg] the steps begin.
SETTINGS = {SHOOTING: (1e-4, 1e-7, 1e-10), BVP: (1e-3, 1e-6)}
BEGIN = 60.0


def oracle_steps(stroke: Stroke, method: str, tolerance: float, many: int) -> tuple[Timing, float]:
    """Median of ``many`` warm steps of 1 deg with tips, and their largest tip error [m]."""
    guess = along_path(stroke.robot, np.radians(BEGIN) * stroke.direction, stroke.D, stroke.loads)
    watch, judge, errors = Stopwatch(), Served(stroke, EXACT), []
    for index in range(1, many + 1):
        alpha = np.radians(BEGIN + index) * stroke.direction
        solve = solve_loaded if method == SHOOTING else solve_loaded_bvp
        found = watch.time(partial(solve, stroke.robot, alpha, stroke.D, stroke.loads, guess, tolerance))
        assert isinstance(found, LoadedSolution | CollocatedSolution)
        if not found.success:
            raise RuntimeError(f"{method} at {BEGIN + index:g} deg: {found.message}")
        errors.append(float(np.linalg.norm(found.tip - judge.answered(alpha, stroke.D).tip.position)))
        guess = (
            found
            if isinstance(found, LoadedSolution)
            else solve_loaded(stroke.robot, alpha, stroke.D, stroke.loads, guess)
        )
    return watch.median, max(errors)
