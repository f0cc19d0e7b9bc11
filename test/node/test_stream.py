"""What is let out of the stream, and that what is withheld leaves no trace."""

from dataclasses import dataclass

import numpy as np
import pytest

from ctr_pvs import Loads
from ctr_pvs import Pose
from ctr_pvs import Status
from ctr_pvs_ros.inputs.commands import Command
from ctr_pvs_ros.inputs.commands import Reason
from ctr_pvs_ros.inputs.commands import RejectedCommand
from ctr_pvs_ros.stream import Policy
from ctr_pvs_ros.stream import Stream
from ctr_pvs_ros.stream import judge


@dataclass(frozen=True)
class Outcome:
    """As much of an Equilibrium as the stream looks at."""

    status: Status = Status.OK
    stability_margin: float = 1.0
    message: str = "what the solver says"
    tip: Pose | None = None

    @property
    def success(self) -> bool:
        return self.status in (Status.OK, Status.SNAP)


class ScriptedSolver:
    """Answers from a script, and records which answer each solve started from."""

    def __init__(self, script: list[Outcome]) -> None:
        self.script = script
        self.started_from: list[Outcome | None] = []
        self.kept: Outcome | None = None
        self.loads: list[Loads | None] = []

    def solve(self, alpha, D, start, budget, loads) -> Outcome:
        assert start == "warm"
        assert budget == 0.5
        self.loads.append(loads)
        outcome = self.script.pop(0)
        self.started_from.append(self.kept)
        if outcome.success:
            self.kept = outcome
        return outcome


COMMAND = Command(np.zeros(2), np.zeros(2))
FAILURES = [status for status in Status if status not in (Status.OK, Status.SNAP)]


def policy(on_snap="follow", margin_warn=0.2, margin_stop=0.1) -> Policy:
    return Policy(on_snap, margin_warn, margin_stop)


@pytest.mark.parametrize(
    ("outcome", "on_snap", "publish", "word"),
    [
        (Outcome(), "follow", True, ""),
        (Outcome(stability_margin=0.15), "follow", True, "margin_warn"),
        (Outcome(stability_margin=0.05), "follow", False, "margin_stop"),
        (Outcome(stability_margin=float("nan")), "follow", False, "nan"),
        (Outcome(Status.SNAP), "follow", True, "what the solver says"),
        (Outcome(Status.SNAP, stability_margin=0.05), "follow", False, "margin_stop"),
        (Outcome(Status.SNAP), "hold", False, "on_snap is hold"),
        (Outcome(Status.SNAP), "stop", False, "on_snap is stop"),
        *((Outcome(status, stability_margin=float("nan")), "follow", False, status.value) for status in FAILURES),
    ],
)
def test_verdicts(outcome, on_snap, publish, word):
    verdict = judge(outcome, policy(on_snap))
    assert verdict.publish is publish
    assert word in verdict.remark
    assert bool(verdict.remark) is bool(word)


@pytest.mark.parametrize("margin", [0.0, -0.1, float("nan")])
def test_an_answer_that_is_not_stable_is_withheld_whatever_the_thresholds(margin):
    verdict = judge(Outcome(stability_margin=margin), policy(margin_warn=0.0, margin_stop=0.0))
    assert not verdict.publish
    assert verdict.remark


def test_a_withheld_answer_is_not_where_the_next_solve_starts():
    good, withheld, failed, last = Outcome(), Outcome(Status.SNAP), Outcome(Status.NOT_CONVERGED), Outcome()
    solver = ScriptedSolver([good, withheld, failed, last])
    stream = Stream(solver)
    published = [stream.follow(COMMAND, policy("hold"), 0.5).verdict.publish for _ in range(4)]
    assert published == [True, False, False, True]
    assert solver.started_from[0] is None
    assert all(start is good for start in solver.started_from[1:])


def test_the_last_command_is_the_last_one_that_went_out():
    stream = Stream(ScriptedSolver([Outcome(), Outcome(Status.TIMEOUT)]))
    assert stream.last is None
    first, second = (Command(np.array([angle]), np.zeros(1)) for angle in (1.0, 2.0))
    stream.follow(first, policy(), 0.5)
    stream.follow(second, policy(), 0.5)
    assert stream.last is first


def test_after_a_snap_under_stop_commands_are_refused_until_released():
    stream = Stream(ScriptedSolver([Outcome(Status.SNAP), Outcome()]))
    stream.follow(COMMAND, policy("stop"), 0.5)
    for _ in range(2):
        with pytest.raises(RejectedCommand) as caught:
            stream.follow(COMMAND, policy("stop"), 0.5)
        assert caught.value.reason is Reason.STOPPED
    stream.release()
    assert stream.follow(COMMAND, policy("stop"), 0.5).verdict.publish


def test_a_load_is_solved_for_and_turned_by_the_last_tip_that_went_out():
    """A wrench in the tip's frame must not be turned by a tip that nobody has seen."""
    first, withheld = (Pose(np.zeros(3), np.array([0.0, 0.0, np.sin(x), np.cos(x)])) for x in (0.1, 0.2))
    solver = ScriptedSolver([Outcome(tip=first), Outcome(Status.SNAP, tip=withheld), Outcome(Status.TIMEOUT)])
    stream, load = Stream(solver), Loads(tip_force=(0.0, 0.1, 0.0))
    loads = [None, load, Loads()]
    assert stream.orientation is None
    for each in loads:
        stream.follow(COMMAND, policy("hold"), 0.5, each)
        assert stream.orientation is first.orientation
    assert solver.loads == loads
