"""What the node tells on /diagnostics: counters and the state of the last command, as one DiagnosticStatus."""

from __future__ import annotations

import math
import time
from collections import Counter
from collections import deque
from typing import TYPE_CHECKING
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticStatus
from diagnostic_msgs.msg import KeyValue

from ctr_pvs import Status
from ctr_pvs_ros.inputs.commands import Command
from ctr_pvs_ros.inputs.commands import RejectedCommand
from ctr_pvs_ros.inputs.external_load import ExternalLoad
from ctr_pvs_ros.inputs.poses import RejectedPose
from ctr_pvs_ros.outputs.outcomes import snap_reserve
from ctr_pvs_ros.stream import Answer

if TYPE_CHECKING:
    from ctr_pvs import Equilibrium

SOLVE_TIMES_KEPT = 1000


class Report:
    """Counts what happens to commands. Times are judged by receipt on a steady clock.

    Args:
        load: keeps the account of wrenches; None where none are listened to.
    """

    def __init__(self, load: ExternalLoad[Any] | None = None) -> None:
        self._load = load
        self._counts = Counter(
            received=0, accepted=0, published=0, rejected=0, clamped=0, snaps=0, zero_stamps=0, for_others=0
        )
        self._reasons: Counter[str] = Counter()
        self._solve_times: deque[float] = deque(maxlen=SOLVE_TIMES_KEPT)
        self._answer: Answer | None = None
        self._robot_remarks = ""
        self._last_rejection = ""
        self._last_clamp = self._last_hint = ""
        self._last_snap = ""
        self._published: Equilibrium | None = None
        self._fault = ""  # of the node itself; the next answer takes it back
        self._faults = 0
        self._rated = (time.monotonic(), 0)  # when the command rate was last told, and the commands until then
        self._news = ""  # the last thing to warn of since the last status, even if all went well after it
        self._received = time.monotonic()  # of the last command; until there is one, start-up
        self._header_age = float("nan")

    def about_robot(self, remarks: list[str]) -> None:
        """What looks wrong in the robot file: told for good, and warned of in the next status."""
        self._robot_remarks = self._news = "; ".join(remarks)

    def received(self, header_age: float | None) -> None:
        """A command came, its stamp `header_age` [s] before its receipt; None: it had a zero stamp."""
        self._received = time.monotonic()
        self._counts["received"] += 1
        self._header_age = float("nan") if header_age is None else header_age
        self._counts["zero_stamps"] += header_age is None

    def for_others(self) -> None:
        """A message came that is none of this robot's business."""
        self._counts["for_others"] += 1

    def rejected(self, rejection: RejectedCommand | RejectedPose) -> None:
        """The command changed nothing."""
        self._counts["rejected"] += 1
        self._reasons[rejection.reason.value] += 1
        self._last_rejection = f"{rejection.reason.value}: {rejection}"
        self._news = f"command rejected: {self._last_rejection}"

    def warn(self, text: str) -> None:
        """Something that is no command's fault deserves a look."""
        self._news = text

    def fault(self, text: str) -> None:
        """Something failed that should not; the last answer stays."""
        self._fault = text
        self._faults += 1

    def answered(self, answer: Answer) -> None:
        """A command or a wrench was solved for, and the answer sent where the verdict says so."""
        self._answer = answer
        self._fault = ""
        self._solve_times.append(answer.solve_time)
        self._counts["published"] += answer.verdict.publish
        if answer.equilibrium.status is Status.SNAP:
            self._counts["snaps"] += 1
            self._last_snap = f"{_tip(self._published)} -> {_tip(answer.equilibrium)}"
        if answer.verdict.publish:
            self._published = answer.equilibrium
        if answer.verdict.remark:
            self._news = answer.verdict.remark

    def accepted(self, command: Command) -> None:
        """The command was one to solve for."""
        self._counts["accepted"] += 1
        if command.notes:
            self._counts["clamped"] += 1
            self._last_clamp = "; ".join(command.notes)
            self._news = f"command clamped: {self._last_clamp}"
        if command.hints:
            self._last_hint = self._news = "; ".join(command.hints)

    def status(
        self, name: str, hardware_id: str, command_timeout: float, wrench_timeout: float = 0.0
    ) -> DiagnosticStatus:
        """The state since start-up; what is over by now warns once, in the first status after it."""
        level, message = self._summary(command_timeout, wrench_timeout)
        self._news = ""
        values = self._count_values() | self._load_values() | self._answer_values()
        return DiagnosticStatus(
            level=level,
            name=name,
            hardware_id=hardware_id,
            message=message,
            values=[KeyValue(key=key, value=value) for key, value in values.items()],
        )

    def _summary(self, command_timeout: float, wrench_timeout: float) -> tuple[bytes, str]:
        of_the_load = self._load.remark(wrench_timeout) if self._load is not None else ""
        if self._fault:
            return DiagnosticStatus.ERROR, f"internal error: {self._fault}; the last answer stays"
        if self._answer is not None and not self._answer.verdict.publish:
            return DiagnosticStatus.ERROR, self._answer.verdict.remark
        age = self._age()
        if command_timeout > 0.0 and age > command_timeout:
            return DiagnosticStatus.STALE, f"no command for {age:.1f} s (command_timeout is {command_timeout:g} s)"
        remark = self._news or (self._answer.verdict.remark if self._answer is not None else "")
        if remark or of_the_load:
            return DiagnosticStatus.WARN, "; ".join(filter(None, (remark, of_the_load)))
        return DiagnosticStatus.OK, "waiting for the first command" if self._answer is None else "ok"

    def _age(self) -> float:
        """Time without a command, s."""
        return time.monotonic() - self._received

    def _rate(self) -> float:
        """Commands per second since the last call."""
        (since, before), (now, received) = self._rated, (time.monotonic(), self._counts["received"])
        self._rated = now, received
        return (received - before) / max(now - since, 1e-3)

    def _count_values(self) -> dict[str, str]:
        counts = self._counts
        return {
            "robot warnings": self._robot_remarks,
            "commands accepted": str(counts["accepted"]),
            "answers published": str(counts["published"]),
            "commands rejected": str(counts["rejected"]),
            "rejected by reason": ", ".join(f"{reason}: {count}" for reason, count in sorted(self._reasons.items())),
            "last rejection": self._last_rejection,
            "commands clamped": str(counts["clamped"]),
            "last clamping": self._last_clamp,
            "last hint": self._last_hint,
            "messages without joints of this robot": str(counts["for_others"]),
            "snaps": str(counts["snaps"]),
            "last snap, tip before -> after [m]": self._last_snap,
            "internal errors": str(self._faults),
            "command rate [1/s]": f"{self._rate():.1f}",
            "commands with zero stamp (receipt time used)": str(counts["zero_stamps"]),
            "time without a command [s]": f"{self._age():.3f}",
            "last command's stamp age at receipt [s]": f"{self._header_age:.6f}",
        }

    def _load_values(self) -> dict[str, str]:
        return self._load.values() if self._load is not None else {}

    def _answer_values(self) -> dict[str, str]:
        if self._answer is None:
            return {}
        equilibrium = self._answer.equilibrium
        median, p95 = np.percentile(self._solve_times, (50, 95)) * 1e3
        return {
            "last status": equilibrium.status.value,
            "last message": equilibrium.message,
            "stability margin": f"{equilibrium.stability_margin:.6g}",
            "snap reserve": _snap_reserve(equilibrium),
            "fidelity": equilibrium.fidelity,
            "degrees of freedom": str(equilibrium.degrees_of_freedom) if equilibrium.success else "",
            "error estimate [m]": f"{equilibrium.error_estimate:.3g}",
            "residual": f"{equilibrium.residual:.3g}",
            "solve time p50 [ms]": f"{median:.3f}",
            "solve time p95 [ms]": f"{p95:.3f}",
            "solve time max [ms]": f"{max(self._solve_times) * 1e3:.3f}",
        }


def _snap_reserve(equilibrium: Equilibrium) -> str:
    """Nothing where it is not known."""
    reserve = snap_reserve(equilibrium) if equilibrium.success else math.nan
    return "" if math.isnan(reserve) else f"{reserve:.4g}"


def _tip(equilibrium: Equilibrium | None) -> str:
    """Where the tip is [m], for people."""
    if equilibrium is None or not equilibrium.success:
        return "unknown"
    return "({:.6f}, {:.6f}, {:.6f})".format(*equilibrium.tip.position)
