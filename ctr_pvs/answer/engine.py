"""One robot and one tolerance, ready for the kernel: its arrays, and a workspace for each thread that asks.

This is the one place where Python meets the kernel.  Arguments become contiguous arrays of floats here; a call that
finds its workspace too small is repeated with a larger one, so nothing is sized by a guess.
"""

from __future__ import annotations

import threading
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.kernel import entries
from ctr_pvs.kernel import outputs
from ctr_pvs.kernel.arrays import CAPACITIES
from ctr_pvs.kernel.arrays import ELEMENTS
from ctr_pvs.kernel.arrays import LOADS
from ctr_pvs.kernel.arrays import NODES
from ctr_pvs.kernel.arrays import SECTIONS
from ctr_pvs.kernel.arrays import STATE
from ctr_pvs.kernel.arrays import UNKNOWNS
from ctr_pvs.kernel.arrays import WIDEST
from ctr_pvs.kernel.walk.step import NOT_PROVEN
from ctr_pvs.kernel.walk.step import TOO_SMALL
from ctr_pvs.kernel.workspace import workspace_sizes
from ctr_pvs.model.packing import packed_robot
from ctr_pvs.model.packing import quadrature_rules
from ctr_pvs.robot.robot import Robot

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Code = int

#: Room for unknowns of a state to begin with, for each tube.
FIRST_UNKNOWNS = 48


#: For a single step.
NO_ROOM, NO_CODES = np.empty((2, 0)), np.empty(0, dtype=np.int64)


