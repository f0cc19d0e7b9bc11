"""Who is right: every answer against the exact equilibria of its command.

``PairJudge`` knows all equilibria of two tubes in closed form (``ctr_pvs.oracles.two_tubes``), and how many unstable
directions each has from an integration back from the tip (``ctr_pvs.oracles.tip_curve``); neither uses the solver's
energy or its path following. ``FineJudge`` takes robots of three tubes: the stability of an answer is that of the
energy Hessian at a much higher degree, and the branch is followed by steps so small that no certificate is needed."""

from __future__ import annotations

from abc import ABC
from abc import abstractmethod
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from bench.common.dense import FixedDegree
from bench.stability.methods import Answer
from ctr_pvs import Robot
from ctr_pvs.oracles.standard_model import AngleField
from ctr_pvs.oracles.two_tubes import two_tube_parameters
from ctr_pvs.solve.equilibria import stationary
from ctr_pvs.solve.equilibria import tip_curve

Array = NDArray[np.float64]

TURN = 2.0 * np.pi
#: An answer farther than this [rad] from every equilibrium is none.
SAME = 0.01
#: Degree of the finer model of the second judge.
JUDGE_DEGREE = 16
#: Its steps [rad of relative rotation], the shortest of them, and how far [rad] a step may lie from its prediction.
FINE_STEP, FINEST_STEP, ROOM = 0.025, 1e-7, 0.05


class Outcome(Enum):
    """What an answer was, from good to bad."""

    RIGHT = "right branch"
    SNAP = "flagged snap"
    FAILURE = "reported failure"
    RESUMED = "elsewhere after a failure"
    FALSE_ALARM = "flagged snap, no fold"
    WRONG = "silent wrong branch"
    UNSTABLE = "silent unstable"
    NOTHING = "not an equilibrium"


class Kind(Enum):
    """A state that is no stable equilibrium."""

    UNSTABLE = "unstable"
    NOTHING = "nothing"


class Judge(ABC):
    """Tells the branches of one robot at one D apart; ``commands`` (M, N) are the alphas of the sweep [rad]."""

    def __init__(self, robot: Robot, D: Array, commands: Array) -> None:
        self.robot, self.D, self.commands = robot, D, commands

    @abstractmethod
    def locate(self, field: AngleField, k: int) -> int | Kind:
        """The stable branch of a state at command ``k``; branch 0 sets out from the relaxed robot."""

    @abstractmethod
    def alive(self, branch: int, k: int) -> bool:
        """Whether a branch exists up to command ``k``."""


class PairJudge(Judge):
    """Branches are numbered by the whole turns of the tip."""

    def __init__(self, robot: Robot, D: Array, commands: Array) -> None:
        super().__init__(robot, D, commands)
        self.pair = two_tube_parameters(robot, D)
        fold = self.pair.snap
        self.tip_end, self.alpha_end = (np.inf, np.inf) if fold is None else (fold.theta_tip, fold.alpha)
        self.ends = np.array([0.0, min(tube.length - d for tube, d in zip(robot.tubes, D, strict=True))])
        curve = tip_curve(robot, D)
        stable = [branch for branch in curve.branches if branch.stable]
        reach = max(np.abs(branch.theta_tip).max() for branch in stable)
        if len(stable) != 1 or (fold is not None and abs(reach - fold.theta_tip) > 1e-6):
            raise RuntimeError("the two judges disagree about the stable branch")

    def locate(self, field: AngleField, k: int) -> int | Kind:
        at_base, at_tip = np.diff(field.angles_at(self.ends), axis=1)[:, 0]
        tips = self.pair.equilibria(float(np.diff(self.commands[k])[0]))
        error = np.maximum(np.abs(self.pair.base(tips)[0] - at_base), np.abs(tips - at_tip))
        nearest = int(np.argmin(error))
        if error[nearest] > SAME:
            return Kind.NOTHING
        if self.pair.snap is None:
            return 0
        turns = round(tips[nearest] / TURN)
        return turns if abs(tips[nearest] - TURN * turns) < self.tip_end else Kind.UNSTABLE

    def alive(self, branch: int, k: int) -> bool:
        return bool(abs(np.diff(self.commands[k])[0] - TURN * branch) < self.alpha_end)


