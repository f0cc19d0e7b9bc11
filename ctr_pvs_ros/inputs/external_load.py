"""The load that acts on the tip: that of the newest wrench, held until the next one, with an account of what came."""

from __future__ import annotations

import time
from collections import Counter
from typing import Generic
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from ctr_pvs import Loads
from ctr_pvs_ros.inputs.wrenches import RejectedWrench
from ctr_pvs_ros.inputs.wrenches import TipWrench

Stamp = TypeVar("Stamp")


class ExternalLoad(Generic[Stamp]):
    """Takes wrenches one by one.

    A wrench in the tip's frame is turned with the tip of the last answer and is dead from there on. Before there is an
    answer it waits for one, and the load before it, if any, acts until then.

    Attributes:
        loads: what acts now, in base axes; None until the first wrench.
        unanswered: the stamp of the newest wrench while no solve has been made under it.
    """

    def __init__(self) -> None:
        self.loads: Loads | None = None
        self.unanswered: Stamp | None = None
        self._waiting: TipWrench | None = None
        self._accepted = 0
        self._reasons: Counter[str] = Counter()
        self._last_rejection = ""
        self._news = ""  # the last refusal since it was last asked for
        self._received = time.monotonic()  # of the last wrench that was accepted; until there is one, start-up

    def accept(self, wrench: TipWrench, stamp: Stamp, orientation: NDArray[np.float64] | None) -> None:
        """Let `wrench` act from now on; `orientation`: of the last answer's tip, (4,) xyzw, None if there is none."""
        self._received = time.monotonic()
        self._accepted += 1
        self.unanswered = stamp
        self._waiting = wrench
        self._turn(orientation)

    def rejected(self, rejection: RejectedWrench) -> None:
        """A wrench came that changes nothing: the last load is held."""
        self._reasons[rejection.reason.value] += 1
        self._last_rejection = f"{rejection.reason.value}: {rejection}"
        self._news = f"wrench rejected: {self._last_rejection}; the last load is held"

    def solved(self, orientation: NDArray[np.float64] | None) -> None:
        """A solve was made under `loads`; `orientation` as for `accept`. What waited for a tip acts from now on, and is
        still unanswered."""
        if self._waiting is None:
            self.unanswered = None
        else:
            self._turn(orientation)

    def _turn(self, orientation: NDArray[np.float64] | None) -> None:
        loads = self._waiting.loads(orientation) if self._waiting is not None else None
        if loads is not None:
            self.loads, self._waiting = loads, None

    def remark(self, timeout: float) -> str:
        """What to warn of: a refusal since this was last asked for, and no wrench for `timeout` [s]; 0: never."""
        parts, self._news = [self._news] if self._news else [], ""
        age = self._age()
        if timeout > 0.0 and age > timeout:
            held = "the last load is held" if self._accepted else "none has come yet, and no load acts"
            parts.append(f"no wrench for {age:.1f} s (wrench_timeout is {timeout:g} s); {held}")
        return "; ".join(parts)

    def values(self) -> dict[str, str]:
        """For diagnostics: the load that acts, its age, and what came."""
        loads = self.loads if self.loads is not None else Loads()
        return {
            "external force [N]": _shown(loads.tip_force),
            "external moment [N m]": _shown(loads.tip_moment),
            "time without a wrench [s]": f"{self._age():.3f}",
            "wrenches accepted": str(self._accepted),
            "wrenches rejected": str(self._reasons.total()),
            "wrenches rejected by reason": ", ".join(f"{reason}: {n}" for reason, n in sorted(self._reasons.items())),
            "last wrench rejection": self._last_rejection,
        }

    def _age(self) -> float:
        """Time without a wrench that was accepted, s."""
        return time.monotonic() - self._received


def _shown(vector: tuple[float, float, float]) -> str:
    return "({:.6g}, {:.6g}, {:.6g})".format(*vector)
