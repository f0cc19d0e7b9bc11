"""The piecewise domain: who is where, for any tip order and on exact coincidences."""

from __future__ import annotations

import numpy as np
import pytest
from random_robots import random_D
from random_robots import random_robot

from ctr_pvs.model.sections import ABSENT
from ctr_pvs.model.sections import piecewise_domain


def test_the_seeds_partial_overlap(seed_robot):
    """D_1 equals the outer straight length: that boundary is on the orifice; inner: 48 mm straight, then curved."""
    domain = piecewise_domain(seed_robot, np.array([0.0935, 0.1705]))
    assert domain.boundaries == pytest.approx([0.0, 0.048, 0.0923, 0.133])
    assert domain.segment.tolist() == [[1, 0], [1, 1], [ABSENT, 1]]
    assert domain.kinked_tubes().tolist() == [True, False]
    assert domain.guide_segment.tolist() == [0, 0]
    assert domain.length == pytest.approx(0.133)


@pytest.mark.parametrize("seed", range(40))
def test_sections_hold_what_the_tubes_have(seed):
    """At random places the table names the segment that the tube's own breaks give."""
    rng = np.random.default_rng(seed)
    robot = random_robot(rng, 1 + seed % 5)
    D = random_D(rng, robot)
    domain = piecewise_domain(robot, D)
    assert np.all(domain.lengths > 0.0)
    for s in rng.uniform(0.0, domain.length, 20):
        m = int(domain.locate(np.array([s]))[0])
        assert domain.boundaries[m] < s <= domain.boundaries[m + 1]
        for j, tube in enumerate(robot.tubes):
            here = int(np.searchsorted(tube.breaks, s + D[j], side="left")) - 1
            assert domain.segment[m, j] == (here if here < len(tube.segments) else ABSENT)


def test_places_within_the_tolerance_are_one(seed_robot):
    exact = piecewise_domain(seed_robot, np.array([0.0935, 0.2085]))
    for shift in (-9e-13, 9e-13):
        near = piecewise_domain(seed_robot, np.array([0.0935 + shift, 0.2085]))
        assert np.array_equal(near.segment, exact.segment) and np.array_equal(near.guide_segment, exact.guide_segment)
        assert near.kinked_tubes().tolist() == [True, False]
    apart = piecewise_domain(seed_robot, np.array([0.0935 - 3e-12, 0.2085]))
    assert apart.n_sections == exact.n_sections + 1 and not apart.kinked_tubes().any()


def test_a_base_on_the_orifice_is_no_kink(seed_robot):
    domain = piecewise_domain(seed_robot, np.zeros(2))
    assert not domain.kinked_tubes().any()
    assert domain.guide_segment.tolist() == [ABSENT, ABSENT]


def test_fully_retracted(seed_robot):
    ends = np.array([seed_robot.tubes[0].length] * 2)
    domain = piecewise_domain(seed_robot, ends)
    assert domain.segment[:, 0].tolist() == [ABSENT] * domain.n_sections
    assert domain.kinked_tubes().tolist() == [True, False]
