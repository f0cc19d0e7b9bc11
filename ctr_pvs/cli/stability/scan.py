"""What rotating one tube does to the stability of a robot: a sweep step by step, folds and branches, a map over D.

A sweep is what actuators would do: it sets out cold at its first angle and goes on from answer to answer, through snaps
where there are any.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.answer.equilibrium import Equilibrium
from ctr_pvs.errors import FieldError
from ctr_pvs.oracles.tip_curve import TURN
from ctr_pvs.oracles.tip_curve import TipCurve
from ctr_pvs.oracles.two_tubes import TwoTubes
from ctr_pvs.oracles.two_tubes import two_tube_parameters
from ctr_pvs.robot.robot import Robot
from ctr_pvs.solve.equilibria import tip_curve
from ctr_pvs.solve.solver import EquilibriumSolver

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Scene:
    """A robot at base rotations ``alpha`` (N,) [rad] and base positions ``D`` (N,) [m], of which tube ``tube`` (from 0)
    is rotated."""

    robot: Robot
    alpha: Array
    D: Array
    tube: int

    def at(self, angle: float) -> Array:
        """alpha (N,) with the rotated tube at ``angle``."""
        alpha = self.alpha.copy()
        alpha[self.tube] = angle
        return alpha

    def moved(self, D: float) -> Scene:
        """This scene with the rotated tube's base at ``D`` [m]."""
        bases = self.D.copy()
        bases[self.tube] = D
        return Scene(self.robot, self.alpha, bases, self.tube)


@dataclass(frozen=True)
class SweepSnap:
    """A snap on the way: the angle [rad] where the branch ended, and the energy released [J]."""

    angle: float
    energy_released: float


@dataclass(frozen=True, eq=False)
class Sweep:
    """angles (k,) [rad]; answers : one of the solver for each; snaps : on the way between them, in order.

    snaps_before : number of snaps on the way from the relaxed robot to the first angle.
    """

    angles: Array
    answers: tuple[Equilibrium, ...]
    snaps: tuple[SweepSnap, ...]
    snaps_before: int

    def values(self, name: str) -> Array:
        """(k,) an attribute of the answers, NaN where the solver failed."""
        return np.array([getattr(one, name) if one.success else np.nan for one in self.answers])

    @property
    def worst(self) -> Equilibrium | None:
        """The answer with the smallest margin."""
        good = [one for one in self.answers if one.success]
        return min(good, key=lambda one: one.stability_margin) if good else None


@dataclass(frozen=True)
class FoldAt:
    """A fold met by the rotated tube at ``angle`` [rad]; theta_tip [rad] there.

    as_it_grows : whether the two branches that meet here end as the angle grows, or as it falls.
    ends_stable : whether one of them is stable.
    """

    angle: float
    theta_tip: float
    as_it_grows: bool
    ends_stable: bool


@dataclass(frozen=True, eq=False)
class BranchAt:
    """A branch of equilibria: angles of the rotated tube and theta_tip (k,) [rad]."""

    angles: Array
    theta_tip: Array
    stable: bool


@dataclass(frozen=True, eq=False)
class SCurve:
    """All equilibria of the two tubes that pull at each other, over a range of the rotated tube's angle.

    a, b : these tubes, from 0; theta_tip is psi_b - psi_a [rad] at s = ``end`` [m], where their overlap ends.
    resolved : False if the curve may have folds that are not told.
    """

    a: int
    b: int
    end: float
    folds: tuple[FoldAt, ...]
    branches: tuple[BranchAt, ...]
    resolved: bool


@dataclass(frozen=True, eq=False)
class MarginMap:
    """Sweeps at several D of the rotated tube: D (m,) [m], angles (k,) [rad], margin (m, k).

    The margin is that of the branch where the sweep set out, NaN past its end; snap (m,) [rad] is where it ends, NaN
    where it does not.
    """

    D: Array
    angles: Array
    margin: Array
    snap: Array


@dataclass(frozen=True, eq=False)
class Scan:
    """Everything told about one scene; None for what it does not have, or what was not asked for."""

    scene: Scene
    sweep: Sweep
    curve: SCurve | None
    closed_form: TwoTubes | None
    map: MarginMap | None = None


