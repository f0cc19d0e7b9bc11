"""What a tip force costs: warm steps of 1 deg under 0.5 N, at every tolerance, with everything that an answer tells.

    scripts/in_env.sh python3 -m bench.loads.loaded_cost

Writes docs/loaded_cost.csv, .png and .svg, and the tables of docs/loads.md.  What is compared is measured in turn, one
step of each after the other; times are medians, in microseconds and in u (see ``common.clock``).  Errors are distances
to the tips of another solver at a tolerance of 1e-10 m.
"""

from __future__ import annotations

import argparse
import csv
import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from bench.common.batches import commands
from bench.common.clock import Stopwatch
from bench.common.document import publish
from bench.common.document import table
from bench.common.places import DOCS
from bench.common.places import LOADS
from bench.common.strokes import POSES
from bench.loads.oracle_steps import BVP
from bench.loads.oracle_steps import SETTINGS
from bench.loads.oracle_steps import SHOOTING
from bench.loads.oracle_steps import oracle_steps
from bench.loads.rivals import MACHINE
from bench.loads.rivals import RIVALS
from bench.loads.strokes import Ask
from bench.loads.strokes import Served
from bench.loads.strokes import Stroke
from bench.loads.strokes import everything
from bench.loads.strokes import serve_in_turn
from bench.loads.strokes import strokes
from bench.loads.strokes import tip_and_estimate
from bench.serving.many import share
from bench.serving.serving_cost import machine
from bench.serving.steps import told
from ctr_pvs import EquilibriumSolver

#: Tolerances [m], and the most u that a step with tip and estimate should take at two of them.
TOLERANCES = tuple(float(f"1e-{digits}") for digits in range(4, 10))
TARGETS = {1e-6: 120.0, 1e-8: 170.0}
#: Tolerance [m] of what is measured at one; the most u of a full answer; three tubes against two.
TOLERANCE, FULL_TARGET, TUBES_TARGET = 1e-6, 350.0, 2.5
STEPS, ORACLE_STEPS, BATCH = 600, 6, 1000
PARTIAL, FULL = "Fig. 4, partial overlap", "Fig. 4, full overlap"
OURS, HERE = "this solver", "this run"
#: Settings that the table of rivals shows; the chart and the CSV file have all.
SHOWN = {OURS: ("1e-04", "1e-06", "1e-08"), SHOOTING: ("1e-07",), BVP: ("1e-06",)}
OUTPUTS: dict[str, Ask] = {
    "60 poses": lambda answer: answer.backbone(POSES),
    "torques and forces": lambda answer: (answer.torque, answer.force),
    "Jacobian": lambda answer: answer.jacobian,
    "Jacobian and compliance": lambda answer: (answer.jacobian, answer.compliance),
    "margin": lambda answer: answer.stability_margin,
}


@dataclass(frozen=True)
class Row:
    """One method with one setting on one scene: a step with its tip.  Times are medians; error and estimate [m] the
    largest.  where : this run, or another machine."""

    scene: str
    method: str
    setting: str
    time_us: float
    time_u: float
    error_m: float
    estimate_m: float
    unknowns: int
    where: str = HERE


def tolerance_rows(stroke: Stroke, many: int) -> list[Row]:
    """Every tolerance, one step of each in turn."""
    every = [Served(stroke, tolerance) for tolerance in TOLERANCES]
    serve_in_turn(every, many, judged=True)
    rows = []
    for served in every:
        median, unknowns = served.watch.median, served.unknowns
        errors = max(served.errors), max(served.estimates)
        setting = f"{served.tolerance:.0e}"
        rows.append(Row(stroke.name, OURS, setting, median.microseconds, median.units, *errors, unknowns))
    return rows


def oracle_rows(stroke: Stroke, many: int) -> Iterator[Row]:
    """The boundary-value model by scipy."""
    for method, settings in SETTINGS.items():
        for setting in settings:
            median, error = oracle_steps(stroke, method, setting, many)
            yield Row(stroke.name, method, f"{setting:.0e}", median.microseconds, median.units, error, np.nan, 0)


