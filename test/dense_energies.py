"""The whole energy of a scene in plain numpy, for comparison: of an answer's own degrees, or of a random state."""

from __future__ import annotations

import numpy as np
from random_robots import random_D
from random_robots import random_robot

from ctr_pvs import Equilibrium
from ctr_pvs.answer.engine import Engine
from ctr_pvs.answer.state import State
from ctr_pvs.model.sections import ABSENT
from ctr_pvs.model.sections import piecewise_domain
from ctr_pvs.solve.dense import DenseEnergy

#: Unknowns of every tube in an element that only check the others.
FINER = 2


def energy_of(engine: Engine, state: State) -> DenseEnergy:
    """The energy in the unknowns of ``state``, whatever degrees it has."""
    energy = DenseEnergy.__new__(DenseEnergy)
    energy.engine, energy.D, energy.degree, energy.n = engine, state.D, 0, len(state.unknowns)
    energy.angle_map, energy.moment, energy.coupling, energy.place = engine.dense_map(state.vector, energy.n)
    energy.angle_map = energy.angle_map.reshape(*energy.moment.shape, energy.n)
    return energy


def energy_of_answer(answer: Equilibrium) -> DenseEnergy:
    return energy_of(answer._engine, answer.state)


def solved_for(engine: Engine, state: State) -> np.ndarray:
    """(U,) true for the unknowns that are solved for; the others only check."""
    domain = piecewise_domain(engine.robot, state.D)
    elements = engine.elements(state.vector)
    last = np.flatnonzero(elements[:, 2])[-1] if elements[:, 2].any() else -1
    mask = [True] * engine.robot.n_tubes
    for m, (start, end, coupled, degree) in enumerate(elements.tolist()):
        section = domain.locate(np.array([0.5 * (start + end)]))[0]
        for tube, index in zip(engine.robot.tubes, domain.segment[section], strict=True):
            if index == ABSENT or m > last:
                continue
            if coupled and not tube.segments[index].is_straight:
                mask += [True] * (int(degree) + 1) + [False] * FINER
            else:
                mask.append(True)
    return np.array(mask)


def random_scene(seed: int, tubes: int, degree: int = 4, strength: float = 1.0, twist: float = 0.3):
    """The energy of a random robot at a random D, random base angles, and random unknowns that are no equilibrium but
    twist no tube by much more than ``twist`` [rad]."""
    rng = np.random.default_rng([seed, tubes, 7])
    robot = random_robot(rng, tubes, strength)
    energy = DenseEnergy(Engine(robot, 1e-5), random_D(rng, robot), degree)
    y = rng.standard_normal(energy.n)
    size = energy.twist_size(y)
    return energy, rng.uniform(-2.0, 2.0, tubes), twist / size * y if size else 0.01 * y
