"""Minutes of everything at once: 200 commands a second, 1 % of them broken, and all that a busy graph does beside it.

SOAK_MINUTES sets how long (10). The report is printed whether or not the test passes.

A queue of one keeps the newest command, so one that the node has not taken when the next comes is lost. On a machine
that has a processor to spare none is. Where the node stood in line for a processor the machine lost them and not the
node; the kernel keeps account of that, and the test allows no more losses than it explains: none without any waiting,
and next to none without more of it than usual.
"""

import bisect
import itertools
import math
import os
import statistics
import time
from collections import Counter
from typing import NamedTuple

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseArray
from joint_state_fuzz import fuzz
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from std_msgs.msg import Float64MultiArray

from ctr_pvs_interfaces.msg import EquilibriumStatus
from ctr_pvs_interfaces.srv import SolveEquilibrium
from ros.load import EVERY_ANSWER
from ros.load import Load
from ros.load import children
from ros.load import faults_in
from ros.load import joint_state
from ros.load import rejections
from ros.load import resident_memory
from ros.load import stamp_of
from ros.load import waiting_time

pytestmark = pytest.mark.alone

MINUTES = float(os.environ.get("SOAK_MINUTES", "10"))
PERIOD = 0.005  # s, between commands
BROKEN = 100  # one command in so many
EVENT_PERIOD = 0.5  # s, between the things that happen beside the stream
SAMPLE_PERIOD = 1.0  # s, between looks at the node's memory and waiting time
JOINING = 4.0  # s; until then the middleware now and then holds up a publisher for a third of a second (reliability.md)
WARM_UP = 60.0  # s; until then tables are filled that stay. Memory is compared with what it was then
MEMORY_GROWTH = 5.0  # MB
RARELY = 1e-4  # share of good commands that may be lost while the node waits for a processor no longer than usual
JOINTS = ["outer_rotation", "outer_translation", "inner_rotation", "inner_translation"]
PARAMETERS = [("backbone_poses", 20), ("margin_warn", 0.2), ("backbone_poses", 100), ("compute_budget", 0.5)]
WRONG_PARAMETERS = [("backbone_poses", 1), ("margin_stop", 0.9), ("on_snap", "jump"), ("robot_file", "other.yaml")]


def stroke(t):
    """A smooth walk through rotations and translations, far from every fold; period and lengths have no common beat."""
    turns = 0.5 * math.sin(0.7 * t), 1.5 * math.sin(1.4 * t)
    slides = 0.09 + 0.02 * math.sin(0.3 * t), 0.21 + 0.03 * math.sin(0.45 * t)
    return [turns[0], slides[0], turns[1], slides[1]]


class Sample(NamedTuple):
    """Of a node: time.monotonic(), RSS with its child processes [MB], time spent in line for a processor [s]."""

    when: float
    memory: float
    waited: float

    @classmethod
    def of(cls, pid):
        memory = sum(resident_memory(process) for process in (pid, *children(pid)))
        return cls(time.monotonic(), memory, waiting_time(pid))


class Company:
    """What goes on beside the stream: parameters, right and wrong, service calls, subscribers coming and going."""

    def __init__(self, load):
        self._load = load
        self._parameters = AsyncParameterClient(load.ros, "ctr_equilibrium")
        self._solve = load.ros.create_client(SolveEquilibrium, "ctr_equilibrium/solve")
        self._visitors = []
        self._asked = []
        self.visits = 0
        self._events = itertools.cycle((self._set, self._visit, self._call, self._set_wrong, self._leave, self._call))
        self._right, self._wrong = itertools.cycle(PARAMETERS), itertools.cycle(WRONG_PARAMETERS)
        self._sights = itertools.cycle(((PoseArray, "backbone"), (Float64MultiArray, "jacobian")))
        self._count = 0

    def step(self):
        """The next event."""
        next(self._events)()

    def ready(self):
        """Whether all that is to be asked has been found."""
        return self._parameters.services_are_ready() and self._solve.service_is_ready()

    def _ask(self, future, good):
        self._asked.append((time.monotonic(), future, good))

    def _set(self):
        name, value = next(self._right)
        future = self._parameters.set_parameters([Parameter(name, value=value)])
        self._ask(future, lambda answer: answer.results[0].successful)

    def _set_wrong(self):
        name, value = next(self._wrong)
        future = self._parameters.set_parameters([Parameter(name, value=value)])
        self._ask(future, lambda answer: not answer.results[0].successful and answer.results[0].reason)

    def _call(self):
        self._count += 1
        bad = self._count % 3 == 0
        joints = joint_state(JOINTS, stroke(self._count)[: 3 if bad else 4])
        request = SolveEquilibrium.Request(joints=joints, warm_start=self._count % 2 == 0)
        self._ask(self._solve.call_async(request), lambda answer: answer.success is not bad and answer.message)

    def _visit(self):
        kind, topic = next(self._sights)
        visitor = self._load.ros.create_subscription(kind, topic, lambda _: None, EVERY_ANSWER, raw=True)
        self._visitors.append(visitor)
        self.visits += 1

    def _leave(self):
        while self._visitors:
            self._load.ros.destroy_subscription(self._visitors.pop())

    def faults(self):
        """How many requests there were, and which were not answered as they should be, with when they were made."""
        wrong = [
            (when, future.result() if future.done() else "no answer")
            for when, future, good in self._asked
            if not (future.done() and good(future.result()))
        ]
        return len(self._asked), wrong


