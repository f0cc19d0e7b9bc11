"""The main job, seen from outside: stream the two sweeps of Fig. 4 through the node and check every answer.

The node runs in a process of its own; commands and answers go over DDS. Exit code 0 means that every reply came and
every tip is within TIP_TOLERANCE of the reference values.
"""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import rclpy
from numpy.typing import NDArray
from sensor_msgs.msg import JointState

from ctr_pvs_interfaces.srv import SolveEquilibrium
from ctr_pvs_ros.client.client import LockStepClient
from ctr_pvs_ros.client.client import NoReply
from ctr_pvs_ros.client.client import Reply
from ctr_pvs_ros.demo_picture import Curves
from ctr_pvs_ros.demo_picture import save_picture
from ctr_pvs_ros.process import NodeProcess
from ctr_pvs_ros.process import isolate
from ctr_pvs_ros.process import share_file

TIP_TOLERANCE = 1e-5  # m
REPLY_TIMEOUT = 5.0  # s
START_TIMEOUT = 20.0  # s
JOINTS = ("outer_rotation", "inner_rotation", "outer_translation", "inner_translation")
HEADER = (
    f"alpha  {'tip [mm]':>27}  {'error':>9}  {'torque [N m]':>18}{'force [N]':>18}   margin    reply",
    f"[deg]  {'x':>9}{'y':>9}{'z':>9}  {'[mm]':>9}  {'outer':>9}{'inner':>9}{'outer':>9}{'inner':>9}              [ms]",
)
TITLES = {"fig4_full": "full overlap", "fig4_partial": "partial overlap"}


@dataclass(frozen=True)
class Row:
    """One command of a sweep: inner rotation [deg], D (2,) [m], reference tip (3,) [m]."""

    sweep: str
    angle: int
    D: tuple[float, float]
    reference: NDArray[np.float64]

    @property
    def joints(self) -> dict[str, float]:
        """The command, by joint name [rad and m]."""
        return dict(zip(JOINTS, (0.0, math.radians(self.angle), *self.D), strict=True))


@dataclass(frozen=True)
class Result:
    """A row and its reply."""

    row: Row
    reply: Reply

    @property
    def tip(self) -> NDArray[np.float64]:
        """(3,) [m]."""
        position = self.reply.tip.pose.position
        return np.array([position.x, position.y, position.z])

    @property
    def error(self) -> float:
        """Distance from the reference tip [m]."""
        return float(np.linalg.norm(self.tip - self.row.reference))

    def effort(self, joint: str) -> float:
        """Torque [N m] or force [N] of a joint."""
        return self.reply.joints.effort[list(self.reply.joints.name).index(joint)]


def read_rows() -> list[Row]:
    """The commands of both sweeps with their reference tips."""
    data = json.loads(share_file("data", "reference_values.json").read_text(encoding="utf-8"))
    return [
        Row(sweep, row["alpha2_deg"], tuple(data[sweep]["D"]), np.array(row["tip_m"]))
        for sweep in TITLES
        for row in data[sweep]["rows"]
    ]


def stream(client: LockStepClient, rows: list[Row]) -> Iterator[Result]:
    """Send the commands one after the other; each sweep starts from zero rotation. Raises NoReply."""
    previous = rows[0]
    for row in rows:
        if row.sweep != previous.sweep:
            # Unwind before sliding, so that the path between the sweeps stays away from the fold.
            client.command(Row(previous.sweep, 0, previous.D, row.reference).joints, REPLY_TIMEOUT)
        yield Result(row, client.command(row.joints, REPLY_TIMEOUT))
        previous = row


def stream_with_progress(client: LockStepClient, rows: list[Row]) -> list[Result]:
    """Stream and show one line that moves with the replies."""
    results = []
    for count, result in enumerate(stream(client, rows), start=1):
        results.append(result)
        line = f"{count:2d}/{len(rows)} {TITLES[result.row.sweep]:15s} {result.row.angle:3d} deg"
        line += f"  tip error {result.error * 1e3:.6f} mm  reply {result.reply.reply_time * 1e3:6.2f} ms"
        print(f"\r{line}", end="" if sys.stdout.isatty() else "\n", flush=True)
    print()
    return results


