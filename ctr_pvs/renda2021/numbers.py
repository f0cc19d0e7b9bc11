"""The numbers that the seed paper prints, and a row that sets one of ours beside one of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple


class Printed(NamedTuple):
    """A number as the paper prints it, and where."""

    text: str
    where: str


#: From F. Renda, C. Messer, D. C. Rucker, F. Boyer, "A Sliding-rod Variable-strain Model for Concentric Tube Robots",
#: IEEE Robotics and Automation Letters, 2021; [21] is that paper's own reference.
PRINTED = {
    "fig2_theta_linear_deg": Printed("85.5", "III-B"),
    "fig2_tip_linear_mm": Printed("1.17", "III-B"),
    "fig2_tip_linear_mean_mm": Printed("0.78", "III-B"),
    "fig2_theta_converged_deg": Printed("84.4", "III-B, of [21]"),
    "fig2_theta_mirrored_deg": Printed("275.6", "III-B, of [21]: -84.4"),
    "fig4_full_max_mm": Printed("0.48", "III-C, against [21]"),
    "fig4_full_mean_mm": Printed("0.44", "III-C, against [21]"),
    "fig4_partial_max_mm": Printed("0.89", "III-C, against [21]"),
    "fig4_partial_mean_mm": Printed("0.72", "III-C, against [21]"),
    "table2_a_force": Printed("0", "Table II"),
    "table2_a_torque": Printed("0", "Table II"),
    "table2_b_force": Printed("3.65", "Table II"),
    "table2_b_torque": Printed("0", "Table II"),
    "table2_c_force": Printed("6.71", "Table II"),
    "table2_c_torque": Printed("0", "Table II"),
    "table2_d_force": Printed("0.28", "Table II"),
    "table2_d_torque": Printed("0.118", "Table II"),
    "table2_e_force": Printed("-1.45", "Table II"),
    "table2_e_torque": Printed("0.122", "Table II"),
    "table2_f_force": Printed("1.89", "Table II"),
    "table2_f_torque": Printed("0.129", "Table II"),
    "table2_d_related_force": Printed("0.28", "Table II"),
}


@dataclass(frozen=True)
class Row:
    """One number: its name, what it is with its unit, the paper's and ours.  seed is None where the paper has none."""

    name: str
    what: str
    ours: float
    seed: float | None = None
    seed_text: str = ""
    where: str = ""

    @property
    def difference(self) -> float | None:
        """Ours less the paper's."""
        return None if self.seed is None else self.ours - self.seed


def row(name: str, what: str, ours: float) -> Row:
    """The row of ``name``, with the paper's number if it prints one under this name."""
    ours = float(ours) + 0.0  # no minus before a zero
    if name not in PRINTED:
        return Row(name, what, ours)
    text, where = PRINTED[name]
    return Row(name, what, ours, float(text), text, where)


@dataclass(frozen=True)
class Part:
    """The rows of one figure, equation or table, with the conditions they hold for and what to know about them."""

    title: str
    rows: tuple[Row, ...]
    notes: tuple[str, ...] = ()
