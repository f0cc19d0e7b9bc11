"""Where the arrays of the kernel lie in the workspace of one thread: one array of floats, one of ints."""

from __future__ import annotations

import numpy as np

from ctr_pvs.kernel.arrays import AXES
from ctr_pvs.kernel.arrays import BENDS
from ctr_pvs.kernel.arrays import CAPACITIES
from ctr_pvs.kernel.arrays import COUNTS
from ctr_pvs.kernel.arrays import ELEMENTS
from ctr_pvs.kernel.arrays import HIGHEST_DEGREE
from ctr_pvs.kernel.arrays import LINE
from ctr_pvs.kernel.arrays import LINES
from ctr_pvs.kernel.arrays import LOADS
from ctr_pvs.kernel.arrays import MARKS
from ctr_pvs.kernel.arrays import MOST_NODES
from ctr_pvs.kernel.arrays import NODES
from ctr_pvs.kernel.arrays import POINT
from ctr_pvs.kernel.arrays import ROWS
from ctr_pvs.kernel.arrays import SECTIONS
from ctr_pvs.kernel.arrays import STATICS
from ctr_pvs.kernel.arrays import SUMS
from ctr_pvs.kernel.arrays import UNKNOWNS
from ctr_pvs.kernel.arrays import WIDEST
from ctr_pvs.kernel.arrays import Array
from ctr_pvs.kernel.arrays import Bench
from ctr_pvs.kernel.arrays import Ints
from ctr_pvs.kernel.arrays import Kit
from ctr_pvs.kernel.arrays import Scene
from ctr_pvs.kernel.arrays import Sections
from ctr_pvs.kernel.compiler import compiled
from ctr_pvs.kernel.compiler import entry_point


@entry_point("UniTuple(int64, 2)(int64, int64[::1])")
def workspace_sizes(tubes: int, capacity: Ints) -> tuple[int, int]:
    """How many floats and ints a workspace of this ``capacity`` (CAPACITIES,) takes."""
    sections, elements, unknowns = capacity[SECTIONS], capacity[ELEMENTS], capacity[UNKNOWNS]
    floats = 3 * sections + 1 + 2 * scene_floats(tubes, capacity)
    floats += capacity[WIDEST] * (elements * (capacity[WIDEST] + 4) + 3 * (MOST_NODES + 4) + 1)
    floats += (2 * (tubes + 3) + LINES) * (tubes + 6) + SUMS * SUMS
    floats += 18 + 6 * MOST_NODES + 7 * (HIGHEST_DEGREE + 2) + ROWS * unknowns + (elements + 1) * (3 * tubes + 10)
    ints = CAPACITIES + sections * (tubes + 5) + 2 * scene_ints(tubes, capacity) + tubes
    return floats, ints


@compiled
def scene_floats(tubes: int, capacity: Ints) -> int:
    """How many floats a scene takes."""
    ends, nodes = capacity[ELEMENTS] + 1, capacity[NODES]
    floats = 4 * tubes + ends * (LINE + 4 + STATICS + 3 * tubes) + nodes * (2 + AXES + 2 * BENDS + 8 * tubes)
    return floats + 5 * capacity[UNKNOWNS] + capacity[LOADS]


@compiled
def scene_ints(tubes: int, capacity: Ints) -> int:
    """How many ints a scene takes."""
    return COUNTS + capacity[ELEMENTS] * (MARKS + 3 * tubes) + capacity[LOADS] // POINT + 1


@compiled
def kit_of(tubes: Array, segments: Ints, rules: Array, floats: Array, ints: Ints) -> Kit:
    """What an entry point was given, with the arrays of the workspace under their names: to be called once, as making
    views takes a while (1 us of a step of 15)."""
    N = len(segments)
    scenes = scene_of(floats, ints, N, 0), scene_of(floats, ints, N, 1)
    return Kit(tubes, segments, rules, floats, ints, scenes, bench_of(floats, ints, N))


