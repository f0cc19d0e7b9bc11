"""What is said of right and wrong answers under loads: answers of the boundary-value model, judged as a solver's."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest
from loaded_cases import robot_of
from scipy.spatial.transform import Rotation

from bench.loaded import random_loaded_sweeps
from bench.loaded.loaded_judge import LoadedPath
from bench.loaded.random_loaded_sweeps import Sweep
from bench.loaded.random_loaded_sweeps import judged
from bench.loaded.random_loaded_sweeps import random_sweep
from ctr_pvs.answer.status import Status
from ctr_pvs.oracles.loaded_model import LoadedSolution
from ctr_pvs.oracles.loaded_path import along_path
from ctr_pvs.robot.loads import Loads

SEED, FULL, NONE = robot_of("seed"), np.array([0.0935, 0.2085]), Loads()
SIDE = Loads(tip_force=(0.0, 1.0, 0.0))
ORIFICE = [0.0, 0.0]


@dataclass(frozen=True, eq=False)
class Answer:
    """A solution, read as an answer is; ``whole_turns`` are added to its twist angles."""

    solution: LoadedSolution
    snaps: tuple = ()
    whole_turns: tuple[int, int] = (0, 0)
    success: bool = True
    status: Status = Status.OK
    message: str = ""
    stability_margin: float = 0.1

    @property
    def tip(self):
        return SimpleNamespace(position=self.solution.tip)

    def twist(self, s):
        return self.solution.angles_at(s) + 2.0 * np.pi * np.array(self.whole_turns)

    def backbone_at(self, s):
        psi = self.solution.angles_at(s)[:, self.solution.problem.leader]
        frames = Rotation.from_matrix(self.solution.frames(s)) * Rotation.from_rotvec(np.outer(psi, [1.0, 0.0, 0.0]))
        return SimpleNamespace(orientation=frames.as_quat())


class Answering:
    """A solver that gives the answers it is told to give."""

    def __init__(self, cold: Answer, warm: Answer | None = None) -> None:
        self.cold, self.warm = cold, warm

    def solve(self, alpha, D, *, loads=None):
        return self.cold

    def follow(self, alpha, D, *, loads=None):
        return self.warm


def at(degrees: float, loads: Loads = NONE, **told) -> Answer:
    """The answer of a cold start at an angle of the inner tube."""
    solution = along_path(SEED, turned(degrees), FULL, loads, ORIFICE, rtol=1e-9)
    assert solution.success
    return Answer(solution, **told)


def turned(degrees: float) -> np.ndarray:
    return np.array([0.0, np.radians(degrees)])


def sweep(end: float, loads: Loads = NONE, begin: float = 0.0) -> Sweep:
    return Sweep(SEED, LoadedPath(turned(begin), FULL, loads, turned(end), FULL, loads))


@pytest.fixture(scope="module")
def start() -> Answer:
    """At 0 deg without loads."""
    return at(0.0)


@pytest.fixture(scope="module")
def loaded_start() -> Answer:
    return at(0.0, SIDE)


def test_right(start, loaded_start):
    verdict = judged(sweep(270.0, SIDE), Answering(loaded_start, at(270.0, SIDE)), Answering(start))
    assert (verdict.found, verdict.remark) == ("right", "") and verdict.tip_error < 1e-9


def test_another_branch(start):
    """At 275 deg there is a second stable state, that of -85 deg."""
    other = at(-85.0, whole_turns=(0, 1))
    verdict = judged(sweep(275.0), Answering(start, other), Answering(start))
    assert verdict.found == "WRONG BRANCH" and "judge ended at 1.0000, apart" in verdict.remark


@pytest.mark.soak
def test_a_snap_that_is_told_and_one_that_is_not(start, loaded_start, monkeypatch):
    """With 1 N to the side the branch ends at 297.19 deg; the robot falls to the branch of -60 deg."""
    monkeypatch.setattr(random_loaded_sweeps, "told", lambda answer, state: state)
    there = at(-60.0, SIDE, whole_turns=(0, 1))
    landing = at(297.2 - 360.0, SIDE, whole_turns=(0, 1))

    def verdict(**told):
        answer = Answer(there.solution, whole_turns=(0, 1), **told)
        return judged(sweep(300.0, SIDE), Answering(loaded_start, answer), Answering(start))

    def snap(degrees: float, released: float = 0.01):
        return SimpleNamespace(t=degrees / 300.0, after=landing, energy_released=released)

    assert verdict(snaps=(snap(297.2),)).found == "flagged snap"
    unflagged = verdict()
    assert unflagged.found == "WRONG BRANCH" and "judge ended at 0.990" in unflagged.remark
    early = verdict(snaps=(snap(280.0),))
    assert early.found == "WRONG BRANCH" and "snap at 0.9333" in early.remark
    assert "gains energy" in verdict(snaps=(snap(297.2, -0.01),)).remark


def test_a_cold_start_on_another_branch():
    """The ramp of loads is judged from the unloaded cold start."""
    other = at(-85.0, SIDE, whole_turns=(0, 1))
    verdict = judged(sweep(275.0, SIDE, 275.0), Answering(other, other), Answering(at(275.0)))
    assert verdict.found == "WRONG BRANCH" and verdict.remark.startswith("cold: apart")


def test_an_unstable_answer(start):
    """Above 7.42 N the planar state at 0 deg still solves the equations, but falls sideways."""
    up = Loads(tip_force=(0.0, 0.0, 8.0))
    assert judged(sweep(0.0, up), Answering(at(0.0, up)), Answering(start)).found == "UNSTABLE"
    held = Loads(tip_force=(0.0, 0.0, 7.0))
    stable = at(0.0, held)
    assert judged(sweep(0.0, held), Answering(stable, stable), Answering(start)).found == "right"


def test_no_answer(start):
    failed = Answer(start.solution, success=False, status=Status.TIMEOUT, message="out of time")
    assert judged(sweep(10.0), Answering(failed), Answering(start)).remark.startswith("cold: ")
    verdict = judged(sweep(10.0), Answering(start, failed), Answering(start))
    assert verdict.found == "honest failure" and verdict.remark.endswith("out of time")


def test_sweeps_are_of_many_kinds():
    """Commands and loads that can be taken; the same seed is the same sweep."""
    seen = []
    for seed in range(60):
        path, robot = random_sweep(seed).path, random_sweep(seed).robot
        for t in (0.0, 0.5, 1.0):
            alpha, D, loads = path.at(t)
            robot.check_command(alpha, D)
            assert all(D[point.tube] < point.X for point in loads.point_forces)
        loads = path.loads_end
        seen.append(
            (robot.n_tubes, path.loads == loads, path.loads.is_none, loads.has_moments, bool(loads.line_forces))
        )
        seen[-1] += (bool(loads.point_forces), np.array_equal(path.D, path.D_end))
    assert all(len(set(kind)) == 2 for kind in zip(*seen, strict=True))
    assert random_sweep(7).path.at(0.3)[2] == random_sweep(7).path.at(0.3)[2]
