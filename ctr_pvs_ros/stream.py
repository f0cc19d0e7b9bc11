"""The command stream: solve each accepted command, and decide whether its answer may go out."""

from __future__ import annotations

import copy
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ctr_pvs import Loads
from ctr_pvs import Status
from ctr_pvs_ros.inputs.commands import Command
from ctr_pvs_ros.inputs.commands import Reason
from ctr_pvs_ros.inputs.commands import RejectedCommand

if TYPE_CHECKING:
    from ctr_pvs import Equilibrium
    from ctr_pvs import EquilibriumSolver


#: Why an answer is withheld, where it is not the solver's status.
SNAP_HELD, MARGIN_STOP = "snap_held", "margin_stop"


@dataclass(frozen=True)
class Policy:
    """When an answer is withheld: see the node's parameters of the same names."""

    on_snap: str
    margin_warn: float
    margin_stop: float


@dataclass(frozen=True)
class Verdict:
    """Whether an answer goes out, and why not or with what warning (empty: nothing to say); reason: of withholding an
    answer, in a word."""

    publish: bool
    remark: str = ""
    reason: str = ""


@dataclass(frozen=True)
class Answer:
    """One solved command: the equilibrium, what is done with it, and the wall-clock time the solve took [s]."""

    equilibrium: Equilibrium
    verdict: Verdict
    solve_time: float


@dataclass(frozen=True, eq=False)
class Tried:
    """A command that was solved for, and nothing more: what came of it, the wall-clock time it took [s], and the solver
    that goes on from there."""

    command: Command
    equilibrium: Equilibrium
    solve_time: float
    solver: EquilibriumSolver


def judge(equilibrium: Equilibrium, policy: Policy) -> Verdict:
    """Decide on one answer."""
    margin = equilibrium.stability_margin
    if not equilibrium.success:
        return Verdict(False, f"{equilibrium.status.value}: {equilibrium.message}; the last answer stays")
    if equilibrium.status is Status.SNAP and policy.on_snap != "follow":
        return Verdict(
            False, f"snap held (on_snap is {policy.on_snap}): {equilibrium.message}; the last answer stays", SNAP_HELD
        )
    if not (margin > 0.0 and margin >= policy.margin_stop):  # NaN counts as unstable
        rule = f"below margin_stop ({policy.margin_stop:g})" if margin > 0.0 else "not above 0"
        return Verdict(False, f"stability margin {margin:.3g} is {rule}; the last answer stays", MARGIN_STOP)
    if equilibrium.status is Status.SNAP:
        return Verdict(True, f"snap: {equilibrium.message}")
    if margin < policy.margin_warn:
        return Verdict(True, f"stability margin {margin:.3g} is below margin_warn ({policy.margin_warn:g})")
    return Verdict(True)


class Stream:
    """Follows commands one by one; what is not let out leaves no trace in the warm start."""

    def __init__(self, solver: EquilibriumSolver) -> None:
        self._solver = solver
        self._published: Equilibrium | None = None
        self.stopped = False  # after a snap under on_snap = stop
        self.last: Command | None = None  # the command behind the last answer that went out

    @property
    def answer(self) -> Equilibrium | None:
        """The last one that went out."""
        return self._published

    @property
    def orientation(self) -> NDArray[np.float64] | None:
        """Of the tip of the last answer that went out, unit quaternion (4,) xyzw; None: there is none."""
        return None if self._published is None else self._published.tip.orientation

    def release(self) -> None:
        """Accept commands again after a snap under on_snap = stop."""
        self.stopped = False

    def try_out(self, command: Command, budget: float, loads: Loads | None = None) -> Tried:
        """Solve for a command under `loads` from the last answer that went out, within `budget` [s]. Nothing changes.

        Raises:
            RejectedCommand: stopped after a snap.
        """
        if self.stopped:
            raise RejectedCommand(Reason.STOPPED, "stopped after a snap; set on_snap to go on")
        # A withheld answer must not become the place the next command starts from, so the solve runs on a copy.
        solver = copy.copy(self._solver)
        began = time.perf_counter()
        equilibrium = solver.solve(command.alpha, command.D, start="warm", budget=budget, loads=loads)
        return Tried(command, equilibrium, time.perf_counter() - began, solver)

    def settle(self, tried: Tried, policy: Policy) -> Answer:
        """Decide on what was tried last: whether it goes out, and is where the next command starts from."""
        equilibrium = tried.equilibrium
        verdict = judge(equilibrium, policy)
        if verdict.publish:
            self._solver, self.last, self._published = tried.solver, tried.command, equilibrium
        elif equilibrium.status is Status.SNAP and policy.on_snap == "stop":
            self.stopped = True
        return Answer(equilibrium, verdict, tried.solve_time)

    def follow(self, command: Command, policy: Policy, budget: float, loads: Loads | None = None) -> Answer:
        """Solve for a command, and decide; see `try_out` and `settle`."""
        return self.settle(self.try_out(command, budget, loads), policy)