class Account:
    """Sends the stream and keeps the books."""

    def __init__(self, peer, seconds):
        self.load = Load(peer.namespace, backbone=False)
        self.company = Company(self.load)
        self.samples = []
        self.status = {}
        self.refusals = Counter()
        self.good = []
        self.outcomes = {}  # by stamp [ns]
        self._pid = peer.process.id
        self._seconds = seconds
        self._name = f"{peer.namespace.lstrip('/')}/ctr_equilibrium: equilibrium"
        self.load.ros.create_subscription(DiagnosticArray, "/diagnostics", self._on_diagnostics, 10)
        name = f"{peer.namespace}/ctr_equilibrium/status"
        self.load.ros.create_subscription(EquilibriumStatus, name, self._on_status, EVERY_ANSWER)
        self._broken = (message for message in fuzz(6, 10**9) if len(message.reasons) == 1)

    def _on_diagnostics(self, message):
        for status in message.status:
            if status.name == self._name:
                self.status = {value.key: value.value for value in status.values}

    def _on_status(self, message):
        self.outcomes[stamp_of(message)] = message.outcome

    def run(self):
        """The stream and its company; returns when all is said."""
        self.load.spin_to(time.monotonic() + JOINING)
        assert self.company.ready()
        due = begin = time.monotonic()
        next_event, next_sample = begin + 1.0, begin + 1.0
        for count in range(int(self._seconds / PERIOD)):
            self.load.spin_to(due)
            self._send(count)
            # Where this process was held up it does not make up for it: two commands at once are not 200 Hz.
            due = max(due, time.monotonic()) + PERIOD
            if due >= next_event:
                next_event += EVENT_PERIOD
                self.company.step()
            if due >= next_sample:
                next_sample += SAMPLE_PERIOD
                self.samples.append(Sample.of(self._pid))
        self.load.spin_to(time.monotonic() + 3.0)

    def _send(self, count):
        stamp = time.time_ns()
        if count % BROKEN == BROKEN - 1:
            message = next(self._broken)
            self.refusals.update(message.reasons)
            self.load.send(joint_state(message.names, message.positions, stamp))
        else:
            self.good.append(stamp)
            self.load.send(joint_state(JOINTS, stroke(count * PERIOD), stamp))

    def lost(self):
        """When each good command that was not answered went out."""
        return [self.load.sent[stamp] for stamp in self.good if stamp not in self.load.answered]

    def waiting(self):
        """How long the node stood in line in each stretch between samples [s]."""
        return [b.waited - a.waited for a, b in itertools.pairwise(self.samples)]

    def excused(self, usual=0.0):
        """How many commands the machine may have lost in each stretch between samples.

        One for each period that the node stood in line beyond what is ``usual`` [s], in that stretch or beside it: at a
        boundary the loss may fall on one side and its cause on the other.
        """
        held_up = [max(0.0, waited - usual) for waited in self.waiting()]
        around = [sum(held_up[max(i - 1, 0) : i + 2]) for i in range(len(held_up))]
        return [int(waited / PERIOD) for waited in around]

    def unexplained(self, usual=0.0):
        """Stretches in which more commands were lost than ``excused``: (when, lost, explained)."""
        begins = [sample.when for sample in self.samples]
        lost = Counter(min(max(bisect.bisect(begins, when) - 1, 0), len(begins) - 2) for when in self.lost())
        return [(begins[i], lost[i], excused) for i, excused in enumerate(self.excused(usual)) if lost[i] > excused]

    def surprising(self):
        """How many good commands were lost while the node stood in line no longer than usual."""
        usual = statistics.median(self.waiting())
        return sum(lost - excused for _, lost, excused in self.unexplained(usual))

    def uncounted(self):
        """How many broken commands the node did not count."""
        return sum(self.refusals.values()) - int(self.status["commands rejected"])

    def untold(self):
        """How many commands were answered, or counted as refused, and had no status that says so."""
        good = (EquilibriumStatus.ACCEPTED, EquilibriumStatus.SNAP)
        answered = sum(self.outcomes.get(stamp) not in good for stamp in self.load.answered)
        refused = sum(outcome == EquilibriumStatus.REFUSED for outcome in self.outcomes.values())
        return answered + abs(int(self.status["commands rejected"]) - refused)

    def growth(self):
        """Of the node's memory since the warm-up [MB]; None: the run was too short to tell."""
        warm = [sample.memory for sample in self.samples if sample.when > self.samples[0].when + WARM_UP]
        few = 10
        return statistics.median(warm[-few:]) - statistics.median(warm[:few]) if len(warm) > 4 * few else None

    def report(self):
        """The figures, a line each."""
        answered, lost = self.load.answered, self.lost()
        told = [stamp for stamp in self.good if stamp in answered]
        delays = sorted(answered[stamp] - self.load.sent[stamp] for stamp in told)
        slowest = max(told, key=lambda stamp: answered[stamp] - self.load.sent[stamp])
        begin = self.samples[0].when
        p50, p99, p999 = (delays[int(share * len(delays))] * 1e3 for share in (0.5, 0.99, 0.999))
        asked, wrong = self.company.faults()
        took = self.samples[-1].when - self.samples[0].when
        waited = self.samples[-1].waited - self.samples[0].waited
        growth = self.growth()
        grown = "too short to tell growth" if growth is None else f"{growth:+.2f} MB since {WARM_UP:g} s"
        lines = (
            f"{took / 60:.1f} min: {len(self.good)} good commands, {len(lost)} of them not answered, in the seconds "
            f"{sorted({int(when - begin) for when in lost})}",
            f"the node stood in line for a processor {waited:.1f} s, which explains up to {int(waited / PERIOD)}; "
            f"{self.surprising()} were lost while it stood no longer than usual",
            f"command to tip, client included: median {p50:.2f} ms, 99 % {p99:.2f}, 99.9 % {p999:.2f}, "
            f"max {delays[-1] * 1e3:.2f} after {self.load.sent[slowest] - begin:.1f} s",
            f"broken: {sum(self.refusals.values())} sent, {self.uncounted()} of them not counted",
            f"statuses: {len(self.outcomes)}, {self.untold()} commands answered or refused without one",
            f"beside it: {asked} requests, {len(wrong)} answered wrongly; {self.company.visits} visitors",
            f"memory: {self.samples[0].memory:.1f} MB at first, {self.samples[-1].memory:.1f} MB at last, {grown}",
        )
        return "\n".join(lines)


@pytest.mark.soak
def test_minutes_of_everything_at_once(start_node, capsys):
    peer = start_node("/soaked", publish_jacobian="true")
    peer.ros.destroy_node()  # its subscriptions would only cost time
    account = Account(peer, 60.0 * MINUTES)
    account.run()
    with capsys.disabled():
        print("\n" + account.report())
    assert faults_in(peer.log) == []
    assert peer.process.running
    assert account.company.faults()[1] == []
    assert account.load.not_finite == []
    assert account.unexplained() == []
    assert account.surprising() <= math.ceil(RARELY * len(account.good))
    assert not Counter(rejections(account.status)) - account.refusals
    assert account.uncounted() <= sum(account.excused())
    assert account.untold() == 0
    assert account.status["internal errors"] == "0"
    growth = account.growth()
    assert growth is None or growth < MEMORY_GROWTH
