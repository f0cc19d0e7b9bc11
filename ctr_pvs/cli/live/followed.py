"""The page of a robot that somebody else moves: it shows what it is told, and has no sliders.

Nothing here knows where that comes from; ``ctr_client view`` tells it what a running node publishes.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.answer.backbone import Pose
from ctr_pvs.cli.live.mesh import Solid
from ctr_pvs.cli.live.readout import Readout
from ctr_pvs.cli.live.readout import snap_is_near
from ctr_pvs.cli.live.scene import Scene
from ctr_pvs.cli.live.turns import Turns

if TYPE_CHECKING:
    from viser import ViserServer

Array = NDArray[np.float64]

#: Tips that are remembered.
TRACE = 2000
#: Where the tip is looked for before any is known [m].
SOMEWHERE = (0.1, 0.0, 0.0)


@dataclass(frozen=True)
class Told:
    """One answer.

    tip_force : (3,) [N], along the axes of the poses.  margin, reserve : NaN where not known.
    joints : rows of name, position and effort, as they are to be read.
    """

    tubes: tuple[Solid, ...]
    tip: Pose
    tip_force: Array
    margin: float
    reserve: float
    joints: Sequence[tuple[str, str, str]]


class FollowedPage:
    """Shows on ``server`` what becomes of the commands to whom is called ``name``."""

    def __init__(self, server: ViserServer, name: str, largest_force: float) -> None:
        self.server: Any = server  # its types would ask for exact widths of floats
        self.name = name
        self.trace: deque[Array] = deque(maxlen=TRACE)
        self._turns = Turns()
        self._outcome, self._silence = ("no answer yet", True), ""
        self._near = False
        self._seen = False
        self.scene = Scene(server, SOMEWHERE, largest_force)
        server.gui.add_markdown(f"following **{name}**: it is commanded from elsewhere, so there are no sliders")
        self.readout = Readout(server)
        self.clear = self.server.gui.add_button("Clear the trace")
        self.clear.on_click(self._clear)
        self._tell()

    def stop(self) -> None:
        """Ends the server."""
        self.server.stop()

    def show(self, told: Told) -> None:
        """An answer in place of the last one."""
        with self._turns.mine(), self.server.atomic():
            if not self._seen:
                self._seen = True
                self.scene.look_at(told.tip.position)
            self.trace.append(told.tip.position)
            self.scene.show(told.tubes, told.tip)
            self.scene.show_force(told.tip, told.tip_force)
            self.scene.show_trace(self.trace)
            self.readout.show_stability(told.margin, told.reserve)
            self.readout.show_table(told.tip.position, ("joint", "position", "effort"), told.joints)
            self._near = snap_is_near(told.margin, told.reserve)
            self._tell()

    def wipe(self) -> None:
        """Takes the tubes away: whoever moved them has ended."""
        with self._turns.mine():
            self.scene.hide()
            self._outcome = f"{self.name} has ended", False
            self._tell()

    def outcome(self, message: str, good: bool) -> None:
        """What became of the last command, answered or not."""
        with self._turns.mine():
            self._outcome = message, good
            self._tell()

    def silent(self, seconds: float | None) -> None:
        """For how long nothing has been heard, where that is long; None: all is well."""
        with self._turns.mine():
            self._silence = (
                ""
                if seconds is None
                else f"Nothing heard from {self.name} for {seconds:.0f} s; what is shown is the last that was."
            )
            self._tell()

    def _tell(self) -> None:
        message, good = self._outcome
        warning = "**A snap is near.** " if good and self._near else ""
        if self._silence:
            self.readout.tell(self._silence, False)
        else:
            self.readout.tell(f"{warning}{message}", good)

    def _clear(self, event: Any) -> None:
        with self._turns.mine():
            self.trace.clear()
            self.scene.show_trace(self.trace)