@compiled
def scene_of(floats: Array, ints: Ints, tubes: int, which: int) -> Scene:
    """Scene number ``which`` (0 or 1) of a workspace."""
    elements, nodes, unknowns = ints[ELEMENTS], ints[NODES], ints[UNKNOWNS]
    f = 3 * ints[SECTIONS] + 1 + which * scene_floats(tubes, ints)
    i = CAPACITIES + ints[SECTIONS] * (tubes + 5) + which * scene_ints(tubes, ints)
    e1 = elements + 1
    base = floats[f : f + 4 * tubes].reshape(4, tubes)
    f += 4 * tubes
    line = floats[f : f + LINE * e1].reshape(e1, LINE)
    f += LINE * e1
    frame = floats[f : f + 4 * e1].view(np.complex128).reshape(e1, 2)
    f += 4 * e1
    statics = floats[f : f + STATICS * e1].reshape(e1, STATICS)
    f += STATICS * e1
    held = floats[f : f + 3 * e1 * tubes].reshape(3, e1, tubes)
    f += 3 * e1 * tubes
    gauss = floats[f : f + 2 * nodes].reshape(nodes, 2)
    f += 2 * nodes
    axes = floats[f : f + AXES * nodes].reshape(nodes, AXES)
    f += AXES * nodes
    moments = floats[f : f + 4 * nodes * tubes].view(np.complex128).reshape(2, nodes, tubes)
    f += 4 * nodes * tubes
    turns = floats[f : f + 4 * nodes * tubes].reshape(4, nodes, tubes)
    f += 4 * nodes * tubes
    bends = floats[f : f + 2 * BENDS * nodes].view(np.complex128).reshape(nodes, BENDS)
    f += 2 * BENDS * nodes
    vectors = floats[f : f + 5 * unknowns].reshape(5, unknowns)
    f += 5 * unknowns
    loads = floats[f : f + ints[LOADS]]
    counts = ints[i : i + COUNTS]
    i += COUNTS
    marks = ints[i : i + MARKS * elements].reshape(elements, MARKS)
    i += MARKS * elements
    parts = ints[i : i + 3 * elements * tubes].reshape(3, elements, tubes)
    i += 3 * elements * tubes
    point_at = ints[i : i + ints[LOADS] // POINT + 1]
    return Scene(
        counts, base, line, frame, statics, held, marks, parts, gauss, axes, moments, turns, bends, vectors, loads,
        point_at,
    )  # fmt: skip


@compiled
def sections_of(kit: Kit) -> Sections:
    """The sections of a workspace."""
    floats, ints, tubes = kit.floats, kit.ints, len(kit.segments)
    sections = ints[SECTIONS]
    i = CAPACITIES
    start = floats[: sections + 1]
    pulls = floats[sections + 1 : 3 * sections + 1].reshape(2, sections)
    segment = ints[i : i + sections * tubes].reshape(sections, tubes)
    rest = ints[i + sections * tubes : i + sections * (tubes + 5)].reshape(5, sections)
    return Sections(start, pulls, segment, rest[0], rest[1], rest[2], rest[3], rest[4])


@compiled
def bench_of(floats: Array, ints: Ints, tubes: int) -> Bench:
    """Where the kernel works in a workspace."""
    elements, unknowns, widest = ints[ELEMENTS], ints[UNKNOWNS], ints[WIDEST]
    f = 3 * ints[SECTIONS] + 1 + 2 * scene_floats(tubes, ints)
    i = CAPACITIES + ints[SECTIONS] * (tubes + 5) + 2 * scene_ints(tubes, ints)
    e1, ends = elements + 1, tubes + 3
    factors = floats[f : f + elements * widest * widest].reshape(elements, widest, widest)
    f += elements * widest * widest
    sides = floats[f : f + elements * widest].reshape(elements, widest)
    f += elements * widest
    swings = floats[f : f + 3 * elements * widest].reshape(elements, 3, widest)
    f += 3 * elements * widest
    squares = floats[f : f + 2 * ends * ends].reshape(2, ends, ends)
    f += 2 * ends * ends
    sums = floats[f : f + SUMS * SUMS].reshape(SUMS, SUMS)
    f += SUMS * SUMS
    lines = floats[f : f + LINES * (tubes + 6)].reshape(LINES, tubes + 6)
    f += LINES * (tubes + 6)
    row = floats[f : f + widest]
    f += widest
    spread = floats[f : f + 3 * (MOST_NODES + 4) * widest]
    f += 3 * (MOST_NODES + 4) * widest
    space = floats[f : f + 18].reshape(6, 3)
    f += 18
    sites = floats[f : f + 6 * MOST_NODES].reshape(2, MOST_NODES, 3)
    f += 6 * MOST_NODES
    series = floats[f : f + 7 * (HIGHEST_DEGREE + 2)].reshape(HIGHEST_DEGREE + 2, 7)
    f += 7 * (HIGHEST_DEGREE + 2)
    rows = floats[f : f + ROWS * unknowns].reshape(ROWS, unknowns)
    f += ROWS * unknowns
    ends_move = floats[f : f + e1]
    f += e1
    moved = floats[f : f + 2 * e1 * ends].reshape(2, e1, ends)
    f += 2 * e1 * ends
    rates = floats[f : f + e1 * ends].reshape(e1, ends)
    offset = ints[i : i + tubes]
    return Bench(
        factors, sides, swings, squares, sums, lines, row, spread, space, sites, series, rows, ends_move, moved, rates,
        offset,
    )  # fmt: skip
