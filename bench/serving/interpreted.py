"""Steps with their tips, as JSON on standard output: seconds and u of each stroke.

NUMBA_DISABLE_JIT=1 python3 -m bench.serving.interpreted STEPS STROKE ...
"""

from __future__ import annotations

import dataclasses
import json
import sys

from bench.common.strokes import serve
from bench.common.strokes import solve_and_tip
from bench.common.strokes import strokes
from ctr_pvs.kernel.compiler import mode


def main(steps: str, *names: str) -> None:
    if mode() != "interpreted":
        raise SystemExit("kernels are compiled: set NUMBA_DISABLE_JIT=1")
    chosen = {stroke.name: stroke for stroke in strokes()}
    print(json.dumps([dataclasses.astuple(serve(chosen[name], solve_and_tip, int(steps))) for name in names]))


if __name__ == "__main__":
    main(*sys.argv[1:])