class Workspace:
    """The arrays that the kernel works in, of a capacity that only grows."""

    def __init__(self, tubes: int, sections: int) -> None:
        self.tubes = tubes
        self.capacity = np.zeros(CAPACITIES, dtype=np.int64)
        self.capacity[SECTIONS], self.capacity[ELEMENTS] = sections, sections
        self.capacity[NODES], self.capacity[UNKNOWNS] = 12 * sections, 20 * tubes * sections
        self.capacity[WIDEST] = 12 * tubes
        self._allocate()

    def _allocate(self) -> None:
        floats, ints = workspace_sizes(self.tubes, self.capacity)
        self.floats, self.ints = np.zeros(floats), np.zeros(ints, dtype=np.int64)
        self.ints[:CAPACITIES] = self.capacity

    def grow(self) -> bool:
        """Takes on what a call has found missing; false if the workspace was not too small."""
        if self.ints[SECTIONS] >= 0:
            return False
        wanted = self.ints[:CAPACITIES].copy()
        exact = [SECTIONS, LOADS]
        wanted[SECTIONS] = -wanted[SECTIONS]
        # Half as much again: along a path elements come and go.
        capacity = np.maximum(self.capacity, wanted + wanted // 2)
        capacity[exact] = np.maximum(self.capacity, wanted)[exact]
        self.capacity = capacity
        self._allocate()
        return True


class Engine:
    """Calls the kernel for ``robot`` within ``tolerance`` [m].

    A state of the kernel is a vector (see ``kernel.arrays``) that means something to engines of equal robot and
    tolerance only.
    """

    def __init__(self, robot: Robot, tolerance: float) -> None:
        self.robot, self.tolerance = robot, tolerance
        self.tubes, self.segments = packed_robot(robot)
        self.rules = quadrature_rules()
        self.state_size = STATE + (3 + FIRST_UNKNOWNS) * robot.n_tubes
        self._local = threading.local()
        self._relaxed_gain: tuple[bytes, float] | None = None

    def __reduce__(self) -> tuple[type[Engine], tuple[Robot, float]]:
        """Pickled, it is what it was made of: workspaces belong to the threads of one process."""
        return type(self), (self.robot, self.tolerance)

    @property
    def workspace(self) -> Workspace:
        """That of the calling thread."""
        try:
            work: Workspace = self._local.workspace
        except AttributeError:
            work = self._local.workspace = Workspace(self.robot.n_tubes, int(self.segments.sum()) + 1)
        return work

    def fixed(self) -> tuple[Array, Ints, Array, Array, Ints]:
        """What every call of the kernel begins with."""
        work = self.workspace
        return self.tubes, self.segments, self.rules, work.floats, work.ints

    def repeat(self, call: Callable[[], Code]) -> Code:
        """What ``call`` returns, called again with more room as often as it asks for it."""
        while (code := call()) == TOO_SMALL:
            self.grow()
        return code

    def grow(self) -> None:
        """More room for the workspace, or else for states."""
        if not self.workspace.grow():
            self.state_size = 2 * self.state_size

    def step(
        self, last: Array, alpha: Array, D: Array, loads: Array, raised: int = 0, floor: int = 0, slack: float = 0.0,
        untwisted: bool = False, tip: bool = True,
    ) -> tuple[Code, Array]:  # fmt: skip
        """One checked step from the state ``last``, to packed ``loads``: see ``step.step``."""
        while True:
            out = np.empty(self.state_size)
            work = self.workspace
            code = entries.take_steps(
                self.tubes, self.segments, self.rules, work.floats, work.ints, last, alpha, D, loads,
                self.tolerance, raised, floor, slack, untwisted, tip, out, NO_ROOM, NO_CODES,
            )  # fmt: skip
            if code != TOO_SMALL:
                return code, out
            self.grow()

    def cold_rows(self, alpha: Array, D: Array, untwisted: bool, out: Array, codes: Ints) -> None:
        """Cold starts at the commands alpha, D (M, N): the first columns of their states into ``out`` (M, W), what
        ``alone.cold`` says into codes (M,); see ``entries.take_steps``."""
        flat = alpha.reshape(-1), D.reshape(-1)
        self.repeat(
            lambda: entries.take_steps(
                *self.fixed(), flat[0][:0], *flat, flat[0][:0], self.tolerance, 0, 0, 0.0, untwisted, True,
                out.reshape(-1), np.empty((2, max(self.state_size, 7 * self.robot.n_tubes))), codes,
            )
        )  # fmt: skip

    def cold_states(self, alpha: Array, D: Array, untwisted: bool, codes: Ints) -> Array:
        """``cold_rows`` with room for whole states, which are returned (M, W)."""
        given = codes.copy()
        while True:
            size = self.state_size
            states = np.empty((len(codes), size))
            codes[:] = given
            self.cold_rows(alpha, D, untwisted, states, codes)
            if self.state_size == size:
                return states

    def cold_start(self, alpha: Array, D: Array, untwisted: bool) -> tuple[Code, Array]:
        """``cold_states`` for one command."""
        codes = np.full(1, -1, dtype=np.int64)
        states = self.cold_states(alpha, D, untwisted, codes)
        return int(codes[0]), states[0]

    def untwisted(self, alpha: Array, D: Array) -> tuple[Code, Array]:
        """See ``entries.untwisted_state``."""
        out = np.empty(0)

        def call() -> Code:
            nonlocal out
            out = np.empty(self.state_size)
            return entries.untwisted_state(*self.fixed(), alpha, D, self.tolerance, out)

        return self.repeat(call), out

    def relaxed(self, D: Array, degree: int) -> tuple[Code, Array]:
        """See ``entries.relaxed_state``."""
        out, work = np.empty(0), np.empty((7, self.robot.n_tubes))

        def call() -> Code:
            nonlocal out
            out = np.empty(self.state_size)
            return entries.relaxed_state(*self.fixed(), D, self.tolerance, degree, work, out)

        return self.repeat(call), out

    def land(
        self, state: Array, command: Array, clock: Array, degree: int, steps: int, out: Array
    ) -> tuple[Code, Array]:
        """See ``entries.land``; ``out`` is where the flow has come so far, empty to begin with."""

        def call() -> Code:
            nonlocal out
            size = max(self.state_size, len(out))
            if len(out) != size:
                out = np.concatenate([out, np.zeros(size - len(out))])
            return entries.land(*self.fixed(), state, command, clock, self.tolerance, degree, steps, out)

        return self.repeat(call), out

    def margin(self, state: Array) -> float:
        """Stability margin of a state; -1 if it is not stable."""
        while np.isnan(value := outputs.margin(*self.fixed(), state, self.tolerance)):
            self.grow()
        return float(value)

    def loads(self, state: Array) -> Array:
        """See ``outputs.loads``."""
        out = np.zeros((6, self.robot.n_tubes))
        self.repeat(lambda: outputs.loads(*self.fixed(), state, self.tolerance, out))
        return out

    def rates(self, state: Array) -> tuple[Code, Array, Array, Array]:
        """Rates of the tip (6, 2 N + 6) by alpha, D, force and moment on it, turns of the tubes' ends by alpha (N, N)
        and torques and forces by force and moment on the tip (2 N, 6): see ``outputs.jacobian``."""
        N = self.robot.n_tubes
        out, gain, actuation = np.zeros((2 * N + 6, 6)), np.zeros((N, N)), np.zeros((2 * N, 6))
        code = self.repeat(lambda: outputs.jacobian(*self.fixed(), state, self.tolerance, out, gain, actuation))
        return code, out.T, gain, actuation

    def base_wrench(self, state: Array) -> Array:
        """(6,) force [N] and moment [N m] about the orifice of all beyond it: see ``outputs.base_wrench``."""
        out = np.zeros(6)
        self.repeat(lambda: outputs.base_wrench(*self.fixed(), state, self.tolerance, out))
        return out

    def relaxed_gain(self, D: Array, degree: int) -> float:
        """det(d psi_tip / d alpha) of the relaxed robot at D (N,); NaN if no relaxed state was found.  That of the last
        D is kept: at one D it is asked for again and again."""
        kept = self._relaxed_gain
        key = D.tobytes()
        if kept is None or kept[0] != key:
            code, state = self.relaxed(D, degree)
            gain = float("nan") if code == NOT_PROVEN else float(np.linalg.det(self.rates(state)[2]))
            kept = self._relaxed_gain = key, gain
        return kept[1]

    def poses(self, state: Array, s: Array, tube: int = -1) -> tuple[Array, Array]:
        """See ``outputs.backbone``."""
        position, orientation = np.empty((len(s), 3)), np.empty((len(s), 4))
        self.repeat(lambda: outputs.backbone(*self.fixed(), state, self.tolerance, tube, s, position, orientation))
        return position, orientation

    def angles(self, state: Array, s: Array) -> tuple[Array, Array]:
        """psi (n, N) [rad] and torques (n, N) [N m] at arc lengths s (n,) [m]: see ``outputs.angles``."""
        N = self.robot.n_tubes
        psi, torque = np.empty((len(s), N)), np.empty((len(s), N))
        self.repeat(lambda: outputs.angles(*self.fixed(), state, self.tolerance, s, psi, torque))
        return psi, torque

    def elements(self, state: Array) -> Array:
        """(M, 4) start and end [m], 1 where fields vary inside, degree: see ``outputs.elements``."""
        out = np.empty((0, 4))
        while (count := outputs.elements(*self.fixed(), state, self.tolerance, out)) != len(out):
            if count < 0:
                self.grow()
            else:
                out = np.empty((count, 4))
        return out

    def describe(self, state: Array) -> Array:
        """See ``outputs.describe``."""
        out = np.empty(0)

        def call() -> Code:
            nonlocal out
            out = np.empty(self.state_size)
            return outputs.describe(*self.fixed(), state, self.tolerance, out)

        self.repeat(call)
        return out

    def blank(self, alpha: Array, D: Array, degree: int) -> Array:
        """See ``entries.blank_state``."""
        out = np.empty(0)

        def call() -> Code:
            nonlocal out
            out = np.empty(self.state_size)
            return entries.blank_state(*self.fixed(), alpha, D, self.tolerance, degree, out)

        self.repeat(call)
        return out

    def dense_map(self, state: Array, unknowns: int) -> tuple[Array, NDArray[np.complex128], Array, Array]:
        """Angle map (G N, U), moment (G, N), share and place (G,): see ``outputs.dense_map``."""
        N, count = self.robot.n_tubes, 0
        while True:
            out, moment = np.empty((count * N, unknowns)), np.empty((count, N), dtype=complex)
            share, place = np.empty(count), np.empty(count)
            found = outputs.dense_map(*self.fixed(), state, self.tolerance, out, moment, share, place)
            if found == count:
                return out, moment, share, place
            if found < 0:
                self.grow()
            else:
                count = found
