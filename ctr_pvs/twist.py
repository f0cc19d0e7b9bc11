"""Which twist fields are unknown, and what a vector q of them means.

With no load outside, every tube's torque T_j(s) = GJ_j psi_j'(s) is zero at its tip, is constant where nothing
couples the tubes, and the torques of all tubes add up to zero at every s.  What is left to solve for:

* one *lead* block: the constant torques in the guide and in the sections before the first coupled one, merged;
* a block for every later section up to the last coupled one: Legendre polynomials where the section is coupled,
constants
  where it is not;
* nothing past the last coupled section, where no torque is left.

The unknowns are scaled so that the torsional energy is q.q / 2 [J]: eigenvalues of the energy Hessian in q are then
relative to the torsional stiffness, and the zero-torque condition is a projection with orthonormal columns.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.basis import TwistBasis
from ctr_pvs.materials import Materials

Array = NDArray[np.float64]

CONSTANT = TwistBasis(0)
END = np.ones(1)
#: Square root of a section's coupling that one panel of polynomials takes on.  Beyond, a twist kink is short against
#: the section, and polynomials over all of it would pin the kink where nothing holds it.
BENDS_A_PANEL = 3.5


def panels_needed(coupling: float) -> int:
    """Number of equal panels for a section of this ``Materials.coupling``."""
    return max(1, math.ceil(math.sqrt(coupling) / BENDS_A_PANEL))


@dataclass(frozen=True, eq=False)
class TorqueField:
    """Torque of every tube along the robot: what is carried from one command to the next.

    guide : (N,) torque [N m] in the guide.
    boundaries : (M + 1,) arc lengths [m] of the sections.
    bases, sections : per section the basis, and (N, basis.size) coefficients [N m] of its functions.
    topology : ``Domain.topology`` of the sections.
    """

    guide: Array
    boundaries: Array
    bases: tuple[TwistBasis, ...]
    sections: tuple[Array, ...]
    topology: tuple[object, ...]

    def at(self, s: Array) -> Array:
        """(g, N) torque [N m] at ``s`` (g,) [m]: the first value before the orifice, none past the end."""
        out = np.zeros((len(s), len(self.guide)))
        index = np.searchsorted(self.boundaries, s, side="left") - 1
        for m in np.unique(index):
            here = index == m
            if m < 0:
                out[here] = self.guide
            elif m < len(self.sections):
                start, end = self.boundaries[m : m + 2]
                out[here] = self.bases[m].tabulate((s[here] - start) / (end - start))[0] @ self.sections[m].T
        return out

    def moved(self, rate: TorqueField, step: float) -> TorqueField:
        """This field plus ``step`` times ``rate`` (of the same sections)."""
        sections = tuple(a + step * b for a, b in zip(self.sections, rate.sections, strict=True))
        return TorqueField(self.guide + step * rate.guide, self.boundaries, self.bases, sections, self.topology)


@dataclass(frozen=True, eq=False)
class Block:
    """Unknowns of one section, or of the lead (section -1).

    scale : (N,) square root of the compliance that a unit of q acts through, 0 for tubes that do not twist here.
    frame : (N, r) orthonormal columns, orthogonal to 1 / scale: the zero-torque condition.
    basis : functions of x that the torques are made of; columns of q run over (r, basis.size).
    """

    section: int
    scale: Array
    frame: Array
    basis: TwistBasis
    columns: slice

    @property
    def spread(self) -> Array:
        """(N, r) torque per unit of q and per unit of the section's normalised polynomial."""
        inverse = np.divide(1.0, self.scale, out=np.zeros_like(self.scale), where=self.scale > 0.0)
        return inverse[:, None] * self.frame


#: Polynomial degree of the torques in every coupled section, or section by section (others are not read).
Degrees: TypeAlias = int | tuple[int, ...]


