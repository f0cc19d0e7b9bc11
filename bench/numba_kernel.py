"""What a compiled kernel would give: two tubes, hand-written for Numba, against the package.

    OPENBLAS_NUM_THREADS=1 python bench/numba_kernel.py

The package does not use Numba and does not need it.  To measure, install it beside the package's own requirements, in
an environment of its own: ``pip install numba``.  Compiling takes a few seconds, each time.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy is loaded: all matrices are small

import argparse
import importlib
import importlib.util
import time
from functools import partial
from pathlib import Path

import numpy as np
from clock import Stopwatch
from clock import Timing
from clock import unit
from document import publish
from document import table
from numpy.typing import NDArray
from served import STEPS
from served import Stroke
from served import serve
from served import solve_alone
from served import solve_and_tip
from served import strokes

from ctr_pvs import Equilibrium
from ctr_pvs import EquilibriumSolver

Array = NDArray[np.float64]

DOCUMENT = Path(__file__).resolve().parents[1] / "docs" / "speed_accuracy.md"
SKIPPED = "numba is not installed, so the compiled kernel is left out; to measure it: pip install numba"
#: Degree of the torque, and how far [m] tips and poses may be from the package's.
DEGREE, AGREEMENT = 5, 1e-9
#: Steps in the section where curvature changes, for the tip alone.
TIP_STEPS, POSES = 4, 60
ANGLES = (20.0, 100.0, 190.0)  # deg


class Pair:
    """The two tubes of Fig. 4 at one D, as arrays for ``compiled_pair``."""

    def __init__(self, stroke: Stroke) -> None:
        self.kernel = importlib.import_module("compiled_pair")  # which needs Numba
        (outer, inner), D = stroke.robot.tubes, stroke.D
        K, soft = np.empty(2), np.empty(2)
        bent, kappa = np.empty((2, 2)), np.empty(2, dtype=complex)
        for j, tube in enumerate((outer, inner)):
            K[j], soft[j] = tube.segments[0].bending_stiffness, 1.0 / tube.segments[0].torsional_stiffness
            kappa[j] = tube.segments[1].curvature[0]
            bent[j] = tube.breaks[1:] - D[j]  # where each is curved
        bent = np.maximum(bent, 0.0)
        start, end = bent[:, 0].max(), bent[:, 1].min()
        lead = float(soft @ (D + start))
        well = K.prod() / K.sum() * float(np.abs(kappa.prod()))
        phase = float(np.angle(kappa[1] * kappa[0].conjugate()))
        total = float(bent[:, 1].max())
        self.numbers = np.array([start, end - start, total, lead, soft.sum(), well, phase, *soft, *D])
        self.bounds = np.unique(np.concatenate([[0.0], bent.ravel()]))
        self.moments = np.zeros((len(self.bounds) - 1, 4))
        for m, middle in enumerate(0.5 * (self.bounds[:-1] + self.bounds[1:])):
            present = middle < bent[:, 1]
            moment = np.where(present & (middle > bent[:, 0]), K * kappa, 0.0) / K[present].sum()
            self.moments[m] = moment.view(float)
        y, weights = np.polynomial.legendre.leggauss(DEGREE + 3)
        x = 0.5 * (y + 1.0)
        raw = np.polynomial.legendre.legvander(y, DEGREE + 1)
        k = np.arange(1, DEGREE + 1)
        rest = (raw[:, 2:] - raw[:, :-2]) / (2.0 * np.sqrt(2.0 * k + 1.0))
        self.integrals, self.weights = np.ascontiguousarray(np.column_stack([x, rest])), 0.5 * weights
        # Where only the torque of the lead turns a tube, or one is alone, few steps are exact enough.
        coupled = (self.bounds[:-1] >= start) & (self.bounds[1:] <= end)
        self.longest = np.where(coupled, np.diff(self.bounds) / TIP_STEPS, np.diff(self.bounds) / 2.0)
        self.q = np.zeros(DEGREE + 2)
        self.tip_place, self.places = np.array([total]), np.linspace(0.0, total, POSES)
        self.positions, self.orientations = np.empty((POSES, 3)), np.empty((POSES, 4))

    def solve(self, alpha: Array) -> None:
        """Newton from the last answer."""
        if self.kernel.solve(self.numbers, self.integrals, self.weights, alpha, self.q) < 0:
            raise RuntimeError(f"the compiled Newton did not converge at {np.degrees(alpha)} deg")

    def poses(self, alpha: Array, places: Array) -> tuple[Array, Array]:
        """Positions and quaternions at ``places`` (n,) [m], in arrays that the next call overwrites."""
        n = len(places)
        out = self.positions[:n], self.orientations[:n]
        self.kernel.backbone(self.numbers, self.bounds, self.moments, alpha, self.q, places, self.longest, *out)
        return out


def differences(stroke: Stroke) -> tuple[float, float]:
    """Largest distances of positions [m] and of quaternions from the package's, over a few commands."""
    pair, solver = Pair(stroke), EquilibriumSolver(stroke.robot, 1e-10)
    apart, turned = 0.0, 0.0
    for degrees in np.arange(0.0, max(ANGLES) + 1.0, 5.0):
        alpha = np.radians(degrees) * stroke.direction
        pair.solve(alpha)
        if degrees not in ANGLES:
            continue
        answer = solver.solve(alpha, stroke.D)
        backbone = answer.backbone(POSES)
        tip = pair.poses(alpha, pair.tip_place)[0][0]
        apart = max(apart, float(np.linalg.norm(tip - answer.tip.position)))
        positions, orientations = pair.poses(alpha, pair.places)
        apart = max(apart, float(np.linalg.norm(positions - backbone.position, axis=1).max()))
        sign = np.sign(np.sum(orientations * backbone.orientation, axis=1, keepdims=True))
        turned = max(turned, float(np.abs(sign * orientations - backbone.orientation).max()))
    return apart, turned


