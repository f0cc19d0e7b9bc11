"""Actuator work along paths of commands, integrated between the kinks of the energy.

A command is one vector (alpha_1 .. alpha_N, D_1 .. D_N); a path is a chain of straight legs between commands.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ctr_pvs import Equilibrium
from ctr_pvs import EquilibriumSolver
from ctr_pvs import Robot
from ctr_pvs import Status
from ctr_pvs.model.sections import SAME_PLACE
from ctr_pvs.pvs.printed_loads import printed_forces

Array = NDArray[np.float64]
Forces = Callable[[Equilibrium], Array]

#: Gauss points on a panel, and the most [rad] that any tube turns and [m] that any slides on one.
NODES, PANEL_TURN, PANEL_SLIDE = 8, 0.5, 0.02


@dataclass(frozen=True)
class Travel:
    """What a path of commands cost.

    corners : equilibria at the corners, in order.  work : (corners,) actuator work [J] from the start to each.
    """

    corners: tuple[Equilibrium, ...]
    work: Array

    @property
    def energy_change(self) -> float:
        """E at the end less E at the start [J]."""
        return self.corners[-1].energy - self.corners[0].energy

    def same_equilibrium(self) -> bool:
        """True if the robot came back with the twist that it set out with."""
        first, last = (np.diff(corner.shape.angle_at_boundaries[-1]) for corner in (self.corners[0], self.corners[-1]))
        return bool(np.allclose(first, last, atol=1e-6))


class PathLost(RuntimeError):
    """The stable equilibrium ended on the way: the robot snapped, or the solver gave up."""


def by_virtual_work(answer: Equilibrium) -> Array:
    """dE/dD (N,) [N]."""
    return answer.force


def by_equation_41(answer: Equilibrium) -> Array:
    """Eq. (41) of Renda et al. on the +D axis (2,) [N]."""
    return -printed_forces(answer.shape)


def travel(solver: EquilibriumSolver, path: Sequence[Array], forces: Forces = by_virtual_work) -> Travel:
    """Drive ``solver`` along ``path`` and add up the work of the torques dE/dalpha and of ``forces``."""
    corners, work = [_reach(solver, path[0])], [0.0]
    for start, end in itertools.pairwise(path):
        work.append(work[-1] + _leg_work(solver, start, end, forces))
        corners.append(_reach(solver, end))
    return Travel(tuple(corners), np.array(work))


def _leg_work(solver: EquilibriumSolver, start: Array, end: Array, forces: Forces) -> float:
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    work = 0.0
    for a, b in itertools.pairwise(panels(solver.robot, start, end)):
        for x, weight in zip(nodes, weights, strict=True):
            answer = _reach(solver, start + (a + 0.5 * (b - a) * (x + 1.0)) * (end - start))
            loads = np.concatenate([answer.torque, forces(answer)])
            work += 0.5 * (b - a) * weight * float(loads @ (end - start))
    return work


def _reach(solver: EquilibriumSolver, command: Array) -> Equilibrium:
    answer = solver.solve(*np.split(command, 2))
    if answer.status is not Status.OK:
        raise PathLost(answer.message)
    return answer


def panels(robot: Robot, start: Array, end: Array) -> Array:
    """Fractions 0 .. 1 of the leg from ``start`` to ``end``, cut at every kink and into short pieces between them."""
    turn, slide = np.abs(np.array(np.split(end - start, 2))).max(axis=1)
    cuts = [0.0, *kinks(robot, start, end), 1.0]
    pieces = [
        np.linspace(a, b, 1 + max(1, int(np.ceil((b - a) * max(turn / PANEL_TURN, slide / PANEL_SLIDE)))))[:-1]
        for a, b in itertools.pairwise(cuts)
    ]
    return np.concatenate([*pieces, [1.0]])


def kinks(robot: Robot, start: Array, end: Array) -> list[float]:
    """Fractions of the leg, in order, where an event of one tube meets the orifice or an event of another tube."""
    # The orifice counts as a tube with one event that stays at s = 0.
    places = [(np.zeros(1), 0.0)]
    for tube, a, b in zip(robot.tubes, start[robot.n_tubes :], end[robot.n_tubes :], strict=True):
        places.append((tube.breaks[1:] - a, a - b))
    meetings = set()
    for (first, rate), (second, other_rate) in itertools.combinations(places, 2):
        if rate == other_rate:
            continue
        t = (second[None, :] - first[:, None]) / (rate - other_rate)
        in_guide = first[:, None] + rate * t < -SAME_PLACE
        meetings.update(t[~in_guide].tolist())
    return sorted(t for t in meetings if 0.0 < t < 1.0)
