"""What serving a robot costs: the generated tables of docs/speed_accuracy.md.

    scripts/in_env.sh python3 -m bench.serving.serving_cost

Warm steps of 0.1 deg, a batch with its memory, what other ways cost at equal measured tip error, and where the time of
a solve goes.  Times are medians, in microseconds and in u (see ``common.clock``).
"""

from __future__ import annotations

import argparse
import platform
import time

import numpy as np
import scipy

from bench.common.clock import unit
from bench.common.document import publish
from bench.common.places import SPEED
from bench.common.scenes import scenes
from bench.common.strokes import STEPS
from bench.common.strokes import strokes
from bench.serving.comparisons import profile_table
from bench.serving.comparisons import ratio_table
from bench.serving.comparisons import seeds_table
from bench.serving.many import BATCH
from bench.serving.many import batch_table
from bench.serving.steps import sliding_table
from bench.serving.steps import steps_table
from bench.serving.steps import tolerance_table
from bench.serving.steps import tubes_table
from bench.speed.rows import Course
from bench.speed.rows import quiet
from ctr_pvs.kernel.compiler import mode


def machine() -> str:
    """What the numbers depend on."""
    versions = f"Python {platform.python_version()}, numpy {np.__version__}, scipy {scipy.__version__}"
    return f"{platform.machine()}, {versions}; kernels {mode()}; u = {1e6 * unit():.3f} µs."


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--quick", action="store_true", help="a few steps on one scene, printed only")
    options = parser.parse_args()
    quiet()
    begin = time.perf_counter()
    document = None if options.quick else SPEED
    many, size = (20, 20) if options.quick else (STEPS, BATCH)
    chosen, compared = strokes(), scenes()
    if options.quick:
        chosen, compared = chosen[:1], scenes(1, 2)[:1]
    publish("machine", machine(), document)
    publish("warm steps", steps_table(chosen, many), document)
    publish("sliding steps", sliding_table([chosen[0], chosen[-1]], many // 2), document)
    publish("tolerance", tolerance_table([chosen[0], chosen[-1]], many // 4), document)
    publish("three tubes", tubes_table(many // 2), document)
    publish("batch", batch_table(size), document)
    courses = [Course(scene) for scene in compared]
    publish("equal error", ratio_table(courses), document)
    publish("seed's way", seeds_table(courses), document)
    publish("profile", profile_table(chosen[0], many), document)
    print(f"\n{time.perf_counter() - begin:.0f} s")


if __name__ == "__main__":
    main()
