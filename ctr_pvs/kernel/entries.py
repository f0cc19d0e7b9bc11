"""The functions of the kernel that the rest of the package calls.

All take the same five arrays first: tubes, segments (the robot), rules, floats, ints (one thread's workspace); see
``arrays``.  TOO_SMALL means that the workspace must grow to what ``ints`` then says, and the call be repeated.
"""

from __future__ import annotations

import math

from ctr_pvs.kernel.arrays import MOMENTS
from ctr_pvs.kernel.arrays import N_UNKNOWNS
from ctr_pvs.kernel.arrays import OTHER
from ctr_pvs.kernel.arrays import RIGID
from ctr_pvs.kernel.arrays import STATE
from ctr_pvs.kernel.arrays import TWISTED
from ctr_pvs.kernel.arrays import Array
from ctr_pvs.kernel.arrays import Ints
from ctr_pvs.kernel.arrays import Kit
from ctr_pvs.kernel.arrays import Y
from ctr_pvs.kernel.carry import carry
from ctr_pvs.kernel.carry import drop_finer
from ctr_pvs.kernel.compiler import compiled
from ctr_pvs.kernel.compiler import entry_point
from ctr_pvs.kernel.layout import holds
from ctr_pvs.kernel.layout import prepare
from ctr_pvs.kernel.sections import FINER
from ctr_pvs.kernel.twist.condensation import factorize
from ctr_pvs.kernel.twist.element import EXACT
from ctr_pvs.kernel.twist.element import energy_gradient
from ctr_pvs.kernel.twist.element import energy_value
from ctr_pvs.kernel.twist.fields import FINE
from ctr_pvs.kernel.twist.flow import AT_REST
from ctr_pvs.kernel.twist.flow import NUDGE
from ctr_pvs.kernel.twist.flow import flow
from ctr_pvs.kernel.twist.flow import soften
from ctr_pvs.kernel.twist.newton import twist_size
from ctr_pvs.kernel.twist.relaxed import relax
from ctr_pvs.kernel.walk.alone import cold
from ctr_pvs.kernel.walk.step import MORE
from ctr_pvs.kernel.walk.step import NOT_PROVEN
from ctr_pvs.kernel.walk.step import OK
from ctr_pvs.kernel.walk.step import TOO_SMALL
from ctr_pvs.kernel.walk.step import finish
from ctr_pvs.kernel.walk.step import open_state
from ctr_pvs.kernel.walk.step import step
from ctr_pvs.kernel.walk.step import write_state
from ctr_pvs.kernel.workspace import kit_of

WORKSPACE = "float64[:, :, ::1], int64[::1], float64[:, :, ::1], float64[::1], int64[::1]"


@entry_point(
    f"int64({WORKSPACE}, float64[::1], float64[::1], float64[::1], float64[::1], float64, int64, int64, float64, "
    "boolean, boolean, float64[::1], float64[:, ::1], int64[::1])"
)
def take_steps(
    tubes: Array, segments: Ints, rules: Array, floats: Array, ints: Ints, last: Array, alpha: Array, D: Array,
    loads: Array, tolerance: float, raised: int, floor: int, slack: float, untwisted: bool, tip: bool, out: Array,
    room: Array, codes: Ints,
) -> int:  # fmt: skip
    """One step or many cold starts: one entry point, so that steps are compiled once.

    Without ``codes``, from the state ``last`` to the command (alpha, D) and packed ``loads`` in one step that is
    checked; see ``step.step``.  With codes (M,), cold starts at the commands alpha, D (M N,) without loads: the first
    numbers of their states into ``out`` (M W,), what ``alone.cold`` says into ``codes``; room (2, R) : for states.
    Rows whose code is not -1 are passed over, so that a TOO_SMALL call can be repeated.
    """
    kit = kit_of(tubes, segments, rules, floats, ints)
    if len(codes) == 0:
        return step(kit, last, alpha, D, loads, tolerance, raised, floor, slack, untwisted, tip, out)
    N, width = len(segments), len(out) // len(codes)
    for row in range(len(codes)):
        if codes[row] >= 0:
            continue
        a = row * N
        came = cold(kit, alpha[a : a + N], D[a : a + N], tolerance, untwisted, room[0], room[1])
        if came == TOO_SMALL:
            return TOO_SMALL
        codes[row] = came
        for i in range(min(width, room.shape[1])):
            out[row * width + i] = room[1, i]
    return OK


@entry_point(f"int64({WORKSPACE}, float64[::1], float64[::1], float64, float64[::1])")
def untwisted_state(
    tubes: Array, segments: Ints, rules: Array, floats: Array, ints: Ints, alpha: Array, D: Array, tolerance: float,
    out: Array,
) -> int:  # fmt: skip
    """The state without twist at (alpha, D), eq. (28)-(31), and the estimate of what it neglects; NOT_PROVEN where it
    is not stable."""
    kit = kit_of(tubes, segments, rules, floats, ints)
    scene, bench = kit.scenes[0], kit.bench
    if not prepare(kit, scene, D, alpha[:0], tolerance, 0, 0):
        return TOO_SMALL
    for u in range(scene.counts[N_UNKNOWNS]):
        scene.vectors[Y, u] = 0.0
    energy_gradient(scene, bench, tubes, rules, alpha)
    if not factorize(scene, bench, rules, FINE, EXACT, 0.0, 0.0, -1.0):
        return NOT_PROVEN
    if not write_state(scene, alpha, 0, RIGID, out):
        return TOO_SMALL
    finish(scene, bench, tubes, rules, alpha, math.inf, tolerance, out)
    return OK


