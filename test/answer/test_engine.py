"""Where Python meets the kernel: calls that find no room are repeated with more, and nothing shows of it."""

from __future__ import annotations

import numpy as np
import pytest
from random_robots import random_D
from random_robots import random_robot

from ctr_pvs import EquilibriumSolver
from ctr_pvs import Robot
from ctr_pvs.answer.degrees import settled
from ctr_pvs.answer.engine import Engine
from ctr_pvs.answer.engine import Workspace
from ctr_pvs.answer.state import State
from ctr_pvs.kernel.arrays import S_FLOOR
from ctr_pvs.kernel.arrays import S_LOADS
from ctr_pvs.kernel.arrays import S_RAISED
from ctr_pvs.kernel.arrays import S_UNKNOWNS
from ctr_pvs.kernel.arrays import STATE
from ctr_pvs.kernel.walk.step import MORE
from ctr_pvs.kernel.walk.step import NOT_PROVEN
from ctr_pvs.kernel.walk.step import OK
from ctr_pvs.model.packing import packed_loads
from ctr_pvs.robot.loads import Loads
from ctr_pvs.robot.loads import PointForce
from ctr_pvs.solve.dense import DenseEnergy
from ctr_pvs.solve.path import NO_LOADS
from ctr_pvs.solve.path import CommandPath
from ctr_pvs.solve.path import follow

TOLERANCE = 1e-7


def cramped(engine: Engine) -> Engine:
    """``engine`` with no room for anything, as if it had just been made for a far simpler robot."""
    small = Workspace(engine.robot.n_tubes, int(engine.segments.sum()) + 1)
    small.capacity[1:] = 1
    small._allocate()
    engine._local.workspace = small
    engine._local.room = None
    engine.state_size = 3 * engine.robot.n_tubes + 20
    return engine


def told(state: np.ndarray, N: int) -> np.ndarray:
    """Degrees, command, torques, loads and unknowns of a state: what every state has, and what lies past it is no part
    of it."""
    return np.concatenate(
        [
            state[[S_RAISED, S_FLOOR, S_LOADS, S_UNKNOWNS]],
            state[STATE : STATE + 3 * N + int(state[S_LOADS] + state[S_UNKNOWNS])],
        ]
    )


def some_loads(robot: Robot) -> Loads:
    """Of all kinds: on the tip, on a point in the middle of what is mostly beyond the orifice, along a tube."""
    last = robot.n_tubes - 1
    point = PointForce(last, robot.tubes[last].length - 1e-3, (0.0, 0.01, 0.02), (0.0, 1e-4, 0.0))
    return Loads((0.0, 0.02, 0.01), (1e-4, 2e-4, 0.0), (point,), {last: (0.0, 0.1, 0.1)})


def both(robot):
    """A roomy engine and the maker of a cramped one: each call meets a new one, so that none profits from another."""
    return Engine(robot, TOLERANCE), lambda: cramped(Engine(robot, TOLERANCE))


def trimmed(vector: np.ndarray, N: int) -> np.ndarray:
    """A state without the room behind it."""
    return vector[: STATE + 3 * N + int(vector[S_LOADS] + vector[S_UNKNOWNS])].copy()


