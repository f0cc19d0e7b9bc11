"""How far a tip is off, and its rates against differences."""

from __future__ import annotations

import numpy as np
import pytest

from ctr_pvs import EquilibriumSolver
from ctr_pvs import load_robot
from ctr_pvs.errors import FieldError
from ctr_pvs.tasks.aim import Aim
from ctr_pvs.tasks.aim import quaternion_product
from ctr_pvs.tasks.aim import tangent_of
from ctr_pvs.tasks.aim import turned_about_x

ALPHA, D = np.array([0.2, 0.9, -0.4]), np.array([0.05, 0.1, 0.17])


@pytest.fixture(scope="module")
def answer():
    return EquilibriumSolver(load_robot("three_tubes"), 1e-9).solve(ALPHA, D)


def aims(answer):
    """At the tip itself but for the position: there all rates are exact."""
    position, orientation = answer.tip.position + 0.01, answer.tip.orientation
    yield Aim(position)
    yield Aim(position, [1.0, 0.3, 0.2])
    yield Aim(position, None, orientation)


@pytest.mark.parametrize("which", range(3))
def test_rates_are_those_of_differences(answer, which):
    aim = list(aims(answer))[which]
    solver, h = EquilibriumSolver(answer._engine.robot, 1e-9), 1e-5
    rates = aim.jacobian(answer)
    for column in range(6):
        step = np.zeros(6)
        step[column] = h * (1.0 if column < 3 else 0.1)
        ahead, behind = (solver.solve(ALPHA + s * step[:3], D + s * step[3:], start="cold") for s in (1.0, -1.0))
        difference = (aim.residual(ahead) - aim.residual(behind)) / (2.0 * step[column])
        assert rates[:, column] == pytest.approx(difference, abs=2e-5 * max(1.0, np.abs(difference).max()))


def test_the_tip_itself_is_met_and_angles_are_told(answer):
    tip = answer.tip
    assert Aim(tip.position, None, tip.orientation, 1e-9, 1e-7).met(answer)
    turn = 0.3
    turned = quaternion_product(np.array([0.0, np.sin(turn / 2), 0.0, np.cos(turn / 2)]), tip.orientation)
    for sign in (1.0, -1.0):  # a quaternion and its negative are one orientation
        aim = Aim(tip.position, None, sign * turned)
        assert aim.angle(answer) == pytest.approx(turn, abs=1e-12) and not aim.met(answer)
    tangent = tangent_of(tip.orientation)
    across = np.cross(tangent, [0.0, 0.0, 1.0])
    across /= np.linalg.norm(across)
    aim = Aim(tip.position, np.cos(turn) * tangent + np.sin(turn) * across)
    assert aim.angle(answer) == pytest.approx(turn, abs=1e-12)


def test_a_turn_of_all_tubes_turns_the_tip(answer):
    turn = 0.7
    other = EquilibriumSolver(answer._engine.robot, 1e-9).solve(ALPHA + turn, D)
    position, orientation = turned_about_x(np.array([turn]), answer.tip.position[None], answer.tip.orientation[None])
    assert position[0] == pytest.approx(other.tip.position, abs=1e-9)
    assert abs(orientation[0] @ other.tip.orientation) == pytest.approx(1.0, abs=1e-9)
    aim = Aim(other.tip.position)
    assert float(aim.turn_from(answer.tip.position)) == pytest.approx(turn, abs=1e-7)


@pytest.mark.parametrize(
    "words",
    [
        ([0.1, 0.0], None, None),
        ([0.1, 0.0, np.nan], None, None),
        ("abc", None, None),
        ([0.1, 0.0, 0.0], [0.0, 0.0, 0.0], None),
        ([0.1, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]),
    ],
)
def test_what_is_no_aim_is_refused(words):
    with pytest.raises(FieldError):
        Aim(*words)
