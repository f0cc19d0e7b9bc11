"""Tables of warm steps: as a controller asks for them, sliding, at every tolerance, with two tubes and three."""

from __future__ import annotations

import json
import os
import subprocess
import sys

from bench.common.clock import Timing
from bench.common.document import table
from bench.common.nested_robots import nested
from bench.common.nested_robots import turned
from bench.common.places import ROOT
from bench.common.strokes import ASKED
from bench.common.strokes import Served
from bench.common.strokes import Stroke
from bench.common.strokes import serve_in_turn
from bench.common.strokes import solve_and_tip

#: A step that slides should take no more than this many times as long as one that does not; so should three tubes
#: against two.
SLIDING_TARGET, TUBES_TARGET = 1.5, 2.0
#: Tolerances [m], the loosest first.
TOLERANCES = tuple(float(f"1e-{digits}") for digits in range(2, 10))
#: Steps that are interpreted: they take some hundred times as long.
INTERPRETED_STEPS = 20


def told(timing: Timing) -> str:
    return f"{timing.microseconds:.3g} µs, {timing.units:.0f} u"


def steps_table(chosen: list[Stroke], many: int) -> str:
    """Every stroke and everything asked; then the same without compiled kernels."""
    rows = [[name, f"{target:.0f} u"] for name, (_, target) in ASKED.items()]
    for stroke in chosen:
        timings = serve_in_turn([Served(stroke, ask) for ask, _ in ASKED.values()], many)
        for row, timing in zip(rows, timings, strict=True):
            row.append(told(timing))
    steps = min(many, INTERPRETED_STEPS)
    rows.append(["solve and tip pose, interpreted", "", *(told(timing) for timing in interpreted(chosen, steps))])
    return table([f"median of {many:,} steps of 0.1°", "target", *(stroke.name for stroke in chosen)], rows)


def interpreted(chosen: list[Stroke], many: int) -> list[Timing]:
    """Steps with their tips in a process whose kernels are not compiled."""
    command = [sys.executable, "-m", "bench.serving.interpreted", str(many), *(stroke.name for stroke in chosen)]
    variables = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    done = subprocess.run(command, cwd=ROOT, env=variables, check=True, capture_output=True, text=True)
    return [Timing(*numbers) for numbers in json.loads(done.stdout)]


def sliding_table(chosen: list[Stroke], many: int) -> str:
    """Every step at a base position of its own, and how many times as long that takes."""
    rows = []
    for name, (ask, _) in ASKED.items():
        cells = []
        for stroke in chosen:
            still, slid = serve_in_turn([Served(stroke, ask), Served(stroke, ask, sliding=True)], many)
            cells += [told(slid), f"{slid.units / still.units:.2f}"]
        rows.append([name, f"{SLIDING_TARGET}", *cells])
    head = [f"median of {many:,} steps of 0.1° and 10 µm", "ratio should be"]
    for stroke in chosen:
        head += [stroke.name, "ratio to steps at one D"]
    return table(head, rows)


def tolerance_table(chosen: list[Stroke], many: int) -> str:
    """What a looser tolerance saves: solve and tip pose."""
    rows = [[f"{tolerance:.0e} m"] for tolerance in TOLERANCES]
    for stroke in chosen:
        every = [Served(stroke, solve_and_tip, tolerance=tolerance) for tolerance in TOLERANCES]
        for row, served, timing in zip(rows, every, serve_in_turn(every, many), strict=True):
            row.append(f"{told(timing)}, {served.unknowns} unknowns")
    return table([f"tolerance; median of {many:,} steps of 0.1° with tips", *(stroke.name for stroke in chosen)], rows)


def tubes_table(many: int) -> str:
    """Three nested tubes against two of the same family."""
    rows = []
    for name, (ask, _) in ASKED.items():
        two, three = serve_in_turn(
            [Served(Stroke(f"{n} tubes", *nested(n), turned(n), 0.0, 160.0), ask) for n in (2, 3)], many
        )
        rows.append([name, told(two), told(three), f"{three.units / two.units:.2f}", f"{TUBES_TARGET:.0f}"])
    return table(["", "two nested tubes", "three", "ratio", "target"], rows)
