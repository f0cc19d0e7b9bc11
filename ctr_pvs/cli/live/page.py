"""The page with sliders; viser serves it from its own files, without a network."""

from __future__ import annotations

import math
import threading
from typing import TYPE_CHECKING
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.cli.live.mesh import solids
from ctr_pvs.cli.live.others import Ghost
from ctr_pvs.cli.live.others import Others
from ctr_pvs.cli.live.others import Question
from ctr_pvs.cli.live.readout import MM
from ctr_pvs.cli.live.readout import Readout
from ctr_pvs.cli.live.readout import snap_is_near
from ctr_pvs.cli.live.scene import Scene
from ctr_pvs.cli.live.searcher import Searcher
from ctr_pvs.cli.live.state import FRAMES
from ctr_pvs.cli.live.state import Frame
from ctr_pvs.cli.live.state import LiveRobot
from ctr_pvs.cli.live.state import Shown
from ctr_pvs.cli.live.turns import Turns

if TYPE_CHECKING:
    from viser import ViserServer

Array = NDArray[np.float64]

STEP_ANGLE, STEP_D, STEP_FORCE = 0.5, 0.1, 0.01  # deg, mm, N
#: Sliders that are nearer than this to the command are left where they are.
SAME = 1e-6
#: Limits of sliders are cut to so many decimals.
DECIMALS = 2
#: Seconds that a snap is shown for.
SNAP_TIME = 0.5
#: Ghosts that are drawn, those of least energy.
MOST_GHOSTS = 12