class TwistSpace:
    """The unknown twist fields of one domain with polynomials of one degree, or of one for each section.

    n : number of unknowns.  Psi is affine in them: psi(s) = alpha + A(s) q.
    """

    def __init__(self, materials: Materials, degree: Degrees) -> None:
        self.materials = materials
        self.degree = degree
        coupled = np.flatnonzero(materials.coupled)
        self.first, self.last = (int(coupled[0]), int(coupled[-1])) if len(coupled) else (0, -1)
        self._lead_compliances: dict[int, Array] = {}
        self.blocks = self._blocks()
        self.n = self.blocks[-1].columns.stop if self.blocks else 0

    @property
    def layout(self) -> tuple[object, ...]:
        """Equal for two spaces with the same sections, panels and degrees: their nodes correspond."""
        return (self.materials.domain.topology, tuple(block.basis for block in self.blocks))

    def basis(self, m: int) -> TwistBasis:
        """The functions that carry the torques of section m: panels where coupling is strong, constants where none
        is."""
        if not self.materials.coupled[m]:
            return CONSTANT
        degree = self.degree if isinstance(self.degree, int) else self.degree[m]
        return TwistBasis(degree, panels_needed(self.materials.coupling(m)))

    def _twisting(self) -> NDArray[np.bool_]:
        """(last + 1, N) tubes that carry torque in each section: curved in a coupled section from there on."""
        pulled = self.materials.curved[: self.last + 1] & self.materials.coupled[: self.last + 1, None]
        return np.logical_or.accumulate(pulled[::-1], axis=0)[::-1]

    def _blocks(self) -> list[Block]:
        if self.last < 0:
            return []
        twisting = self._twisting()
        blocks = []
        lead = np.where(twisting[self.first], self._lead_compliance(self.first), 0.0)
        if lead.any():
            blocks.append(self._block(-1, np.sqrt(lead), twisting[self.first], CONSTANT, 0))
        for m in range(self.first, self.last + 1):
            stiffness = self.materials.torsional[m]
            compliance = np.divide(
                self.materials.domain.lengths[m], stiffness, out=np.zeros_like(stiffness), where=twisting[m]
            )
            start = blocks[-1].columns.stop if blocks else 0
            blocks.append(self._block(m, np.sqrt(compliance), twisting[m], self.basis(m), start))
        return blocks

    @staticmethod
    def _block(section: int, scale: Array, twisting: NDArray[np.bool_], basis: TwistBasis, start: int) -> Block:
        frame = _zero_torque_frame(scale, twisting)
        return Block(section, scale, frame, basis, slice(start, start + frame.shape[1] * basis.size))

    def _lead_compliance(self, m: int) -> Array:
        """(N,) twist per torque from the tubes' bases to the start of section m [rad/(N m)]."""
        if m not in self._lead_compliances:
            stiffness = self.materials.torsional[:m]
            lengths = self.materials.domain.lengths[:m, None]
            shares = np.divide(lengths, stiffness, out=np.zeros_like(stiffness), where=stiffness > 0.0)
            self._lead_compliances[m] = self.materials.guide_compliance + shares.sum(axis=0)
        return self._lead_compliances[m]

    def angle_map(self, m: int, x: Array) -> Array:
        """A (g, N, n) [rad/sqrt(J)] at the places ``x`` (g,) in [0, 1] of section m."""
        out = np.zeros((len(x), self.materials.robot.n_tubes, self.n))
        for block in self.blocks:
            if block.section > m:
                break
            out[:, :, block.columns] = self._block_map(block, m, x)
        return out

    def _block_map(self, block: Block, m: int, x: Array) -> Array:
        """(g or 1, N, columns) of ``angle_map``; 1 where it is the same everywhere."""
        modes = block.scale[:, None] * block.frame
        if block.section < 0:
            if m >= self.first:
                return modes[None]
            return self._lead_share(m, x)[:, :, None] * modes
        # Past its own section a block's twist is complete: the integrals at x = 1.
        if block.section < m:
            return (modes[:, :, None] * block.basis.tabulate(END)[1]).reshape(1, len(modes), -1)
        integrals = block.basis.tabulate(x)[1]
        return (modes[None, :, :, None] * integrals[:, None, None, :]).reshape(len(x), len(modes), -1)

    def _lead_share(self, m: int, x: Array) -> Array:
        """(g, N) share of the lead's compliance that lies before the places ``x`` of a section m of the lead."""
        before, after, whole = (self._lead_compliance(index) for index in (m, m + 1, self.first))
        reached = before + x[:, None] * (after - before)
        return np.divide(reached, whole, out=np.zeros_like(reached), where=whole > 0.0)

    def field(self, q: Array) -> TorqueField:
        """The torque field of ``q`` (n,)."""
        domain = self.materials.domain
        none = np.zeros((self.materials.robot.n_tubes, 1))
        sections, bases = [none] * domain.n_sections, [CONSTANT] * domain.n_sections
        guide = np.zeros(self.materials.robot.n_tubes)
        for block in self.blocks:
            torque = block.spread @ q[block.columns].reshape(-1, block.basis.size)
            if block.section < 0:
                guide = torque[:, 0]
                sections[: self.first] = [torque] * self.first
            else:
                sections[block.section], bases[block.section] = torque, block.basis
        return TorqueField(guide, domain.boundaries, tuple(bases), tuple(sections), domain.topology)

    def coordinates(self, field: TorqueField) -> Array:
        """The q (n,) whose torques are nearest to ``field``: coefficient by coefficient in equal sections, else in
        s."""
        same = field.topology == self.materials.domain.topology
        q = np.zeros(self.n)
        for block in self.blocks:
            torque = self._matching(field, block) if same else self._sampled(field, block)
            q[block.columns] = (block.frame.T @ (block.scale[:, None] * torque)).ravel()
        return q

    def _matching(self, field: TorqueField, block: Block) -> Array:
        if block.section < 0:
            return field.guide[:, None]
        basis, given = field.bases[block.section], field.sections[block.section]
        if basis.panels != block.basis.panels:
            return self._sampled(field, block)
        torque = np.zeros((len(given), basis.panels, block.basis.degree + 1))
        shared = min(basis.degree, block.basis.degree) + 1
        torque[:, :, :shared] = given.reshape(len(given), basis.panels, -1)[:, :, :shared]
        return torque.reshape(len(given), -1)

    def _sampled(self, field: TorqueField, block: Block) -> Array:
        if block.section < 0:
            return field.guide[:, None]
        rule = block.basis.rule
        start, end = self.materials.domain.boundaries[block.section : block.section + 2]
        return (field.at(start + rule.x * (end - start)) * rule.weights[:, None]).T @ block.basis.tabulate(rule.x)[0]


def _zero_torque_frame(scale: Array, twisting: NDArray[np.bool_]) -> Array:
    """(N, n - 1) orthonormal columns for the n twisting tubes, orthogonal to 1 / scale.

    A Householder reflection of the last axis: smooth in ``scale``, so that q can be compared between nearby
    commands.  A tube whose base is on the orifice has no compliance there; it is given a vanishing one, and its
    column does nothing.
    """
    tubes = np.flatnonzero(twisting)
    relative = scale[tubes] / scale[tubes].max()
    normal = 1.0 / np.maximum(relative, 1e-9)
    normal /= np.linalg.norm(normal)
    mirror = normal.copy()
    mirror[-1] += 1.0
    mirror /= np.linalg.norm(mirror)
    frame = np.zeros((len(scale), len(tubes) - 1))
    frame[tubes] = (np.eye(len(tubes)) - 2.0 * np.outer(mirror, mirror))[:, :-1]
    return frame
