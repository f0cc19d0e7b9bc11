"""Robots found for targets that a known robot reaches, from robots that are off from it: how many, how near, how fast.

scripts/in_env.sh python3 -m bench.design.known_designs             # the tables of docs/design.md, some minutes
scripts/in_env.sh python3 -m bench.design.known_designs --robot three_tubes --seeds 3 --starts 4
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.common.document import table
from bench.common.places import CONFIG
from ctr_pvs import EquilibriumSolver
from ctr_pvs import Robot
from ctr_pvs import load_robot
from ctr_pvs.tasks.design.design import Design
from ctr_pvs.tasks.design.design import design
from ctr_pvs.tasks.design.parameters import chosen
from ctr_pvs.tasks.design.parameters import robot_with
from ctr_pvs.tasks.design.targets import Targets
from ctr_pvs.tasks.workspace import random_commands

Array = NDArray[np.float64]

#: Least margin of a command whose tip is a target: above the floor of a design.
MARGIN = 0.15
#: How far curvatures and curved parts are off at first, and straight parts at most.
OFF, STRAIGHT = (0.3, 0.5), 0.2


@dataclass(frozen=True, eq=False)
class Run:
    """A design, seconds of the processor, and how far its parameters (P,) are from the known ones, as shares."""

    found: Design
    cpu: float
    from_known: Array


def targets_of(known: Robot, seed: int, count: int) -> Targets:
    """Tips of a robot at random commands, before the orifice."""
    solver, tips = EquilibriumSolver(known, 1e-8), []
    for row in random_commands(known, 50 * count, seed):
        answer = solver.solve(*np.split(row, 2), start="cold")
        if answer.success and answer.stability_margin > MARGIN and answer.tip.position[0] >= 0.0:
            tips.append(answer.tip.position)
        if len(tips) == count:
            break
    return Targets(np.array(tips))


def robot_off(known: Robot, seed: int) -> Robot:
    """``known`` with other lengths and curvatures."""
    rng, parameters = np.random.default_rng(seed), chosen(known)
    shares = []
    for p in parameters:
        straight = p.kind == "length" and known.tubes[p.tube].segments[p.segment].is_straight
        off = rng.uniform(-STRAIGHT, STRAIGHT) if straight else rng.choice([-1.0, 1.0]) * rng.uniform(*OFF)
        shares.append(1.0 + off)
    return robot_with(known, parameters, np.array([p.start for p in parameters]) * shares)


def run(known: Robot, seed: int, count: int, starts: int) -> Run:
    cpu = time.process_time()
    found = design(robot_off(known, seed), targets_of(known, seed, count), starts=starts, seed=seed)
    values = np.array([p.start for p in chosen(known)])
    return Run(found, time.process_time() - cpu, np.abs(found.values / values - 1.0))


def row(seed: int, done: Run) -> list[str]:
    """Of the table."""
    before, after, total = done.found.before, done.found.after, len(done.found.targets)
    return [
        str(seed), f"{before.reached} of {total}", f"{1e3 * before.worst:.1f}", f"{after.reached} of {total}",
        f"{1e9 * after.worst:.1f}", f"{min(target.margin for target in after.targets):.3f}",
        f"{100.0 * np.median(done.from_known):.0f}", f"{100.0 * done.from_known.max():.0f}", str(done.found.tried),
        f"{done.found.seconds:.1f}", f"{done.cpu:.1f}",
    ]  # fmt: skip


HEAD = (
    "seed", "reached before", "worst [mm]", "reached", "worst [nm]", "least margin", "off the known [%], median",
    "largest", "designs", "s", "CPU s",
)  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--robot", default="renda2021")
    parser.add_argument("--seeds", type=int, default=6)
    parser.add_argument("--targets", type=int, default=20)
    parser.add_argument("--starts", type=int, default=8)
    arguments = parser.parse_args()
    known, rows = load_robot(CONFIG / f"{arguments.robot}.yaml"), []
    for seed in range(arguments.seeds):
        rows.append(row(seed, run(known, seed, arguments.targets, arguments.starts)))
        print(rows[-1], flush=True)
    print(table(HEAD, rows))


if __name__ == "__main__":
    main()
