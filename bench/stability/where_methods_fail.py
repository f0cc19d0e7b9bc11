"""Where methods fail: sweeps through folds and cold starts, every answer checked against exact equilibria.

    scripts/in_env.sh python3 -m bench.stability.where_methods_fail    # docs/stability.md, its figures and a CSV
    scripts/in_env.sh python3 -m bench.stability.where_methods_fail --quick --output DIR    # a few robots: the CSV only

Two tubes: lambda from 0.5 to 10, b from 0 to 4.  Three tubes: random robots.  Warm: one sweep of commands, each method
started from its last success.  Cold: single commands from scratch.  ``methods`` says what is compared, ``judges`` what
counts as right.
"""

from __future__ import annotations

import argparse
import itertools
import sys
import time
from pathlib import Path

from bench.common.document import publish
from bench.common.places import DOCS
from bench.common.places import STABILITY
from bench.stability.rows import STEPS
from bench.stability.rows import load
from bench.stability.rows import save
from bench.stability.rows import summary
from bench.stability.rows import three_tube_rows
from bench.stability.rows import two_tube_rows

LAMBDAS, GUIDES = (0.5, 1.0, 2.0, 3.0, 4.0, 5.0, 7.0, 10.0), (0.0, 0.25, 0.5, 1.0, 2.0, 4.0)
#: The quick run: one pair that cannot snap, and one that does.
QUICK_PAIRS = ((2.0, 0.0), (5.0, 0.0))
QUICK_STEPS = 33
ROBOTS, QUICK_ROBOTS = 100, 1


def main(arguments: list[str]) -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--quick", action="store_true", help="a few robots; no figures, docs/stability.md stays")
    parser.add_argument("--redraw", action="store_true", help="tables and figures from the CSV of an earlier run")
    parser.add_argument("--output", type=Path, default=DOCS / "figures", help="folder of the CSV and figures")
    chosen = parser.parse_args(arguments)
    chosen.output.mkdir(parents=True, exist_ok=True)
    results = chosen.output / "where_methods_fail.csv"
    begin = time.monotonic()
    if not chosen.redraw:
        pairs = QUICK_PAIRS if chosen.quick else itertools.product(LAMBDAS, GUIDES)
        rows = list(two_tube_rows(pairs, QUICK_STEPS if chosen.quick else STEPS))
        rows += three_tube_rows(QUICK_ROBOTS if chosen.quick else ROBOTS)
        save(rows, results)
        print(f"{time.monotonic() - begin:.0f} s")
    rows = load(results)
    groups = {
        "two tubes": [row for row in rows if row.robot == "pair"],
        "three tubes": [row for row in rows if row.robot != "pair"],
    }
    for kind, group in groups.items():
        for start in ("warm", "cold before the fold", "cold past the fold"):
            part = summary([row for row in group if row.start == start])
            publish(f"{kind}, {start}", part, None if chosen.quick else STABILITY)
    if not chosen.quick:
        from bench.stability import chart  # matplotlib is needed for the figures only

        chart.draw_pairs(groups["two tubes"], chosen.output / "where_methods_fail.png")
        chart.draw_robots(groups["three tubes"], chosen.output / "where_methods_fail_three_tubes.png")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
