"""What became of a command or a wrench, for the topic ~/status."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

from builtin_interfaces.msg import Time
from geometry_msgs.msg import Vector3
from geometry_msgs.msg import Wrench
from std_msgs.msg import Header

from ctr_pvs import Loads
from ctr_pvs import NoEquilibriumError
from ctr_pvs import Status
from ctr_pvs_interfaces.msg import EquilibriumStatus
from ctr_pvs_ros.inputs.commands import RejectedCommand
from ctr_pvs_ros.inputs.poses import RejectedPose
from ctr_pvs_ros.inputs.wrenches import RejectedWrench
from ctr_pvs_ros.outputs.serialized import STAMP
from ctr_pvs_ros.outputs.serialized import Form
from ctr_pvs_ros.outputs.serialized import placeholders
from ctr_pvs_ros.outputs.serialized import stamp_bytes
from ctr_pvs_ros.stream import Answer

if TYPE_CHECKING:
    from ctr_pvs import Equilibrium

INTERNAL_ERROR = "internal_error"
NAN = float("nan")
NO_LOADS = Loads()
KINDS = 64  # of statuses that differ in more than numbers; as many are kept ready


@dataclass(frozen=True, eq=False)
class Outcome:
    """Of what came with one stamp.

    Attributes:
        stamp, trigger: EquilibriumStatus.COMMAND, WRENCH, POSE, or a wrench with one of the others.
        code: EquilibriumStatus.ACCEPTED, REFUSED, FAILED or SNAP.
        reason, message, hint: see the message's definition.
        loads: that were solved under; None: no load.
        equilibrium, solve_time: of the solve, if there was one [s].
        tip_distance: of the tip from where it was asked to be [m], if it was.
    """

    stamp: Time
    trigger: int
    code: int
    reason: str
    message: str
    hint: str = ""
    loads: Loads | None = None
    equilibrium: Equilibrium | None = None
    solve_time: float = NAN
    tip_distance: float = NAN


def refused(stamp: Time, trigger: int, rejection: RejectedCommand | RejectedPose | RejectedWrench) -> Outcome:
    """It broke a rule."""
    return Outcome(stamp, trigger, EquilibriumStatus.REFUSED, rejection.reason.value, str(rejection))


def broken(stamp: Time, trigger: int, text: str) -> Outcome:
    """The node itself failed."""
    return Outcome(stamp, trigger, EquilibriumStatus.FAILED, INTERNAL_ERROR, f"{text}; the last answer stays")


def solved(
    stamp: Time, trigger: int, answer: Answer, loads: Loads | None, hint: str = "", tip_distance: float = NAN
) -> Outcome:
    """It was solved for, and the answer sent where the verdict says so."""
    equilibrium, verdict = answer.equilibrium, answer.verdict
    code = EquilibriumStatus.ACCEPTED
    if not verdict.publish:
        code = EquilibriumStatus.FAILED
    elif equilibrium.status is Status.SNAP:
        code = EquilibriumStatus.SNAP
    reason = verdict.reason or equilibrium.status.value
    message = verdict.remark or equilibrium.message
    return Outcome(stamp, trigger, code, reason, message, hint, loads, equilibrium, answer.solve_time, tip_distance)


class StatusForms:
    """Serializes statuses; loads are along the axes of ``frame_id``.

    As Python objects a status takes as long as all other outputs together. Most differ in numbers only.
    """

    def __init__(self, frame_id: str) -> None:
        self._frame_id = frame_id
        self._form = lru_cache(maxsize=KINDS)(self._new_form)

    def of(self, outcome: Outcome) -> bytes:
        """ctr_pvs_interfaces/EquilibriumStatus."""
        texts = (outcome.reason, outcome.message, outcome.hint)
        fidelity, freedom, margin, reserve, error = "", 0, NAN, NAN, NAN
        if (equilibrium := outcome.equilibrium) is not None:
            fidelity = equilibrium.fidelity
            if equilibrium.success:
                freedom = int(equilibrium.degrees_of_freedom)
                margin, reserve = float(equilibrium.stability_margin), snap_reserve(equilibrium)
                error = float(equilibrium.error_estimate)
        loads = outcome.loads or NO_LOADS
        stamp = stamp_bytes(outcome.stamp.sec, outcome.stamp.nanosec)
        of_solve = struct.pack("=4d", margin, reserve, error, outcome.solve_time)
        of_load = struct.pack("=7d", *loads.tip_force, *loads.tip_moment, outcome.tip_distance)
        form = self._form(outcome.trigger, outcome.code, *texts, fidelity, freedom)
        return form.fill(stamp, of_solve, of_load)

    def _new_form(
        self, trigger: int, code: int, reason: str, message: str, hint: str, fidelity: str, freedom: int
    ) -> Form:
        margin, reserve, error, solve_time = of_solve = placeholders(4)
        fx, fy, fz, mx, my, mz, distance = of_load = placeholders(7, run=1)
        status = EquilibriumStatus(
            header=Header(stamp=STAMP, frame_id=self._frame_id),
            trigger=trigger,
            outcome=code,
            reason=reason,
            message=message,
            hint=hint,
            stability_margin=margin,
            snap_reserve=reserve,
            error_estimate=error,
            solve_time=solve_time,
            fidelity=fidelity,
            degrees_of_freedom=freedom,
            applied_wrench=Wrench(force=Vector3(x=fx, y=fy, z=fz), torque=Vector3(x=mx, y=my, z=mz)),
            tip_distance=distance,
        )
        return Form(status, (STAMP, of_solve, of_load))


def snap_reserve(equilibrium: Equilibrium) -> float:
    """NaN where it is not known: under a moment a state can be stable and have no rates."""
    try:
        return float(equilibrium.snap_reserve)
    except NoEquilibriumError:
        return NAN
