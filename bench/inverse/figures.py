"""The figures of docs/inverse.md: a tip that traces a circle, and one that goes along a needle's path.

    scripts/in_env.sh python3 -m bench.inverse.figures

Writes docs/figures/inverse_*.png.
"""

from __future__ import annotations

import argparse

from bench.common.places import FIGURES
from bench.inverse.path_chart import draw_circle
from bench.inverse.path_chart import draw_needle


def main() -> None:
    argparse.ArgumentParser(description=__doc__.partition("\n")[0]).parse_args()
    FIGURES.mkdir(exist_ok=True)
    draw_circle(FIGURES / "inverse_circle.png")
    draw_needle(FIGURES / "inverse_needle.png")


if __name__ == "__main__":
    main()
