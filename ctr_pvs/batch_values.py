"""What the tables of ``batch_tables`` need to know of base positions, and what follows from it."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.batch_layout import Geometry
from ctr_pvs.batch_linear import factorise
from ctr_pvs.batch_linear import packed_entries
from ctr_pvs.batch_linear import product
from ctr_pvs.batch_tables import Tables
from ctr_pvs.fidelity import CAUTION
from ctr_pvs.serve import LEAST_SLACK
from ctr_pvs.serve import MOST_SLACK
from ctr_pvs.serve import SLACK

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


class Values:
    """What ``Tables`` need to know of base positions (K of them).

    amplitude (R, K) [J] and phase (R, K) of the pairs; entries (Q, K) of the torsional energy's form; stiffness
    (n, K) its diagonal, compliance (n, K) the inverse of that where it is diagonal; lead (N, K) compliances of the
    tubes that twist in the lead; twist_norm, slack, calm (K,); swing (W, K) motion of the tip [m] per angle.
    """

    _BY_BASE = (
        *("amplitude", "phase", "entries", "stiffness", "compliance", "lead", "lead_stiffness", "lead_total"),
        *("twist_norm", "slack", "calm", "coupled", "share", "swing"),
    )

    def __init__(self, tables: Tables, geometry: Geometry, tolerance: float) -> None:
        self.tables, self._whole = tables, geometry
        self._rows: Indices | None = None
        self.divisions: dict[float, Indices] = {}
        with np.errstate(divide="ignore", invalid="ignore"):
            self._lead()
        self._pairs()
        h, section = geometry.lengths, tables.section[tables.lead :]
        self.compliance = np.concatenate([self._lead_compliance, h[section]])
        self.stiffness = np.concatenate([self._lead_stiffness, 1.0 / h[section]])
        self.entries = np.concatenate([1.0 / h, self._lead_entries])
        length = np.maximum(geometry.length, tolerance)
        self.slack = np.clip(SLACK * tolerance / length, LEAST_SLACK, MOST_SLACK)
        self._norms()
        self.swing = self._swing()
        self.calm = self._calm()

    @cached_property
    def geometry(self) -> Geometry:
        whole = self._whole
        return whole if self._rows is None else Geometry(whole.layout, whole.D[:, self._rows])

    def take(self, rows: Indices) -> Values:
        """The same for some of the base positions."""
        if self._whole.D.shape[1] == 1:
            return self
        out: Values = object.__new__(Values)
        out.tables, out._whole, out._rows = self.tables, self._whole, rows if self._rows is None else self._rows[rows]
        out.divisions = {}
        for name in self._BY_BASE:
            value = getattr(self, name)
            setattr(out, name, value if value.shape[-1] == 1 else np.take(value, rows, axis=-1))
        return out

    def _lead(self) -> None:
        """lead (N, K) compliances of the tubes that twist there; lead_stiffness (r, K), lead_total (K,) : g and G."""
        tables = self.tables
        tubes, r = tables.leading, tables.lead
        self.lead = np.zeros((tables.tubes, self.geometry.D.shape[1]))
        if r:
            self.lead[tubes] = self.geometry.lead[tubes]
        g = 1.0 / self.lead[tubes]
        self.lead_total = g.sum(axis=0)
        self.lead_stiffness = g[1:] if r else np.zeros((0, self.lead.shape[1]))
        if r == 1:
            self._lead_compliance = self.lead[tubes].sum(axis=0)[None]
            self._lead_stiffness = self._lead_entries = 1.0 / self._lead_compliance
            return
        i, j = packed_entries(r)
        mixed = self.lead_stiffness[i] * self.lead_stiffness[j] / self.lead_total
        self._lead_entries = np.where((i == j)[:, None], self.lead_stiffness[i], 0.0) - mixed
        self._lead_stiffness = self._lead_entries[np.flatnonzero(i == j)]
        self._lead_compliance = self.lead[tubes[1:]]

    def _pairs(self) -> None:
        """amplitude, phase."""
        tables, geometry = self.tables, self.geometry
        h = geometry.lengths[tables.node_section]
        if tables.layout.constant:
            pairs = tables.serving.pairs
            own = tables.layout.materials.domain.lengths[tables.node_section]
            self.amplitude = (pairs.amplitude / own)[:, None] * h
            self.phase = pairs.phase[:, None]
            return
        product = np.empty(h.shape, dtype=complex)
        for row, (m, x) in enumerate(zip(tables.node_section.tolist(), tables.place, strict=True)):
            bending = tables.layout.materials.bending[m]
            i, j, place = int(tables.first[row]), int(tables.second[row]), np.array([x])
            one, two = geometry.pre_curvature(m, i, place)[0], geometry.pre_curvature(m, j, place)[0]
            product[row] = bending[i] * bending[j] * one.conj() * two
        self.amplitude = tables.weight[:, None] * h * np.abs(product)
        self.phase = np.angle(product)

    def _norms(self) -> None:
        """twist_norm, and coupled (K,) : the trace of the coupling against torsion, a bound of its largest value; share
        (R, K) : what each pair adds to it."""
        tables, h = self.tables, self.geometry.lengths
        lead = np.zeros(self.lead.shape)
        if tables.lead:
            lead[tables.leading] = self.lead[tables.leading] - 1.0 / self.lead_total
        sizes = (tables.squares @ h).reshape(-1, tables.tubes, h.shape[1]) + lead
        self.twist_norm = np.sqrt(sizes.max(axis=(0, 1), initial=0.0))
        both = self.lead[tables.first] + self.lead[tables.second]
        self.share = self.amplitude * (both + tables.same @ h)
        self.coupled = self.share.sum(axis=0)

    def _calm(self) -> NDArray[np.bool_]:
        """(K,) true where the energy is certainly convex at whatever angles: then there is one branch only."""
        tables, calm = self.tables, self.coupled < 1.0
        if len(calm) == 1 and not calm[0]:
            weakest = np.concatenate([-self.amplitude, self.entries])
            calm = factorise(tables.finer_hessian @ weakest, tables.finer)[1]
        return calm

    def _swing(self) -> Array:
        """(W, K) weights of the angles."""
        tables, geometry = self.tables, self.geometry
        parts = [np.zeros((0, geometry.D.shape[1]))]
        for m, j, x, weights in tables.swing_list:
            bending = tables.layout.materials.bending[m]
            arm = weights[:, None] * geometry.lengths[m] * (geometry.length - geometry.places(m, x))
            arm = arm * np.abs(geometry.pre_curvature(m, j, x)) * (bending[j] / bending.sum())
            if m < tables.layout.first:
                arm = arm * (
                    geometry.lead_before(m)[j] + x[:, None] * geometry.lengths[m] * tables.layout.softness[m, j]
                )
            inside = tables.layout.first <= m <= tables.layout.last
            parts.append(arm if inside else arm.sum(axis=0, keepdims=True))
        return np.concatenate(parts)

    def first_twist(self) -> list[tuple[int, int, Array]]:
        """Per pair of tubes: the complex strength (K,) [m] of ``ServingModel.may_be_untwisted``."""
        tables = self.tables
        products = self._products(self.geometry.lengths, self.lead)
        pull = (np.abs(products) * self.swing[:, None]).sum(axis=0) * self.amplitude
        waves = pull * np.exp(1j * self.phase) / (1.0 + self.coupled)
        out = []
        for turn in np.unique(tables.turns, axis=0):
            total = waves[np.all(tables.turns == turn, axis=1)].sum(axis=0)
            out.append((int(turn.argmin()), int(turn.argmax()), total))
        return out

    def _products(self, lengths: Array, lead: Array) -> Array:
        """(W, R, K) how much each angle that swings the tip turns where torsion alone holds the pull of a pair."""
        tables = self.tables
        out = np.tensordot(tables.products, lengths, 1)
        for j in range(tables.tubes):
            turn, torque = tables.swings[:, tables.finer + j], tables.swings[:, tables.finer + tables.tubes + j]
            turned = turn[:, None] * lead[j] + torque[:, None]
            out += tables.turns[:, j, None] * turned[:, None]
        return np.asarray(out)

    def tip_shares(self) -> Array:
        """(finer, K) ``serving.ServingModel.tip_shares``."""
        tables, out = self.tables, np.ones((self.tables.finer, self.geometry.D.shape[1]))
        for m in tables.layout.coupled:
            columns = tables.n + np.flatnonzero(tables.section[tables.n :] == m)
            degree = np.array([tables.label[column][-1] for column in columns.tolist()])
            out[columns] = np.minimum(1.0, CAUTION * self.geometry.ellipse(m) ** -(degree[:, None] - 1.0))
        return out

    def least_first_twist(self) -> tuple[int, int, Array] | None:
        """As ``first_twist`` has it, but no more than a lower bound of the strength; None unless one pair of tubes
        pulls at one angle."""
        tables = self.tables
        if not tables.n or not tables.layout.constant or np.any(tables.turns != tables.turns[:1]) or np.ptp(self.phase):
            return None
        n, h = tables.n, self.geometry.lengths
        kept = np.concatenate([np.arange(n), np.arange(tables.finer, tables.finer + 2 * tables.tubes)])
        forward = np.sign(self._products(h[:, :1], self.lead[:, :1])[:, 0])  # (W, 1)
        summed = product((tables.swings[:, kept] * forward).T, self.swing)
        turns = tables.turns[0]
        lead = turns @ (summed[n : n + tables.tubes] * self.lead + summed[n + tables.tubes :])
        inside = tables.difference[:, tables.lead : n] @ (summed[tables.lead : n] * h[tables.section[tables.lead : n]])
        pull = (np.abs(lead + inside) * self.amplitude).sum(axis=0) / (1.0 + self.coupled)
        return int(turns.argmin()), int(turns.argmax()), pull * np.exp(1j * self.phase[0])

    def stiff(self, u: Array) -> Array:
        """Q u (n, rows)."""
        out = u * self.stiffness[: len(u)]
        r = self.tables.lead
        if r > 1:
            g = self.lead_stiffness
            out[:r] = g * (u[:r] - (g * u[:r]).sum(axis=0) / self.lead_total)
        return out

    def soft_square(self, gradient: Array) -> Array:
        """(rows,) squared size of the q that the gradient (n, rows) would be without coupling."""
        out = (gradient * gradient * self.compliance[: len(gradient)]).sum(axis=0)
        r = self.tables.lead
        if r > 1:
            out += self.lead[self.tables.leading[0]] * gradient[:r].sum(axis=0) ** 2
        return np.asarray(out)

    def tip_motion(self, change: Array) -> Array:
        """(rows,) bound of the motion [m] of any point of the backbone by a change of the finer unknowns."""
        moved = self.tables.scratch.array("swings", len(self.tables.swings), change.shape[1])
        product(self.tables.swings, self.features(change), moved)
        np.abs(moved, out=moved)
        return np.asarray(self.swing[:, 0] @ moved if self.swing.shape[1] == 1 else (self.swing * moved).sum(axis=0))

    def features(self, u: Array) -> Array:
        """(n + 2 N, rows) u, turn of each tube over the lead [rad], its torque [N m]."""
        tables = self.tables
        out = np.zeros((len(u) + 2 * tables.tubes, u.shape[1]))
        out[: len(u)] = u
        if tables.lead:
            r, torque = tables.lead, out[len(u) + tables.tubes :]
            torque[tables.leading[1:]] = self.stiff(u[:r])
            torque[tables.leading[0]] = -torque[tables.leading[1:]].sum(axis=0)
            np.multiply(torque, self.lead, out=out[len(u) : len(u) + tables.tubes])
        return out
