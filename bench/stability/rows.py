"""The rows of the failure chart: sweeps and cold starts of all methods, every answer judged."""

from __future__ import annotations

import csv
import warnings
from collections import Counter
from collections.abc import Iterable
from collections.abc import Iterator
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bench.common.document import table
from bench.stability.judges import TURN
from bench.stability.judges import FineJudge
from bench.stability.judges import Judge
from bench.stability.judges import Outcome
from bench.stability.judges import PairJudge
from bench.stability.judges import Tracker
from bench.stability.methods import METHODS
from bench.stability.methods import Answer
from bench.stability.methods import Method
from bench.stability.robots_that_snap import pair
from bench.stability.robots_that_snap import three_tubes

Array = NDArray[np.float64]

#: A sweep goes from 0 beyond one turn, and beyond the fold, by this much [rad]; steps of 0.1 rad where one turn does.
BEYOND, STEPS = 0.35, 66
COLD_STARTS = 12
THREE_STEPS, THREE_COLD = 24, 4
#: Shooting and solve_bvp take most of the time: only every so many robots of three tubes are given to them.
SLOW, EVERY = ("shooting", "solve_bvp"), 3

SILENT = (Outcome.WRONG, Outcome.UNSTABLE, Outcome.NOTHING)


@dataclass(frozen=True)
class Row:
    """The answers of one method to one robot: how many of each outcome.

    robot : "pair" with lambda and b, or the number of a random robot of three tubes; start : warm, cold before the fold
    or cold past it.
    """

    robot: str
    lam: float
    b: float
    start: str
    method: str
    answers: Counter[Outcome]

    @property
    def worst(self) -> Outcome:
        return [outcome for outcome in Outcome if self.answers[outcome]][-1]


def run(
    name: str,
    lam: float,
    b: float,
    judge: Judge,
    sweep: Iterable[int],
    cold: Iterable[int],
    skipped: Sequence[str] = (),
) -> Iterator[Row]:
    """All methods but those ``skipped`` on one robot; ``sweep`` and ``cold`` are numbers of the judge's commands."""
    before, past = [k for k in cold if judge.alive(0, k)], [k for k in cold if not judge.alive(0, k)]
    for method, make in METHODS.items():
        if method in skipped:
            continue
        warm, tracker = make(judge.robot, judge.D, True), Tracker(judge)
        yield Row(name, lam, b, "warm", method, Counter(tracker.outcome(_solve(warm, judge, k), k) for k in sweep))
        for start, commands in (("cold before the fold", before), ("cold past the fold", past)):
            scratch = make(judge.robot, judge.D, False)
            answers = Counter(Tracker(judge).outcome(_solve(scratch, judge, k), k) for k in commands)
            if answers:
                yield Row(name, lam, b, start, method, answers)


def _solve(method: Method, judge: Judge, k: int) -> Answer:
    with warnings.catch_warnings():
        # A diverging trial overflows, scipy says so: the success flag is what counts here.
        warnings.simplefilter("ignore", RuntimeWarning)
        return method.solve(judge.commands[k])


def two_tube_rows(pairs: Iterable[tuple[float, float]], steps: int) -> Iterator[Row]:
    for lam, b in pairs:
        robot, D = pair(lam, b)
        probe = PairJudge(robot, D, np.zeros((1, 2)))
        fold = probe.alpha_end if np.isfinite(probe.alpha_end) else 0.0
        sweep = np.linspace(0.0, max(TURN, fold) + BEYOND, steps + 1)
        cold = np.append(np.linspace(0.0, sweep[-1], COLD_STARTS)[1:], np.pi)
        alphas = np.concatenate([sweep, np.sort(cold)])
        judge = PairJudge(robot, D, np.column_stack([np.zeros_like(alphas), alphas]))
        yield from run("pair", lam, b, judge, range(steps + 1), range(steps + 1, len(alphas)))


def three_tube_rows(robots: int) -> Iterator[Row]:
    for seed in range(robots):
        robot, D, direction = three_tubes(np.random.default_rng([seed, 3]))
        commands = np.linspace(0.0, TURN + BEYOND, THREE_STEPS + 1)[:, None] * direction
        cold = range(THREE_STEPS // THREE_COLD, THREE_STEPS + 1, THREE_STEPS // THREE_COLD)
        judge = FineJudge(robot, D, commands)
        skipped = SLOW if seed % EVERY else ()
        yield from run(f"three {seed}", np.nan, np.nan, judge, range(THREE_STEPS + 1), cold, skipped)


def save(rows: list[Row], path: Path) -> None:
    with path.open("w", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(["robot", "lambda", "b", "start", "method", *(outcome.value for outcome in Outcome), "worst"])
        for row in rows:
            counts = [row.answers[outcome] for outcome in Outcome]
            writer.writerow([row.robot, row.lam, row.b, row.start, row.method, *counts, row.worst.value])


def load(path: Path) -> list[Row]:
    rows = []
    with path.open(newline="") as stream:
        for line in csv.DictReader(stream):
            answers = Counter({outcome: int(line[outcome.value]) for outcome in Outcome})
            lam, b = float(line["lambda"]), float(line["b"])
            rows.append(Row(line["robot"], lam, b, line["start"], line["method"], answers))
    return rows


def summary(rows: list[Row]) -> str:
    """Answers of each outcome, by method, and how many robots got a silently wrong one."""
    lines = []
    for method in METHODS:
        own = [row for row in rows if row.method == method]
        total = sum((row.answers for row in own), Counter())
        caught = sum(row.worst in SILENT for row in own)
        counts = [str(total[outcome] or "·") for outcome in Outcome]
        lines.append([method, str(total.total()), *counts, f"{caught} of {len(own)}"])
    return table(["method", "answers", *(outcome.value for outcome in Outcome), "robots silently wrong"], lines)
