"""Tables of batches: many cold commands of the seed's robot, and the whole workspace of three tubes."""

from __future__ import annotations

import resource
import tracemalloc
from functools import partial

import numpy as np
from numpy.typing import NDArray

from bench.common.batches import batch_tips
from bench.common.batches import commands
from bench.common.clock import Stopwatch
from bench.common.clock import Timing
from bench.common.document import table
from bench.common.nested_robots import nested
from bench.common.scenes import PARTIAL_OVERLAP
from bench.common.scenes import SEED
from bench.common.strokes import TOLERANCE
from ctr_pvs import EquilibriumSolver
from ctr_pvs import Robot
from ctr_pvs import Status

Array = NDArray[np.float64]

#: Commands in the batch, the most u for each, and the most memory [MB].
BATCH, BATCH_TARGET, MEMORY_TARGET = 10_000, 20.0, 500.0
#: Commands of the workspace, and the most [ms] for a row, without a snap on its way and with one.
WORKSPACE, ROW_TARGET, SNAP_TARGET = 2000, 0.4, 5.0


def batch_table(size: int) -> str:
    """Time for each command of a cold batch, and memory."""
    rows = []
    for name, slide in (("all at one D", 0.0), ("each at its own D", 0.02)):
        alpha, D = commands(size, np.array([0.0, 1.0]), np.radians(150.0), PARTIAL_OVERLAP, slide)
        run = partial(batch_tips, EquilibriumSolver(SEED, TOLERANCE), alpha, D)
        watch = Stopwatch()
        _, failed = watch.time(run)  # type: ignore[misc]
        each = share(watch.median, size)
        tracemalloc.start()
        run()
        traced = tracemalloc.get_traced_memory()[1] / 2**20
        tracemalloc.stop()
        resident = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**10
        rows.append([name, f"{each.microseconds:.3g} µs, {each.units:.1f} u", f"{BATCH_TARGET:.0f} u", str(failed)])
        rows[-1] += [f"{traced:.0f} MB", f"{resident:.0f} MB", f"{MEMORY_TARGET:.0f} MB"]
    head = [f"{size:,} cold commands with tips", "each", "target", "failed", "traced peak", "process peak", "target"]
    return table(head, rows)


def share(timing: Timing, count: int) -> Timing:
    return Timing(timing.seconds / count, timing.units / count)


def workspace(robot: Robot, count: int, seed: int = 3) -> tuple[Array, Array]:
    """Random commands alpha, D (count, N): any rotation, and tubes anywhere between drawn in and pushed out."""
    rng = np.random.default_rng(seed)
    lengths = np.array([tube.length for tube in robot.tubes])
    D = np.sort(rng.random((count, robot.n_tubes)) * lengths, axis=1)
    return rng.uniform(-np.pi, np.pi, (count, robot.n_tubes)), np.minimum(D, lengths)


def workspace_table(count: int) -> str:
    """Rows of one batch by what came of them, each kind timed by itself."""
    robot, _ = nested(3)
    solver = EquilibriumSolver(robot, TOLERANCE)
    alpha, D = workspace(robot, count)
    status = solver.solve_batch(alpha, D).status
    snapped = status == Status.SNAP
    kinds = (
        ("no snap on the way", status == Status.OK, f"{ROW_TARGET} ms"),
        ("snaps on the way", snapped, f"{SNAP_TARGET} ms"),
        ("no answer", ~snapped & (status != Status.OK), ""),
    )
    rows = []
    for name, chosen, target in kinds:
        if not chosen.any():
            rows.append([name, "0", "", target])
            continue
        watch = Stopwatch()
        watch.time(partial(solver.solve_batch, alpha[chosen], D[chosen]))
        each = share(watch.median, int(chosen.sum()))
        rows.append([name, str(int(chosen.sum())), f"{1e3 * each.seconds:.3g} ms, {each.units:.0f} u", target])
    return table([f"{count:,} random commands of three tubes, cold", "rows", "each", "target"], rows)
