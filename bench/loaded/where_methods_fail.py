"""What methods do at a fold under load: sweeps through it and cold starts, every answer judged.

    scripts/in_env.sh python3 -m bench.loaded.where_methods_fail

The seed's robot at partial overlap under -0.5 N across its tip, tube 2 turned from 0 to 260 deg: its stable branch ends
at 193.037 deg.  Writes docs/figures/loads_where_methods_fail.png and the table of docs/loads.md.
"""

from __future__ import annotations

import argparse
import warnings
from collections import Counter
from dataclasses import dataclass
from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from bench.common.document import publish
from bench.common.document import table
from bench.common.places import FIGURES
from bench.common.places import LOADS
from bench.common.scenes import PARTIAL_OVERLAP
from bench.common.scenes import SEED
from bench.loaded.fold_methods import METHODS
from bench.loaded.fold_methods import FoldJudge
from bench.loaded.fold_methods import FoldMethod
from bench.loaded.fold_methods import Found
from bench.stability.judges import Outcome
from bench.stability.judges import Tracker
from ctr_pvs import Loads

Array = NDArray[np.float64]

FORCE = Loads((0.0, -0.5, 0.0))
#: Where sweeps end, their steps, and those between cold starts [deg].
END, STEPS, COLD_STEP = 260.0, (5.0, 13.0), 13.0
#: Where the branch ends [deg], by two independent methods: test/data/loads_reference.json.
FOLD = 193.037
#: The sweep that is drawn.
DRAWN = 5.0


@dataclass(frozen=True)
class Told:
    """One answer: command [deg], what it was, and the angle between the tubes at their ends [deg], NaN without one."""

    alpha: float
    outcome: Outcome
    angle: float


@dataclass(frozen=True)
class Sweep:
    """All answers of all methods to one sweep, or to cold starts; and the branches that the judge met."""

    name: str
    answers: dict[str, list[Told]]
    branches: list[tuple[Array, Array]] = field(default_factory=list)


def sweep(step: float, warm: bool, end: float = END) -> Sweep:
    """Commands ``step`` [deg] apart."""
    angles = np.append(np.arange(0.0, end, step), end)
    commands = np.column_stack([np.zeros_like(angles), np.radians(angles)])
    judge = FoldJudge(SEED, PARTIAL_OVERLAP, FORCE, commands)
    first = 0 if warm else 1
    answers: dict[str, list[Told]] = {}
    for name, make in METHODS.items():
        method, tracker = make(judge, warm), Tracker(judge)
        answers[name] = []
        for k in range(first, len(angles)):
            tracker = tracker if warm else Tracker(judge)
            answers[name].append(_judged(method, tracker, commands[k], k))
    branches = []
    for index in range(len(judge.branches)):
        states = [(angle, judge.state(index, k)) for k, angle in enumerate(angles)]
        known = [(angle, _between(state.psi_ends)) for angle, state in states if state is not None]
        branches.append((np.array([a for a, _ in known]), np.array([b for _, b in known])))
    return Sweep(f"steps of {step:g}°" if warm else "cold", answers, branches)


def _judged(method: FoldMethod, tracker: Tracker, alpha: Array, k: int) -> Told:
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        # A diverging trial overflows, scipy says so: the success flag is what counts here.
        warnings.simplefilter("ignore", RuntimeWarning)
        answer = method.solve(alpha)
    place = answer.field.place if isinstance(answer.field, Found) else None
    angle = np.nan if place is None else _between(place.psi_ends)
    return Told(float(np.degrees(alpha[1])), tracker.outcome(answer, k), angle)


def _between(psi: Array) -> float:
    return float(np.degrees(psi[1] - psi[0]))


def summary(sweeps: list[Sweep]) -> str:
    """Answers of each outcome, by method; warm sweeps together, and cold starts."""
    outcomes = [o for o in Outcome if any(t.outcome is o for s in sweeps for ts in s.answers.values() for t in ts)]
    lines = []
    for start, group in (
        ("warm", [s for s in sweeps if s.name != "cold"]),
        ("cold", [s for s in sweeps if s.name == "cold"]),
    ):
        for method in METHODS if group else ():
            counts = Counter(told.outcome for s in group for told in s.answers[method])
            cells = [str(counts[outcome] or "·") for outcome in outcomes]
            lines.append([f"{method}, {start}", str(counts.total()), *cells])
    return table(["method", "answers", *(outcome.value for outcome in outcomes)], lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--quick", action="store_true", help="one coarse sweep, printed only")
    options = parser.parse_args()
    sweeps = [sweep(step, True) for step in ((65.0,) if options.quick else STEPS)]
    if not options.quick:
        sweeps.append(sweep(COLD_STEP, False))
    publish("loaded failures", summary(sweeps), None if options.quick else LOADS)
    if not options.quick:
        from bench.loaded.failure_chart import draw  # matplotlib is needed for the figure only

        draw(sweeps[STEPS.index(DRAWN)], sweeps[-1], FOLD, FIGURES / "loads_where_methods_fail.png")


if __name__ == "__main__":
    main()
