"""Rates of the tip with the tubes' parameters: against differences of solves, robot by robot."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from long_runs import some
from random_robots import random_D
from random_robots import random_robot

from ctr_pvs import EquilibriumSolver
from ctr_pvs import Robot
from ctr_pvs import Segment
from ctr_pvs import Tube
from ctr_pvs.tasks.calibration.rates import tube_rates

TIGHT = 1e-9


def changed(robot, tube, segment=None, **factors):
    """The robot with some values of one tube's segments (or of one of them) times 1 + a factor; lengths plus it."""

    def change(index, old):
        if segment not in (None, index):
            return old
        new = {}
        for key, h in factors.items():
            value = getattr(old, key)
            new[key] = (
                tuple(c * (1 + h) for c in value)
                if key == "curvature"
                else value + h
                if key == "length"
                else value * (1 + h)
            )
        return replace(old, **new)

    tubes = list(robot.tubes)
    tubes[tube] = replace(tubes[tube], segments=tuple(change(*pair) for pair in enumerate(tubes[tube].segments)))
    return replace(robot, tubes=tuple(tubes))


def rotation(a, b):
    """Rotation vector [rad] from quaternion a to b, small, in base axes."""
    (ax, ay, az, aw), (bx, by, bz, bw) = a, b
    # b times the conjugate of a
    return 2.0 * np.array(
        [
            -bw * ax + bx * aw - by * az + bz * ay,
            -bw * ay + by * aw - bz * ax + bx * az,
            -bw * az + bz * aw - bx * ay + by * ax,
        ]
    )


def difference(robot, alpha, D, h, **what):
    """(6,) central difference of the tip."""
    tips = []
    for sign in (1.0, -1.0):
        key = next(key for key in what if key not in ("tube", "segment"))
        other = changed(robot, what["tube"], what.get("segment"), **{key: sign * h})
        answer = EquilibriumSolver(other, TIGHT, "torsion").solve(alpha, D, start="cold")
        assert answer.success
        tips.append(answer.tip)
    turned = rotation(tips[1].orientation, tips[0].orientation)
    return np.concatenate([tips[0].position - tips[1].position, turned]) / (2.0 * h)


def check(robot, alpha, D):
    answer = EquilibriumSolver(robot, TIGHT, "torsion").solve(alpha, D, start="cold")
    assert answer.success
    rates = tube_rates(answer.shape)
    scale = np.repeat([answer.length, 1.0], 3)
    for j, tube in enumerate(robot.tubes):
        for name, key in (("bending", "bending_stiffness"), ("torsion", "torsional_stiffness")):
            told = difference(robot, alpha, D, 1e-4, tube=j, **{key: 1})
            assert getattr(rates, name)[:, j] / scale == pytest.approx(told / scale, abs=3e-6), (name, j)
        told = difference(robot, alpha, D, 1e-4, tube=j, curvature=1)
        assert rates.curvature[:, j] / scale == pytest.approx(told / scale, abs=3e-6), ("curvature", j)
        for i in range(len(tube.segments)):
            told = difference(robot, alpha, D, 1e-6, tube=j, segment=i, length=1)
            assert rates.length[j][:, i] == pytest.approx(told, abs=2e-4, rel=1e-4), ("length", j, i)


@pytest.mark.parametrize("seed", some(range(12), {0, 1, 2}))
def test_rates_are_those_of_differences(seed):
    rng = np.random.default_rng(seed)
    robot = random_robot(rng, 2 + seed % 2, strength=0.6)
    check(robot, rng.uniform(-0.8, 0.8, robot.n_tubes), random_D(rng, robot))


def test_the_joint_rates_of_the_kernel_are_the_same_rule():
    """Sliding a tube is lengthening its first segment backwards, but for what the guide then holds."""
    robot = Robot(
        "pair",
        (
            Tube("outer", (Segment(0.05, 0.05, 0.04), Segment(0.08, 0.05, 0.04, (6.0,)))),
            Tube("inner", (Segment(0.15, 0.02, 0.015), Segment(0.06, 0.02, 0.015, (9.0 + 3j, 40.0)))),
        ),
    )
    answer = EquilibriumSolver(robot, TIGHT, "torsion").solve([0.0, 1.0], [0.03, 0.06], start="cold")
    rates = tube_rates(answer.shape)
    turned = answer.torque / np.array([0.04, 0.015])  # twist [rad/m] that a longer guide adds
    for j in range(2):
        slid = answer.jacobian[:, 2 + j] + answer.jacobian[:, j] * turned[j]
        assert rates.length[j][:, 0] == pytest.approx(-slid, abs=1e-6), j


def test_nothing_out_moves_nothing():
    robot = Robot("one", (Tube("only", (Segment(0.05, 0.05, 0.04, (3.0,)),)),))
    answer = EquilibriumSolver(robot, TIGHT, "torsion").solve([0.2], [0.05])
    assert not tube_rates(answer.shape).bending.any()
