#!/usr/bin/env python3
"""A pipeline without a display on simulated time: every command waits for its answer, and no clock on a wall counts.

    python3 examples/simulated_pipeline.py --output trajectory.csv      # no pip install beyond what the node needs

Starts a node with use_sim_time, plays the simulator that publishes /clock, and streams an insertion with a rotation:
at each step the time goes on, a command with that time as its stamp goes out, and the status and the outputs with the
same stamp are waited for. So it runs as fast as the answers come, and a run on a slow machine gives the same file as
one on a fast machine. Exit code 1 when a command is refused or not answered.
"""

from __future__ import annotations

import argparse
import csv
import math
import sys
import time
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import rclpy
from rclpy.node import Node
from rclpy.parameter import Parameter
from rosgraph_msgs.msg import Clock

from ctr_pvs.cli.words import whole_number
from ctr_pvs_ros.client.client import NoReply
from ctr_pvs_ros.client.status_client import StatusClient
from ctr_pvs_ros.client.status_client import Told
from ctr_pvs_ros.client.texts import answered
from ctr_pvs_ros.process import NodeProcess
from ctr_pvs_ros.process import isolate
from ctr_pvs_ros.process import share_file

BEGIN, PERIOD = 100_000_000_000, 100_000_000  # ns of simulated time: where it sets out, and from command to command
STEPS = 80
# Positions at the begin and at the end [rad and m]: the inner tube turns by 100 deg while both slide out.
FROM = {"outer_rotation": 0.0, "outer_translation": 0.14, "inner_rotation": 0.0, "inner_translation": 0.24}
TO = {
    "outer_rotation": 0.0,
    "outer_translation": 0.0935,
    "inner_rotation": math.radians(100),
    "inner_translation": 0.2085,
}
COLUMNS = ["time_s", *FROM, "tip_x_m", "tip_y_m", "tip_z_m", "stability_margin", "snap_reserve"]
TIMEOUT = 20.0  # s of real time


class Refused(RuntimeError):
    """A command that was not answered; the message is the node's."""


def trajectory(steps: int) -> Iterator[tuple[int, dict[str, float]]]:
    """Stamps [ns] and positions by joint name, at rest at both ends."""
    for step in range(steps + 1):
        way = 0.5 - 0.5 * math.cos(math.pi * step / steps)
        yield BEGIN + step * PERIOD, {name: start + way * (TO[name] - start) for name, start in FROM.items()}


class SimulatedTime:
    """Publishes /clock. `node` follows it, as everything does that has use_sim_time set."""

    def __init__(self, node: Node, client: StatusClient) -> None:
        self._clock, self._client = node.get_clock(), client
        self._publisher = node.create_publisher(Clock, "/clock", 1)

    def set(self, now: int) -> None:
        """Let it be `now` [ns], and wait until it is."""
        message = Clock()
        message.clock.sec, message.clock.nanosec = divmod(now, 1_000_000_000)

        def is_now() -> bool:
            if self._clock.now().nanoseconds == now:
                return True
            self._publisher.publish(message)  # again: subscribers of /clock do not insist on every message
            return False

        self._client.spin_until(is_now, TIMEOUT, "simulated time")


def row(told: Told) -> list[float]:
    """A line of the file: what the node says, by its own stamp."""
    status, tip, joints = told.status, told.tip, told.joints
    if not answered(status):
        raise Refused(f"{status.reason}: {status.message}")
    stamp, place = status.header.stamp, tip.pose.position
    positions = dict(zip(joints.name, joints.position, strict=True))
    numbers = [place.x, place.y, place.z, status.stability_margin, status.snap_reserve]
    return [stamp.sec + stamp.nanosec * 1e-9, *(positions[name] for name in FROM), *numbers]


def run(steps: int) -> tuple[list[list[float]], float]:
    """The rows of a whole trajectory, and how long it took in real time [s]; raises NoReply and Refused."""
    simulated = Parameter("use_sim_time", value=True)
    node = rclpy.create_node("simulated_pipeline", parameter_overrides=[simulated])
    with NodeProcess(share_file("config", "renda2021.yaml"), {"use_sim_time": "true"}):
        client = StatusClient(node)
        clock = SimulatedTime(node, client)
        client.wait_for_node(TIMEOUT)
        began, rows = time.monotonic(), []
        for now, joints in trajectory(steps):
            clock.set(now)
            rows.append(row(client.command(list(joints), list(joints.values()), TIMEOUT)))
        return rows, time.monotonic() - began


def write(path: Path, rows: list[list[float]]) -> None:
    """As CSV, every number to its last bit."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(COLUMNS)
        writer.writerows(rows)


def summary(rows: list[list[float]], wall: float) -> str:
    """What happened, in `wall` [s] of real time."""
    margins, reserves = ([line[COLUMNS.index(name)] for line in rows] for name in ("stability_margin", "snap_reserve"))
    tips = [line[COLUMNS.index("tip_x_m") :][:3] for line in rows]
    length = sum(math.dist(*pair) for pair in pairwise(tips))
    simulated = rows[-1][0] - rows[0][0]
    return (
        f"{len(rows)} commands, {len(rows)} answers; {simulated:.2f} s of simulated time in {wall:.2f} s of real time\n"
        f"the tip went {1e3 * length:.1f} mm, to {' '.join(f'{1e3 * value:.3f}' for value in tips[-1])} mm\n"
        f"smallest stability margin {min(margins):.4f}, smallest snap reserve {min(reserves):.4f}"
    )


def main() -> int:
    """Run the trajectory and write the file; returns the exit code."""
    parser = argparse.ArgumentParser(description="Stream a trajectory through a node on simulated time.")
    parser.add_argument("--output", type=Path, default=Path("trajectory.csv"), help="CSV file (%(default)s)")
    parser.add_argument("--steps", type=whole_number(1, 100_000), default=STEPS, help="from begin to end (%(default)s)")
    arguments = parser.parse_args()
    isolate()  # a /clock of its own
    rclpy.init(args=[])
    try:
        rows, wall = run(arguments.steps)
    except (NoReply, Refused) as error:
        print(f"pipeline failed: {error}", file=sys.stderr)
        return 1
    finally:
        rclpy.try_shutdown()
    write(arguments.output, rows)
    print(summary(rows, wall))
    print(f"written to {arguments.output}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