def rival_rows() -> list[Row]:
    """What others take, as it was measured elsewhere."""
    return [Row(r.scene, r.name, r.remark, r.time_us, r.time_u, r.error_m, np.nan, 0, MACHINE) for r in RIVALS]


def tolerance_table(rows: list[Row]) -> str:
    scenes = list(dict.fromkeys(row.scene for row in rows))
    lines = []
    for tolerance in TOLERANCES:
        target = TARGETS.get(tolerance)
        line = [f"{tolerance:.0e} m", "" if target is None else f"{target:.0f} u"]
        for scene in scenes:
            (row,) = (row for row in rows if row.scene == scene and row.setting == f"{tolerance:.0e}")
            line.append(f"{row.time_us:.3g} µs, {row.time_u:.0f} u; {row.unknowns} unknowns")
            line.append(f"{row.error_m:.1e} m ({row.estimate_m:.1e} m)")
        lines.append(line)
    head = ["tolerance", "target"]
    for scene in scenes:
        head += [scene, "largest error (estimate)"]
    return table(head, lines)


def steps_table(chosen: list[Stroke], many: int) -> str:
    """Without load, with it, and sliding, one after the other: the least that is asked, then everything."""
    asked = {"solve, tip, estimate": (tip_and_estimate, TARGETS[TOLERANCE]), "full answer": (everything, FULL_TARGET)}
    kinds = {"no load": (False, False), "0.5 N": (True, False), "0.5 N, D slides 10 µm a step": (True, True)}
    lines = []
    for name, (ask, target) in asked.items():
        own = [[f"{name}; {kind}", f"{target:.0f} u" if loaded else ""] for kind, (loaded, _) in kinds.items()]
        for stroke in chosen:
            every = [
                Served(replace(stroke, loads=stroke.loads if loaded else None, sliding=sliding), TOLERANCE, ask)
                for loaded, sliding in kinds.values()
            ]
            serve_in_turn(every, many)
            for line, served in zip(own, every, strict=True):
                ratio = served.watch.median.units / every[0].watch.median.units
                line += [told(served.watch.median), f"{ratio:.2f}"]
        lines += own
    head = [f"median of {many} steps of 1°, to {TOLERANCE:.0e} m", "target"]
    for stroke in chosen:
        head += [stroke.name, "to no load"]
    return table(head, lines)


def parts_table(chosen: list[Stroke], many: int) -> str:
    """What each output adds to a step."""
    lines = [[name] for name in OUTPUTS]
    for stroke in chosen:
        every = [Served(stroke, TOLERANCE), *(Served(stroke, TOLERANCE, ask) for ask in OUTPUTS.values())]
        serve_in_turn(every, many)
        least = every[0].watch.median.units
        for line, served in zip(lines, every[1:], strict=True):
            line.append(f"{served.watch.median.units - least:.0f} u")
    return table(["0.5 N; beside solve, tip and estimate", *(stroke.name for stroke in chosen)], lines)


def derivatives(stroke: Stroke, many: int) -> str:
    """A step with Jacobian and compliance."""
    served = Served(stroke, TOLERANCE, OUTPUTS["Jacobian and compliance"])
    serve_in_turn([served], many)
    return f"{served.watch.median.units:.0f} u"


def tubes_table(every: dict[str, Stroke], many: int) -> str:
    """Three tubes against two: of one family, and the example robot against the seed's."""
    lines = []
    for two, three in (("two nested tubes", "three nested tubes"), (PARTIAL, "three_tubes.yaml")):
        pair = [Served(every[name], TOLERANCE) for name in (two, three)]
        serve_in_turn(pair, many)
        few, more = (served.watch.median for served in pair)
        cells = [f"{name}: {told(median)}" for name, median in ((two, few), (three, more))]
        lines.append([*cells, f"{more.units / few.units:.2f}", f"{TUBES_TARGET:g}"])
    return table([f"two tubes, 0.5 N, to {TOLERANCE:.0e} m", "three", "ratio", "target"], lines)


