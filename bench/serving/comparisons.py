"""Tables of what other ways cost at equal tip error, and of where the time goes."""

from __future__ import annotations

from functools import partial

import numpy as np

from bench.common.clock import Stopwatch
from bench.common.document import table
from bench.common.samples import Samples
from bench.common.strokes import Stroke
from bench.common.strokes import serve
from bench.common.strokes import solve_and_tip
from bench.serving.steps import told
from bench.speed.methods import AUTO
from bench.speed.methods import BVP_NAME
from bench.speed.methods import METHODS
from bench.speed.methods import SEED
from bench.speed.methods import AtLevel
from bench.speed.rows import WARM
from bench.speed.rows import Course
from bench.speed.rows import Row
from bench.speed.rows import measure
from bench.speed.seeds_way import AsPrinted

#: Tip error [m] at which methods are compared, and how many times as long as ours theirs should take.
ERROR, RATIOS = 1e-6, {BVP_NAME: 25.0, SEED: 50.0}
#: Solves of the seed's equations as printed.
PRINTED = 3
#: Functions told in the profile.
TOLD = 12


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