@dataclass
class _Branch:
    """q (n,) at the commands from ``first`` on, as far as it was followed; ``ended`` once it was lost."""

    first: int
    states: list[Array]
    ended: bool = False


class FineJudge(Judge):
    """Branches are numbered as they turn up; commands lie on a line."""

    def __init__(self, robot: Robot, D: Array, commands: Array) -> None:
        super().__init__(robot, D, commands)
        self.energy = FixedDegree(robot, D, JUDGE_DEGREE)
        self.s = self.energy.place
        present = self.s[:, None] <= np.array([tube.length for tube in robot.tubes]) - D + 1e-12
        self.present = present.ravel()
        self.inverse = np.linalg.pinv(self.energy.angle_map.reshape(-1, self.energy.n)[self.present])
        start, _ = stationary(self.energy, commands[0], np.zeros(self.energy.n), ROOM)
        if start is None or self.energy.margin(start, commands[0]) <= 0.0:
            raise RuntimeError("the robot is not relaxed at the first command")
        self.branches = [_Branch(0, [start])]

    def locate(self, field: AngleField, k: int) -> int | Kind:
        alpha = self.commands[k]
        twist = (field.angles_at(self.s) - alpha).ravel()[self.present]
        q, _ = stationary(self.energy, alpha, self.inverse @ twist, 2.0 * SAME)
        if q is None:
            return Kind.NOTHING
        if self.energy.margin(q, alpha) <= 0.0:
            return Kind.UNSTABLE
        for index in range(len(self.branches)):
            state = self._state(index, k)
            if state is not None and self.energy.twist_size(state - q) < SAME:
                return index
        self.branches.append(_Branch(k, [q]))
        return len(self.branches) - 1

    def alive(self, branch: int, k: int) -> bool:
        return self._state(branch, k) is not None

    def _state(self, index: int, k: int) -> Array | None:
        branch = self.branches[index]
        while not branch.ended and branch.first + len(branch.states) <= k:
            at = branch.first + len(branch.states)
            reached = self._fine(branch.states[-1], self.commands[at - 1], self.commands[at])
            if reached is None:
                branch.ended = True
            else:
                branch.states.append(reached)
        known = 0 <= k - branch.first < len(branch.states)
        return branch.states[k - branch.first] if known else None

    def _fine(self, q: Array, begin: Array, end: Array) -> Array | None:
        """Follow a stable state from one command to the next; None where its branch ends."""
        t, step = 0.0, FINE_STEP / np.ptp(end - begin)
        before: tuple[float, Array] | None = None
        while t < 1.0:
            step = min(step, 1.0 - t)
            alpha = begin + (t + step) * (end - begin)
            guess = q if before is None else q + (q - before[1]) * (step / (t - before[0]))
            found, _ = stationary(self.energy, alpha, guess, ROOM)
            near = found is not None and self.energy.twist_size(found - q) < ROOM
            if near and self.energy.margin(found, alpha) > 0.0:
                before, q, t = (t, q), found, t + step
                step = min(1.5 * step, FINE_STEP / np.ptp(end - begin))
            else:
                step *= 0.5
                if step < FINEST_STEP:
                    return None
        return q


class Tracker:
    """Goes along with one method: which branch it may be on, and whether it has said that something happened."""

    def __init__(self, judge: Judge) -> None:
        self.judge = judge
        self.branch, self.failed = 0, False

    def outcome(self, answer: Answer, k: int) -> Outcome:
        """Classify the answer to command ``k``.

        The right branch is that of the relaxed robot until it ends.  Past its end any stable branch is accepted if the
        method said that it left the old one: by a flagged snap, or by a failure just before.  From then on that branch
        is the right one.  Whoever says nothing is wrong until it says something or is back.
        """
        if not answer.success or answer.field is None:
            self.failed = True
            return Outcome.FAILURE
        place = self.judge.locate(answer.field, k)
        warned, self.failed = self.failed, False
        if isinstance(place, Kind):
            return Outcome.UNSTABLE if place is Kind.UNSTABLE else Outcome.NOTHING
        if answer.snapped:
            ended = not self.judge.alive(self.branch, k)
            self.branch = place
            return Outcome.SNAP if ended else Outcome.FALSE_ALARM
        if place == self.branch:
            return Outcome.RIGHT
        if warned:
            self.branch = place
            return Outcome.RESUMED
        return Outcome.WRONG
