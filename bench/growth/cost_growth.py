"""How the cost grows with the work: tubes, sections, poses, and commands in a batch.

    scripts/in_env.sh python3 -m bench.growth.cost_growth

Writes docs/cost_growth.csv, .png and .svg, and a table of docs/speed_accuracy.md.  Solves are warm, 1 deg from the last
answer, at a tolerance of 1e-6 m.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from bench.common.document import publish
from bench.common.places import DOCS
from bench.common.places import SPEED
from bench.growth.points import BATCHES
from bench.growth.points import POSES
from bench.growth.points import SEGMENTS
from bench.growth.points import STEPS
from bench.growth.points import TUBES
from bench.growth.points import Point
from bench.growth.points import batches
from bench.growth.points import fits_table
from bench.growth.points import poses
from bench.growth.points import segments
from bench.growth.points import tubes
from bench.growth.points import write


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--quick", action="store_true", help="few numbers and steps, no figure")
    parser.add_argument("--output", type=Path, default=DOCS, help="folder for the files (default: docs)")
    options = parser.parse_args()
    few = 2 if options.quick else None
    steps = 4 if options.quick else STEPS
    points: list[Point] = []
    for part in (
        tubes(TUBES[:few], steps),
        segments(SEGMENTS[:few], steps),
        poses(POSES[:few], steps),
        batches(BATCHES[:few]),
    ):
        points += part
    publish("growth", fits_table(points), None if options.quick else SPEED)
    options.output.mkdir(parents=True, exist_ok=True)
    write(points, options.output / "cost_growth.csv")
    if not options.quick:
        from bench.growth.chart import draw  # matplotlib is needed for the figure only

        draw(points, options.output / "cost_growth")


if __name__ == "__main__":
    main()
