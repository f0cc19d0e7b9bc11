"""The seed paper's numbers beside ours, all computed afresh: Fig. 2, Fig. 4, eq. (31), Table II."""

from __future__ import annotations

import json
import textwrap
from dataclasses import dataclass
from pathlib import Path

from ctr_pvs.renda2021.columns import aligned
from ctr_pvs.renda2021.figures import make_folder
from ctr_pvs.renda2021.figures import save_fig2
from ctr_pvs.renda2021.figures import save_fig4
from ctr_pvs.renda2021.loads import table2
from ctr_pvs.renda2021.numbers import Part
from ctr_pvs.renda2021.numbers import Row
from ctr_pvs.renda2021.shapes import Branch
from ctr_pvs.renda2021.shapes import Sweep
from ctr_pvs.renda2021.shapes import eq31
from ctr_pvs.renda2021.shapes import fig2
from ctr_pvs.renda2021.shapes import fig4

INTRODUCTION = (
    'F. Renda, C. Messer, D. C. Rucker, F. Boyer, "A Sliding-rod Variable-strain Model for Concentric Tube Robots", '
    "2021: what it prints (seed), what this package computes (ours), and ours less the seed's."
)
WIDTH = 110


@dataclass(frozen=True, eq=False)
class Reproduction:
    """All rows, in parts, and the shapes of Fig. 2 and Fig. 4."""

    parts: tuple[Part, ...]
    branches: dict[str, Branch]
    sweeps: dict[str, Sweep]

    @property
    def rows(self) -> list[Row]:
        return [row for part in self.parts for row in part.rows]


def reproduce() -> Reproduction:
    """Compute everything; about a second.  Raises ``NoEquilibriumError`` if a solve fails."""
    fig2_part, branches = fig2()
    fig4_part, sweeps = fig4()
    return Reproduction((fig2_part, fig4_part, eq31(), table2()), branches, sweeps)


def as_json(reproduction: Reproduction) -> str:
    """A strict JSON list of {name, seed, ours, difference}; seed and difference are null where the paper has no
    number."""
    rows = [
        {"name": row.name, "seed": row.seed, "ours": row.ours, "difference": row.difference}
        for row in reproduction.rows
    ]
    return json.dumps(rows, allow_nan=False)


def as_text(reproduction: Reproduction) -> str:
    """A table over all parts, each with its conditions and notes."""
    where = max(len(row.where) for row in reproduction.rows)
    table = aligned(
        ["what", "seed", "ours", "difference", "printed in".ljust(where)],
        *(
            [row.what, row.seed_text, _number(row.ours), _difference(row), row.where.ljust(where)]
            for row in reproduction.rows
        ),
    )
    lines = [textwrap.fill(INTRODUCTION, WIDTH)]
    rest = iter(table[1:])
    for part in reproduction.parts:
        lines += ["", part.title, table[0], *(next(rest) for _ in part.rows)]
        lines += [textwrap.fill(note, WIDTH) for note in part.notes]
    return "\n".join(lines)


def save_pictures(reproduction: Reproduction, folder: Path) -> list[Path]:
    """Draw Fig. 2 and Fig. 4 into ``folder``, made if missing.

    Raises ``PictureError`` where matplotlib is missing, ``OSError`` where the folder cannot be written.
    """
    make_folder(folder)
    paths = [folder / "fig2.png", folder / "fig4.png"]
    save_fig2(reproduction.branches, paths[0])
    save_fig4(reproduction.sweeps, paths[1])
    return paths


def _difference(row: Row) -> str:
    if row.difference is None:
        return ""
    return _number(row.difference, "+")


def _number(value: float, sign: str = "") -> str:
    """Four decimals, or two digits and an exponent for what they would show as nothing."""
    if value == 0.0:
        return "0"
    return f"{value:{sign}.1e}" if abs(value) < 1e-3 else f"{value:{sign}.4f}"
