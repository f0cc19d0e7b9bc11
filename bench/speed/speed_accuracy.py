"""Speed against accuracy: time per solve with its tip against the tip's measured error, one run, one machine.

    scripts/in_env.sh python3 -m bench.speed.speed_accuracy

Writes docs/speed_accuracy.csv, .png and .svg.  Errors are distances to converged tips, which a boundary-value solver
of its own equations confirms once per scene; times are medians, in microseconds and in u (see ``common.clock``).
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

from bench.common.clock import unit
from bench.common.places import DOCS
from bench.common.scenes import scenes
from bench.speed.methods import METHODS
from bench.speed.rows import AGREEMENT
from bench.speed.rows import Course
from bench.speed.rows import Row
from bench.speed.rows import quickest
from bench.speed.rows import quiet
from bench.speed.rows import sweep
from bench.speed.rows import write

#: Everything is measured so many times, with everything else in between, and the quickest counts: other work on the
#: machine comes and goes.
ROUNDS = 2


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--quick", action="store_true", help="one scene, few settings and commands, no figure")
    parser.add_argument("--output", type=Path, default=DOCS, help="folder for the files (default: docs)")
    options = parser.parse_args()
    quiet()
    begin = time.perf_counter()
    chosen = [Course(scene) for scene in (scenes(1, 2)[:1] if options.quick else scenes())]
    for course in chosen:
        distance = course.confirm()
        print(f"{course.scene.name}: converged tip is {distance:.1e} m from solve_bvp at 1e-10", flush=True)
        if distance > AGREEMENT:
            raise SystemExit("the references do not agree")
    rounds: list[list[Row]] = []
    for _ in range(1 if options.quick else ROUNDS):
        rounds.append([])
        for family in METHODS:
            rounds[-1] += sweep(chosen, family, options.quick)
            print(f"{family:12s} {time.perf_counter() - begin:5.0f} s, u = {1e6 * unit():.3f} µs", flush=True)
    rows = quickest(rounds)
    options.output.mkdir(parents=True, exist_ok=True)
    write(rows, options.output / "speed_accuracy.csv")
    if not options.quick:
        from bench.speed.chart import draw  # matplotlib is needed for the figure only

        draw(rows, options.output / "speed_accuracy")


if __name__ == "__main__":
    main()
