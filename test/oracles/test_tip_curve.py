"""The torques that go with a point of the tip curve, against the boundary-value model and the torsion equation."""

from __future__ import annotations

import numpy as np
import pytest
from bvp_shape import BvpShape

from ctr_pvs import Robot
from ctr_pvs import Segment
from ctr_pvs import Tube
from ctr_pvs.oracles.tip_curve import TipCurve
from ctr_pvs.oracles.tube_pair import materials_at
from ctr_pvs.oracles.tube_pair import tube_pair


def gapped_robot() -> Robot:
    """Three tubes, the first straight; the others couple in two places with a straight gap between, and in the lead
    one of them is stiffer."""
    a = Tube("a", (Segment(0.10, 0.05, 0.04),))
    b = Tube("b", (Segment(0.05, 0.03, 0.02), Segment(0.03, 0.03, 0.02, (9.0,)), Segment(0.07, 0.02, 0.015, (4j, 20))))
    curved, straight = Segment(0.04, 0.012, 0.009, (7.0 + 5.0j,), 8.0), Segment(0.02, 0.01, 0.008)
    c = Tube("c", (Segment(0.06, 0.02, 0.016), Segment(0.02, 0.01, 0.008), curved, straight, curved))
    return Robot("gapped", (a, b, c))


@pytest.mark.parametrize(("name", "alpha"), [("seed", 1.2), ("seed", 3.6), ("gapped", 0.9), ("gapped", -2.0)])
def test_torques_are_those_of_the_boundary_value_model(seed_robot, name, alpha):
    robot, D = (seed_robot, [0.07, 0.15]) if name == "seed" else (gapped_robot(), [0.0, 0.02, 0.03])
    shape = BvpShape(robot, np.append(np.zeros(robot.n_tubes - 1), alpha), D)
    materials = materials_at(robot, D)
    pair = tube_pair(materials)
    end = pair.sections[-1].index
    tip = shape.angle_at_boundaries[end + 1]
    s = np.concatenate([[-0.01], np.linspace(0.0, materials.domain.length, 57), materials.domain.boundaries])
    [torques] = TipCurve(pair).integral.torques(tip[[pair.b]] - tip[[pair.a]], s)
    expected = np.zeros_like(torques)
    for row, place in zip(expected, s, strict=True):
        m = int(materials.domain.locate(np.array([place]))[0])
        x = np.clip((place - materials.domain.boundaries[m]) / materials.domain.lengths[m], 0.0, 1.0)
        row[:] = materials.torsional[m] * shape.twist_rate(m, np.array([x]))[0]
    assert np.abs(expected).max() > 1e-3
    assert torques == pytest.approx(expected, abs=1e-9)
    assert not torques[s > materials.domain.boundaries[end + 1]].any()
    assert np.array_equal(torques[0], torques[1])  # in the guide, and at the orifice


def test_many_tips_at_once_and_places_in_any_order(seed_robot):
    integral = TipCurve(tube_pair(materials_at(seed_robot, [0.07, 0.15]))).integral
    tips, s = np.array([-2.0, 0.4, 3.0]), np.array([0.05, 0.0, 0.09, 0.02, 0.05])
    together = integral.torques(tips, s)
    assert together.shape == (3, 5, 2) and np.array_equal(together[:, 0], together[:, 4])
    assert together.sum(axis=2) == pytest.approx(np.zeros((3, 5)), abs=1e-16)
    for tip, torques in zip(tips, together, strict=True):
        for place, torque in zip(s, torques, strict=True):
            alone = integral.torques(np.array([tip]), np.array([place]))
            assert alone[0, 0] == pytest.approx(torque, abs=1e-11)
    assert integral.torques(tips, np.zeros(0)).shape == (3, 0, 2)
