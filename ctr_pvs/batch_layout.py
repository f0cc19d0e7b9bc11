"""Sections, lengths and compliances of many base positions at once.

Base positions with the same tubes' segments in the same order along the robot share a ``Layout``.  Within it section
boundaries are linear in D, so all that ``sections``, ``materials`` and ``fidelity`` say about one D is here an array
over D.  K stands for the number of base positions, always the last axis; where all D agree it is 1 and broadcasts.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.basis import gauss_legendre
from ctr_pvs.fidelity import FASTER
from ctr_pvs.fidelity import GLANCE
from ctr_pvs.fidelity import HIGHEST_DEGREE
from ctr_pvs.fidelity import LOWEST_DEGREE
from ctr_pvs.fidelity import TURN_SHARE
from ctr_pvs.materials import Materials
from ctr_pvs.robot.robot import Robot
from ctr_pvs.robot.robot import Segment
from ctr_pvs.sections import ABSENT
from ctr_pvs.sections import SAME_PLACE
from ctr_pvs.sections import piecewise_domain
from ctr_pvs.twist import BENDS_A_PANEL

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
Indices = NDArray[np.int64]


def topology_keys(robot: Robot, D: Array) -> Indices:
    """(K,) equal numbers for base positions ``D`` (N, K) whose boundaries have the same order and coincidences."""
    tubes = np.concatenate([np.full(len(tube.breaks), j) for j, tube in enumerate(robot.tubes)])
    places = np.concatenate([tube.breaks for tube in robot.tubes])[:, None] - D[tubes]
    order = np.argsort(places, axis=0, kind="stable")
    rows = np.take_along_axis(places, order, axis=0)
    side = (places > SAME_PLACE).astype(np.int64) + (places >= -SAME_PLACE)
    side[1:] += 3 * (np.diff(rows, axis=0) <= SAME_PLACE)
    return hashed(order * 6 + side)


def hashed(table: NDArray[np.int64] | Array) -> Indices:
    """(K,) one number for each column of ``table`` (B, K): equal for equal columns, and different for different ones
    but for a chance of 2^-64."""
    key = np.zeros(table.shape[1], dtype=np.uint64)
    for row in np.ascontiguousarray(table).view(np.uint64):
        key ^= key >> np.uint64(31)
        key *= np.uint64(0x9E3779B97F4A7C15)
        key += row
    return key.view(np.int64)


class Layout:
    """One topology: what does not depend on D.

    materials : at one D of this topology.  first, last : coupled sections, (0, -1) without.  constant : true where
    every pre-curvature that couples keeps its size and direction, so that phases do not depend on D.
    """

    def __init__(self, robot: Robot, D: Array) -> None:
        self.robot = robot
        self.materials = Materials(robot, piecewise_domain(robot, D))
        domain = self.materials.domain
        self.sections, self.tubes = domain.n_sections, robot.n_tubes
        ends = [group[0] for group in domain.events[1:]]
        self._owner = np.array([event.tube for event in ends], dtype=np.int64)
        last = [len(tube.segments) for tube in robot.tubes]
        index = [event.after if event.after != ABSENT else last[event.tube] for event in ends]
        self._place = np.array([robot.tubes[event.tube].breaks[i] for event, i in zip(ends, index, strict=True)])
        self.coupled = np.flatnonzero(self.materials.coupled).tolist()
        self.first, self.last = (self.coupled[0], self.coupled[-1]) if self.coupled else (0, -1)
        self.constant = all(self.is_constant(m, j) for m in self.coupled for j in self.curved(m))
        self.lengths = [tube.length for tube in robot.tubes]
        stiffness = self.materials.torsional
        self.softness = np.divide(1.0, stiffness, out=np.zeros_like(stiffness), where=stiffness > 0.0)
        self._guide = [_guide_table(robot, tube) for tube in range(self.tubes)]

    def curved(self, m: int) -> list[int]:
        """The pre-curved tubes of section m."""
        return self.materials.curved_tubes[m]

    def is_constant(self, m: int, tube: int) -> bool:
        segment = self.materials.segment(tube, int(self.materials.domain.segment[m, tube]))
        return len(segment.curvature) == 1 and not segment.turn

    def boundaries(self, D: Array) -> Array:
        """(M + 1, K) arc lengths [m] of the section boundaries for ``D`` (N, K)."""
        places = self._place[:, None] - D[self._owner]
        return np.concatenate([np.zeros((1, D.shape[1])), places])

    def guide_compliance(self, D: Array) -> Array:
        """(N, K) twist per torque [rad/(N m)] of the guided parts."""
        return np.array([np.interp(base, *table) for base, table in zip(D, self._guide, strict=True)])


def _guide_table(robot: Robot, tube: int) -> tuple[Array, Array]:
    parts = [segment.length / segment.torsional_stiffness for segment in robot.tubes[tube].segments]
    return robot.tubes[tube].breaks, np.concatenate([[0.0], np.cumsum(parts)])


class Geometry:
    """Base positions ``D`` (N, K) of one layout.

    boundaries (M + 1, K), lengths (M, K), length (K,) [m].  lead (N, K): twist per torque [rad/(N m)] from the bases to
    the first coupled section.
    """

    def __init__(self, layout: Layout, D: Array) -> None:
        self.layout, self.D = layout, D
        self.boundaries = layout.boundaries(D)
        self.lengths = np.diff(self.boundaries, axis=0)
        self.length = self.boundaries[-1]

    @cached_property
    def lead(self) -> Array:
        return self.lead_before(self.layout.first)

    def lead_before(self, m: int) -> Array:
        """(N, K) twist per torque from the bases to the start of section m."""
        return self.layout.guide_compliance(self.D) + self.layout.softness[:m].T @ self.lengths[:m]

    def places(self, m: int, x: Array) -> Array:
        """(g, K) arc lengths [m] of the places ``x`` (g,) in [0, 1] of section m."""
        return self.boundaries[m] + x[:, None] * self.lengths[m]

    def pre_curvature(self, m: int, tube: int, x: Array) -> ComplexArray:
        """(g, K) kappa_y + i kappa_z [1/m] of a curved tube, (g, 1) where it is constant."""
        materials = self.layout.materials
        index = int(materials.domain.segment[m, tube])
        segment = materials.segment(tube, index)
        if self.layout.is_constant(m, tube):
            return np.full((len(x), 1), segment.curvature[0])
        start = self.layout.robot.tubes[tube].breaks[index]
        return segment.pre_curvature(self.places(m, x) + (self.D[tube] - start))

    def coupling(self, m: int) -> Array:
        """(K,) strength of the coupling, see ``Materials.coupling``."""
        layout, places = self.layout, np.linspace(0.0, 1.0, 5)
        tubes = layout.curved(m)
        bending = layout.materials.bending[m]
        kappa = [np.abs(self.pre_curvature(m, j, places)).max(axis=0) * bending[j] for j in tubes]
        moment = np.array(np.broadcast_arrays(*kappa))  # (t, K)
        soft = layout.softness[m, tubes]
        pull = moment[:, None] * moment / bending.sum()
        if len(tubes) == 2:
            largest = pull[0, 1] * soft.sum()
        else:
            root = np.sqrt(soft)
            laplacian = -pull * np.outer(root, root)[:, :, None]
            for index in range(len(tubes)):
                laplacian[index, index] = (pull[index].sum(axis=0) - pull[index, index]) * soft[index]
            largest = np.linalg.eigvalsh(laplacian.T)[:, -1]
        return np.asarray(self.lengths[m] ** 2 * largest)

    def panels(self, m: int) -> Indices:
        """(K,) ``twist.panels_needed`` of a coupled section."""
        return np.maximum(1, np.ceil(np.sqrt(self.coupling(m)) / BENDS_A_PANEL)).astype(np.int64)

    def first_degrees(self, tolerance: float) -> Indices:
        """(M, K) ``fidelity.first_degrees``."""
        degrees = np.zeros(self.lengths.shape, dtype=np.int64)
        if not self.layout.coupled:
            return degrees
        swing = self._swing()
        for m in self.layout.coupled:
            motion = swing * np.minimum(1.0, self.coupling(m))
            needed = np.log(np.maximum(motion / tolerance, 1.0)) / np.log(FASTER * self.ellipse(m)) - 1.0
            degrees[m] = np.clip(np.ceil(needed), LOWEST_DEGREE, HIGHEST_DEGREE)
        return degrees

    def ellipse(self, m: int) -> Array:
        """(K,) ``fidelity.ellipse`` of a coupled section."""
        places = gauss_legendre(GLANCE).x
        turn = max(abs(self._segment(m, j).turn) for j in self.layout.curved(m)) + self.mean_bend(m, places).max(axis=0)
        bandwidth = self.coupling(m) + TURN_SHARE * (turn * self.lengths[m]) ** 2
        width = np.pi / np.sqrt(np.maximum(bandwidth / self.panels(m) ** 2, 1e-6))
        return np.asarray(width + np.hypot(width, 1.0))

    def _segment(self, m: int, tube: int) -> Segment:
        materials = self.layout.materials
        return materials.segment(tube, int(materials.domain.segment[m, tube]))

    def mean_bend(self, m: int, x: Array) -> Array:
        """(g, K) curvature [1/m] at the places ``x`` of section m if all tubes bent to the same side."""
        bending, total = self.layout.materials.bending[m], np.zeros((len(x), 1))
        for j in self.layout.curved(m):
            total = total + np.abs(self.pre_curvature(m, j, x)) * (bending[j] / bending.sum())
        return total

    def _swing(self) -> Array:
        """(K,) motion of the tip [m] if all tubes turned by 1 rad from the first coupled section on."""
        rule, total = gauss_legendre(GLANCE), np.zeros(self.D.shape[1])
        for m in range(self.layout.first, self.layout.sections):
            arms = (self.length - self.places(m, rule.x)) * self.mean_bend(m, rule.x)
            total += self.lengths[m] * (rule.weights @ arms)
        return total
