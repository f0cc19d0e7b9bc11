"""How far twist moves the backbone: bounds that are linear in a change of the unknowns, for one D.

Twist turns the curvature by |K_j kappa_j| / sum K per angle, which swings what lies beyond: no point farther off than
the arc length to the tip.  Where all places see the same change of an angle, as they do past the last coupled section
and, in proportion, before the first one, their swings add up to one.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.basis import gauss_legendre
from ctr_pvs.composition import sealed
from ctr_pvs.energy import PLAIN_NODES
from ctr_pvs.energy import TorsionEnergy
from ctr_pvs.unknowns import KEPT
from ctr_pvs.unknowns import Places
from ctr_pvs.unknowns import Unknowns

Array = NDArray[np.float64]


def tip_weights(energy: TorsionEnergy) -> Array:
    """(W, n) motions of the tip [m], taken without sign, per change of q: their sum bounds the motion of every point of
    the backbone."""
    space = energy.space
    swung = _swung(space.unknowns)
    swings = _swings(energy, swung).take(swung.kept)
    return swings[:, None] * swung.integrals * space.modes.take(swung.tube, axis=0)


def _swings(energy: TorsionEnergy, swung: _Swung) -> Array:
    """(rows, N) motion of the tip [m] for a twist [rad] of each tube: at every coupled and every other place between
    coupled sections, and all before them and all past them together."""
    domain, plain = energy.materials.domain, swung.plain
    length, lengths = domain.length, domain.lengths.take(plain.section)
    coupled = (energy.coupling * (length - energy.s))[:, None] * np.abs(energy.moment)
    if not len(plain.x):
        return coupled
    s = domain.boundaries.take(plain.section) + lengths * plain.x
    others = swung.moment
    if others is None:
        others = np.abs(energy.materials.pre_curvature(plain.section, s)) * plain.bending
    others = others * (lengths * plain.share * (length - s))[:, None]
    before, past = swung.before, swung.past
    if before:
        others[:before] *= energy.space.lead_share(plain.section[:before], plain.x[:before])
    first, last = others[:before].sum(axis=0), others[past:].sum(axis=0)
    return np.concatenate((coupled, others[before:past], first[None], last[None]))


class _Swung:
    """Where twist swings the tip, whatever the lengths of sections.

    plain : places of pre-curved sections without coupling; ``before`` of them lie before the first coupled one, those
    from ``past`` on beyond the last.  moment (places, N) : size of K kappa* there [N m] if lengths do not change it.
    kept, tube (W,) : the entries of ``_swings`` that can differ from zero, and their tubes; integrals (W, n) of the
    unknowns' functions there.
    """

    def __init__(self, given: Unknowns) -> None:
        made, rule = given.composition, gauss_legendre(PLAIN_NODES)
        sections = np.flatnonzero(made.curved.any(axis=1) & ~made.coupled).tolist() if given.n else []
        self.plain = Places(given, [(m, rule) for m in sections])
        section = self.plain.section
        self.moment = None if made.size is None else self.plain.bending * made.size[section]
        self.before, self.past = (int(index) for index in np.searchsorted(section, (made.first, made.last)))
        between = slice(self.before, self.past)
        curved, integrals = made.curved[section], self.plain.integrals
        rows = [made.curved[given.nodes.section]]
        tables = [given.nodes.integrals]
        if sections:
            rows.append(curved[between])
            tables.append(integrals[between])
            for part, end in ((slice(0, self.before), 0), (slice(self.past, None), -1)):
                rows.append(np.logical_or.reduce(curved[part], keepdims=True))
                tables.append(integrals[end][None])
        present = np.concatenate(rows)
        self.kept = np.flatnonzero(present)
        row, self.tube = np.nonzero(present)
        self.integrals = np.concatenate(tables)[row]
        sealed(self)


@lru_cache(maxsize=KEPT)
def _swung(given: Unknowns) -> _Swung:
    return _Swung(given)