@entry_point(f"int64({WORKSPACE}, float64[::1], float64, int64, float64[:, ::1], float64[::1])")
def relaxed_state(
    tubes: Array, segments: Ints, rules: Array, floats: Array, ints: Ints, D: Array, tolerance: float, floor: int,
    work: Array, out: Array,
) -> int:  # fmt: skip
    """The relaxed robot at D: OK, MORE if others are as near to zero base angles, NOT_PROVEN if none was found.

    work (7, N) : room."""
    kit = kit_of(tubes, segments, rules, floats, ints)
    scene, bench = kit.scenes[0], kit.bench
    if not prepare(kit, scene, D, D[:0], tolerance, 0, floor):
        return TOO_SMALL
    found = relax(scene, bench, tubes, rules, work[6], work)
    if found == 0:
        return NOT_PROVEN
    if not write_state(scene, work[6], 0, TWISTED, out):
        return TOO_SMALL
    return OK if found == 1 else MORE


@entry_point(f"int64({WORKSPACE}, float64[::1], float64[::1], float64[::1], float64, int64, int64, float64[::1])")
def land(
    tubes: Array, segments: Ints, rules: Array, floats: Array, ints: Ints, state: Array, command: Array, clock: Array,
    tolerance: float, floor: int, most: int, out: Array,
) -> int:  # fmt: skip
    """Where the gradient flow from ``state`` lands at ``command``, alpha, D and packed loads, just past the fold, into
    ``out``.

    OK at a stable equilibrium; NOT_PROVEN if the state is still held there, or does not come to rest; MORE if there is
    more to go after ``most`` steps: then ``out`` is where it is.  clock (5,) : see ``flow.flow``, to begin with zeros;
    then energies [J] before and after, NaN where point
    moments act.
    """
    kit = kit_of(tubes, segments, rules, floats, ints)
    N = len(segments)
    alpha, D, loads = command[:N], command[N : 2 * N], command[2 * N :]
    begun = clock[2] > 0.0
    came = step_aside(kit, out if begun else state, D, loads, tolerance, floor)
    if came < 0:
        return TOO_SMALL
    scene, bench = kit.scenes[came], kit.bench
    drop_finer(scene, FINER)  # the path was followed without them, and its landing is to be
    if not begun:
        clock[0], clock[1], clock[2], clock[3] = 0.0, 0.1, AT_REST, energy_value(scene, tubes, rules, alpha)
        soften(scene, bench, tubes, rules, alpha)
        for u in range(scene.counts[N_UNKNOWNS]):
            scene.vectors[Y, u] += scene.vectors[OTHER, u]
    ended = flow(scene, bench, tubes, rules, alpha, clock, most)
    if not write_state(scene, alpha, 0, TWISTED, out):
        clock[2] = 0.0
        return TOO_SMALL
    if ended < 1:
        return MORE if ended == 0 else NOT_PROVEN
    clock[4] = energy_value(scene, tubes, rules, alpha)
    if scene.counts[MOMENTS] > 0:
        clock[3], clock[4] = math.nan, math.nan
    came = step_aside(kit, state, D, loads, tolerance, floor)
    if came < 0:
        return TOO_SMALL
    scene = kit.scenes[came]
    for u in range(scene.counts[N_UNKNOWNS]):
        scene.vectors[OTHER, u] = out[STATE + 3 * N + len(loads) + u] - scene.vectors[Y, u]
    return OK if twist_size(scene, scene.vectors[OTHER], FINE) > NUDGE else NOT_PROVEN


@compiled
def step_aside(
    kit: Kit, state: Array, D: Array, loads: Array,
    tolerance: float, floor: int,
) -> int:  # fmt: skip
    """Carries ``state`` to D and packed ``loads`` as it is; the scene that then holds it, -1 if the workspace is too
    small."""
    from_scene = open_state(kit, state, tolerance)
    if from_scene < 0:
        return -1
    old, new = kit.scenes[from_scene], kit.scenes[1 - from_scene]
    if holds(old, D, loads, 0, floor):
        return from_scene
    if not prepare(kit, new, D, loads, tolerance, 0, floor):
        return -1
    carry(old, new, kit.rules)
    return 1 - from_scene


@entry_point(f"int64({WORKSPACE}, float64[::1], float64[::1], float64, int64, float64[::1])")
def blank_state(
    tubes: Array, segments: Ints, rules: Array, floats: Array, ints: Ints, alpha: Array, D: Array, tolerance: float,
    floor: int, out: Array,
) -> int:  # fmt: skip
    """A state at (alpha, D) with degrees of at least ``floor`` and no twist, not solved for."""
    kit = kit_of(tubes, segments, rules, floats, ints)
    scene = kit.scenes[0]
    if not prepare(kit, scene, D, alpha[:0], tolerance, 0, floor):
        return TOO_SMALL
    for u in range(scene.counts[N_UNKNOWNS]):
        scene.vectors[Y, u] = 0.0
    return OK if write_state(scene, alpha, 0, TWISTED, out) else TOO_SMALL
