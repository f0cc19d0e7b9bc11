"""The figures of docs/loads.md: shapes under a turning force, compliance along a sweep, snaps over load and rotation.

    scripts/in_env.sh python3 -m bench.loads.figures

Writes docs/figures/loads_*.png and the tables of folds and of sensing in docs/loads.md.
"""

from __future__ import annotations

import argparse

import numpy as np

from bench.common.document import publish
from bench.common.document import table
from bench.common.places import FIGURES
from bench.common.places import LOADS
from bench.loads.compliance_sweep import draw_compliance
from bench.loads.sensing import sensing_table
from bench.loads.snap_map import KNOWN
from bench.loads.snap_map import draw_snaps
from bench.loads.snap_map import load_fold
from bench.loads.snap_map import rotation_fold
from bench.loads.turning_force import draw_turning


def folds_table() -> str:
    """Folds by rotation and by load, beside two independent methods'."""
    rows = []
    for known in KNOWN:
        if known.turned:
            found = rotation_fold(known.D, known.force)
            what, unit = f"α₂ turned under {_force(known.force)}", "deg"
        else:
            found = load_fold(np.radians(known.alpha), known.D, known.force)
            what, unit = f"{_force(known.force)} at α₂ = {known.alpha:g}°, times", ""
        name = f"{what}, D₂ {1e3 * known.D[1]:g} mm"
        rows.append([name, f"{found:.6f} {unit}", f"{known.value} {unit}", f"{abs(found - known.value):.0e}"])
    return table(["the branch ends at", "this solver", "known", "apart"], rows)


def _force(force: tuple[float, float, float]) -> str:
    return "(" + ", ".join(f"{x:g}" for x in force) + ") N"


def main() -> None:
    argparse.ArgumentParser(description=__doc__.partition("\n")[0]).parse_args()
    FIGURES.mkdir(exist_ok=True)
    publish("loaded folds", folds_table(), LOADS)
    publish("loaded sensing", sensing_table(), LOADS)
    draw_turning(FIGURES / "loads_turning_force.png")
    draw_compliance(FIGURES / "loads_compliance.png")
    draw_snaps(FIGURES / "loads_snaps.png")


if __name__ == "__main__":
    main()
