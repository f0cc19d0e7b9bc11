"""What every shape tells of its angles, whatever model it comes from: shown with one that is written down."""

from __future__ import annotations

import numpy as np
import pytest

from ctr_pvs import Robot
from ctr_pvs import Segment
from ctr_pvs import Tube
from ctr_pvs.model.materials import Materials
from ctr_pvs.model.sections import piecewise_domain
from ctr_pvs.model.shape import Shape

RATE = np.array([3.0, -2.0])  # rad/m


class Twisted(Shape):
    """Every tube twists at a constant rate from the orifice to its tip."""

    def __init__(self, robot, alpha, D):
        super().__init__(Materials(robot, piecewise_domain(robot, np.asarray(D))), np.asarray(alpha))
        self.ends = np.array([tube.length for tube in robot.tubes]) - D

    def _psi(self, s):
        return self.alpha + RATE * np.clip(s[:, None], 0.0, self.ends)

    def angle(self, m, x):
        return self._psi(self.domain.boundaries[m] + x * self.domain.lengths[m])

    def twist_rate(self, m, x):
        return np.tile(np.where(self.materials.bending[m] > 0.0, RATE, 0.0), (len(x), 1))

    def curvature(self, m, x):
        return np.zeros(len(x), dtype=complex)

    @property
    def angle_at_boundaries(self):
        return self._psi(self.domain.boundaries)


@pytest.fixture
def robot():
    return Robot("pair", tuple(Tube(name, (Segment(0.2, 0.05, 0.04),)) for name in "ab"))


def test_angles_end_with_their_tube(robot):
    shape = Twisted(robot, [0.1, 0.2], [0.05, 0.12])
    s = np.array([0.15, -0.01, 0.0, 0.08, 0.0800001, 0.03])
    held = shape.angles_held(s)
    assert held == pytest.approx(shape._psi(s))
    told = shape.angles_at(s)
    assert np.isnan(told[[0, 4], 1]).all()
    told[[0, 4], 1] = held[[0, 4], 1]
    assert told == pytest.approx(held)
    assert shape.leader == 0 and shape.panels(0) == 1 and shape.domain.length == pytest.approx(0.15)


def test_a_tube_that_ends_on_the_orifice_has_an_angle_there(robot):
    shape = Twisted(robot, [0.1, 0.2], [0.05, 0.2])
    assert np.allclose(
        shape.angles_at(np.array([0.0, 0.05])), [[0.1, 0.2], [0.25, np.nan]], rtol=0.0, atol=1e-15, equal_nan=True
    )


def test_with_nothing_out_there_are_the_base_angles(robot):
    shape = Twisted(robot, [0.1, 0.2], [0.2, 0.2])
    for told in (shape.angles_at(np.zeros(2)), shape.angles_held(np.zeros(2))):
        assert told.tolist() == [[0.1, 0.2]] * 2
    assert shape.leader == 1