def scan(scene: Scene, angles: Array, tolerance: float, map_D: Array | None = None) -> Scan:
    """Rotate the scene's tube through ``angles`` (k,) [rad], and where ``map_D`` (m,) [m] is given do so at each D.

    Raises ``CommandError`` for commands that the robot cannot take.
    """
    for base in [
        scene.D[scene.tube],
        *([] if map_D is None else map_D),
    ]:  # what cannot be done is known before any work
        for angle in (angles[0], angles[-1]):
            scene.robot.check_command(scene.at(float(angle)), scene.moved(float(base)).D)
    margins = None if map_D is None else margin_map(scene, angles, map_D, tolerance)
    low, high = float(angles.min()), float(angles.max())
    return Scan(scene, sweep(scene, angles, tolerance), s_curve(scene, low, high), _closed_form(scene), margins)


def sweep(scene: Scene, angles: Array, tolerance: float) -> Sweep:
    """One answer for each of the ``angles`` (k,) [rad]."""
    answers = tuple(_answers(scene, angles, tolerance))
    found = [snap for one in answers[1:] if one.success for snap in one.snaps]
    snaps = tuple(SweepSnap(float(snap.alpha[scene.tube]), snap.energy_released) for snap in found)
    return Sweep(angles, answers, snaps, len(answers[0].snaps))


def margin_map(scene: Scene, angles: Array, D: Array, tolerance: float) -> MarginMap:
    """The margin at every one of ``angles`` (k,) [rad] and ``D`` (m,) [m] of the scene's tube."""
    margin = np.full((len(D), len(angles)), np.nan)
    snap = np.full(len(D), np.nan)
    for row, base in enumerate(D.tolist()):
        for column, one in enumerate(_answers(scene.moved(base), angles, tolerance)):
            if one.success and not (one.snaps and column):
                margin[row, column] = one.stability_margin
                continue
            if one.snaps and column:
                snap[row] = one.snaps[0].alpha[scene.tube]
            break
    return MarginMap(D, angles, margin, snap)


def _answers(scene: Scene, angles: Array, tolerance: float) -> Iterator[Equilibrium]:
    solver = EquilibriumSolver(scene.robot, tolerance)
    for angle in angles.tolist():
        yield solver.solve(scene.at(angle), scene.D)


def s_curve(scene: Scene, low: float, high: float) -> SCurve | None:
    """Folds and branches between two angles [rad]; None unless exactly two tubes are curved where they overlap."""
    try:
        curve = tip_curve(scene.robot, scene.D)
    except FieldError:
        return None
    pair = curve.integral.pair
    last = pair.sections[-1]
    sign = {pair.a: -1.0, pair.b: 1.0}.get(scene.tube, 0.0)
    if sign == 0.0:
        return None  # rotating a tube that does not couple changes nothing
    offset = float(scene.at(0.0)[pair.b] - scene.at(0.0)[pair.a])
    sheets = list(_sheets(curve, sign, offset, low, high))
    folds = [
        FoldAt(
            sign * (fold.alpha + turn - offset), fold.theta_tip + turn, fold.maximum == (sign > 0.0), fold.ends_stable
        )
        for turn in sheets
        for fold in curve.folds
    ]
    branches = [
        BranchAt(sign * (branch.alpha + turn - offset), branch.theta_tip + turn, branch.stable)
        for turn in sheets
        for branch in curve.branches
    ]
    return SCurve(
        pair.a,
        pair.b,
        last.start + last.length,
        tuple(sorted((fold for fold in folds if low <= fold.angle <= high), key=lambda fold: fold.angle)),
        tuple(one for one in branches if one.angles.min() <= high and one.angles.max() >= low),
        curve.resolved,
    )


def _sheets(curve: TipCurve, sign: float, offset: float, low: float, high: float) -> Iterator[float]:
    """Whole turns [rad] by which the curve must be moved to cover the angles from low to high."""
    ends = sorted((sign * low + offset, sign * high + offset))
    first = int(np.ceil((ends[0] - curve.alpha.max()) / TURN))
    last = int(np.floor((ends[1] - curve.alpha.min()) / TURN))
    for count in range(first, last + 1):
        yield TURN * count


def _closed_form(scene: Scene) -> TwoTubes | None:
    try:
        return two_tube_parameters(scene.robot, scene.D)
    except FieldError:
        return None
