"""Which twist fields are unknown, and what a vector q of them means.

With no load outside, every tube's torque T_j(s) = GJ_j psi_j'(s) is zero at its tip, is constant where nothing
couples the tubes, and the torques of all tubes add up to zero at every s.  What is left to solve for:

* one *lead* block: the constant torques in the guide and in the sections before the first coupled one, merged;
* a block for every later section up to the last coupled one: Legendre polynomials where the section is coupled,
  constants where it is not;
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
from ctr_pvs.lazy import lazy
from ctr_pvs.materials import Materials
from ctr_pvs.unknowns import CONSTANT
from ctr_pvs.unknowns import Unknowns
from ctr_pvs.unknowns import unknowns

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

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
    unknowns : what does not depend on the sections' lengths.
    modes (N, n) : angle [rad/sqrt(J)] of each tube per unknown and per integral of the unknown's function.
    """

    def __init__(self, materials: Materials, degree: Degrees) -> None:
        self.materials = materials
        self.degree = degree
        made = materials.composition
        self.first, self.last = made.first, made.last
        self._leads = self._lead_compliances()
        lead = self._leads[-1] * made.twisting[self.first] if made.twisting.size else self._leads[:0]
        self.unknowns = unknowns(made, self._bases(), bool(lead.any()))
        self.n = self.unknowns.n
        compliances = np.empty(self.unknowns.twisting.shape)
        if self.unknowns.lead:
            compliances[0] = lead
        lengths = materials.domain.lengths[self.first : self.last + 1, None]
        np.divide(lengths, self.unknowns.torsional, out=compliances[int(self.unknowns.lead) :])
        self._scales = np.sqrt(compliances)
        self._frames = _zero_torque_frames(self._scales, self.unknowns)
        self.modes = self._columns(self._scales)

    def _bases(self) -> tuple[TwistBasis, ...]:
        degree = self.degree
        bases = [CONSTANT] * self.materials.domain.n_sections
        for m in self.materials.composition.coupled_sections.tolist():
            panels = panels_needed(self.materials.coupling(m))
            bases[m] = TwistBasis(degree if isinstance(degree, int) else degree[m], panels)
        return tuple(bases)

    def _columns(self, scales: Array) -> Array:
        """(N, n) the frame column of each unknown, times its block's row of ``scales`` (B, N)."""
        given = self.unknowns
        return (scales.take(given.frame_block, axis=0).T * self._frames).take(given.frame, axis=1)

    @property
    def layout(self) -> tuple[object, ...]:
        """Equal for two spaces with the same sections, panels and degrees: their nodes correspond."""
        return (self.materials.domain.topology, tuple(self.unknowns.bases))

    @lazy
    def blocks(self) -> list[Block]:
        given = self.unknowns
        parts = zip(given.sections, self._scales, given.frame_slices, given.bases, given.columns, strict=True)
        return [Block(m, scale, self._frames[:, frame], basis, columns) for m, scale, frame, basis, columns in parts]

    def basis(self, m: int) -> TwistBasis:
        """The functions that carry the torques of section m: panels where coupling is strong, constants where none
        is."""
        return self.unknowns.section_bases[m]

    def _lead_compliances(self) -> Array:
        """(first + 1, N) twist per torque from the tubes' bases to the start of each section of the lead, and of the
        first one past it [rad/(N m)]."""
        out = np.empty((self.first + 1, self.materials.robot.n_tubes))
        out[0] = self.materials.guide_compliance
        if self.first:
            np.multiply(
                self.materials.domain.lengths[: self.first, None],
                self.materials.composition.softness[: self.first],
                out=out[1:],
            )
            out.cumsum(axis=0, out=out)
        return out

    def angle_map(self, m: int, x: Array) -> Array:
        """A (g, N, n) [rad/sqrt(J)] at the places ``x`` (g,) in [0, 1] of section m."""
        if m >= self.first:
            return self.unknowns.integrals(m, x)[:, None, :] * self.modes
        out = np.zeros((len(x), self.materials.robot.n_tubes, self.n))
        if self.unknowns.lead:
            columns = self.unknowns.columns[0]
            out[:, :, columns] = self.lead_share(m, x)[:, :, None] * self.modes[:, columns]
        return out

    def lead_share(self, m: int | Indices, x: Array) -> Array:
        """(g, N) share of the lead's compliance that lies before the places ``x`` (g,) of a section m of the lead, or
        of one each (g,)."""
        before, after, whole = self._leads.take(m, axis=0), self._leads.take(m + 1, axis=0), self._leads[-1]
        reached = before + x[:, None] * (after - before)
        return np.divide(reached, whole, out=np.zeros_like(reached), where=whole > 0.0)

    def carried(self, q: Array, space: TwistSpace) -> Array:
        """``coordinates`` of the field of ``q`` in another ``space``."""
        if space.unknowns is not self.unknowns:
            return self.coordinates(space.field(q))
        inverse = np.divide(1.0, space._scales, out=np.zeros_like(space._scales), where=space._scales > 0.0)
        return (self.modes.T.dot(space._columns(inverse)) * self.unknowns.alike).dot(q)

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


def _zero_torque_frames(scales: Array, given: Unknowns) -> Array:
    """(N, F) for the n twisting tubes of each block n - 1 orthonormal columns, orthogonal to 1 / scale.

    A Householder reflection of the last axis: smooth in ``scales`` (B, N), so that q can be compared between nearby
    commands.  A tube whose base is on the orifice has no compliance there; it is given a vanishing one, and its
    column does nothing.
    """
    if not given.n:
        return np.zeros((scales.shape[1], 0))
    relative = scales / np.maximum.reduce(scales, axis=1)[:, None]
    normals = given.twisting / np.maximum(relative, 1e-9)
    normals /= np.sqrt((normals * normals).sum(axis=1))[:, None]
    mirrors = normals + given.last_axes
    # Of a mirror half the square is its last component, as normals are unit vectors.
    shares = normals.take(given.frame_tube) / mirrors.take(given.frame_last)
    return given.axes - mirrors.take(given.frame_block, axis=0).T * shares
