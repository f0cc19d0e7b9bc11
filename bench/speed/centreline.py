"""From twist angles to the tip, for the methods that the package is compared with: as quick as numpy allows.

The boundary-value model and the seed's equations give angles or strains; a tip takes one more integration, R' = R
hat(k), r' = R e_x.  Done with an integrator of ODEs it would cost more than some of the solves; here it is a product of
matrix exponentials, sixth order, all steps at once, with every table that depends on D made beforehand.

Reference: S. Blanes, F. Casas, J. A. Oteo, J. Ros, "The Magnus expansion and some of its applications", Physics
Reports 470 (2009), section 5.4.
"""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

from ctr_pvs import Robot

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

#: Steps in every section: enough for 1e-12 m in all scenes.
STEPS = 10
GAUSS = 0.5 + 0.5 * np.array([-np.sqrt(0.6), 0.0, np.sqrt(0.6)])


class Centreline:
    """Steps from the orifice to the far tip for one D (N,) [m].

    s : (g,) arc lengths [m] where curvature is wanted, three in every step; moment (g, N) K_j kappa*_j.
    """

    def __init__(self, robot: Robot, D: Array, steps: int = STEPS) -> None:
        breaks = np.concatenate([tube.breaks - base for tube, base in zip(robot.tubes, D, strict=True)])
        joints = np.unique(np.append(breaks[breaks > 0.0], 0.0))
        joints = joints[np.append(True, np.diff(joints) > 1e-9)]
        edges = np.unique(np.concatenate([np.linspace(a, b, steps + 1) for a, b in itertools.pairwise(joints)]))
        self.h = np.diff(edges)
        self.s = (edges[:-1, None] + self.h[:, None] * GAUSS).ravel()
        bending = np.zeros((len(self.s), robot.n_tubes))
        self.moment = np.zeros(bending.shape, dtype=complex)
        for j, (tube, base) in enumerate(zip(robot.tubes, D, strict=True)):
            index = np.searchsorted(tube.breaks, self.s + base) - 1
            for i, segment in enumerate(tube.segments):
                here = index == i
                bending[here, j] = segment.bending_stiffness
                kappa = segment.pre_curvature(self.s[here] + base - tube.breaks[i])
                self.moment[here, j] = segment.bending_stiffness * kappa
        self.stiffness = bending.sum(axis=1)

    def tip(self, psi: Array) -> Array:
        """Position (3,) [m] of the tip for twist angles (g, N) [rad]; those of tubes that have ended do not count."""
        turned = np.where(self.moment == 0.0, 0.0, self.moment * np.exp(1j * psi))
        return self.tip_of_curvature(turned.sum(axis=1) / self.stiffness)

    def tip_of_curvature(self, k: ComplexArray) -> Array:
        """Position (3,) [m] of the tip for curvatures (g,) [1/m], k_y + i k_z in the frame that does not twist."""
        return product(exponential(exponents(self.h, k.reshape(-1, 3))))[:3, 3]


def exponents(h: Array, k: ComplexArray) -> Array:
    """(n, 4, 4) sixth-order exponents of g' = g hat(xi) over steps ``h`` (n,) with curvatures ``k`` (n, 3)."""
    first = _hat(h, k[:, 1], 1.0)
    second = _hat(np.sqrt(15.0) / 3.0 * h, k[:, 2] - k[:, 0], 0.0)
    third = _hat(10.0 / 3.0 * h, k[:, 2] - 2.0 * k[:, 1] + k[:, 0], 0.0)
    inner = _bracket(first, second)
    outer = _bracket(first, 2.0 * third + inner) / -60.0
    return first + third / 12.0 + _bracket(-20.0 * first - third + inner, second + outer) / 240.0


def _hat(h: Array, k: ComplexArray, tangent: float) -> Array:
    out = np.zeros((len(h), 4, 4))
    y, z = h * k.real, h * k.imag
    out[:, 0, 1], out[:, 1, 0], out[:, 0, 2], out[:, 2, 0] = -z, z, y, -y
    out[:, 0, 3] = h * tangent
    return out


def _bracket(a: Array, b: Array) -> Array:
    """The commutator; the equation multiplies from the right, which turns its sign."""
    return b @ a - a @ b


def exponential(hat: Array) -> Array:
    """(n, 4, 4) exponentials of elements (n, 4, 4) of se(3)."""
    angle2 = hat[:, 2, 1] ** 2 + hat[:, 0, 2] ** 2 + hat[:, 1, 0] ** 2
    angle = np.sqrt(angle2)
    small = angle < 1e-2
    safe = np.where(small, 1.0, angle)
    half = np.where(small, 0.5 - angle2 / 24.0 * (1.0 - angle2 / 30.0), 2.0 * (np.sin(0.5 * safe) / safe) ** 2)
    third = np.where(small, 1.0 / 6.0 - angle2 / 120.0 * (1.0 - angle2 / 42.0), (safe - np.sin(safe)) / safe**3)
    square = hat @ hat
    return np.eye(4) + hat + half[:, None, None] * square + third[:, None, None] * (square @ hat)


def product(matrices: Array) -> Array:
    """(4, 4) product of matrices (n, 4, 4) from left to right, in pairs."""
    while len(matrices) > 1:
        paired = matrices[: len(matrices) // 2 * 2]
        together = paired[0::2] @ paired[1::2]
        matrices = together if len(paired) == len(matrices) else np.concatenate([together, matrices[-1:]])
    return matrices[0]
