"""Legendre polynomials and Gauss points on [0, 1]."""

from __future__ import annotations

import numpy as np
import pytest

from ctr_pvs.model.basis import gauss_legendre
from ctr_pvs.model.basis import legendre


def test_polynomials_are_orthonormal_and_their_integrals_are_their_integrals():
    rule = gauss_legendre(12)
    values = legendre(9, rule.x)[0]
    assert np.allclose(values.T @ (rule.weights[:, None] * values), np.eye(10), atol=1e-13)
    x, h = np.linspace(0.05, 0.95, 7), 1e-6
    slope = (legendre(9, x + h)[1] - legendre(9, x - h)[1]) / (2 * h)
    assert slope == pytest.approx(legendre(9, x)[0], abs=1e-7)
    assert np.allclose(legendre(9, np.zeros(1))[1], 0.0, atol=1e-15)
    assert np.allclose(legendre(9, np.ones(1))[1], np.eye(10)[0], atol=1e-15)  # all but the constant have no mean


@pytest.mark.parametrize(("nodes", "panels"), [(3, 1), (5, 1), (4, 3)])
def test_quadrature_is_exact_up_to_its_degree(nodes, panels):
    rule = gauss_legendre(nodes, panels)
    assert len(rule.x) == nodes * panels and np.all(np.diff(rule.x) > 0.0)
    for power in range(2 * nodes):
        assert rule.weights @ rule.x**power == pytest.approx(1.0 / (power + 1), rel=1e-14)
    if panels == 1:
        assert abs(rule.weights @ rule.x ** (2 * nodes) - 1.0 / (2 * nodes + 1)) > 1e-8
    seam = rule.weights @ np.abs(rule.x - 1 / 3)  # a kink on the seam of three panels costs them nothing
    assert bool(abs(seam - 5 / 18) < 1e-14) is (panels == 3)


def test_shared_rules_cannot_be_written_to():
    with pytest.raises(ValueError, match="read-only"):
        gauss_legendre(4).x[0] = 0.5
