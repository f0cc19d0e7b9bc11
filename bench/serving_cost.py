"""What serving a robot costs: the generated tables of docs/speed_accuracy.md.

    OPENBLAS_NUM_THREADS=1 python bench/serving_cost.py

Warm steps of 0.1 deg, a batch with its memory, what other ways cost at equal measured tip error, and where the time of
a solve goes.  Times are medians, in microseconds and in u (see ``clock``).
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy is loaded: all matrices are small

import argparse
import platform
import resource
import time
import tracemalloc
from functools import partial
from pathlib import Path

import numpy as np
import scipy
from batches import batch_tips
from batches import commands
from clock import Stopwatch
from clock import Timing
from clock import unit
from document import publish
from document import table
from nested_robots import nested
from nested_robots import turned
from samples import Samples
from seeds_way import AsPrinted
from served import ASKED
from served import STEPS
from served import TOLERANCE
from served import Stroke
from served import serve
from served import solve_and_tip
from served import strokes
from speed_accuracy import WARM
from speed_accuracy import Course
from speed_accuracy import Row
from speed_accuracy import measure
from speed_accuracy import quiet
from speed_methods import AUTO
from speed_methods import BVP_NAME
from speed_methods import METHODS
from speed_methods import SEED as SEEDS_WAY
from speed_methods import AtLevel
from speed_scenes import PARTIAL_OVERLAP
from speed_scenes import SEED
from speed_scenes import scenes

from ctr_pvs import EquilibriumSolver

DOCUMENT = Path(__file__).resolve().parents[1] / "docs" / "speed_accuracy.md"
#: Commands in the batch, the most u for each, and the most memory [MB].
BATCH, BATCH_TARGET, MEMORY_TARGET = 10_000, 10.0, 500.0
#: Tip error [m] at which methods are compared, and how many times as long as ours theirs should take.
ERROR, RATIOS = 1e-6, {BVP_NAME: 25.0, SEEDS_WAY: 50.0}
#: Three tubes should take no more than this many times as long as two.
TUBES_TARGET = 2.0
#: Solves of the seed's equations as printed.
PRINTED = 3
#: Functions told in the profile.
TOLD = 12


def told(timing: Timing) -> str:
    return f"{timing.microseconds:.3g} µs, {timing.units:.0f} u"


def machine() -> str:
    """What the numbers depend on."""
    versions = f"Python {platform.python_version()}, numpy {np.__version__}, scipy {scipy.__version__}"
    return f"{platform.machine()}, {versions}; u = {1e6 * unit():.3f} µs."


def steps_table(chosen: list[Stroke], many: int) -> str:
    """Every stroke and everything asked."""
    rows = []
    for name, (ask, target) in ASKED.items():
        rows.append([name, f"{target:.0f} u", *(told(serve(stroke, ask, many)) for stroke in chosen)])
    return table([f"median of {many:,} steps of 0.1°", "target", *(stroke.name for stroke in chosen)], rows)


def sliding_table(chosen: list[Stroke], many: int) -> str:
    """Every step at a base position of its own."""
    rows = [
        [name, *(told(serve(stroke, ask, many, sliding=True)) for stroke in chosen)] for name, (ask, _) in ASKED.items()
    ]
    return table([f"median of {many:,} steps of 0.1° and 10 µm", *(stroke.name for stroke in chosen)], rows)


def tubes_table(many: int) -> str:
    """Three nested tubes against two of the same family."""
    rows = []
    for name, (ask, _) in ASKED.items():
        two, three = (serve(Stroke(f"{n} tubes", *nested(n), turned(n), 0.0, 160.0), ask, many) for n in (2, 3))
        rows.append([name, told(two), told(three), f"{three.units / two.units:.2f}", f"{TUBES_TARGET:.0f}"])
    return table(["", "two nested tubes", "three", "ratio", "target"], rows)


def batch_table(size: int) -> str:
    """Time for each command of a cold batch, and memory."""
    rows = []
    for name, slide in (("all at one D", 0.0), ("each at its own D", 0.02)):
        alpha, D = commands(size, np.array([0.0, 1.0]), np.radians(150.0), PARTIAL_OVERLAP, slide)
        run = partial(batch_tips, EquilibriumSolver(SEED, TOLERANCE), alpha, D)
        watch = Stopwatch()
        _, failed = watch.time(run)  # type: ignore[misc]
        median = watch.median
        each = Timing(median.seconds / size, median.units / size)
        tracemalloc.start()
        run()
        traced = tracemalloc.get_traced_memory()[1] / 2**20
        tracemalloc.stop()
        resident = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**10
        rows.append([name, f"{each.microseconds:.3g} µs, {each.units:.1f} u", f"{BATCH_TARGET:.0f} u", str(failed)])
        rows[-1] += [f"{traced:.0f} MB", f"{resident:.0f} MB", f"{MEMORY_TARGET:.0f} MB"]
    head = [f"{size:,} cold commands with tips", "each", "target", "failed", "traced peak", "process peak", "target"]
    return table(head, rows)


def at_equal_error(course: Course, family: str) -> Row | None:
    """The quickest setting of ``family`` whose largest tip error in warm steps of 1 deg is within ``ERROR``."""
    rows = [measure(course, family, setting, make, WARM) for setting, make in METHODS[family].items()]
    good = [row for row in rows if row.right == row.commands and row.error_largest_m <= ERROR]
    return min(good, key=lambda row: row.time_u, default=None)


def ratio_table(courses: list[Course]) -> str:
    """Others against ours, scene by scene."""
    rows = []
    for course in courses:
        own = at_equal_error(course, AUTO)
        cells = [course.scene.name, _cell(own)]
        for family in RATIOS:
            other = at_equal_error(course, family)
            cells.append(_cell(other))
            cells.append("" if own is None or other is None else f"{other.time_u / own.time_u:.1f}")
        rows.append(cells)
    head = ["tip error ≤ 1e-6 m, steps of 1°", AUTO]
    for family, target in RATIOS.items():
        head += [family, f"ratio (target {target:.0f})"]
    return table(head, rows)


def _cell(row: Row | None) -> str:
    return "none" if row is None else f"{row.time_u:.0f} u ({row.setting}: {row.error_largest_m:.0e} m)"


def seeds_table(courses: list[Course]) -> str:
    """The seed's quadratic basis, tabulated as for the chart, and with its equations evaluated as printed."""
    rows = []
    for course in courses:
        level = AsPrinted(course.scene.robot, course.scene.D)
        watches, errors = (Stopwatch(), Stopwatch()), []
        method = AtLevel(course.scene, level)
        (first, _), *rest = course.runs[-1]
        method.approach(first)
        for alpha, tip in rest[:PRINTED]:
            before = level.q
            found = watches[1].time(partial(level.printed, alpha))
            level.q = before
            quick = watches[0].time(partial(level.warm, alpha))
            errors += [np.linalg.norm(quick - tip), np.linalg.norm(found - tip)]
        rows.append([course.scene.name, *(told(watch.median) for watch in watches), f"{max(errors):.0e} m"])
    return table(["quadratic basis, steps of 1°", "tabulated", "as printed", "largest tip error"], rows)


