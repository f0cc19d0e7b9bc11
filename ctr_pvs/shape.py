"""The fields of one equilibrium along s, at any model level: twist angles psi_j, their rates, the curvature."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.basis import gauss_legendre
from ctr_pvs.collocation import nodes_needed
from ctr_pvs.energy import shared_curvature
from ctr_pvs.materials import Materials
from ctr_pvs.model import shape
from ctr_pvs.pieces import Arc
from ctr_pvs.pieces import Bend
from ctr_pvs.pieces import Piece
from ctr_pvs.sections import ABSENT
from ctr_pvs.sections import Domain
from ctr_pvs.twist import TorqueField
from ctr_pvs.twist import TwistSpace

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

#: Places of a panel where the rates are sampled that decide on its number of nodes.
SAMPLES = 5
#: A panel that bends by less [rad] is straight: how its curvature changes is rounding.
STRAIGHT = 1e-9


class Shape(shape.Shape):
    """A shape that knows its backbone."""

    materials: Materials

    @property
    def domain(self) -> Domain:
        return self.materials.domain

    def pieces(self, tolerance: float, tube: int | None = None) -> list[Piece]:
        """The backbone from the orifice to the tip, for an error of about ``tolerance`` [m] anywhere on it.

        Rolls are those of ``tube``, the leader if None; past its tip a tube keeps its last angle.  With nothing out
        there is one piece of no length.
        """
        tube = self.leader if tube is None else tube
        if not self.domain.n_sections:
            return [Arc(0.0, 0.0, roll=float(self.angle_at_boundaries[0, tube]))]
        pieces: list[Piece] = []
        for m in range(self.domain.n_sections):
            arc = self.arc(m, tube)
            pieces += self._bends(m, tube, tolerance) if arc is None else [arc]
        return pieces

    def arc(self, m: int, tube: int) -> Arc | None:
        """Section m in closed form, where its strain is constant but for a constant turn; else None."""
        return None

    def _bends(self, m: int, tube: int, tolerance: float) -> list[Piece]:
        panels = self.panels(m)
        length = float(self.domain.lengths[m]) / panels
        x = np.linspace(0.0, 1.0, 1 + (SAMPLES - 1) * panels)
        k = self.curvature(m, x)
        bend = float(np.abs(k).max())
        change = float(np.abs(np.diff(k)).max()) * (len(x) - 1) / (panels * length)
        rate = float(np.abs(self.twist_rate(m, x)).max()) + self._turn(m)
        if bend * length > STRAIGHT:
            rate = max(rate, change / bend)
        wave = np.sqrt(self.materials.coupling(m)) / (panels * length) if self.materials.coupled[m] else 0.0
        relative = tolerance / self.domain.length
        parts, nodes = nodes_needed(length, bend, rate, float(wave), relative)
        count = panels * parts
        places = gauss_legendre(nodes, count).x
        k, roll = self.curvature(m, places), self.angle(m, places)[:, tube]
        cuts = [slice(start, start + nodes) for start in range(0, nodes * count, nodes)]
        return [Bend(length / parts, 0.5 * length / parts * k[cut], roll[cut]) for cut in cuts]

    def _turn(self, m: int) -> float:
        """The fastest turn [rad/m] of a pre-curvature in section m."""
        present = enumerate(self.domain.segment[m])
        return max(abs(self.materials.segment(j, int(index)).turn) for j, index in present if index != ABSENT)


class TorsionShape(Shape):
    """The shape of unknowns ``q`` (n,) at the `torsion` level: curvature follows the twist point by point."""

    def __init__(self, space: TwistSpace, alpha: Array, q: Array) -> None:
        super().__init__(space.materials, alpha)
        self.space = space
        self.q = q

    @cached_property
    def torques(self) -> TorqueField:
        """Torque of every tube, to start another solve from."""
        return self.space.field(self.q)

    def angle(self, m: int, x: Array) -> Array:
        psi = np.broadcast_to(self.angle_at_boundaries[m], (len(x), len(self.alpha)))
        twist = self.torques.bases[m].tabulate(x)[1] @ self.torques.sections[m].T
        return psi + twist * self._compliance(m)

    def panels(self, m: int) -> int:
        return self.torques.bases[m].panels

    def arc(self, m: int, tube: int) -> Arc | None:
        length, start = float(self.domain.lengths[m]), np.zeros(1)
        curved = np.flatnonzero(self.materials.curved[m])
        if len(curved) > 1 or self.torques.bases[m].size > 1:
            return None
        rate, psi = self.twist_rate(m, start)[0], self.angle_at_boundaries[m]
        roll = float(psi[tube]), float(rate[tube])
        if not len(curved):
            return Arc(length, 0.0, 0.0, *roll)
        segment = self.materials.segment(int(curved[0]), int(self.domain.segment[m, curved[0]]))
        if len(segment.curvature) > 1:
            return None
        return Arc(length, complex(self.curvature(m, start)[0]), segment.turn + float(rate[curved[0]]), *roll)

    def twist_rate(self, m: int, x: Array) -> Array:
        torque = self.torques.bases[m].tabulate(x)[0] @ self.torques.sections[m].T
        return torque * self._compliance(m) / self.domain.lengths[m]

    def curvature(self, m: int, x: Array) -> ComplexArray:
        kappa = self.materials.pre_curvature(m, self.domain.boundaries[m] + x * self.domain.lengths[m])
        stiffness = self.materials.bending[m]
        return shared_curvature(stiffness, stiffness * kappa * np.exp(1j * self.angle(m, x)))

    def _compliance(self, m: int) -> Array:
        stiffness = self.materials.torsional[m]
        return np.divide(self.domain.lengths[m], stiffness, out=np.zeros_like(stiffness), where=stiffness > 0.0)

    @cached_property
    def angle_at_boundaries(self) -> Array:
        psi = [self.alpha + self.materials.guide_compliance * self.torques.guide]
        for m, (basis, coefficients) in enumerate(zip(self.torques.bases, self.torques.sections, strict=True)):
            mean = coefficients @ basis.tabulate(np.ones(1))[1][0]
            psi.append(psi[-1] + mean * self._compliance(m))
        return np.array(psi)


class TorsionlessShape(TorsionShape):
    """The shape of tubes that are taken for rigid in torsion: angles are the base angles everywhere."""

    twists = False