def compiled(stroke: Stroke, many: int) -> list[Timing]:
    """Warm steps: solve alone, with the tip, with all poses."""

    def task(pair: Pair, alpha: Array, where: Array | None) -> None:
        pair.solve(alpha)
        if where is not None:
            pair.poses(alpha, where)

    def median(pair: Pair, where: Array | None) -> Timing:
        watch = Stopwatch()
        for alpha in stroke.approach():
            pair.solve(alpha)
        for alpha in stroke.steps(many):
            watch.time(partial(task, pair, alpha, where))
        return watch.median

    whole = Pair(stroke)
    return [median(Pair(stroke), where) for where in (None, whole.tip_place, whole.places)]


def with_poses(solver: EquilibriumSolver, alpha: Array, D: Array) -> Equilibrium:
    answer = solver.solve(alpha, D)
    _ = answer.backbone(POSES)
    return answer


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--quick", action="store_true", help="a few steps, printed only")
    options = parser.parse_args()
    if importlib.util.find_spec("numba") is None:
        print(SKIPPED)
        return
    stroke, many = strokes()[0], 50 if options.quick else STEPS
    begin = time.perf_counter()
    apart, turned = differences(stroke)
    print(f"compiled and checked in {time.perf_counter() - begin:.0f} s", flush=True)
    if apart > AGREEMENT:
        raise SystemExit("the compiled kernel does not agree with the package")
    ours = [serve(stroke, ask, many) for ask in (solve_alone, solve_and_tip, with_poses)]
    rows = []
    theirs = compiled(stroke, many)
    for name, own, other in zip(("solve alone", "solve and tip pose", "solve and 60 poses"), ours, theirs, strict=True):
        cells = (f"{t.microseconds:.3g} µs, {t.units:.1f} u" for t in (own, other))
        rows.append([name, *cells, f"{own.units / other.units:.1f}"])
    head = [f"{many:,} warm steps of 0.1°, u = {1e6 * unit():.3f} µs", "this package", "compiled", "ratio"]
    checked = f"{stroke.name}: positions are within {apart:.0e} m of the package's, quaternions within {turned:.0e}."
    publish("compiled", f"{checked}\n\n{table(head, rows)}", None if options.quick else DOCUMENT)


if __name__ == "__main__":
    main()
