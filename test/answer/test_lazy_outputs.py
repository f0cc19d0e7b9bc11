"""An answer owns what its outputs read: whatever is solved after it, and in whichever thread it is read."""

from __future__ import annotations

import pickle
import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from random_robots import random_D
from random_robots import random_robot

from ctr_pvs import Equilibrium
from ctr_pvs import EquilibriumSolver
from ctr_pvs import Loads

TOLERANCE = 1e-6


def outputs(answer: Equilibrium) -> dict[str, np.ndarray]:
    """Everything that an answer tells, each computed when first asked for."""
    s = np.linspace(0.0, answer.length, 9)
    poses = [answer.backbone(9), *(answer.tube_backbone(j, 5) for j in range(len(answer.alpha)))]
    return {
        "tip": np.concatenate([answer.tip.position, answer.tip.orientation]),
        "positions": np.concatenate([one.position for one in poses]),
        "orientations": np.concatenate([one.orientation for one in poses]),
        "torque": answer.torque,
        "forces": answer.force_interval,
        "energy": np.array([answer.energy]),
        "margin": np.array([answer.stability_margin]),
        "reserve": np.array([answer.snap_reserve]),
        "jacobian": answer.jacobian,
        "twist": answer.twist(s),
        "numbers": np.array([answer.residual, answer.error_estimate, answer.degrees_of_freedom, answer.iterations]),
    }


def assert_equal(a: dict[str, np.ndarray], b: dict[str, np.ndarray]) -> None:
    for name, values in a.items():
        assert np.array_equal(values, b[name], equal_nan=True), name


def scene(seed: int, level: str = "auto"):
    """A solver, and commands for it."""
    rng = np.random.default_rng([seed, 17])
    robot = random_robot(rng, 2 + seed % 3)
    commands = [(rng.uniform(-1.5, 1.5, robot.n_tubes), random_D(rng, robot)) for _ in range(201)]
    return EquilibriumSolver(robot, TOLERANCE, level), commands


@pytest.mark.parametrize("level", ["auto", "torsion", "full"])
@pytest.mark.parametrize("seed", range(3))
def test_what_is_solved_later_does_not_change_an_answer(seed, level):
    """Two hundred others, then the outputs of the first, none of which was asked for before."""
    if level == "full" and seed:
        pytest.skip("one is enough: it is slow")
    solver, commands = scene(seed, level)
    fresh, _ = scene(seed, level)
    expected = outputs(fresh.solve(*commands[0]))
    kept = solver.solve(*commands[0])
    for command in commands[1:] if level != "full" else commands[1:6]:
        other = solver.solve(*command)
        if other.success:
            _ = other.tip.position, other.force, other.jacobian
    assert_equal(outputs(kept), expected)


def test_what_is_changed_in_an_output_does_not_change_the_answer():
    solver, commands = scene(1)
    answer = solver.solve(*commands[0])
    expected = outputs(scene(1)[0].solve(*commands[0]))
    alpha, D = answer.state.alpha, answer.state.D
    for array in (answer.tip.position, answer.tip.orientation, answer.torque, answer.backbone(5).position, alpha, D):
        array[...] = 7.0
    assert_equal(outputs(answer), expected)
    again = solver.solve(*commands[0])
    assert again.tip.position == pytest.approx(expected["tip"][:3], abs=1e-12)


def test_an_answer_read_in_another_thread():
    """While the thread that solved it goes on solving."""
    solver, commands = scene(2)
    expected = outputs(scene(2)[0].solve(*commands[0]))
    kept, found = solver.solve(*commands[0]), {}
    reader = threading.Thread(target=lambda: found.update(outputs(kept)))
    reader.start()
    for command in commands[1:80]:
        solver.solve(*command)
    reader.join()
    assert_equal(found, expected)


def test_many_solvers_in_many_threads():
    """Each thread its own solver; every answer is that of a single thread."""
    solver, commands = scene(0)
    answers = [solver.solve(*command, start="cold") for command in commands[:40]]
    expected = [outputs(answer) if answer.success else None for answer in answers]

    def one(index: int):
        answer = EquilibriumSolver(solver.robot, TOLERANCE).solve(*commands[index], start="cold")
        return outputs(answer) if answer.success else None

    with ThreadPoolExecutor(4) as pool:
        for found, own in zip(pool.map(one, range(40)), expected, strict=True):
            assert (found is None) == (own is None)
            if own is not None:
                assert_equal(found, own)


def test_an_answer_that_went_to_another_process_tells_the_same(seed_robot):
    """Asked before and after, and the solver over there goes on from it."""
    here = EquilibriumSolver(seed_robot, TOLERANCE)
    answer = here.solve([0.1, 1.2], [0.09, 0.2], loads=Loads(tip_force=(0.0, 0.1, 0.0)))
    unread = pickle.loads(pickle.dumps(answer))
    told = outputs(answer)
    assert_equal(told, outputs(unread))
    assert_equal(told, outputs(pickle.loads(pickle.dumps(answer))))
    there = EquilibriumSolver(seed_robot, TOLERANCE).fork(unread)
    for solver in (here, there):
        solver.follow([0.1, 1.5], [0.09, 0.2])
    assert_equal(*(outputs(solver.solve([0.1, 1.6], [0.09, 0.2])) for solver in (here, there)))


def test_a_pickled_solver_gives_the_same_bits(seed_robot):
    solver, D = EquilibriumSolver(seed_robot, 1e-6), [0.0935, 0.1705]
    solver.solve([0.0, 1.0], D)
    other = pickle.loads(pickle.dumps(solver))
    for start in ("warm", "cold"):
        here, there = (each.solve([0.0, 1.1], D, start) for each in (solver, other))
        assert here.state.unknowns.tobytes() == there.state.unknowns.tobytes()
        assert here.state.tip.tobytes() == there.state.tip.tobytes()