def batch_table(size: int, stroke: Stroke) -> str:
    """Cold commands at one D, each under a tip force of its own."""
    alpha, D = commands(size, stroke.direction, np.radians(150.0), stroke.D, 0.0)
    force = np.random.default_rng(8).uniform(-0.3, 0.3, (size, 3))
    solver, lines = EquilibriumSolver(stroke.robot, TOLERANCE), []
    for name, tips in (("no load", None), ("a tip force of its own", force)):
        watch = Stopwatch()
        found = watch.time(partial(solver.solve_batch, alpha, D, tip_force=tips))
        failed = sum(not status.success for status in found.status)  # type: ignore[attr-defined]
        lines.append([name, told(share(watch.median, size)), str(failed)])
    return table([f"{size:,} cold commands with tips, to {TOLERANCE:.0e} m", "each", "failed"], lines)


def rivals_table(rows: list[Row], own: dict[str, str]) -> str:
    """Others beside this solver: a step with its tip, and with Jacobian and compliance (``own``, by scene)."""
    known = {(rival.name, rival.scene, rival.remark): rival.derivatives for rival in RIVALS}
    known |= {(OURS, scene, f"{TOLERANCE:.0e}"): text for scene, text in own.items()}
    lines: list[list[str]] = []
    for row in rows:
        told_of = SHOWN.get(row.method)
        if told_of is not None and row.setting not in told_of:
            continue
        name = row.method + (f", {row.setting}" if row.setting else "")
        cells = [f"{row.time_us:.4g} µs, {row.time_u:.0f} u", f"{1e3 * row.error_m:.1e} mm"]
        cells.append(known.get((row.method, row.scene, row.setting), ""))
        lines.append([name, row.scene, *cells, HERE if row.where == HERE else "another machine"])
    head = [
        "0.5 N across the tip, steps of 1°",
        "scene",
        "with tip",
        "largest error",
        "with derivatives",
        "measured in",
    ]
    return table(head, sorted(lines, key=lambda line: line[1], reverse=True))


def write(rows: list[Row], path: Path) -> None:
    with path.open("w", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow([field.name for field in dataclasses.fields(Row)])
        for row in rows:
            values = dataclasses.astuple(row)
            writer.writerow([("" if np.isnan(v) else f"{v:.4g}") if isinstance(v, float) else v for v in values])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--quick", action="store_true", help="a few steps, printed only")
    options = parser.parse_args()
    document = None if options.quick else LOADS
    many, oracle, size = (4, 1, 4) if options.quick else (STEPS, ORACLE_STEPS, BATCH)
    every = strokes()
    chosen = [every[PARTIAL], every[FULL]]
    publish("loaded machine", machine(), document)
    ours = [row for stroke in chosen for row in tolerance_rows(stroke, many)]
    publish("loaded tolerance", tolerance_table(ours), document)
    publish("loaded steps", steps_table(chosen, many), document)
    publish("loaded parts", parts_table(chosen, many), document)
    publish("loaded tubes", tubes_table(every, many), document)
    publish("loaded batch", batch_table(size, every[PARTIAL]), document)
    scipy = [row for stroke in chosen for row in oracle_rows(stroke, oracle)]
    rows = [*ours, *scipy, *rival_rows()]
    own = {stroke.name: derivatives(stroke, many) for stroke in chosen}
    publish("loaded rivals", rivals_table(rows, own), document)
    if not options.quick:
        from bench.loads.cost_chart import draw  # matplotlib is needed for the figure only

        write(rows, DOCS / "loaded_cost.csv")
        draw(rows, DOCS / "loaded_cost")


if __name__ == "__main__":
    main()