class Page:
    """Shows ``live`` on ``server``, and moves it with the sliders.

    alpha, D, force : sliders [deg], [mm], [N].  Callbacks come in threads of the server, one for each event: one at a
    time works, one waits and will see the newest values, others have nothing to add.  What shows a snap ends at once
    where somebody waits.
    """

    def __init__(self, server: ViserServer, live: LiveRobot, largest_force: float) -> None:
        self.server: Any = server  # its types would ask for exact widths of floats
        self.live = live
        self._turns, self._waiting = Turns(), threading.Lock()
        self._setting: int | None = None  # the thread that sets sliders itself
        self._question: Question | None = None
        self._searcher = Searcher(live.robot, live.tolerance, self._found)
        self.scene = Scene(server, live.shown.tip.position, largest_force)
        self._build_sliders(largest_force)
        self.readout = Readout(server)
        self._build_buttons()
        self.show(live.shown)

    def stop(self) -> None:
        """Ends all that it has started."""
        self._searcher.stop()
        self.server.stop()

    def _build_sliders(self, largest_force: float) -> None:
        gui, limits, names = self.server.gui, self.live.limits, [tube.name for tube in self.live.robot.tubes]
        with gui.add_folder("rotation [deg]"):
            self.alpha = [
                _slider(gui, name, np.degrees(limit), STEP_ANGLE)
                for name, limit in zip(names, limits.alpha, strict=True)
                if limit is not None
            ]
        with gui.add_folder("base to orifice, D [mm]"):
            self.D = [
                _slider(gui, name, MM * np.array(limit), STEP_D)
                for name, limit in zip(names, limits.D, strict=True)
                if limit is not None
            ]
        with gui.add_folder("force on the tip [N]"):
            self.force = [gui.add_slider(axis, -largest_force, largest_force, STEP_FORCE, 0.0) for axis in "xyz"]
        for slider in (*self.alpha, *self.D, *self.force):
            slider.on_update(self.changed)

    def _build_buttons(self) -> None:
        gui = self.server.gui
        self.save = gui.add_button("Save the command")
        self.clear = gui.add_button("Clear the trace")
        self.reset = gui.add_button("Reset")
        self.others = gui.add_checkbox("other equilibria", False)
        self.others_told = gui.add_markdown("", visible=False)
        self.others.on_update(self._others_wanted)
        self.save.on_click(self._save)
        self.clear.on_click(self._clear)
        self.reset.on_click(self._reset)

    def changed(self, event: Any = None) -> None:
        """A slider has moved."""
        if self._setting == threading.get_ident() or not self._waiting.acquire(blocking=False):
            return
        with self._turns.mine():
            self._waiting.release()
            asked = self._asked()
            angles, depths, force = asked
            self.show(self.live.move(np.radians(angles), depths / MM, force), asked)

    def _asked(self) -> tuple[Array, Array, Array]:
        """Where the sliders are: (N,) [deg], (N,) [mm], (3,) [N]."""
        alpha, D, force = (
            np.array([slider.value for slider in row], dtype=np.float64) for row in (self.alpha, self.D, self.force)
        )
        return alpha, D, force

    def _reset(self, event: Any) -> None:
        with self._turns.mine():
            self.show(self.live.reset())

    def _clear(self, event: Any) -> None:
        with self._turns.mine():
            self.live.trace.clear()
            self.scene.show_trace(self.live.trace)

    def _save(self, event: Any) -> None:
        with self._turns.mine():
            text = self.live.command()
        (event.client or self.server).send_file_download(f"{self.live.robot.name}_command.yaml", text.encode())

    def show(self, shown: Shown, asked: tuple[Array, Array, Array] | None = None) -> None:
        """Puts everything on the page, snaps on the way first, and the sliders to the command that is shown where it is
        not what they ``asked`` for: others may have been moved on meanwhile."""
        self._forget_others()
        self._set_sliders(shown, self._asked() if asked is None else asked)
        self._play(shown)
        self._show(shown)
        self._look_for_others()

    def _show(self, shown: Shown) -> None:
        with self.server.atomic():
            self.scene.show(solids(shown.tubes), shown.tip)
            self.scene.show_force(shown.tip, shown.tip_force)
            self.scene.show_trace(self.live.trace)
            self._tell(shown)

    def _play(self, shown: Shown) -> None:
        """Shows the snaps on the way until somebody else wants the turn."""
        for frame in shown.motion:
            with self.server.atomic():
                self._show_frame(frame)
            if self._turns.pause(SNAP_TIME / FRAMES):
                break
        if shown.motion:
            self.scene.tell("")

    def _show_frame(self, frame: Frame) -> None:
        self.scene.tell(f"SNAP, {MM * frame.released:.3g} mJ released")
        self.scene.show(solids(frame.tubes), frame.tip, flash=1.0 - frame.share)

    def _tell(self, shown: Shown) -> None:
        warning = "**A snap is near.** " if shown.good and snap_is_near(shown.margin, shown.reserve) else ""
        self.readout.tell(f"{warning}{shown.message}", shown.good)
        self.readout.show_stability(shown.margin, shown.reserve)
        rows = [
            (tube.name, f"{MM * torque:.2f}", f"{force:.3f}")
            for tube, torque, force in zip(shown.tubes, shown.torque, shown.force, strict=True)
        ]
        self.readout.show_table(shown.tip.position, ("tube", "torque [mN m]", "force [N]"), rows)

    def _set_sliders(self, shown: Shown, asked: tuple[Array, Array, Array]) -> None:
        self._setting = threading.get_ident()
        values = np.degrees(shown.alpha), MM * shown.D, shown.tip_force
        try:
            for sliders, before, after in zip((self.alpha, self.D, self.force), asked, values, strict=True):
                for slider, old, new in zip(sliders, before.tolist(), after.tolist(), strict=True):
                    if abs(old - new) > SAME:
                        slider.value = new
        finally:
            self._setting = None

    def _others_wanted(self, event: Any) -> None:
        """The checkbox has changed."""
        with self._turns.mine():
            self._forget_others()
            self._look_for_others()

    def _forget_others(self) -> None:
        """Those of another command are not shown."""
        self._question = None
        self._searcher.ask(None)
        self.scene.show_ghosts(())

    def _look_for_others(self) -> None:
        wanted = bool(self.others.value)
        self.others_told.visible = wanted
        if not wanted:
            return
        self.others_told.content = "looking for other equilibria ..."
        shown = self.live.shown
        self._question = Question(shown.alpha, shown.D, shown.tip_force)
        self._searcher.ask(self._question)

    def _found(self, question: Question, others: Others) -> None:
        """What a search came to; comes in a thread of its own."""
        with self._turns.mine():
            if question is not self._question:
                return  # the command has changed meanwhile
            ghosts = others.beside(self.live.shown.tubes, self.live.tolerance)
            with self.server.atomic():
                self.scene.show_ghosts((solids(ghost.tubes), ghost.stable) for ghost in ghosts[:MOST_GHOSTS])
                self.others_told.content = f"{_counted(ghosts)}; {others.told}"


def _counted(ghosts: tuple[Ghost, ...]) -> str:
    if not ghosts:
        return "no other equilibrium"
    stable = sum(ghost.stable for ghost in ghosts)
    some = f", the first {MOST_GHOSTS} are shown" if len(ghosts) > MOST_GHOSTS else ""
    count = "1 other" if len(ghosts) == 1 else f"{len(ghosts)} others"
    return f"{count}, {stable} stable (green), {len(ghosts) - stable} unstable (purple){some}"


def _slider(gui: Any, name: str, limits: Array, step: float) -> Any:
    """A slider between limits that are cut to a few decimals, at the place nearest to 0."""
    low = math.ceil(round(10**DECIMALS * float(limits[0]), 6)) / 10**DECIMALS
    high = max(low, math.floor(round(10**DECIMALS * float(limits[1]), 6)) / 10**DECIMALS)
    return gui.add_slider(name, low, high, min(step, max(high - low, 1e-9)), min(max(0.0, low), high))