def profile_table(stroke: Stroke, many: int) -> str:
    """Shares of the functions that are at work during warm steps with tips."""
    samples = Samples()
    samples.run(partial(serve, stroke, solve_and_tip, many))
    rows = [[f"`{name}`", f"{samples.share(count):.0f} %"] for name, count in samples.own.most_common(TOLD)]
    rest = 100.0 - sum(samples.share(count) for _, count in samples.own.most_common(TOLD))
    rows.append(["all others", f"{rest:.0f} %"])
    return table([f"at work, in {samples.total:,} samples of solve and tip pose, {stroke.name}", "share"], rows)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--quick", action="store_true", help="a few steps on one scene, printed only")
    options = parser.parse_args()
    quiet()
    begin = time.perf_counter()
    document = None if options.quick else DOCUMENT
    many, size = (20, 20) if options.quick else (STEPS, BATCH)
    chosen, compared = strokes(), scenes()
    if options.quick:
        chosen, compared = chosen[:1], scenes(1, 2)[:1]
    publish("machine", machine(), document)
    publish("warm steps", steps_table(chosen, many), document)
    publish("sliding steps", sliding_table([chosen[0], chosen[-1]], many // 2), document)
    publish("three tubes", tubes_table(many // 2), document)
    publish("batch", batch_table(size), document)
    courses = [Course(scene) for scene in compared]
    publish("equal error", ratio_table(courses), document)
    publish("seed's way", seeds_table(courses), document)
    publish("profile", profile_table(chosen[0], many), document)
    print(f"\n{time.perf_counter() - begin:.0f} s")


if __name__ == "__main__":
    main()
