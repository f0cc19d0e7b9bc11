"""Table II of the seed paper: actuation loads of six configurations, and a relation that its row d) does not meet.

For constant pre-curvatures eq. (41) ties the force to the torque, whatever the lengths, the base positions, the base
rotations and the twist in the guide.  Beyond the orifice, in Bishop axes with c_j = exp(i psi_j) kappa*_j:

    balance of bending   (K_1 + K_2) k = K_1 c_1 + K_2 c_2
    balance of torsion   GJ_j psi_j'' = K_j Im(conj(k) c_j),      psi_j' = 0 where the outer tube ends, s = l
    torque at the base   tau_alpha2 = -GJ_2 psi_2'(0) = GJ_1 psi_1'(0)
    eq. (41), by parts   tau_D2 = K_2 [ (|k(0)|^2 - |k(l)|^2) / 2 + int_0^l Re(conj(k) c_2') ds ]

1. Constant pre-curvatures have c_j' = i psi_j' c_j, so K_j Re(conj(k) c_j') = -GJ_j psi_j' psi_j''.  For j = 2 the
   integral in eq. (41) is GJ_2 psi_2'(0)^2 / 2 = tau_alpha2^2 / (2 GJ_2).
2. Summed over j, the left side is the derivative of (K_1 + K_2) |k|^2 / 2, so that plus sum GJ_j psi_j'^2 / 2 is
   constant along s, and |k(0)|^2 - |k(l)|^2 = -tau_alpha2^2 (1/GJ_1 + 1/GJ_2) / (K_1 + K_2).

Together:  tau_D2 = tau_alpha2^2 / 2 [ 1/GJ_2 - K_2 / (K_1 + K_2) (1/GJ_1 + 1/GJ_2) ].
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from ctr_pvs.answer.equilibrium import Equilibrium
from ctr_pvs.pvs.printed_loads import printed_forces
from ctr_pvs.renda2021.numbers import PRINTED
from ctr_pvs.renda2021.numbers import Part
from ctr_pvs.renda2021.numbers import Row
from ctr_pvs.renda2021.numbers import row
from ctr_pvs.renda2021.robots import INNER
from ctr_pvs.renda2021.robots import OUTER
from ctr_pvs.renda2021.robots import curved_robot
from ctr_pvs.renda2021.shapes import solved
from ctr_pvs.solve.solver import EquilibriumSolver

Stiffness: TypeAlias = tuple[float, float]

#: Geometries at which the relation is tried.
GEOMETRIES = 30

#: Tip tolerance [m]: eq. (41) reads curvature at the ends of the overlap, where a basis is least accurate.
POINTWISE = 1e-10


@dataclass(frozen=True)
class Case:
    """A configuration: alpha_2 [deg], pre-curvatures [1/m, 1/m^2] from each tube's base; L and D [m] of both tubes."""

    alpha_2: float
    outer: tuple[float, ...]
    inner: tuple[float, ...]
    L: tuple[float, float]
    D: tuple[float, float]

    def equilibrium(self) -> Equilibrium:
        robot = curved_robot("table2", self.L, self.outer, self.inner)
        solver = EquilibriumSolver(robot, POINTWISE, "torsion")
        return solved(solver.solve([0.0, math.radians(self.alpha_2)], self.D))


# The paper prints neither L nor D.  With these, b) and c) come out as printed.
_PLANAR = {"L": (0.2, 0.4), "D": (0.05, 0.2)}
_OUT_OF_PLANE = {"L": (0.23, 0.4), "D": (0.07, 0.08)}
TABLE2 = {
    "a": Case(0.0, (10.0,), (30.0,), **_PLANAR),
    "b": Case(0.0, (30.0, -80.0), (30.0,), **_PLANAR),
    "c": Case(0.0, (30.0,), (50.0, 80.0), **_PLANAR),
    "d": Case(90.0, (20.0,), (10.0,), **_OUT_OF_PLANE),
    "e": Case(90.0, (20.0, 40.0), (10.0,), **_OUT_OF_PLANE),
    "f": Case(90.0, (20.0,), (10.0, 40.0), **_OUT_OF_PLANE),
}


