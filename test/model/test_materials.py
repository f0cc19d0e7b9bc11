"""Stiffnesses and pre-curvatures of every section, and what the guide holds, against sums over the tubes' own parts."""

from __future__ import annotations

import numpy as np
import pytest
from random_robots import random_D
from random_robots import random_robot
from scipy.integrate import quad

from ctr_pvs import Robot
from ctr_pvs import Segment
from ctr_pvs import Tube
from ctr_pvs.model.basis import gauss_legendre
from ctr_pvs.model.materials import Materials
from ctr_pvs.model.materials import bending_density
from ctr_pvs.model.materials import section_nodes
from ctr_pvs.model.materials import shared_curvature
from ctr_pvs.model.sections import piecewise_domain


def scene(seed: int) -> Materials:
    rng = np.random.default_rng([seed, 8])
    robot = random_robot(rng, 1 + seed % 5)
    return Materials(robot, piecewise_domain(robot, random_D(rng, robot)))


def segment_at(tube: Tube, X: float) -> tuple[Segment, float] | None:
    """The segment of a tube at its abscissa X [m], and the abscissa in it, by counting lengths."""
    for segment in tube.segments:
        if segment.length > X:
            return segment, X
        X -= segment.length
    return None


@pytest.mark.parametrize("seed", range(20))
def test_sections_hold_what_the_tubes_have(seed):
    materials, rng = scene(seed), np.random.default_rng(seed)
    domain = materials.domain
    for s in rng.uniform(0.0, domain.length, 12):
        m = int(domain.locate(np.array([s]))[0])
        kappa, rate = materials.pre_curvature(m, np.array([s]))[0], materials.pre_curvature_rate(m, np.array([s]))[0]
        curved = 0
        for j, tube in enumerate(materials.robot.tubes):
            found = segment_at(tube, s + domain.D[j])
            if found is None:
                assert not (materials.bending[m, j] or materials.torsional[m, j] or kappa[j] or rate[j])
                continue
            segment, X = found
            assert materials.bending[m, j] == segment.bending_stiffness
            assert materials.torsional[m, j] == segment.torsional_stiffness
            assert materials.curved[m, j] != segment.is_straight
            assert kappa[j] == pytest.approx(segment.pre_curvature(X), rel=1e-9, abs=1e-9)
            assert rate[j] == pytest.approx(segment.pre_curvature_rate(X), rel=1e-9, abs=1e-7)
            curved += not segment.is_straight
        assert materials.coupled[m] == (curved >= 2)


@pytest.mark.parametrize("seed", range(8))
def test_the_guide_holds_what_lies_behind_the_orifice(seed):
    materials = scene(seed)
    for j, (tube, D) in enumerate(zip(materials.robot.tubes, materials.domain.D.tolist(), strict=True)):
        compliance = straightening = 0.0
        for start, segment in zip(tube.breaks.tolist(), tube.segments, strict=False):
            inside = min(max(D - start, 0.0), segment.length)
            compliance += inside / segment.torsional_stiffness
            work = quad(lambda X, g=segment: abs(g.pre_curvature(X)) ** 2, 0.0, inside, epsabs=0.0, epsrel=1e-12)[0]
            straightening += 0.5 * segment.bending_stiffness * work
        assert materials.guide_compliance[j] == pytest.approx(compliance, rel=1e-13)
        assert materials.straightening_energy[j] == pytest.approx(straightening, rel=1e-10, abs=1e-15)


def test_nothing_out_and_nothing_in():
    segment = Segment(0.1, 0.05, 0.04, (10.0,))
    robot = Robot("pair", (Tube("a", (segment,)), Tube("b", (segment,))))
    inside = Materials(robot, piecewise_domain(robot, np.full(2, 0.1)))
    assert inside.bending.shape == inside.curved.shape == (0, 2) and inside.coupled.shape == (0,)
    assert inside.guide_compliance == pytest.approx([2.5, 2.5])
    assert inside.straightening_energy == pytest.approx([0.25, 0.25])
    out = Materials(robot, piecewise_domain(robot, np.zeros(2)))
    assert out.coupled.tolist() == [True]
    assert not (out.guide_compliance.any() or out.straightening_energy.any())


def test_the_shared_curvature_is_where_the_energy_is_least():
    rng = np.random.default_rng(3)
    K, psi = rng.uniform(0.1, 1.0, 4), rng.uniform(-3.0, 3.0, 4)
    kappa = rng.standard_normal(4) + 1j * rng.standard_normal(4)
    k = shared_curvature(K, K * kappa * np.exp(1j * psi))
    least = bending_density(K, kappa, psi, k)
    for direction in (1.0, 1j, -1.0 + 0.5j):
        excess = bending_density(K, kappa, psi, k + 1e-3 * direction) - least
        assert excess == pytest.approx(0.5 * K.sum() * abs(1e-3 * direction) ** 2, rel=1e-8)


def test_the_points_of_a_section_integrate_along_it():
    materials = scene(3)
    for m, length in enumerate(materials.domain.lengths):
        nodes = section_nodes(materials, m, gauss_legendre(5, 2))
        assert nodes.weight.sum() == pytest.approx(length, rel=1e-14)
        middle = 0.5 * materials.domain.boundaries[m : m + 2].sum()
        assert nodes.weight @ nodes.s == pytest.approx(length * middle, rel=1e-13)
        assert np.array_equal(nodes.kappa, materials.pre_curvature(m, nodes.s))
        assert nodes.section == m and np.array_equal(nodes.bending, materials.bending[m])