def table(results: list[Result]) -> str:
    """All answers, one sweep after the other."""
    lines = []
    sweep = ""
    for result in results:
        if result.row.sweep != sweep:
            sweep = result.row.sweep
            outer, inner = result.row.D
            lines += ["", f"{TITLES[sweep]}: D = {outer:g}, {inner:g} m", *HEADER]
        tip = "".join(_number(value * 1e3, 3) for value in result.tip)
        efforts = "".join(_number(result.effort(joint), 4) for joint in JOINTS)
        reply = result.reply
        lines.append(
            f"{result.row.angle:5d}  {tip}  {result.error * 1e3:9.6f}  {efforts}  {reply.stability_margin:7.4f}"
            f"  {reply.reply_time * 1e3:7.2f}"
        )
    return "\n".join(lines)


def _number(value: float, decimals: int) -> str:
    """A table cell; nothing is shown as minus zero."""
    return f"{round(value, decimals) + 0.0:9.{decimals}f}"


def call_service(client: LockStepClient, row: Row) -> str:
    """Ask the service for one row, cold, and tell what it says about the force."""
    joints = JointState(name=list(row.joints), position=list(row.joints.values()))
    response = client.solve(SolveEquilibrium.Request(joints=joints), REPLY_TIMEOUT)
    if not response.success:
        raise NoReply(f"the service could not solve {row.joints}: {response.message}")
    return (
        f"service, {TITLES[row.sweep]}, {row.angle} deg, cold start: {response.status} after"
        f" {response.solve_time * 1e3:.1f} ms, {response.degrees_of_freedom} unknowns,"
        f" error estimate {response.error_estimate:.1e} m.\n"
        "The outer tube's straight part ends on the orifice, so its holding force is an interval:"
        f" {response.force_lower[0]:.4f} to {response.force_upper[0]:.4f} N (the table has the end towards +D)."
    )


def curves(results: list[Result]) -> list[Curves]:
    """The backbones for the picture."""
    panels = []
    for sweep, title in TITLES.items():
        chosen = [result for result in results if result.row.sweep == sweep]
        positions = [
            np.array([(p.position.x, p.position.y, p.position.z) for p in result.reply.backbone.poses])
            for result in chosen
        ]
        references = np.array([result.row.reference for result in chosen])
        panels.append(Curves(title, [result.row.angle for result in chosen], positions, references))
    return panels


def run(picture: Path) -> bool:
    """Stream, tell and draw; whether every tip is near enough. Raises NoReply, or OSError for the picture."""
    rows = read_rows()
    print("starting the node and streaming two sweeps over DDS", flush=True)
    with NodeProcess(share_file("config", "renda2021.yaml")):
        client = LockStepClient(rclpy.create_node("sweep_demo"))
        client.wait_for_node(START_TIMEOUT)
        results = stream_with_progress(client, rows)
        service = call_service(client, next(row for row in rows if row.angle == 100))
    save_picture(curves(results), picture)
    worst = max(result.error for result in results)
    print(table(results), service, "", sep="\n")
    print(f"{len(results)} of {len(rows)} replies; largest tip error {worst * 1e3:.6f} mm", end=" ")
    print(f"(allowed {TIP_TOLERANCE * 1e3:g} mm); picture: {picture}")
    return worst <= TIP_TOLERANCE


def main(picture: Path) -> int:
    """Run the demo and say how it went; returns the exit code. The executable is sweep_demo, see front."""
    isolate()
    rclpy.init(args=[])
    try:
        good = run(picture)
    except (NoReply, OSError) as error:
        print(f"\ndemo failed: {error}", file=sys.stderr)
        return 1
    finally:
        rclpy.try_shutdown()
    print("demo passed" if good else "demo failed: a tip is too far from its reference")
    return 0 if good else 1
