"""Strain bases of the `full` level: B_1 for the leading tube (eq. 19) and B_theta for the relative twists (eq. 20).

A basis family tabulates, for one section, the columns of B_1 (rows: torsion, and the two bending directions in the
leading tube's frame) and of each B_theta.  Columns may depend on each other (pre-curvatures that vanish or are
multiples): the solver takes the least change of coordinates.  The leading tube is the outermost one present;
B_theta_j is tube j against the next outer one.  Where a single tube is left beyond the orifice its own rest strain
is the answer, and nothing is unknown.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike
from numpy.typing import NDArray

from ctr_pvs.errors import FieldError
from ctr_pvs.model.basis import legendre

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class SectionView:
    """What a basis may depend on in one section, at the places x (g,) in [0, 1] of it.

    x, s : (g,) place in the section, and arc length [m].
    kappa : (g, p) pre-curvatures kappa_y + i kappa_z [1/m] of the p tubes present, outermost first; 0 in the guide.
    alpha : (p,) their base angles [rad], for bases that follow the command.
    """

    x: Array
    s: Array
    kappa: NDArray[np.complex128]
    alpha: Array


@dataclass(frozen=True, eq=False)
class SectionBasis:
    """Tabulated bases: lead (g, 3, n_1) of B_1, rows k_x, k_y, k_z; relative: one (g, n_j) per inner tube present."""

    lead: Array
    relative: tuple[Array, ...]


class StrainBasis(Protocol):
    """A family of bases.  ``bends`` is false in the guide, where the tubes are held straight: only row k_x counts."""

    def __call__(self, view: SectionView, bends: bool) -> SectionBasis: ...


@dataclass(frozen=True)
class PolynomialBasis:
    """All polynomials up to ``degree`` for every strain of a section that bends, constants in the guide.

    orthogonal : Legendre polynomials; otherwise the seed's monomials 1, X, X^2, .. of eq. (34).  Both span the same
    strains, so equilibria agree; monomials are worse conditioned.
    """

    degree: int
    orthogonal: bool = True

    def __post_init__(self) -> None:
        if not (isinstance(self.degree, int) and 0 <= self.degree <= 40):
            raise FieldError("degree", self.degree, "a whole number from 0 to 40")

    def __call__(self, view: SectionView, bends: bool) -> SectionBasis:
        degree = self.degree if bends else 0
        values = legendre(degree, view.x)[0] if self.orthogonal else np.vander(view.x, degree + 1, increasing=True)
        rows = 3 if bends else 1
        lead = np.zeros((len(view.x), 3, rows * values.shape[1]))
        for row in range(rows):
            lead[:, row, row * values.shape[1] : (row + 1) * values.shape[1]] = values
        return SectionBasis(lead, (values,) * (view.kappa.shape[1] - 1))


@dataclass(frozen=True)
class ReferenceStrainBasis:
    """Eq. (29): the tubes' own pre-curvatures, turned by their base angles, and no twist.

    With it the energy's minimum is the torsionless closed form, eq. (28)-(31), for any variable curvature.
    """

    def __call__(self, view: SectionView, bends: bool) -> SectionBasis:
        points, tubes = view.kappa.shape
        none = (np.zeros((points, 0)),) * (tubes - 1)
        if not bends:
            return SectionBasis(np.zeros((points, 3, 0)), none)
        turned = view.kappa * np.exp(1j * (view.alpha - view.alpha[0]))
        lead = np.zeros((points, 3, 2 * tubes))
        lead[:, 1, :tubes] = turned.real
        lead[:, 2, tubes:] = turned.imag
        return SectionBasis(lead, none)


@dataclass(frozen=True)
class CustomBasis:
    """Any basis: functions of the section's view that give B_1 (g, 3, n_1) and each B_theta (g, n_j)."""

    lead: Callable[[SectionView], ArrayLike]
    relative: Callable[[SectionView, int], ArrayLike]

    def __call__(self, view: SectionView, bends: bool) -> SectionBasis:
        lead = np.asarray(self.lead(view), dtype=float)
        if lead.ndim != 3 or lead.shape[:2] != (len(view.x), 3):
            raise FieldError("lead", lead.shape, f"an array ({len(view.x)}, 3, n)")
        if not bends:
            lead = lead * np.array([1.0, 0.0, 0.0])[:, None]
        relative = []
        for inner in range(1, view.kappa.shape[1]):
            table = np.asarray(self.relative(view, inner), dtype=float)
            if table.ndim != 2 or len(table) != len(view.x):
                raise FieldError("relative", table.shape, f"an array ({len(view.x)}, n)")
            relative.append(table)
        return SectionBasis(lead, tuple(relative))
