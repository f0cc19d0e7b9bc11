"""Robots at the edge of what is solved: strong coupling, twenty tubes, any size, slivers, bases at their limits."""

from __future__ import annotations

import time

import numpy as np
import pytest
from random_robots import two_tubes

from ctr_pvs import EquilibriumSolver
from ctr_pvs import Robot
from ctr_pvs import Segment
from ctr_pvs import Status
from ctr_pvs import Tube

HARD = {
    "long guides, b = 10": lambda: two_tubes(1.0, 10.0),
    "lambda = 10": lambda: two_tubes(10.0, 0.0),
    "low GJ, lambda = 30": lambda: two_tubes(30.0, 0.1),
    "low GJ, lambda = 100": lambda: two_tubes(100.0, 0.1),
    "near-rigid GJ": lambda: two_tubes(1e-6, 0.5),
    "no curvature": lambda: two_tubes(0.0, 0.5),
}


@pytest.mark.parametrize("name", HARD)
def test_hard_cases_turn_through_everything(name):
    """A whole turn and back in uneven steps: every answer is stable and flagged, or fails with a reason."""
    robot, D = HARD[name]()
    solver = EquilibriumSolver(robot, tolerance=1e-6)
    for angle in (0.3, 2.9, np.pi, 3.6, 6.0, 7.5, 2.0):
        answer = solver.solve([0.0, angle], D)
        assert answer.success, answer.message
        assert answer.stability_margin > 0.0
        assert answer.residual < 1e-10 or (answer.fidelity == "torsionless" and answer.error_estimate < 1e-6)
        assert (answer.status is Status.SNAP) == bool(answer.snaps)


def test_beyond_what_the_basis_can_show_the_status_is_honest():
    """lambda = 1e4: twist concentrates in a layer of a hundredth of the overlap. An answer, or an honest failure."""
    robot, D = two_tubes(1e4, 0.1)
    answer = EquilibriumSolver(robot, tolerance=1e-8).solve([0.0, 2.0], D, budget=3.0)
    assert answer.status is not Status.SNAP
    if answer.success:
        assert answer.error_estimate <= 1e-8 and answer.stability_margin > 0.0
    else:
        assert answer.message


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_scaled_robots_are_the_same_robots(seed_robot, scale):
    """All lengths times 1e-3 or 1e3, curvatures divided, stiffnesses to the fourth power: same angles, scaled shape."""

    def resized(tube):
        segments = tuple(
            Segment(
                g.length * scale,
                g.bending_stiffness * scale**4,
                g.torsional_stiffness * scale**4,
                tuple(c / scale ** (k + 1) for k, c in enumerate(g.curvature)),
            )
            for g in tube.segments
        )
        return Tube(tube.name, segments)

    robot = Robot("scaled", tuple(resized(tube) for tube in seed_robot.tubes))
    D = np.array([0.09, 0.2])
    plain = EquilibriumSolver(seed_robot, tolerance=1e-7).solve([0.0, 2.0], D)
    scaled = EquilibriumSolver(robot, tolerance=max(1e-10, 1e-7 * scale)).solve([0.0, 2.0], D * scale)
    assert scaled.success
    assert scaled.tip.position == pytest.approx(plain.tip.position * scale, rel=1e-5, abs=1e-7 * scale)
    assert scaled.torque == pytest.approx(plain.torque * scale**3, rel=1e-6)
    assert scaled.force == pytest.approx(plain.force * scale**2, rel=1e-5)
    assert scaled.stability_margin == pytest.approx(plain.stability_margin, abs=1e-6)


def test_twenty_tubes():
    """Twenty nested tubes over one overlap: solved, stable, no total torque, and in reasonable time."""
    tubes = tuple(
        Tube(f"t{j}", (Segment(0.02, 0.01 + 0.002 * j, 0.01), Segment(0.1, 0.01 + 0.002 * j, 0.01, (4.0 + 0.3 * j,))))
        for j in range(20)
    )
    start = time.monotonic()
    answer = EquilibriumSolver(Robot("twenty", tubes), tolerance=1e-5).solve(np.linspace(0, 1.5, 20), np.full(20, 0.01))
    assert answer.success and answer.stability_margin > 0.0
    assert abs(answer.torque.sum()) < 1e-12
    assert time.monotonic() - start < 60.0


def test_micrometre_sections():
    """Sections of 1 um between coupled ones change next to nothing and disturb nothing."""
    K, G = 0.02, 0.015
    sliver = Segment(1e-6, K, G, (40.0,))
    plain = Tube("a", (Segment(0.02, K, G), Segment(0.08, K, G, (12.0,))))
    cut = Tube("a", (Segment(0.02, K, G), Segment(0.04, K, G, (12.0,)), sliver, Segment(0.04, K, G, (12.0,))))
    inner = Tube("b", (Segment(0.03, K, G), Segment(0.1, K, G, (10.0 + 3j,))))
    answers = [
        EquilibriumSolver(Robot("r", (outer, inner)), 1e-8).solve([0.0, 2.0], [0.01, 0.015]) for outer in (plain, cut)
    ]
    assert all(answer.success for answer in answers)
    assert np.linalg.norm(answers[0].tip.position - answers[1].tip.position) < 5e-6
    assert answers[0].torque == pytest.approx(answers[1].torque, abs=1e-4)


@pytest.mark.parametrize("D", [[0.0, 0.0], [0.185, 0.1858], [0.1858, 0.3035], [0.0, 0.3035], [0.1858, 0.1858]])
def test_D_at_its_limits(seed_robot, D):
    answer = EquilibriumSolver(seed_robot, tolerance=1e-7).solve([0.0, 2.0], D)
    assert answer.success and answer.stability_margin > 0.0
    assert np.all(np.isfinite(answer.force_interval)) and abs(answer.torque.sum()) < 1e-12


def test_sliding_into_strong_coupling_adds_elements():
    """Pushing out until the overlap needs a second element, and back: the branch goes on."""
    robot, D = two_tubes(30.0, 0.5)
    inside = [0.6 * robot.tubes[0].length] * 2
    solver = EquilibriumSolver(robot, tolerance=1e-7)
    first = solver.solve([0.0, 1.0], inside)
    out = solver.follow([0.0, 1.0], D)
    elements = [max(a.shape.panels(m) for m in range(a.shape.domain.n_sections)) for a in (first, out)]
    assert elements[0] == 1 < elements[1]
    back = solver.follow([0.0, 1.0], inside)
    assert first.success and out.success and back.success
    assert back.tip.position == pytest.approx(first.tip.position, abs=1e-9)
