"""Following a stable equilibrium along the straight path from command to command.

A step is taken only if it is proven to keep its branch (``step``); otherwise it is halved.  Where steps vanish, or the
margin has, the stable branch has ended.
"""

from __future__ import annotations

import math

from ctr_pvs.kernel.arrays import END
from ctr_pvs.kernel.arrays import S_STEPS
from ctr_pvs.kernel.arrays import STATE
from ctr_pvs.kernel.arrays import Array
from ctr_pvs.kernel.arrays import Ints
from ctr_pvs.kernel.arrays import Kit
from ctr_pvs.kernel.arrays import bench_of
from ctr_pvs.kernel.arrays import scene_of
from ctr_pvs.kernel.compiler import compiled
from ctr_pvs.kernel.twist.margin import stability_margin
from ctr_pvs.kernel.walk.step import FOLD
from ctr_pvs.kernel.walk.step import LARGEST_SLIDE
from ctr_pvs.kernel.walk.step import MORE
from ctr_pvs.kernel.walk.step import OK
from ctr_pvs.kernel.walk.step import TOO_SMALL
from ctr_pvs.kernel.walk.step import open_state
from ctr_pvs.kernel.walk.step import step

#: A step along the path shorter than this fraction of it is none: the branch ends here.
SHORTEST_STEP = 1e-13
#: A state with less margin that cannot be left by a step is at the branch's end: at a fold the margin falls with the
#: square root of what is left, so this is about 1e-10 rad before it.
AT_THE_FOLD = 1e-5
#: Shorter steps than this are a reason to look at the margin.
SHORT_STEP = 1e-3
#: By how much the converged model may differ [rad] on a path: near a fold there is no room for more.
PATH_SLACK = 1e-9


@compiled
def margin_of(kit: Kit, state: Array, tolerance: float) -> float:
    """The stability margin of ``state``; NaN if the workspace is too small for it."""
    N = len(kit.segments)
    which = open_state(kit, state, tolerance)
    if which < 0:
        return math.nan
    scene = scene_of(kit, which)
    return stability_margin(scene, bench_of(kit), kit.rules, state[STATE : STATE + N])


@compiled
def command_at(begin: Array, end: Array, t: float, out: Array) -> None:
    """The command at the fraction t of the straight path between two, (2 N,) each; the ends are exact."""
    for i in range(len(out)):
        out[i] = end[i] if t == 1.0 else begin[i] + t * (end[i] - begin[i])


@compiled
def longest_step(tubes: Array, segments: Ints, begin: Array, end: Array) -> float:
    """The longest step that may be worth a try, as a fraction of the path, for how far tubes may slide in one."""
    N = len(segments)
    longest, slide = 0.0, 0.0
    for j in range(N):
        longest = max(longest, tubes[j, segments[j] - 1, END])
        slide = max(slide, abs(end[N + j] - begin[N + j]))
    return LARGEST_SLIDE * longest / max(slide, 1e-300)


@compiled
def follow(
    kit: Kit, begin: Array, end: Array, clock: Array,
    tolerance: float, raised: int, floor: int, most: int, state: Array, ahead: Array, command: Array,
) -> int:  # fmt: skip
    """Follows ``state`` along the path from the command ``begin`` to ``end``, (alpha, D) (2 N,) each, for at most
    ``most`` tries of a step: OK at its end, FOLD where the branch ends, MORE if there is more to go.

    clock (3,) : fraction of the path, next step and Newton steps so far; to begin with 0, 1, 0.  raised, floor :
    degrees.  ahead : room for a state; command (2 N,) : for a command.  A TOO_SMALL call has done nothing since the
    last good step and may be repeated.
    """
    N = len(kit.segments)
    failed = False
    longest = longest_step(kit.tubes, kit.segments, begin, end)
    for _ in range(most):
        if clock[0] >= 1.0:
            return OK
        clock[1] = min(clock[1], longest, 1.0 - clock[0])
        target = 1.0 if clock[1] >= 1.0 - clock[0] else clock[0] + clock[1]
        command_at(begin, end, target, command)
        came = step(
            kit, state, command[:N], command[N:], tolerance, raised, floor, PATH_SLACK,
            False, False, ahead,
        )  # fmt: skip
        if came == TOO_SMALL:
            return TOO_SMALL
        if came == OK:
            clock[0] = target
            if not failed:  # else the end of the branch may be near, and twice the step was too long
                clock[1] *= 2.0
            failed = False
            clock[2] += ahead[S_STEPS]
            for i in range(len(state)):
                state[i] = ahead[i]
            continue
        clock[1] *= 0.5
        failed = True
        if clock[1] < SHORTEST_STEP:
            return FOLD
        if clock[1] < SHORT_STEP:
            margin = margin_of(kit, state, tolerance)
            if margin < AT_THE_FOLD:
                return FOLD
    return MORE if clock[0] < 1.0 else OK