def table2() -> Part:
    """The rows of Table II, the relation for row d) and how well it holds."""
    rows: list[Row] = []
    for letter, case in TABLE2.items():
        equilibrium = case.equilibrium()
        force = printed_forces(equilibrium.shape)[1]
        rows.append(row(f"table2_{letter}_force", f"{letter}) tau_D2, eq. (41) as it stands [N]", force))
        rows.append(row(f"table2_{letter}_torque", f"{letter}) tau_alpha2 [N m]", equilibrium.torque[1]))
        rows.append(row(f"table2_{letter}_virtual_work", f"{letter}) dE/dD_2, virtual work [N]", equilibrium.force[1]))
    torque = float(PRINTED["table2_d_torque"].text)
    what = f"d) tau_D2 that goes with a torque of {torque:g} N m [N]"
    rows.append(row("table2_d_related_force", what, related_force(torque)))
    what = f"d) largest deviation from the relation, {GEOMETRIES} geometries [N]"
    rows.append(row("table2_d_relation_error", what, relation_error()))
    return Part(
        "Table II: cross sections of Table I, wholly curved tubes (section IV-B)",
        tuple(rows),
        (_geometry_note(), _axis_note(), _relation_note()),
    )


def related_force(torque: float, outer: Stiffness = OUTER.stiffness, inner: Stiffness = INNER.stiffness) -> float:
    """tau_D2 [N] that eq. (41) gives with ``torque`` tau_alpha2 [N m], for constant pre-curvatures; outer, inner:
    (K, GJ) [N m^2]."""
    (K1, GJ1), (K2, GJ2) = outer, inner
    return 0.5 * torque**2 * (1.0 / GJ2 - K2 / (K1 + K2) * (1.0 / GJ1 + 1.0 / GJ2))


def related_torque(force: float) -> float:
    """The inverse of ``related_force``, not negative."""
    return math.sqrt(force / related_force(1.0))


def relation_error() -> float:
    """Largest |tau_D2 - related_force(tau_alpha2)| [N] of row d) over random lengths and base positions."""
    rng = np.random.default_rng(41)
    worst = 0.0
    for _ in range(GEOMETRIES):
        L1 = rng.uniform(0.1, 0.3)
        D1 = rng.uniform(0.0, 0.9) * L1
        D2 = D1 + rng.uniform(0.0, 0.2)
        L2 = D2 + (L1 - D1) + rng.uniform(0.01, 0.2)  # eq. (41) has the inner tube reach farther
        equilibrium = replace(TABLE2["d"], L=(L1, L2), D=(D1, D2)).equilibrium()
        deviation = printed_forces(equilibrium.shape)[1] - related_force(equilibrium.torque[1])
        worst = max(worst, abs(float(deviation)))
    return worst


def _geometry_note() -> str:
    planar, out_of_plane = TABLE2["a"], TABLE2["d"]
    return (
        "The paper prints neither L nor D. Used here: L_2 = 400 mm; "
        f"a) to c) {_lengths(planar)}; d) to f) {_lengths(out_of_plane)}. "
        "X of a linear coefficient counts from its tube's base."
    )


def _lengths(case: Case) -> str:
    D1, L1, D2 = (f"{1e3 * length:g}" for length in (case.D[0], case.L[0], case.D[1]))
    return f"D_1 = {D1}, L_1 = {L1}, D_2 = {D2} mm"


def _axis_note() -> str:
    return (
        "Eq. (41) counts its force along +x; on the +D axis it is the negative, and it leaves out the concentrated "
        "axial forces at the orifice and at the outer tube's tip, which dE/dD_2 holds."
    )


def _relation_note() -> str:
    torque, force = (float(PRINTED[f"table2_d_{kind}"].text) for kind in ("torque", "force"))
    low, high = related_force(torque - 5e-4), related_force(torque + 5e-4)
    return (
        "Row d) as printed has no geometry: for constant pre-curvatures eq. (41) gives tau_D2 = tau_alpha2^2 / 2 "
        "[1/GJ_2 - K_2/(K_1 + K_2) (1/GJ_1 + 1/GJ_2)] whatever L, D and the twist in the guide. "
        f"A torque that rounds to {torque:g} N m goes with {low:.3f} to {high:.3f} N, "
        f"and {force:g} N with {related_torque(force):.3f} N m."
    )