@pytest.mark.parametrize("seed", range(8))
def test_every_call_finds_its_room(seed):
    """With and without loads."""
    rng = np.random.default_rng([seed, 71])
    robot = random_robot(rng, 1 + seed % 4)
    N = robot.n_tubes
    alpha, D = rng.uniform(-1.0, 1.0, N), random_D(rng, robot)
    roomy, make = both(robot)
    answer = EquilibriumSolver(robot, TOLERANCE, fidelity="torsion").solve(alpha, D)
    assert answer.success, answer.message
    free = trimmed(answer.state.vector, N)
    loads = packed_loads(robot, D, some_loads(robot))
    code, vector = roomy.step(free, alpha, D, loads)
    assert code == OK and vector[S_LOADS] == len(loads) > 0
    loaded = trimmed(vector, N)
    nearby = alpha + 0.01 * np.arange(N), np.minimum(D + 1e-4, [tube.length for tube in robot.tubes])
    s = np.linspace(0.0, robot.length_beyond(D), 7)

    def followed(engine, path, state):
        followed = follow(engine, path, State(state, N), 5, np.inf)
        return followed.state.vector, followed.t, followed.iterations

    def of_any(state, acting):
        path = CommandPath(alpha, D, *nearby, acting, acting)
        return [
            lambda engine: engine.step(state, *nearby, acting, untwisted=True),
            lambda engine: settled(engine, state, acting, False),
            lambda engine: engine.margin(state),
            lambda engine: engine.loads(state),
            lambda engine: engine.base_wrench(state),
            lambda engine: engine.rates(state),
            lambda engine: engine.poses(state, s),
            lambda engine: engine.angles(state, s),
            lambda engine: engine.elements(state),
            lambda engine: engine.describe(state),
            lambda engine: engine.dense_map(state, int(state[S_UNKNOWNS])),
            lambda engine: followed(engine, path, state),
        ]

    calls = [
        lambda engine: engine.cold_start(alpha, D, False),
        lambda engine: engine.untwisted(alpha, D),
        lambda engine: engine.relaxed(D, 5),
        lambda engine: engine.describe(engine.blank(alpha, D, 9)),  # torques are not a blank state's own
        lambda engine: engine.step(free, alpha, D, loads),
        *of_any(free, NO_LOADS),
        *of_any(loaded, loads),
    ]
    for call in calls:
        expected, found = call(roomy), call(make())
        if not isinstance(expected, tuple):
            expected, found = (expected,), (found,)
        if isinstance(expected[0], int) and expected[0] == NOT_PROVEN:  # what comes with it means nothing
            expected, found = expected[:1], found[:1]
        for a, b in zip(expected, found, strict=True):
            a, b = np.atleast_1d(a), np.atleast_1d(b)
            if a.ndim == 1 and len(a) > STATE + 3 * N:
                a, b = told(a, N), told(b, N)
            assert np.array_equal(a, b, equal_nan=True)


def test_landings_find_their_room(seed_robot):
    solver = EquilibriumSolver(seed_robot, 1e-6)
    D = [0.0935, 0.2085]
    solver.solve([0.0, 4.8], D)
    before = solver.follow([0.0, np.radians(283)], D).snaps[0]
    command = np.concatenate([before.alpha, before.D]) + 1e-6 * np.eye(4)[1]
    landings = []
    for make in (lambda: Engine(seed_robot, 1e-6), lambda: cramped(Engine(seed_robot, 1e-6))):
        engine, clock, out, code = make(), np.zeros(5), np.empty(0), MORE
        while code == MORE:
            code, out = engine.land(before.before.vector, command, clock, 9, 7, out)
        assert code == OK
        landings.append((told(out, 2), clock))
    assert np.array_equal(landings[0][0], landings[1][0]) and np.array_equal(landings[0][1], landings[1][1])


@pytest.mark.parametrize("seed", range(4))
def test_a_blank_state_has_no_twist_and_its_energy_can_be_put_on(seed):
    rng = np.random.default_rng([seed, 72])
    robot = random_robot(rng, 2 + seed % 3)
    D = random_D(rng, robot)
    engine = Engine(robot, TOLERANCE)
    for degree in (3, 9, 20):
        energy = DenseEnergy(engine, D, degree)
        elements = engine.elements(energy.state(np.zeros(energy.n), np.zeros(robot.n_tubes)).vector)
        assert np.all(elements[elements[:, 2] > 0.0, 3] >= degree)
        assert np.array_equal(elements[1:, 0], elements[:-1, 1])
        assert elements[-1, 1] == pytest.approx(engine.robot.length_beyond(D), abs=1e-12)
