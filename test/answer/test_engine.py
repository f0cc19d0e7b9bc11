"""Where Python meets the kernel: calls that find no room are repeated with more, and nothing shows of it."""

from __future__ import annotations

import numpy as np
import pytest
from random_robots import random_D
from random_robots import random_robot

from ctr_pvs import EquilibriumSolver
from ctr_pvs.answer.engine import Engine
from ctr_pvs.answer.engine import Workspace
from ctr_pvs.kernel.arrays import S_FLOOR
from ctr_pvs.kernel.arrays import S_RAISED
from ctr_pvs.kernel.arrays import S_UNKNOWNS
from ctr_pvs.kernel.arrays import STATE
from ctr_pvs.kernel.walk.step import MORE
from ctr_pvs.kernel.walk.step import OK
from ctr_pvs.solve.dense import DenseEnergy

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
    """Degrees, command, torques and unknowns of a state: what every state has, and what lies past it is no part of
    it."""
    return np.concatenate(
        [state[[S_RAISED, S_FLOOR, S_UNKNOWNS]], state[STATE : STATE + 3 * N + int(state[S_UNKNOWNS])]]
    )


def both(robot):
    """A roomy engine and the maker of a cramped one: each call meets a new one, so that none profits from another."""
    return Engine(robot, TOLERANCE), lambda: cramped(Engine(robot, TOLERANCE))


@pytest.mark.parametrize("seed", range(8))
def test_every_call_finds_its_room(seed):
    rng = np.random.default_rng([seed, 71])
    robot = random_robot(rng, 1 + seed % 4)
    N = robot.n_tubes
    alpha, D = rng.uniform(-1.0, 1.0, N), random_D(rng, robot)
    roomy, make = both(robot)
    code, vector = roomy.cold_start(alpha, D, False)
    assert code in (OK, MORE)
    used = vector[: STATE + 3 * N + int(vector[S_UNKNOWNS])]
    again, other = make().cold_start(alpha, D, False)
    assert again == code and np.array_equal(other[: len(used)], used)
    state = used.copy()
    nearby = alpha + 0.01 * np.arange(N), np.minimum(D + 1e-4, [tube.length for tube in robot.tubes])
    s = np.linspace(0.0, robot.length_beyond(D), 7)
    end, begin = np.concatenate(nearby), np.concatenate([alpha, D])

    def followed(engine):
        engine.state_size = max(engine.state_size, len(state))
        clock = np.array([0.0, 1.0, 0.0])
        code, reached = engine.follow(begin, end, clock, 5, 200, state)
        return code, reached, clock

    calls = [
        lambda engine: engine.advance(state, *nearby, True),
        lambda engine: engine.untwisted(alpha, D),
        lambda engine: engine.settle(state, False),
        lambda engine: engine.relaxed(D, 5),
        lambda engine: engine.margin(state),
        lambda engine: engine.loads(state),
        lambda engine: engine.rates(state),
        lambda engine: engine.poses(state, s),
        lambda engine: engine.angles(state, s),
        lambda engine: engine.elements(state),
        lambda engine: engine.describe(state),
        lambda engine: engine.describe(engine.blank(alpha, D, 9)),  # torques are not a blank state's own
        lambda engine: engine.dense_map(state, int(state[S_UNKNOWNS])),
        followed,
    ]
    for call in calls:
        expected, found = call(roomy), call(make())
        if not isinstance(expected, tuple):
            expected, found = (expected,), (found,)
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
