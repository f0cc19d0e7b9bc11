"""Loads by differences of the energy of equilibria that are solved again, and a robot with kinks to try them on."""

from __future__ import annotations

import numpy as np

from ctr_pvs import CommandError
from ctr_pvs import Robot
from ctr_pvs import Segment
from ctr_pvs import Tube

#: Energies carry rounding of some 1e-16 J, so a difference over a step h cannot be better than about 1e-16 J / h.
ANGLE_STEP, LENGTH_STEP = 2e-3, 2e-5


def energy_at(solver, alpha, D):
    answer = solver.solve(alpha, D)
    assert answer.success, answer.message
    return answer.energy


def derivative(solver, alpha, D, index, step):
    """Fourth-order central difference of the energy along one actuator; None where a neighbour cannot be commanded."""
    values = []
    for shift in (-2, -1, 1, 2):
        command = np.concatenate([alpha, D])
        command[index] += shift * step
        try:
            values.append(energy_at(solver, *np.split(command, 2)))
        except CommandError:
            return None
    return (values[0] - 8 * values[1] + 8 * values[2] - values[3]) / (12 * step)


def one_sided(solver, alpha, D, tube, side):
    """Third-order one-sided difference of the energy in D of one tube, per +D."""
    step = side * 1e-4
    values = []
    for shift in (0, 1, 2, 3):
        moved = np.array(D, dtype=float)
        moved[tube] += shift * step
        values.append(energy_at(solver, alpha, moved))
    return (-11 * values[0] + 18 * values[1] - 9 * values[2] + 2 * values[3]) / (6 * step)


def kink_robot() -> Robot:
    """Three tubes with round lengths, so that boundaries can be laid on one another exactly."""
    a = Segment(0.05, 0.06, 0.045), Segment(0.06, 0.05, 0.04, (9.0, 40.0))
    b = Segment(0.10, 0.03, 0.022, (-3.0 + 2.0j,)), Segment(0.06, 0.025, 0.02, (6.0j,), 15.0)
    c = Segment(0.15, 0.010, 0.008), Segment(0.05, 0.012, 0.009, (12.0 + 5.0j,)), Segment(0.03, 0.011, 0.007, (4.0,))
    return Robot("kinks", (Tube("a", a), Tube("b", b), Tube("c", c)))


KINKS = {
    "boundary of a on the orifice": ([0.05, 0.07, 0.13], [0]),
    "boundaries of b and c coincide": ([0.03, 0.06, 0.11], [1, 2]),
    "tips of a and b coincide": ([0.02, 0.07, 0.115], [0, 1]),
    "tip of a on a boundary of c": ([0.02, 0.04, 0.06], [0, 2]),
    "three at one place, tips of all": ([0.03, 0.08, 0.15], [0, 1, 2]),
    "tip of a on the orifice": ([0.11, 0.12, 0.165], [0]),
    "boundaries of b and c on the orifice": ([0.04, 0.10, 0.15], [1, 2]),
}
