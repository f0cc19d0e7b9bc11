"""The unknown twist fields of one topology and one choice of polynomials: all that does not depend on lengths.

An unknown stands for a torque of ``twist``: that of one column of a block's frame along one function of its basis.  The
angle it turns tubes by is the column times the function's integral, and only the column depends on base positions.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.basis import GaussRule
from ctr_pvs.basis import TwistBasis
from ctr_pvs.composition import Composition
from ctr_pvs.composition import sealed
from ctr_pvs.lazy import lazy

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

#: Topologies and degrees whose tables are kept.
KEPT = 32
CONSTANT = TwistBasis(0)
END = np.ones(1)


class Unknowns:
    """n unknowns in B blocks with F columns of frames together.

    composition : what the sections are made of.  section_bases : functions of the torques in each of them.
    sections, bases : of each block; -1 for the ``lead``, if there is one.  columns : where its unknowns are, in frame
    columns and in functions; frame_slices : where its frame columns are.
    torsional (last + 1 - first, N) : GJ [N m^2] from the first coupled section on, without end where no tube twists.
    twisting (B, N) : tubes that twist in the block.  last_axes (B, N) : 1 for the last one of them.
    frame_block (F,) : block of each frame column.  frame_tube, frame_last (F,) : where a table (B, N) has the tube that
    the column stands for, and the last one of the block.  axes (N, F) : unit vectors of the former.
    frame, function (n,) : frame column of each unknown, and its function, counted over all blocks.
    """

    def __init__(self, made: Composition, bases: tuple[TwistBasis, ...], lead: bool) -> None:
        self.composition, self.section_bases, self.lead = made, bases, lead
        inner = range(made.first, made.last + 1)
        self.sections = [*([-1] if lead else []), *inner]
        self.bases = [CONSTANT if m < 0 else bases[m] for m in self.sections]
        tubes = [np.flatnonzero(made.twisting[max(m, made.first)]).tolist() for m in self.sections]
        self.twisting = made.twisting[[max(m, made.first) for m in self.sections]]
        self.torsional = np.where(made.twisting, made.torsional[: made.last + 1], np.inf)[made.first :]
        blocks: list[int] = []
        frame_tubes: list[int] = []
        frames: list[int] = []
        functions: list[int] = []
        known = 0
        self.frame_slices: list[slice] = []
        self.columns: list[slice] = []
        for block, (twisting, basis) in enumerate(zip(tubes, self.bases, strict=True)):
            first, start = len(blocks), len(frames)
            for tube in twisting[:-1]:
                frames += [len(blocks)] * basis.size
                functions += range(known, known + basis.size)
                blocks.append(block)
                frame_tubes.append(tube)
            known += basis.size
            self.frame_slices.append(slice(first, len(blocks)))
            self.columns.append(slice(start, len(frames)))
        self.frame_block, stands_for, self.frame, self.function = (
            np.array(index, dtype=np.int64) for index in (blocks, frame_tubes, frames, functions)
        )
        count = self.twisting.shape[1]
        last = np.array([twisting[-1] for twisting in tubes], dtype=np.int64)
        self.last_axes, self.axes = np.eye(count)[last], np.eye(count)[:, stands_for]
        self.frame_tube = self.frame_block * count + stands_for
        self.frame_last = self.frame_block * count + last[self.frame_block]
        self.n = len(frames)
        sealed(self)

    @lazy
    def alike(self) -> Array:
        """(n, n) 1 for unknowns of one function, else 0."""
        return (self.function[:, None] == self.function).astype(float)

    def integrals(self, m: int, x: Array) -> Array:
        """(g, n) integral of each unknown's function up to the places ``x`` (g,) of section m, 1 for those of
        the lead."""
        out = np.zeros((len(x), self.n))
        for section, basis, columns in zip(self.sections, self.bases, self.columns, strict=True):
            if section > m:
                break
            # Past its own section a block's twist is complete.
            table = basis.tabulate(x if section == m else END)[1]
            out[:, columns] = np.tile(table, (columns.stop - columns.start) // basis.size)
        return out

    @lazy
    def nodes(self) -> Places:
        """Gauss points of the coupled sections."""
        coupled = self.composition.coupled_sections.tolist()
        return Places(self, [(m, self.section_bases[m].rule) for m in coupled])


class Places:
    """The points of Gauss rules in some sections: G places, whatever the lengths of the sections.

    section (G,); x (G,) in [0, 1]; share (G,) quadrature weights over length and total bending stiffness [1/(N m^2)];
    bending (G, N) [N m^2]; integrals (G, n) of the unknowns' functions.
    """

    def __init__(self, unknowns: Unknowns, rules: list[tuple[int, GaussRule]]) -> None:
        made, none = unknowns.composition, np.zeros(0)
        self.section = np.array([m for m, rule in rules for _ in rule.x], dtype=np.int64)
        self.x = np.concatenate([none, *(rule.x for _, rule in rules)])
        self.share = np.concatenate([none, *(rule.weights for _, rule in rules)]) / made.total[self.section]
        self.bending = made.bending[self.section]
        tables = [unknowns.integrals(m, rule.x) for m, rule in rules]
        self.integrals = np.concatenate([np.zeros((0, unknowns.n)), *tables])
        sealed(self)

    @lazy
    def squares(self) -> Array:
        """(G, n) squares of the integrals."""
        return self.integrals**2


@lru_cache(maxsize=KEPT)
def unknowns(made: Composition, bases: tuple[TwistBasis, ...], lead: bool) -> Unknowns:
    """Those of the sections' ``bases``, with a block for the ``lead`` or without; the last few are kept."""
    return Unknowns(made, bases, lead)
