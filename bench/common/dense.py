"""Whole energies in plain numpy at one polynomial degree, for judges and for methods to compare with.

They share the kernel's elements and nothing else of it: no step, no certificate, no landing, no condensation.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ctr_pvs import Robot
from ctr_pvs.answer.engine import Engine
from ctr_pvs.answer.shape import TorsionShape
from ctr_pvs.answer.state import State
from ctr_pvs.kernel.arrays import S_FLOOR
from ctr_pvs.kernel.arrays import S_TWISTS
from ctr_pvs.kernel.arrays import S_UNKNOWNS
from ctr_pvs.kernel.arrays import STATE
from ctr_pvs.kernel.sections import FINER
from ctr_pvs.model.packing import HIGHEST_DEGREE
from ctr_pvs.model.shape import Shape
from ctr_pvs.solve.dense import DenseEnergy

Array = NDArray[np.float64]

#: Tolerances [m] of an engine: with the first, elements have the degree that is asked for; with the second, their
#: Gauss points integrate as finely as they can.
LOOSE, TIGHT = 1.0, 1e-10
#: The highest degree that an energy takes as its least one.
HIGHEST = HIGHEST_DEGREE - FINER


class FixedDegree(DenseEnergy):
    """The energy at D (N,) [m] with polynomials of exactly ``degree`` in every element of coupled tubes.

    fine : whether the quadrature is that of a much higher degree.  degrees (n,) : of the polynomial that each unknown
    belongs to, 0 in the guide.
    """

    def __init__(self, robot: Robot, D: Array, degree: int, fine: bool = False) -> None:
        D = np.array(D, dtype=float)
        engine = Engine(robot, TIGHT if fine else LOOSE)
        super().__init__(engine, D, HIGHEST if fine else max(degree, 1))
        self.whole = self.n
        degrees = column_degrees(self)
        self.columns = np.flatnonzero(degrees <= degree)
        self.degrees = degrees[self.columns]
        self.n = len(self.columns)
        self.angle_map = np.ascontiguousarray(self.angle_map[:, :, self.columns])

    def vector(self, y: Array, alpha: Array) -> Array:
        """``y`` (n,) at base angles alpha (N,) [rad] as the kernel writes it, not described."""
        N = len(alpha)
        vector = np.zeros(STATE + 3 * N + self.whole)
        vector[S_FLOOR], vector[S_UNKNOWNS], vector[S_TWISTS] = self.degree, self.whole, 1.0
        vector[STATE : STATE + N], vector[STATE + N : STATE + 2 * N] = alpha, self.D
        vector[STATE + 3 * N + self.columns] = y
        return vector

    def state(self, y: Array, alpha: Array) -> State:
        return State(self.engine.describe(self.vector(y, alpha)), len(alpha))

    def shape(self, y: Array, alpha: Array) -> TorsionShape:
        """The fields of ``y`` (n,) at base angles alpha (N,) [rad]."""
        return TorsionShape(self.engine, State(self.vector(y, alpha), len(alpha)))

    def map_at(self, s: Array) -> Array:
        """(g, N, n) psi = alpha + A y at arc lengths ``s`` (g,) [m]."""
        still = np.zeros(len(self.D))
        columns = [self.engine.angles(self.vector(unit, still), s)[0] for unit in np.eye(self.n)]
        return np.stack(columns, axis=2) if columns else np.zeros((len(s), len(still), 0))

    def margin(self, y: Array, alpha: Array) -> float:
        """Smallest eigenvalue of the Hessian relative to torsional stiffness, clipped at 1."""
        return float(self.eigenvalues(y, alpha).min(initial=1.0))


def column_degrees(energy: DenseEnergy) -> NDArray[np.int64]:
    """(n,) the degree of the polynomial that each unknown of ``energy`` belongs to; 0 in the guide."""
    robot = energy.engine.robot
    elements = energy.engine.elements(energy.engine.blank(np.zeros(len(energy.D)), energy.D, energy.degree))
    coupled = np.flatnonzero(elements[:, 2])
    degrees = [0] * robot.n_tubes
    for start, end, pulled, degree in elements[: coupled[-1] + 1 if len(coupled) else 0].tolist():
        for tube, base in zip(robot.tubes, energy.D, strict=True):
            X = 0.5 * (start + end) + base
            if tube.length > X:
                curved = any(tube.segments[int(np.searchsorted(tube.breaks, X)) - 1].curvature)
                degrees += range(int(degree) + FINER + 1 if pulled and curved else 1)
    if len(degrees) != energy.n:
        raise RuntimeError("the unknowns are not laid out as they are taken to be")
    return np.array(degrees, dtype=np.int64)


def nearest(energy: DenseEnergy, shape: Shape, alpha: Array) -> Array:
    """The unknowns (n,) of ``energy`` whose twist angles are nearest to those of ``shape`` under base angles alpha (N,)
    [rad]."""
    if energy.n == 0 or not len(energy.place):
        return np.zeros(energy.n)
    wanted = (shape.angles_held(energy.place) - alpha).ravel()
    return np.asarray(np.linalg.lstsq(energy.angle_map.reshape(-1, energy.n), wanted, rcond=None)[0], dtype=float)


def judge_degree(degrees: Array, more: int) -> int:
    """``more`` degrees than the highest of ``degrees`` (m,), as far as elements go."""
    return min(HIGHEST, int(degrees.max(initial=0)) + more)
