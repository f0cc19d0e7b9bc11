"""The table in docs/conventions.md from z-forward codes to ours: such a code, written out here, bends where it says."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ctr_pvs import EquilibriumSolver
from ctr_pvs import Robot
from ctr_pvs import Segment
from ctr_pvs import Tube

DOCUMENT = Path(__file__).parents[2] / "docs" / "conventions.md"
STIFF = ((0.046, 0.034), (0.018, 0.013))  # N m^2


def ours(position_of_theirs):
    """Their position (x, y, z) in our axes, as the table says."""
    x, y, z = position_of_theirs
    return np.array([z, x, y])


def z_forward(pieces):
    """The tip of a rod whose tangent is the z axis of its frame R: p' = R e_z, R' = R [u], with the pieces' constant u
    (u_x, u_y, u_z) [1/m] over their lengths [m]."""
    R, p = np.eye(3), np.zeros(3)
    steps = 2000
    for length, u in pieces:
        half = Rotation.from_rotvec(0.5 * length / steps * np.asarray(u)).as_matrix()
        for _ in range(steps):
            R = R @ half
            p = p + length / steps * R[:, 2]
            R = R @ half
    return p


def turned(theta, u):
    """A pre-curvature (u_x, u_y) of a tube whose base is turned by theta about z."""
    return Rotation.from_euler("z", theta).apply([*u, 0.0])


@pytest.mark.parametrize("u", [(12.0, 0.0), (0.0, 12.0), (7.0, -9.0)])
@pytest.mark.parametrize("theta", [0.0, 0.7, -2.5])
def test_one_tube_bends_where_the_table_says(u, theta):
    straight, curved, beta = 0.08, 0.1, -0.05
    tube = Tube("t", (Segment(straight, *STIFF[0]), Segment(curved, *STIFF[0], (complex(*u),))))
    answer = EquilibriumSolver(Robot("r", (tube,))).solve([theta], [-beta])
    expected = z_forward([(straight + beta, (0.0, 0.0, 0.0)), (curved, turned(theta, u))])
    np.testing.assert_allclose(answer.tip.position, ours(expected), atol=1e-6)


def test_two_tubes_bend_where_the_table_says():
    """Rigid in torsion, so that the mean of their curvatures, weighted by stiffness, is all there is."""
    us, thetas, betas, length = ((9.0, 2.0), (13.0, -3.0)), (0.4, 1.3), (-0.02, -0.05), (0.12, 0.2)
    tubes = [
        Tube(name, (Segment(long, *stiff, (complex(*u),)),))
        for name, long, stiff, u in zip(("outer", "inner"), length, STIFF, us, strict=True)
    ]
    solver = EquilibriumSolver(Robot("r", tuple(tubes)), fidelity="torsionless")
    answer = solver.solve(thetas, [-beta for beta in betas])
    bent = [turned(theta, u) for theta, u in zip(thetas, us, strict=True)]
    weights = np.array([bending for bending, _ in STIFF])
    together = weights @ np.array(bent) / weights.sum()
    ends = [long + beta for long, beta in zip(length, betas, strict=True)]
    expected = z_forward([(ends[0], together), (ends[1] - ends[0], bent[1])])
    np.testing.assert_allclose(answer.tip.position, ours(expected), atol=2e-6)


def test_the_document_has_these_rows():
    text = DOCUMENT.read_text(encoding="utf-8")
    for theirs, own in (("z, tangent", "x"), ("u_x", "kappa_y"), ("u_y", "kappa_z"), ("beta", "D = -beta"),
                        ("theta", "alpha = theta")):  # fmt: skip
        assert [line for line in text.splitlines() if line.startswith(f"| {theirs}") and own in line], theirs
    assert (DOCUMENT.parent / "figures" / "conventions.png").is_file()
